// Microseconds of `both` over native, in node and in Chromium, in one run: `node bench/frames.mjs FILE.pvs [PATH.json]`. The answers are compared first.

import { readFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { launch, open } from '../testing/browser.mjs';
import { web } from '../testing/buildings.mjs';
import { frames } from '../testing/native.mjs';
import { serve } from '../testing/server.mjs';

const [pvs, path] = process.argv.slice(2).map((name) => resolve(name));
const { list, median, most } = frames(pvs, path, 10_000);
console.log(`native: ${median.toFixed(2)} us, 99 % ${most.toFixed(1)}`);

/** Microseconds of each frame, by the mean of a few: clocks of browsers are coarse. Runs in either. */
async function measure(module, bytes, list) {
  const { Building, View, ready } = await import(module);
  await ready;
  const view = new View(new Building(bytes));
  for (const { matrix, eye, count } of list) {
    const { length } = view.cull(matrix, eye, 'both');
    if (length !== count) throw new Error(`${length} objects, and natively ${count}`);
  }
  const times = list.map(({ matrix, eye }) => {
    const start = performance.now();
    for (let i = 0; i < 20; i++) view.cull(matrix, eye, 'both');
    return (performance.now() - start) * 50;
  });
  times.sort((a, b) => a - b);
  return [times[times.length >> 1], times[Math.floor(times.length * 0.99)]];
}

const asked = list.map(({ matrix, eye, answers }) => ({ matrix: [...matrix], eye, count: answers[4].count }));
const tell = (name, [half, high]) =>
  console.log(`${name}: ${half.toFixed(2)} us, 99 % ${high.toFixed(1)}; ratio ${(half / median).toFixed(2)}, ${(high / most).toFixed(2)}`);
tell('node', await measure(join(web, 'runtime/dist/enfilade.js'), readFileSync(pvs), asked));

const server = await serve({ web, pvs: dirname(pvs) });
// A page of its own process has a finer clock.
server.headers = { 'cross-origin-opener-policy': 'same-origin', 'cross-origin-embedder-policy': 'require-corp' };
const browser = await launch();
const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
tell('Chromium', await page.evaluate(`(async () => {
  ${measure}
  const bytes = new Uint8Array(await (await fetch('/pvs/${pvs.slice(dirname(pvs).length + 1)}')).arrayBuffer());
  return measure('/web/runtime/dist/enfilade.js', bytes, ${JSON.stringify(asked)});
})()`));
await browser.close();
await server.close();
