import type { Mark } from './strokes';

/** A length with its standard deviation [m]; without scale they are of no unit. */
export function lengthWords(lengthM: number, sigmaM: number, metric: boolean): string {
  if (!metric) return `${lengthM.toFixed(3)} ± ${sigmaM.toFixed(3)}, no scale`;
  if (lengthM >= 0.9995) return `${lengthM.toFixed(2)} ± ${Math.max(0.01, sigmaM).toFixed(2)} m`;
  return `${(1000 * lengthM).toFixed(0)} ± ${Math.max(1, 1000 * sigmaM).toFixed(0)} mm`;
}

type Worded = Pick<Mark, 'shape' | 'text' | 'number' | 'lengthM' | 'lengthSigmaM' | 'checkItems'>;

/** What a mark says, as the server's overlay has it; a check list with a line for each item. */
export function markWords(mark: Worded, metric: boolean): string {
  const { shape, text, number, lengthM, lengthSigmaM, checkItems } = mark;
  switch (shape) {
    case 'note':
      return text || 'note';
    case 'measure':
      return [text, lengthM > 0 ? lengthWords(lengthM, lengthSigmaM, metric) : '']
        .filter(Boolean)
        .join(': ');
    case 'pin':
      return [number > 0 ? String(number) : '', text].filter(Boolean).join(': ');
    case 'check_list': {
      const done = checkItems.filter((item) => item.done).length;
      const lines = checkItems.map((item) => `${item.done ? '☑' : '☐'} ${item.text}`);
      return [`${text || 'check list'} ${done}/${checkItems.length}`, ...lines].join('\n');
    }
    default:
      return text;
  }
}
