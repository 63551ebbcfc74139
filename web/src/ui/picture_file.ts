export const MOST_PX = 4096; // annotation.proto, a side
export const MOST_BYTES = 1 << 20;

/** What can be made a picture of: a file's pages, an image's only one. */
export interface PageSource {
  readonly pages: number;
  /** `number`: from 1. */
  draw(number: number): Promise<HTMLCanvasElement>;
  close(): void;
}

export interface FittedPicture {
  readonly bytes: Uint8Array;
  readonly width: number;
  readonly height: number;
}

const isPdf = (file: File): boolean =>
  file.type === 'application/pdf' || file.name.toLowerCase().endsWith('.pdf');

/** Opens a PNG, JPEG, WebP or whatever else the browser knows, or a PDF; rejects with words for a person. */
export async function openPicture(file: File): Promise<PageSource> {
  if (isPdf(file)) {
    const bytes = await file.arrayBuffer();
    const { openPdf } = await import('./pdf');
    return openPdf(bytes);
  }
  const bitmap = await createImageBitmap(file).catch(() => {
    throw new Error('this file is no picture that the browser knows, and no PDF');
  });
  return {
    pages: 1,
    draw: () => Promise.resolve(canvasOf(bitmap, fittedScale(bitmap))),
    close: () => bitmap.close(),
  };
}

/** At most 1: so that no side is longer than is kept. */
export const fittedScale = ({ width, height }: { width: number; height: number }): number =>
  Math.min(1, MOST_PX / width, MOST_PX / height);

function canvasOf(picture: HTMLCanvasElement | ImageBitmap, scale: number): HTMLCanvasElement {
  const canvas = document.createElement('canvas');
  canvas.width = Math.max(1, Math.floor(picture.width * scale));
  canvas.height = Math.max(1, Math.floor(picture.height * scale));
  const context = canvas.getContext('2d');
  if (!context) throw new Error('this browser has no 2D canvas');
  context.imageSmoothingQuality = 'high';
  context.drawImage(picture, 0, 0, canvas.width, canvas.height);
  return canvas;
}

const encoded = (canvas: HTMLCanvasElement, type: string, quality?: number): Promise<Blob> =>
  new Promise((resolve, reject) =>
    canvas.toBlob(
      (blob) => (blob ? resolve(blob) : reject(new Error('this browser could not code it'))),
      type,
      quality,
    ),
  );

/** JPEG has no transparency: what is seen through becomes paper. */
function onPaper(canvas: HTMLCanvasElement): HTMLCanvasElement {
  const paper = document.createElement('canvas');
  paper.width = canvas.width;
  paper.height = canvas.height;
  const context = paper.getContext('2d', { alpha: false });
  if (!context) return canvas;
  context.fillStyle = '#fff';
  context.fillRect(0, 0, paper.width, paper.height);
  context.drawImage(canvas, 0, 0);
  return paper;
}

/**
 * As it is sent: PNG where that fits, else JPEG, else smaller. Coded anew whatever it was: so what a camera
 * wrote into its file, such as where it was taken, stays here.
 */
export async function fitPicture(canvas: HTMLCanvasElement): Promise<FittedPicture> {
  for (let scale = fittedScale(canvas); ; scale *= 0.75) {
    const scaled = scale === 1 ? canvas : canvasOf(canvas, scale);
    const attempts: [string, number?][] = [
      ['image/png'],
      ['image/jpeg', 0.9],
      ['image/jpeg', 0.75],
    ];
    for (const [type, quality] of attempts) {
      const source = type === 'image/jpeg' ? onPaper(scaled) : scaled;
      const blob = await encoded(source, type, quality);
      if (blob.size > MOST_BYTES) continue;
      const bytes = new Uint8Array(await blob.arrayBuffer());
      return { bytes, width: scaled.width, height: scaled.height };
    }
  }
}
