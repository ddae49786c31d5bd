// Microseconds of `both` in wasm over native, in one run: `node bench/frames.mjs FILE.pvs [PATH.json]`. The answers are compared first.

import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { Building, View, ready } from '../runtime/dist/enfilade.js';
import { folder, frames } from '../testing/native.mjs';

const [pvs, path] = process.argv.slice(2);
await ready;
const view = new View(new Building(readFileSync(pvs)));
const { list, median, most } = frames(pvs, path, 10_000, join(folder(), 'frames'));
for (const { matrix, eye, answers } of list) {
  const { length } = view.cull(matrix, eye, 'both');
  if (length !== answers[4].count) throw new Error(`${length} objects, and natively ${answers[4].count}`);
}
const times = new Float64Array(list.length);
for (let round = 0; round < 3; round++) {
  for (const [number, { matrix, eye }] of list.entries()) {
    const start = process.hrtime.bigint();
    view.cull(matrix, eye, 'both');
    times[number] = Number(process.hrtime.bigint() - start) / 1e3;
  }
}
times.sort();
const [half, high] = [times[times.length >> 1], times[Math.floor(times.length * 0.99)]];
console.log(`wasm ${half.toFixed(2)} us, 99 % ${high.toFixed(1)}; native ${median.toFixed(2)}, ${most.toFixed(1)}; ratio ${(half / median).toFixed(2)}, ${(high / most).toFixed(2)}`);
