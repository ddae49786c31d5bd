// The classes of @enfilade/runtime: what they say agrees with itself, and what is wrong is an Error with a sentence.

import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { before, test } from 'node:test';
import { Building, Movers, Paths, Prefetch, View, hash, ready } from '../runtime/dist/enfilade.js';
import * as inline from '../runtime/dist/enfilade.inline.js';
import { data, made, program, pvs, web } from '../testing/buildings.mjs';
import { frames } from '../testing/native.mjs';

let bytes, building, list, file;

before(async () => {
  await ready;
  bytes = new Uint8Array(readFileSync(pvs('office')));
  building = new Building(bytes);
  ({ list, file } = frames(pvs('office'), join(data, 'office.path.json'), 0));
});

const inside = () => list.filter(({ eye }) => building.cellOf(eye) >= 0);
const moved = ({ x, y, z }, by) => ({ x: x + by, y: y + by, z: z + by });
const boxAt = (point, half) => ({ min: moved(point, -half), max: moved(point, half) });

test('a frame agrees with its rows, its runs and its counts', () => {
  const view = new View(building);
  assert.ok(inside().length > 10);
  for (const { matrix, eye } of inside()) {
    const objects = [...view.cull(matrix, eye, 'both')];
    const row = new Set(view.homes().length === 1 ? building.row(view.homes()[0]) : Array.from({ length: building.objects }, (_, i) => i));
    assert.ok(objects.every((object) => row.has(object)));
    const { triangles, objects: count } = view.counts();
    const runs = view.runs();
    let indices = 0;
    for (let i = 0; i < runs.length; i += 2) indices += runs[i + 1] - runs[i];
    assert.deepEqual([count, indices], [objects.length, 3 * triangles]);
    assert.equal(triangles, objects.reduce((sum, object) => sum + building.object(object).triangles, 0));
    assert.ok(view.cells().length > 0 && view.cells()[0] === view.homes()[0]);
    assert.ok(view.portals().every((portal) => portal < 2 * building.portals));
  }
  view.free();
});

test('shut doors hide, and open ones show again', () => {
  const view = new View(building);
  const doors = Array.from({ length: building.portals }, (_, i) => i);
  const seen = () => inside().reduce((sum, { matrix, eye }) => sum + view.cull(matrix, eye, 'portals').length, 0);
  const all = seen();
  for (const door of doors) view.setOpen(door, false);
  assert.ok(doors.every((door) => !view.isOpen(door)));
  const few = seen();
  for (const door of doors) view.setOpen(door, true);
  assert.ok(few < all && seen() === all, `${few} of ${all}`);
  for (const door of doors) {
    const { key, cells, corners } = building.portal(door);
    assert.equal(building.portalWithKey(key), door);
    assert.ok(cells.every((cell) => cell < building.cells) && corners.length >= 9);
  }
  assert.equal(building.portalWithKey('no such'), -1);
  view.free();
});

test('what moves is seen where it is, and not once it is removed', () => {
  const [view, movers] = [new View(building), new Movers(building)];
  const [{ matrix, eye }] = inside();
  const near = movers.insert(boxAt(eye, 0.3));
  const far = movers.insert(boxAt(moved(eye, 1e4), 0.3));
  view.cull(matrix, eye);
  assert.deepEqual([...view.movers(movers)], [Movers.slot(near)]);
  movers.set(far, boxAt(eye, 0.2));
  view.cull(matrix, eye);
  assert.deepEqual([...view.movers(movers)].sort(), [near, far].map(Movers.slot).sort());
  movers.remove(near);
  assert.throws(() => movers.remove(near), /^Error: mover 0\.0 is removed$/);
  assert.throws(() => movers.insert({ min: eye, max: moved(eye, NaN) }), /^Error: not a box/);
  const again = movers.insert(boxAt(eye, 0.1));
  assert.ok(again !== near && Movers.slot(again) === Movers.slot(near));
  movers.free();
  view.free();
});

test('a way is no shorter than the straight line, and shut doors lengthen or end it', () => {
  const [view, paths] = [new View(building), new Paths(building)];
  const places = inside().map(({ eye }) => eye);
  let [longer, ways] = [0, 0];
  for (const [i, from] of places.entries()) {
    const to = places[(i * 7 + 3) % places.length];
    const way = paths.path(view, from, to);
    if (!way) continue;
    ways++;
    const straight = Math.hypot(to.x - from.x, to.y - from.y, to.z - from.z);
    assert.ok(way.metres >= straight - 1e-3 && way.atLeast <= way.metres + 1e-9, `${way.metres} m for ${straight}`);
    assert.equal(way.points.length / 3, way.portals.length + 2);
    let length = 0;
    for (let k = 3; k < way.points.length; k += 3) length += Math.hypot(...[0, 1, 2].map((a) => way.points[k + a] - way.points[k + a - 3]));
    assert.ok(Math.abs(length - way.metres) < 1e-3 * (1 + way.metres));
    if (way.portals.length === 0) continue;
    view.setOpen(way.portals[0] >> 1, false);
    const around = paths.path(view, from, to);
    if (!around || around.metres > way.metres) longer++;
    else assert.ok(around.metres > way.metres - 1e-3);
    view.setOpen(way.portals[0] >> 1, true);
  }
  assert.ok(ways > 10 && longer > 5, `${longer} of ${ways} ways`);
  paths.free();
  view.free();
});

test('chunks come before they are needed, within the budget', () => {
  const chunkOf = Uint32Array.from({ length: building.objects }, (_, i) => i >> 3);
  const chunks = Float64Array.from({ length: chunkOf.at(-1) + 1 }, () => 100);
  const budget = Math.max(600, Math.round(chunks.length / 2) * 100);
  const [view, prefetch] = [new View(building), new Prefetch(building, chunkOf, chunks, budget)];
  const held = new Set();
  let seconds = 0;
  for (const { matrix, eye } of list) {
    const objects = [...view.cull(matrix, eye)];
    const missing = prefetch.frame(view, matrix, eye, (seconds += 0.1));
    assert.equal(missing, objects.filter((object) => !held.has(chunkOf[object])).length);
    for (let step; (step = prefetch.next()); ) {
      if (step.load) {
        assert.ok(!held.has(step.chunk) && step.metres >= 0);
        prefetch.loaded(step.chunk);
        held.add(step.chunk);
      } else {
        assert.ok(held.delete(step.chunk));
        assert.ok(!objects.some((object) => chunkOf[object] === step.chunk));
      }
    }
    assert.ok(held.size * 100 === prefetch.used && prefetch.used <= budget);
  }
  assert.throws(() => new Prefetch(building, chunkOf.slice(1), chunks, budget), /chunks of \d+ objects, and there are \d+/);
  assert.throws(() => new Prefetch(building, chunkOf, chunks.slice(1), budget), /an object is in a chunk beyond the \d+ that there are/);
  prefetch.free();
  view.free();
});

test('damaged files are errors with the text of the program, and the module goes on', () => {
  const damaged = bytes.slice();
  damaged[damaged.length - 9] ^= 1;
  const version = bytes.slice();
  version[8] = 77;
  let named = 0;
  for (const wrong of [bytes.slice(0, bytes.length / 2), damaged, version, new Uint8Array(0), Buffer.from('not a building')]) {
    const path = join(made, 'wrong.pvs');
    writeFileSync(path, wrong);
    const { stderr, status } = spawnSync(program, ['info', path], { encoding: 'utf8' });
    const text = stderr.trim().replace(/^(error: )?.*?wrong\.pvs: /, '');
    assert.equal(status, 2);
    assert.throws(() => new Building(wrong), (error) => error instanceof Error && error.message === text, text);
    named++;
  }
  assert.equal(named, 5);
  const other = new Building(bytes);
  const view = new View(other);
  const movers = new Movers(building);
  assert.throws(() => view.movers(movers), /^Error: the movers are of another building$/);
  assert.throws(() => other.row(other.cells), /^Error: cell \d+ of \d+$/);
  assert.throws(() => view.setOpen(1e6, true), /^Error: portal 1000000 of \d+$/);
  assert.throws(() => view.cull([1, 2], { x: 0, y: 0, z: 0 }), /^Error: a matrix of 2 numbers: it has 16$/);
  // What shows nothing in particular shows everything; an eye in no cell, what is on the screen.
  const [{ matrix, eye }] = inside();
  for (const wrong of [new Float64Array(16), matrix.map(() => NaN)]) assert.equal(view.cull(wrong, eye).length, other.objects);
  const away = moved(eye, 1e5);
  assert.deepEqual([...view.cull(matrix, away, 'both')], [...view.cull(matrix, away, 'frustum')]);
  for (const made of [view, movers, other]) made.free();
});

test('the module with the wasm inside says the same', async () => {
  await inline.ready;
  const view = new inline.View(new inline.Building(bytes));
  for (const { matrix, eye, answers } of list) assert.equal(view.cull(matrix, eye).length, answers[4].count);
  assert.equal(inline.hash(bytes), hash(bytes));
  // XXH3 of nothing, as its author gives it.
  assert.equal(hash(new Uint8Array(0)), '2d06800538d394c2');
});

test('nothing is allocated for a frame once it is warm', () => {
  const walk = join(web, 'testing/allocations.mjs');
  const grown = execFileSync(process.execPath, ['--expose-gc', walk, pvs('office'), file], { encoding: 'utf8' });
  const { frames: count, script, wasm } = JSON.parse(grown);
  // A number that is boxed takes 12 bytes or more; what the engine does beside, some 100 kB in all.
  assert.ok(count >= 100_000 && script < 4 * count && wasm === 0, `${script} bytes of script, ${wasm} of wasm in ${count} frames`);
});
