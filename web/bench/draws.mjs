// Draw calls, triangles and times of frames: `node bench/draws.mjs FOLDER FILE.pvs WHOLE.glb PATH.json [--frames N]`.
//
// The same frames by three.js' own frustum culling of the whole model, by `Culled`, and by `Walk`, each warm. FOLDER is by `enfilade pack`, WHOLE.glb by
// `enfilade export`. Times are those of Chromium's software renderer, with the pixels read back.

import { readFileSync } from 'node:fs';
import { basename, dirname, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { launch, open } from '../testing/browser.mjs';
import { web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

const { values, positionals } = parseArgs({ allowPositionals: true, options: { frames: { type: 'string', default: '20' } } });
const [folder, pvs, whole, path] = positionals.map((name) => resolve(name));
const all = JSON.parse(readFileSync(path, 'utf8')).frames;
const step = Math.max(1, Math.floor(all.length / Number(values.frames)));
const frames = all.filter((_, i) => i % step === 0);

const server = await serve({ web, folder: dirname(folder), pvs: dirname(pvs), whole: dirname(whole) });
const browser = await launch();

/** Draws all frames twice, and measures the second time. `make`: gives what hides things; run in the page. */
async function measure(name, make, ...given) {
  const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
  await page.waitForFunction(() => window.isReady);
  await page.evaluate(make, given);
  const found = await page.evaluate(async (frames) => {
    const { renderer, scene, camera, look } = window;
    const gl = renderer.getContext();
    const pixel = new Uint8Array(4);
    const rows = [];
    for (let pass = 0; pass < 2; pass++) {
      for (const frame of frames) {
        look(frame);
        if (pass === 0) await window.settle();
        const begun = performance.now();
        window.model?.update(camera);
        const hidden = performance.now() - begun;
        renderer.render(scene, camera);
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        const { calls, triangles } = renderer.info.render;
        if (pass === 1) rows.push({ calls, triangles, milliseconds: performance.now() - begun, hidden });
      }
    }
    return rows;
  }, frames);
  await page.context().close();
  const mean = (of) => found.reduce((sum, row) => sum + of(row), 0) / found.length;
  const row = { calls: mean((r) => r.calls), triangles: mean((r) => r.triangles), milliseconds: mean((r) => r.milliseconds), hidden: mean((r) => r.hidden) };
  console.log(`${name}: ${row.calls.toFixed(0)} draw calls, ${row.triangles.toFixed(0)} triangles, ${row.milliseconds.toFixed(1)} ms a frame, ${row.hidden.toFixed(2)} ms of it culling`);
  return row;
}

console.log(`${frames.length} frames of ${basename(path)}, 480 by 270`);
const own = await measure('three.js, its frustum', async ([glb]) => {
  window.settle = async () => {};
  const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
  window.scene.add((await new GLTFLoader().loadAsync(glb)).scene);
}, `/whole/${basename(whole)}`);
const culled = await measure('Culled', async ([pvs, glb]) => {
  window.settle = async () => {};
  window.model = (await window.culled(pvs, glb)).model;
}, `/pvs/${basename(pvs)}`, `/whole/${basename(whole)}`);
const walk = await measure('Walk', async ([folder]) => {
  const walk = window.model = new window.Walk(window.scene, folder);
  await walk.ready;
  window.settle = async () => {
    for (let calm = 0; calm < 3;) {
      walk.update(window.camera);
      await new Promise((resolve) => setTimeout(resolve, 2));
      calm = walk.underWay === 0 ? calm + 1 : 0;
    }
  };
}, `/folder/${basename(folder)}/`);
const times = (a, b) => `${(a.calls / b.calls).toFixed(1)} times fewer draw calls, ${(a.triangles / b.triangles).toFixed(1)} times fewer triangles`;
console.log(`Culled: ${times(own, culled)}; Walk: ${times(own, walk)}`);
await browser.close();
await server.close();
