// The README's commands and program, as they stand there, with a model of a stranger.

import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join, resolve } from 'node:path';
import { test } from 'node:test';
import { launch, open } from '../testing/browser.mjs';
import { model, program, web } from '../testing/buildings.mjs';
import { serve } from '../testing/server.mjs';

const section = readFileSync(join(web, 'README.md'), 'utf8').split('## A model of your own')[1];
const block = (kind) => new RegExp(`\`\`\`${kind}\n([\\s\\S]*?)\`\`\``).exec(section)[1];

test('the README leads from a glTF to a culled scene', async () => {
  const folder = mkdtempSync(join(tmpdir(), 'enfilade-readme-'));
  const server = await serve({ web, site: folder });
  const browser = await launch();
  try {
    copyFileSync(model('villa_rotonda'), join(folder, 'model.glb'));
    symlinkSync(resolve(program), join(folder, 'enfilade'));
    execFileSync('sh', ['-e', '-c', block('sh')], { cwd: folder, env: { ...process.env, PATH: `${folder}:${process.env.PATH}` }, stdio: 'ignore' });
    const text = block('js');
    const lines = text.split('\n').filter((line) => line.trim() !== '').length;
    assert.ok(lines <= 20, `${lines} lines`);
    // As it stands, and with what the test looks at.
    writeFileSync(join(folder, 'program.js'), `${text}\nObject.assign(window, { renderer, culled, building });\n`);
    copyFileSync(join(web, 'testing/pages/readme.html'), join(folder, 'index.html'));
    const page = await open(browser, `${server.address}/site/index.html`);
    await page.waitForFunction(() => window.renderer?.info.render.frame > 2);
    const [calls, objects] = await page.evaluate(() => [window.renderer.info.render.calls, window.building.objects]);
    assert.ok(calls > 0 && calls < objects / 2, `${calls} draw calls for ${objects} objects`);
    assert.deepEqual(page.faults, []);
  } finally {
    await browser.close();
    await server.close();
    rmSync(folder, { recursive: true });
  }
});
