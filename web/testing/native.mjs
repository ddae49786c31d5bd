// Frames of the native run time, as web/runtime/examples/frames.rs writes them.

import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { made, program } from './buildings.mjs';

/** The modes, in the order of the frames' answers. */
export const modes = ['none', 'frustum', 'portals', 'pvs', 'both'];

/** The frames of a path (or none) and of random views: each a matrix, an eye, and the native answers; native microseconds of `both`; the file of all that. */
export function frames(pvs, path, views) {
  const file = join(mkdtempSync(join(made, 'frames-')), 'frames');
  const told = execFileSync(join(dirname(program), 'examples/frames'), [pvs, path ?? '-', String(views), file], { encoding: 'utf8' });
  const [median, most] = told.trim().split(' ').map(Number);
  return { list: written(file), median, most, file };
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
