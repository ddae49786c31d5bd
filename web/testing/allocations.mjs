// What 100,000 frames and more leave behind: `node --expose-gc allocations.mjs FILE.pvs FRAMES`. Prints the bytes of script and of wasm.

import { readFileSync } from 'node:fs';
import { Building, Movers, View, ready } from '../runtime/dist/enfilade.js';
import { written } from './native.mjs';

const [pvs, frames] = process.argv.slice(2);
await ready;
const building = new Building(readFileSync(pvs));
const [view, movers] = [new View(building), new Movers(building)];
const list = written(frames);
const box = { min: { x: 0, y: 0, z: 0 }, max: { x: 1, y: 1, z: 1 } };
const mover = movers.insert(box);
let seen = 0;

function walk(rounds) {
  for (let round = 0; round < rounds; round++) {
    for (let i = 0; i < list.length; i++) {
      const { matrix, eye } = list[i];
      movers.set(mover, box);
      seen += view.cull(matrix, eye, 'both').length + view.runs().length + view.cells().length + view.movers(movers).length;
    }
  }
}

const rounds = Math.ceil(100_000 / list.length);
// The compiler of scripts allocates until it has seen enough.
walk(rounds);
globalThis.gc();
// Garbage counts, too: no collection in between.
const [script, memory] = [process.memoryUsage(), view.cull(list[0].matrix, list[0].eye).buffer.byteLength];
walk(rounds);
const after = process.memoryUsage();
const grown = view.cull(list[0].matrix, list[0].eye).buffer.byteLength - memory;
console.log(JSON.stringify({ frames: rounds * list.length, script: after.heapUsed - script.heapUsed, wasm: grown, seen }));
