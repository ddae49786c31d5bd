// The wasm says what the native run time says, to the bit, on every frame of the recorded paths and on random views.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { Building, View, hash, ready } from '../runtime/dist/enfilade.js';
import { data, pvs } from '../testing/buildings.mjs';
import { frames, modes } from '../testing/native.mjs';

for (const model of ['villa_rotonda', 'office', 'gallery100']) {
  test(`${model}: the same objects as natively`, async () => {
    await ready;
    const building = new Building(readFileSync(pvs(model)));
    const view = new View(building);
    const path = join(data, `${model}.path.json`);
    const recorded = JSON.parse(readFileSync(path)).frames.length;
    const { list } = frames(pvs(model), path, 10_000);
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
