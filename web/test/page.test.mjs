// The page as a person uses it. Pictures of each step are left in the folder that is printed, to be looked at.

import assert from 'node:assert/strict';
import { cpSync, mkdirSync, readFileSync, rmSync } from 'node:fs';
import { basename, join } from 'node:path';
import { after, before, test } from 'node:test';
import { launch, open } from '../testing/browser.mjs';
import { folder, glb, made, pvs, web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

const pictures = join(made, 'pictures');
let server, browser;
before(async () => {
  mkdirSync(pictures, { recursive: true });
  server = await serve({ web, made });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

const start = (options) => open(browser, `${server.address}/web/demo/dist/index.html`, { viewport: { width: 800, height: 450 }, ...options });
const line = (page) => page.locator('#line').textContent();
const message = (page) => page.locator('#message').textContent();
const picture = (page, name) => page.screenshot({ path: join(pictures, `${name}.png`) });

/** Drops files on the page, as a browser does. */
async function drop(page, files) {
  const given = files.map((file) => [file.split('/').pop(), readFileSync(file).toString('base64')]);
  await page.evaluate((given) => {
    const dataTransfer = new DataTransfer();
    for (const [name, base64] of given) dataTransfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    window.dispatchEvent(new DragEvent('drop', { dataTransfer, cancelable: true }));
  }, given);
}

async function opened(page) {
  await page.waitForFunction(() => !document.getElementById('line').hidden && /objects/.test(document.getElementById('line').textContent), undefined, { timeout: 20000 });
}

const numbers = async (page) => /([\d,]+) of ([\d,]+) triangles/.exec(await line(page)).slice(1).map((text) => Number(text.replaceAll(',', '')));

/** Holds a key until the eye is elsewhere, and for some frames. */
async function hold(page, key, milliseconds) {
  await page.keyboard.down(key);
  await page.waitForTimeout(milliseconds);
  await page.keyboard.up(key);
}

test('drop, walk, doors, plan, modes, freeze, keys, resize, a lost context', async () => {
  const page = await start();
  await page.waitForSelector('#start:not([hidden])');
  await picture(page, '1 start');
  await drop(page, [pvs('villa_rotonda')]);
  assert.match(await message(page), /Now its \.glb/);
  await drop(page, [glb('villa_rotonda')]);
  await opened(page);
  await picture(page, '2 dropped');
  const [drawn, frustum] = await numbers(page);
  assert.ok(drawn > 0 && drawn < frustum, `${drawn} of ${frustum}`);

  // The eye begins before a door: with it shut, less is seen.
  await page.keyboard.press('KeyE');
  await page.waitForFunction(() => /is shut/.test(document.getElementById('message').textContent));
  await page.waitForTimeout(500);
  const [shut] = await numbers(page);
  await picture(page, '3 door shut');
  assert.ok(shut < drawn, `${shut} and ${drawn}`);
  await page.mouse.click(400, 225);
  await page.waitForFunction(() => /is open/.test(document.getElementById('message').textContent));
  // The line is written now and then.
  for (let i = 0; i < 50 && (await numbers(page))[0] !== drawn; i++) await page.waitForTimeout(100);
  assert.equal((await numbers(page))[0], drawn, await line(page));

  await page.keyboard.press('KeyM');
  await hold(page, 'KeyW', 1500);
  await picture(page, '4 walked, with the plan');
  await page.keyboard.press('KeyH');
  await page.keyboard.press('Digit2');
  await page.waitForFunction(() => / frustum · /.test(document.getElementById('line').textContent));
  const [byFrustum, all] = await numbers(page);
  assert.equal(byFrustum, all);
  await picture(page, '5 keys, by the frustum');
  await page.keyboard.press('KeyH');
  await page.keyboard.press('Digit5');
  await page.keyboard.press('KeyF');
  await hold(page, 'KeyS', 2500);
  await hold(page, 'Space', 900);
  await picture(page, '6 frozen');
  assert.match(await line(page), /frozen/);
  await page.keyboard.press('KeyF');

  await page.setViewportSize({ width: 420, height: 700 });
  await page.waitForTimeout(300);
  await picture(page, '7 narrow');
  assert.deepEqual(await page.evaluate(() => { const { clientWidth, clientHeight } = document.getElementById('view'); return [clientWidth, clientHeight]; }), [420, 700]);

  await page.evaluate(() => {
    window.lose = document.getElementById('view').getContext('webgl2').getExtension('WEBGL_lose_context');
    window.lose.loseContext();
  });
  await page.waitForFunction(() => /were lost/.test(document.getElementById('message').textContent));
  await page.evaluate(() => window.lose.restoreContext());
  await page.waitForFunction(() => document.getElementById('message').hidden);
  await page.waitForTimeout(500);
  await picture(page, '8 restored');
  // The picture is there again: many colours, not one.
  const colours = await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => {
    const small = Object.assign(document.createElement('canvas'), { width: 64, height: 64 }).getContext('2d');
    small.drawImage(document.getElementById('view'), 0, 0, 64, 64);
    resolve(new Set(new Uint32Array(small.getImageData(0, 0, 64, 64).data.buffer)).size);
  })));
  assert.ok(colours > 10, `${colours} colours`);
  assert.deepEqual(page.faults.filter((text) => !/404|CONTEXT_LOST/.test(text)), []);
  await page.context().close();
});

test('a packed folder: named in the address, and with the page in it; what does not come is told', async () => {
  const name = basename(folder('office'));
  const page = await open(browser, `${server.address}/web/demo/dist/index.html?pack=/made/${name}`, { viewport: { width: 800, height: 450 } });
  await opened(page);
  await page.waitForFunction(() => / 0 missing/.test(document.getElementById('line').textContent));
  await page.keyboard.press('KeyM');
  await page.waitForTimeout(400);
  await picture(page, '12 packed');
  assert.match(await line(page), /MB fetched · .* MB held · 0 missing/);
  await page.context().close();

  const place = join(made, 'with-page');
  rmSync(place, { recursive: true, force: true });
  cpSync(folder('office'), place, { recursive: true });
  cpSync(join(web, 'demo/dist'), place, { recursive: true });
  server.spoil = (address) => /chunks\/\d*[05]\.glbz/.test(address) ? 503 : undefined;
  const other = await open(browser, `${server.address}/made/with-page/index.html`, { viewport: { width: 800, height: 450 } });
  await opened(other);
  await other.waitForFunction(() => /files did not come/.test(document.getElementById('message').textContent), undefined, { timeout: 20000 });
  await other.waitForTimeout(1500);
  await picture(other, '13 boxes');
  server.spoil = undefined;
  await other.context().close();
});

test('two thumbs walk and look', async () => {
  const page = await start({ hasTouch: true, viewport: { width: 800, height: 400 } });
  await page.locator('#files').setInputFiles([pvs('office'), glb('office')]);
  await opened(page);
  const before = await page.screenshot();
  const client = await page.context().newCDPSession(page);
  const touch = (type, points) => client.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([id, x, y]) => ({ id, x, y })) });
  await touch('touchStart', [[0, 150, 250], [1, 600, 200]]);
  await touch('touchMove', [[0, 150, 220], [1, 540, 200]]);
  await page.waitForTimeout(700);
  await touch('touchEnd', []);
  const after = await picture(page, '9 thumbs');
  assert.notDeepEqual(before, after);
  await page.context().close();
});

test('what can not be opened gets a sentence, and the page goes on', async () => {
  const page = await start();
  const [name, mimeType] = ['a.pvs', ''];
  await page.locator('#files').setInputFiles([{ name, mimeType, buffer: readFileSync(pvs('villa_rotonda')).subarray(0, 1000) }]);
  await page.locator('#files').setInputFiles([glb('villa_rotonda')]);
  await page.waitForFunction(() => document.getElementById('message').classList.contains('bad'));
  assert.ok((await message(page)).length > 10);
  await page.locator('#files').setInputFiles([pvs('villa_rotonda'), glb('office')]);
  await page.waitForFunction(() => /has an object/.test(document.getElementById('message').textContent));
  await page.locator('#files').setInputFiles([pvs('villa_rotonda'), join(web, '../data/buildings/villa_rotonda.glb')]);
  await page.waitForFunction(() => /enfilade export/.test(document.getElementById('message').textContent));
  await picture(page, '10 no ids');
  await page.locator('#files').setInputFiles([pvs('villa_rotonda'), glb('villa_rotonda')]);
  await opened(page);
  await page.goto(`${server.address}/web/demo/dist/index.html?pack=http://localhost:1/elsewhere/`);
  await page.waitForFunction(() => /another origin/.test(document.getElementById('message').textContent));
  await page.context().close();
});

test('without WebGL2 the page says so', async () => {
  const page = await browser.newPage();
  await page.addInitScript(() => {
    HTMLCanvasElement.prototype.getContext = () => null;
  });
  await page.goto(`${server.address}/web/demo/dist/index.html`);
  await page.waitForFunction(() => /needs WebGL2/.test(document.getElementById('message').textContent));
  await picture(page, '11 no WebGL2');
  await page.close();
});
