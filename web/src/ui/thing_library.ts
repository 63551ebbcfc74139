/** The models that come with Saccade (deploy/models), by name. */
const FILES = import.meta.glob<string>('../../../deploy/models/*.glb', {
  ...{ query: '?url', import: 'default', eager: true },
});

const nameOf = (path: string): string => path.slice(path.lastIndexOf('/') + 1, -'.glb'.length);

const URLS = new Map(Object.entries(FILES).map(([path, url]) => [nameOf(path), url]));

export const LIBRARY: readonly string[] = [...URLS.keys()].sort();

/** Its GLB file. */
export async function libraryFile(name: string): Promise<Uint8Array> {
  const url = URLS.get(name);
  const answer = url === undefined ? undefined : await fetch(url);
  if (!answer?.ok) throw new Error(`the model ${name} could not be fetched from the server`);
  return new Uint8Array(await answer.arrayBuffer());
}
