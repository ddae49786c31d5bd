export { Culled } from './culled.js';
export { readManifest, type Chunk, type Entry, type Manifest, type MeshFile } from './manifest.js';
export { Walk, type WalkOptions } from './walk.js';
