/** The models that come with Saccade (deploy/models), by name. */
const FILES = import.meta.glob<string>('../../../deploy/models/*.glb', {
  ...{ query: '?url', import: 'default', eager: true },
});

const nameOf = (path: string): string => path.slice(path.lastIndexOf('/') + 1, -'.glb'.length);

const URLS = new Map(Object.entries(FILES).map(([path, url]) => [nameOf(path), url]));

/** Shown through what it lies in, not placed on a floor. */
export const SHOWN_INSIDE: readonly string[] = ['inside'];

export const LIBRARY: readonly string[] = [...URLS.keys()]
  .filter((name) => !SHOWN_INSIDE.includes(name))
  .sort();

/** Its GLB file. */
export async function libraryFile(name: string): Promise<Uint8Array> {
  const url = URLS.get(name);
  const answer = url === undefined ? undefined : await fetch(url);
  if (!answer?.ok) throw new Error(`the model ${name} could not be fetched from the server`);
  return new Uint8Array(await answer.arrayBuffer());
}
