// The module with `enfilade.wasm` beside it.

import { start } from './memory.js';

export * from './all.js';

const place = new URL('enfilade.wasm', import.meta.url);

async function bytes(): Promise<Response | BufferSource> {
  if (place.protocol !== 'file:') return fetch(place);
  // Node: its `fetch` reads no files.
  const { readFile } = await import('node:fs/promises');
  return new Uint8Array(await readFile(place));
}

/** Resolves when the module is loaded; nothing works before. */
export const ready: Promise<void> = start(bytes());
