// The wasm says what the native run time says, to the bit, on every frame of the recorded paths and on random views.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { test } from 'node:test';
import { Building, View, hash, ready } from '../runtime/dist/enfilade.js';
import { data, pvs, viewCells } from '../testing/buildings.mjs';
import { frames, modes } from '../testing/native.mjs';

const plain = ['villa_rotonda', 'office', 'gallery100'].map((model) => [model, pvs]);
for (const [model, made] of [...plain, ['office', viewCells]]) {
  test(`${basename(made(model))}: the same objects as natively`, async () => {
    await ready;
    const building = new Building(readFileSync(made(model)));
    const view = new View(building);
    const path = join(data, `${model}.path.json`);
    const recorded = JSON.parse(readFileSync(path)).frames.length;
    const { list } = frames(made(model), path, 10_000);
    assert.equal(list.length, recorded + 10_000);
    let drawn = 0;
    for (const [number, { matrix, eye, answers }] of list.entries()) {
      for (const [mode, { count, hash: expected }] of answers.entries()) {
        const objects = view.cull(matrix, eye, modes[mode]);
        const found = hash(new Uint8Array(objects.buffer, objects.byteOffset, objects.byteLength));
        assert.deepEqual([objects.length, found], [count, expected], `frame ${number}, ${modes[mode]}`);
        drawn += objects.length;
      }
    }
    assert.ok(drawn > list.length, `${drawn} objects: a test of nothing`);
    view.free();
    building.free();
  });
}
