// The module with the wasm inside, for pages without a bundler.

import base64 from '../build/enfilade.wasm';
import { start } from './memory.js';

export * from './all.js';

/** Resolves when the module is loaded; nothing works before. */
export const ready: Promise<void> = start(Uint8Array.from(atob(base64), (character) => character.charCodeAt(0)));
