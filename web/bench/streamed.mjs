// The streamed walk: `node bench/streamed.mjs FOLDER PATH.json [--budget MB] [--spacing M]`.
//
// Walks a recorded path at 1.4 m/s behind a line of 50 Mbit/s and 50 ms, and prints bytes, frames with something missing, and memory. Chromium draws with
// its software renderer; so that a slow machine does not measure itself, the picture is small.

import { readFileSync } from 'node:fs';
import { basename, dirname, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { launch, open } from '../testing/browser.mjs';
import { web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

const { values, positionals } = parseArgs({ allowPositionals: true, options: { budget: { type: 'string', default: '256' }, seconds: { type: 'string', default: '60' } } });
const [folder, path] = positionals.map((name) => resolve(name));
const METRES_A_SECOND = 1.4;

const server = await serve({ web, folder: dirname(folder) });
const browser = await launch();
const page = await open(browser, `${server.address}/web/testing/pages/scene.html`);
await page.waitForFunction(() => window.isReady);
server.line = { bits: 50e6, milliseconds: 50 };

const { frames } = JSON.parse(readFileSync(path, 'utf8'));
const found = await page.evaluate(async ([address, frames, budget, speed, most]) => {
  const { three, scene, camera, renderer, Walk } = window;
  renderer.setSize(160, 90, false);
  const begun = performance.now();
  const walk = new Walk(scene, address, { budget });
  await walk.ready;
  const opened = { seconds: (performance.now() - begun) / 1000, bytes: walk.bytes };
  const eyes = frames.map(({ eye }) => new three.Vector3(...eye));
  const targets = frames.map(({ target }) => new three.Vector3(...target));
  const ends = [0];
  for (let i = 1; i < eyes.length; i++) ends.push(ends[i - 1] + eyes[i].distanceTo(eyes[i - 1]));
  const target = new three.Vector3();
  const put = (metres) => {
    let i = 1;
    while (i < ends.length - 1 && ends[i] < metres) i++;
    const share = Math.min(1, (metres - ends[i - 1]) / Math.max(1e-9, ends[i] - ends[i - 1]));
    camera.position.lerpVectors(eyes[i - 1], eyes[i], share);
    camera.lookAt(target.lerpVectors(targets[i - 1], targets[i], share));
  };
  const result = { opened, size: walk.size, frames: 0, late: 0, longest: 0, held: 0, heldOver: 0, gaps: [] };
  // The first view: the eye stands until all is there.
  let last = performance.now();
  let gap = 0;
  let walked = -1;
  for (;;) {
    await new Promise((done) => requestAnimationFrame(done));
    const now = performance.now();
    const seconds = (now - last) / 1000;
    last = now;
    if (walked >= 0) walked += speed * seconds;
    if (walked >= ends.at(-1) || walked >= most * speed) break;
    put(Math.max(0, walked));
    walk.update(camera);
    renderer.render(scene, camera);
    result.held = Math.max(result.held, walk.held);
    if (walk.held > budget) result.heldOver++;
    if (walked < 0) {
      if (walk.missing > 0) continue;
      result.first = { seconds: (now - begun) / 1000, bytes: walk.bytes };
      walked = 0;
      continue;
    }
    result.frames++;
    if (walk.missing > 0 && gap === 0) result.gaps.push([walked, walk.missing]);
    gap = walk.missing > 0 ? gap + seconds : 0;
    if (walk.missing > 0) result.late++;
    result.longest = Math.max(result.longest, gap);
  }
  return { ...result, metres: walked, bytes: walk.bytes, missing: walk.missing, errors: walk.errors };
}, [`/folder/${basename(folder)}/`, frames, Number(values.budget) * 1e6, METRES_A_SECOND, Number(values.seconds)]);

const share = (bytes) => `${(bytes / 1e3).toFixed(0)} kB, ${((100 * bytes) / found.size).toFixed(1)} %`;
console.log(`${basename(folder)}: ${(found.size / 1e3).toFixed(0)} kB in the folder, budget ${values.budget} MB`);
console.log(`opened: ${share(found.opened.bytes)}, ${found.opened.seconds.toFixed(2)} s`);
console.log(`first full view: ${share(found.first.bytes)}, ${found.first.seconds.toFixed(2)} s`);
console.log(`over ${found.metres.toFixed(0)} m of the path: ${share(found.bytes)}`);
console.log(`frames with something missing: ${found.late} of ${found.frames}, ${((100 * found.late) / found.frames).toFixed(2)} %; longest ${found.longest.toFixed(2)} s`);
if (found.late > 0) console.log(`at ${found.gaps.map(([metres, missing]) => `${metres.toFixed(1)} m: ${missing} objects`).join(', ')}`);
console.log(`held at most: ${(found.held / 1e6).toFixed(2)} MB; frames above the budget: ${found.heldOver}`);
console.log(`requests: ${server.asked.filter((address) => address.startsWith('/folder/')).length}; errors: ${found.errors.length}`);
await browser.close();
await server.close();
