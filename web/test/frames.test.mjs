// Frames allocate nothing once they are warm, but for the number that the browser's clock gives.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { basename } from 'node:path';
import { launch, open } from '../testing/browser.mjs';
import { folder, glb, made, path, pvs, web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

let server, browser;
before(async () => {
  server = await serve({ web, made });
  browser = await launch(['--js-flags=--expose-gc', '--enable-precise-memory-info']);
});
after(async () => {
  await browser?.close();
  await server?.close();
});

/** Bytes that each of many updates along a path, at 1.4 m/s, leaves on the heap; and those that moving the camera leaves. */
const growth = (page, frames) => page.evaluate(async (frames) => {
  const { model, camera, three } = window;
  const eyes = frames.map(({ eye }) => new three.Vector3(...eye));
  const targets = frames.map(({ target }) => new three.Vector3(...target));
  const target = new three.Vector3();
  const run = (count, update) => {
    for (let i = 0; i < count; i++) {
      const at = Math.floor(i / 50) % (frames.length - 1);
      camera.position.lerpVectors(eyes[at], eyes[at + 1], (i % 50) / 50);
      camera.lookAt(target.lerpVectors(targets[at], targets[at + 1], (i % 50) / 50));
      update(camera);
    }
  };
  const least = [];
  for (const update of [() => {}, (camera) => model.update(camera)]) {
    run(50 * frames.length, update);
    // Time for the compiler to do its part.
    await new Promise((resolve) => setTimeout(resolve, 500));
    let bytes = Infinity;
    for (let pass = 0; pass < 5; pass++) {
      window.gc();
      const before = performance.memory.usedJSHeapSize;
      run(4000, update);
      bytes = Math.min(bytes, (performance.memory.usedJSHeapSize - before) / 4000);
    }
    least.push(bytes);
  }
  return least[1] - least[0];
}, frames);

async function scene() {
  const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
  await page.waitForFunction(() => window.isReady);
  return page;
}

test('Culled: no bytes a frame', async () => {
  const page = await scene();
  await page.evaluate(async ([pvs, glb]) => {
    window.model = (await window.culled(pvs, glb)).model;
  }, [pvs('office'), glb('office')].map((file) => `/made/${basename(file)}`));
  const bytes = await growth(page, path('office').frames);
  assert.ok(bytes < 1, `${bytes} bytes a frame`);
  await page.context().close();
});

test('Walk: no bytes but the time in a frame in which nothing arrives', async () => {
  const page = await scene();
  const frames = path('office').frames;
  await page.evaluate(async ([address, frames]) => {
    const walk = window.model = new window.Walk(window.scene, address);
    await walk.ready;
    for (const frame of frames) {
      window.look(frame);
      for (let calm = 0; calm < 3;) {
        walk.update(window.camera);
        await new Promise((resolve) => setTimeout(resolve, 2));
        calm = walk.underWay === 0 ? calm + 1 : 0;
      }
    }
  }, [`/made/${basename(folder('office'))}/`, frames]);
  const bytes = await growth(page, frames);
  // The browser's time is a number on the heap.
  assert.ok(bytes < 24, `${bytes} bytes a frame`);
  await page.context().close();
});
