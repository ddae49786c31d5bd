// Frames of the native run time, as web/runtime/examples/frames.rs writes them.

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

export const web = dirname(dirname(fileURLToPath(import.meta.url)));
export const repository = dirname(web);
const target = process.env.CARGO_TARGET_DIR ?? join(repository, 'target');

/** The modes, in the order of the frames' answers. */
export const modes = ['none', 'frustum', 'portals', 'pvs', 'both'];

/** Runs a program of the repository, built before by `just web`; gives what it prints. */
export function run(program, args) {
  return execFileSync(join(target, 'release', program), args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}

/** A folder for the time of a test. */
export function folder(context) {
  const made = mkdtempSync(join(tmpdir(), 'enfilade-'));
  context?.after(() => rmSync(made, { recursive: true, force: true }));
  return made;
}

/** Bakes a model of the repository. */
export function baked(model, to) {
  run('enfilade', ['bake', join(repository, 'data/buildings', `${model}.glb`), '-o', to, '--rays', '10000']);
  return new Uint8Array(readFileSync(to));
}

/** The frames of a path (or none) and of random views: each a matrix, an eye, and the native answers; and native microseconds of `both`. */
export function frames(pvs, path, views, to) {
  const [median, most] = run('examples/frames', [pvs, path ?? '-', String(views), to]).trim().split(' ').map(Number);
  return { list: written(to), median, most };
}

/** The frames that were written to a file. */
export function written(file) {
  const bytes = readFileSync(file);
  const data = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 4;
  return Array.from({ length: data.getUint32(0, true) }, () => {
    const numbers = Float64Array.from({ length: 19 }, (_, i) => data.getFloat64(at + 8 * i, true));
    at += 19 * 8;
    const answers = modes.map(() => {
      const answer = { count: data.getUint32(at, true), hash: data.getBigUint64(at + 4, true).toString(16).padStart(16, '0') };
      at += 12;
      return answer;
    });
    return { matrix: numbers.slice(0, 16), eye: { x: numbers[16], y: numbers[17], z: numbers[18] }, answers };
  });
}
