// Scenes that are loaded whole: what is hidden was not seen.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, open } from '../testing/browser.mjs';
import { data, glb, made, path, pvs, web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

let server, browser;
before(async () => {
  server = await serve({ web, made, data });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

async function scene() {
  const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
  await page.waitForFunction(() => window.isReady);
  return page;
}

// Every third frame: the software renderer takes 0.1 s for two.
for (const name of ['villa_rotonda', 'office', 'gallery100']) {
  test(`${name}: frames of its path drawn culled are those drawn whole`, async () => {
    const [file, model] = [pvs(name), glb(name)].map((place) => place.slice(made.length));
    const page = await scene();
    const frames = path(name).frames.filter((_, i) => i % 3 === 0);
    const found = await page.evaluate(async ([pvs, glb, frames]) => {
      const { model } = await window.culled(pvs, glb);
      return frames.map((frame) => window.compare(model, frame, 'both'));
    }, [`/made${file}`, `/made${model}`, frames]);
    const differ = found.map((frame) => frame.differ);
    assert.deepEqual(differ, differ.map(() => 0));
    const sum = (of) => found.reduce((total, frame) => total + of(frame), 0);
    // A building of rooms hides most of itself.
    assert.ok(3 * sum((frame) => frame.triangles) < 2 * sum((frame) => frame.whole.triangles), 'much is hidden');
    assert.deepEqual(page.faults, []);
    await page.context().close();
  });
}

test('a scene that stands elsewhere, turned, is culled as where it was modelled', async () => {
  const [file, model] = [pvs('villa_rotonda'), glb('villa_rotonda')].map((place) => place.slice(made.length));
  const page = await scene();
  const differ = await page.evaluate(async ([pvs, glb, frames]) => {
    const { model, loaded } = await window.culled(pvs, glb);
    return frames.map(({ eye, target }) => {
      loaded.position.set(120, -3, 40);
      loaded.rotation.set(0, 1, 0);
      loaded.updateMatrixWorld(true);
      const [a, b] = [eye, target].map((point) => loaded.localToWorld(new window.three.Vector3(...point)).toArray());
      const frame = { eye: a, target: b };
      window.look(frame);
      model.update(window.camera, 'both');
      const ids = [...model.view.cells()];
      const { differ } = window.compare(model, frame, 'both');
      return { differ, cells: ids.length };
    });
  }, [`/made${file}`, `/made${model}`, path('villa_rotonda').frames.filter((_, i) => i % 12 === 0)]);
  assert.ok(differ.every(({ differ }) => differ === 0));
  assert.ok(differ.every(({ cells }) => cells > 0 && cells < 27));
  await page.context().close();
});

test('a scene without ids, or of another model, is refused with what to do', async () => {
  const page = await scene();
  const texts = await page.evaluate(async ([pvs, plain, other]) => {
    const text = (glb) => window.culled(pvs, glb).then(() => 'taken', (error) => error.message);
    return [await text(plain), await text(other)];
  }, [`/made${pvs('villa_rotonda').slice(made.length)}`, '/data/villa_rotonda.glb', `/made${glb('office').slice(made.length)}`]);
  assert.match(texts[0], /enfilade export/);
  assert.match(texts[1], /has an object \d+, and the \.pvs file has 192/);
  await page.context().close();
});
