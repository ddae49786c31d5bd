// Packed folders: what arrives is what is drawn, and what does not come leaves a box and a line.

import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { basename, join } from 'node:path';
import { after, before, test } from 'node:test';
import { gunzipSync, gzipSync } from 'node:zlib';
import { launch, open } from '../testing/browser.mjs';
import { folder, made, path, pvs, web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

let server, browser;
before(async () => {
  server = await serve({ web, made });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

async function scene() {
  server.spoil = server.line = server.headers = undefined;
  const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
  await page.waitForFunction(() => window.isReady);
  return page;
}

const manifest = (name) => JSON.parse(gunzipSync(readFileSync(join(folder(name), 'manifest.jsonz'))));
const place = (name) => `/made/${basename(folder(name))}/`;

/** Opens a folder, and gives the text of the error, or `ready`. */
const opening = (page, address) => page.evaluate(async (address) => {
  window.walk?.dispose();
  window.walk = new window.Walk(window.scene, address);
  return window.walk.ready.then(() => 'ready', (error) => error.message);
}, address);

/** Draws a frame again and again until nothing is under way. */
const settle = (page, frame, mode = 'both') => page.evaluate(async ([frame, mode]) => {
  window.look(frame);
  for (let calm = 0; calm < 3;) {
    window.walk.update(window.camera, mode);
    await new Promise((resolve) => setTimeout(resolve, 5));
    calm = window.walk.underWay === 0 ? calm + 1 : 0;
  }
  return { missing: window.walk.missing, errors: window.walk.errors, held: window.walk.held, bytes: window.walk.bytes, size: window.walk.size };
}, [frame, mode]);

/** The folder with one thing changed in its manifest. */
function changed(change) {
  server.spoil = (address, bytes) => {
    if (!address.endsWith('/manifest.jsonz')) return undefined;
    const manifest = JSON.parse(gunzipSync(bytes));
    change(manifest);
    return gzipSync(JSON.stringify(manifest));
  };
}

for (const name of ['villa_rotonda', 'office']) {
  test(`${name}: frames of its path drawn culled, as it arrives, are those drawn whole`, async () => {
    const page = await scene();
    assert.equal(await opening(page, place(name)), 'ready');
    const frames = path(name).frames.filter((_, i) => i % 4 === 0);
    for (const frame of frames) {
      const state = await settle(page, frame);
      assert.deepEqual([state.missing, state.errors], [0, []]);
      await page.evaluate(() => window.keep(window.walk, 'both'));
    }
    // All that is culled by nothing arrives, too.
    assert.equal((await settle(page, frames[0], 'none')).missing, 0);
    const found = await page.evaluate((frames) => frames.map((frame, i) => window.differ(window.walk, frame, i)), frames);
    assert.deepEqual(found.map(({ pixels }) => pixels), found.map(() => 0));
    assert.ok(found.every(({ pixels, triangles, all }) => pixels === 0 && triangles < all));
    assert.deepEqual(page.faults, []);
    await page.context().close();
  });
}

test('a manifest that does not fit is refused with the field', async () => {
  const page = await scene();
  const cases = [
    [(m) => { m.enfilade = 1; }, /enfilade: /],
    [(m) => { m.chunks[0].file = '../x.glb'; }, /chunks\[0\]\.file.*\.\.\/x\.glb/],
    [(m) => { m.chunks[0].file = '/x.glb'; }, /chunks\[0\]\.file/],
    [(m) => { m.chunks[0].file = 'http://localhost:1/x.glb'; }, /chunks\[0\]\.file/],
    [(m) => { m.pvs.file = 'a/../../b.pvs'; }, /pvs\.file/],
    [(m) => { m.chunks[1].file = m.chunks[0].file; }, /name of two files/],
    [(m) => { m.chunks[0].bytes = -1; }, /chunks\[0\]\.bytes/],
    [(m) => { m.chunks[0].hash = 'no'; }, /chunks\[0\]\.hash/],
    [(m) => { m.chunks[0].objects = [5, 5]; }, /chunks\[0\]\.objects/],
    [(m) => { m.chunks[0].objects = [1]; }, /chunks\[0\]\.objects/],
    [(m) => { m.chunks[0].objects[1] = 1e9; }, /chunks\[0\]\.objects/],
    [(m) => { m.chunks[0].pictures = [999]; }, /chunks\[0\]\.pictures\[0\]/],
    [(m) => { m.chunks[0].meshes = [999]; }, /chunks\[0\]\.meshes\[0\]/],
    [(m) => { m.chunks.pop(); }, /chunks/],
    [(m) => { m.origin = [0, 0]; }, /origin/],
    [(m) => { m.origin[1] = null; }, /origin\[1\]/],
    [(m) => { m.objects += 1; }, /object/],
    [(m) => { delete m.pictures; }, /pictures/],
  ];
  for (const [change, text] of cases) {
    changed(change);
    assert.match(await opening(page, place('villa_rotonda')), text);
  }
  for (const [bytes, text] of [[gzipSync('{'), /manifest\.jsonz: .*JSON/], [Buffer.from('{}'), /manifest\.jsonz: not in gzip, or damaged/]]) {
    server.spoil = (address) => address.endsWith('/manifest.jsonz') ? bytes : undefined;
    assert.match(await opening(page, place('villa_rotonda')), text);
  }
  assert.equal(server.asked.filter((address) => address.includes('/x.glb')).length, 0);
  await page.context().close();
});

test('a .pvs file of another hash or model, or cut, is refused before anything is drawn', async () => {
  const page = await scene();
  const { model } = manifest('villa_rotonda');
  server.asked.length = 0;
  const other = '0123456789abcdef0123456789abcdef';
  changed((m) => { m.model = other; });
  const text = await opening(page, place('villa_rotonda'));
  assert.ok(text.includes(model) && text.includes(other), text);
  changed((m) => { m.pvs.hash = '0123456789abcdef'; });
  assert.match(await opening(page, place('villa_rotonda')), /building\.pvs: its hash is [0-9a-f]{16}, and the manifest says 0123456789abcdef/);
  server.spoil = (address, bytes) => address.endsWith('.pvs') ? bytes.subarray(0, 500) : undefined;
  assert.match(await opening(page, place('villa_rotonda')), /building\.pvs: 500 bytes/);
  assert.deepEqual(server.asked.filter((address) => /chunks/.test(address)), []);
  await page.context().close();
});

test('chunks that do not come, come short or are others: three tries, boxes, and the walk goes on', async () => {
  const [frame] = path('villa_rotonda').frames;
  const spoils = [
    [() => 404, /404/],
    [(bytes) => bytes.subarray(0, bytes.length - 4), /bytes, and the manifest says/],
    [(bytes) => Buffer.from(bytes).fill(7, 40, 44), /its hash is/],
  ];
  for (const [spoil, text] of spoils) {
    const page = await scene();
    let bad;
    server.asked.length = 0;
    server.spoil = (address, bytes) => {
      if (!address.includes('/chunks/')) return undefined;
      bad ??= address;
      return address === bad ? spoil(bytes) : undefined;
    };
    assert.equal(await opening(page, place('villa_rotonda')), 'ready');
    const state = await settle(page, frame);
    assert.equal(state.errors.length, 1);
    assert.match(state.errors[0], text);
    assert.ok(bad.endsWith(state.errors[0].split(':')[0]), state.errors[0]);
    assert.equal(server.asked.filter((address) => address === bad).length, 3);
    assert.ok(state.missing > 0);
    assert.ok(state.held > 0);
    const boxes = await page.evaluate(() => {
      let lines = 0;
      window.scene.traverse((node) => { if (node.isLineSegments && node.visible) lines += node.geometry.drawRange.count; });
      return lines / 24;
    });
    assert.equal(boxes, state.missing);
    await page.context().close();
  }
});

test('an answer that leads elsewhere is refused', async () => {
  const page = await scene();
  server.headers = { location: 'http://127.0.0.1:1/' };
  server.spoil = (address) => address.endsWith('.pvs') ? 302 : undefined;
  assert.match(await opening(page, place('villa_rotonda')), /building\.pvs: /);
  server.headers = undefined;
  await page.context().close();
});

test('a budget is never passed, and what is let go comes again', async () => {
  const page = await scene();
  const { size } = await page.evaluate(async (address) => {
    window.walk = new window.Walk(window.scene, address);
    await window.walk.ready;
    return { size: window.walk.size };
  }, place('office'));
  const budget = Math.round(size / 3);
  await page.evaluate(async ([address, budget]) => {
    window.walk.dispose();
    window.walk = new window.Walk(window.scene, address, { budget });
    await window.walk.ready;
  }, [place('office'), budget]);
  const frames = path('office').frames;
  let [most, fetched] = [0, 0];
  for (const frame of [...frames, ...frames].filter((_, i) => i % 6 === 0)) {
    const state = await settle(page, frame);
    most = Math.max(most, state.held);
    assert.ok(state.held <= budget, `${state.held} held, and the budget is ${budget}`);
    assert.deepEqual(state.errors, []);
    fetched = state.bytes;
  }
  assert.ok(most > 0 && fetched > 0);
  const left = await page.evaluate(() => {
    window.walk.dispose();
    return [window.scene.children.filter(({ name }) => name === 'enfilade').length, window.renderer.info.memory.geometries];
  });
  assert.deepEqual(left, [0, 0]);
  await page.context().close();
});

test('a picture is fetched once, counted and given back; without it walls are there all the same', async () => {
  const [frame] = path('villa_rotonda').frames;
  const page = await scene();
  const state = async () => page.evaluate(() => {
    const maps = new Set();
    window.renderer.render(window.scene, window.camera);
    window.scene.traverse(({ material }) => { if (material?.map) maps.add(material.map.source); });
    return { maps: maps.size, textures: window.renderer.info.memory.textures };
  });
  // three.js keeps a table for its materials once it has drawn one.
  assert.equal(await opening(page, place('villa_rotonda')), 'ready');
  await settle(page, frame);
  await state();
  await page.evaluate(() => window.walk.dispose());
  const before = await state();
  server.asked.length = 0;
  assert.equal(await opening(page, place('pictured')), 'ready');
  const { missing, held, errors } = await settle(page, frame, 'none');
  assert.deepEqual([missing, errors], [0, []]);
  assert.equal((await state()).maps, 1);
  assert.equal(server.asked.filter((address) => address.includes('/pictures/')).length, 1);
  // 16 by 16 pixels of 4 bytes and a third, with each chunk that has it.
  const packed = manifest('pictured');
  const users = packed.chunks.filter(({ pictures, meshes }) => pictures || meshes?.some((file) => packed.meshes[file].pictures)).length;
  assert.ok(users > 1 && held > users * Math.ceil((16 * 16 * 4 * 4) / 3));
  await page.evaluate(() => window.walk.dispose());
  await new Promise((resolve) => setTimeout(resolve, 100));
  const after = await state();
  assert.deepEqual([after.maps, after.textures], [before.maps, before.textures]);

  server.spoil = (address) => address.includes('/pictures/') ? 404 : undefined;
  assert.equal(await opening(page, place('pictured')), 'ready');
  const without = await settle(page, frame, 'none');
  assert.equal(without.missing, 0);
  assert.equal(without.errors.length, 1);
  assert.match(without.errors[0], /^pictures\/.*404/);
  assert.equal((await state()).maps, 1);
  await page.context().close();
});
