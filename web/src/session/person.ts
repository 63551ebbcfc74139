const KEY = 'saccade.person';
const VALID = /^[A-Za-z0-9_-]{32,64}$/; // session.proto

/**
 * The secret that stands for the person at this browser: made once, kept for all its tabs. Colour,
 * authorship and what can be undone belong to it. Where nothing may be kept it lasts as long as the page.
 */
export function personKey(storage: Pick<Storage, 'getItem' | 'setItem'>): string {
  try {
    const kept = storage.getItem(KEY);
    if (kept && VALID.test(kept)) return kept;
  } catch {
    // Forbidden: a new one.
  }
  const key = newKey();
  try {
    storage.setItem(KEY, key);
  } catch {
    // Full or forbidden: then another page is another person.
  }
  return key;
}

/** 192 bits as base64url. */
function newKey(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(24));
  return btoa(String.fromCharCode(...bytes))
    .replace(/\+/g, '-')
    .replace(/\//g, '_');
}
