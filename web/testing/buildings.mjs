// The repository's buildings, baked, exported and packed into a temporary folder, each once for all tests.

import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, renameSync, statSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { textured } from './textured.mjs';

export const web = join(dirname(fileURLToPath(import.meta.url)), '..');
export const data = join(web, '../data/buildings');
const target = process.env.CARGO_TARGET_DIR ?? join(web, '../target');
export const program = process.env.ENFILADE ?? join(target, 'release/enfilade');
if (!existsSync(program)) throw new Error(`no ${program}: build it, or give its path in ENFILADE`);

/** What tests make: models, folders and pictures to look at. Another program makes others. */
export const made = process.env.ENFILADE_WEB_OUT ?? join(tmpdir(), `enfilade-web-${statSync(program).mtimeMs}`);
mkdirSync(made, { recursive: true });

/** Runs the program. */
export function enfilade(...args) {
  return execFileSync(program, args, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] });
}

/** A file that is made once: `make` writes it under another name first. */
function once(path, make) {
  if (existsSync(path)) return path;
  const [end] = /(\.\w+)?$/.exec(path);
  const unfinished = `${path.slice(0, path.length - end.length)}.${process.pid}${end}`;
  make(unfinished);
  if (!existsSync(path)) renameSync(unfinished, path);
  return path;
}

/** The villa with a picture on its walls. */
const pictured = () => once(join(made, 'pictured-model.glb'), (to) => writeFileSync(to, textured(readFileSync(join(data, 'villa_rotonda.glb')), 0)));

export const model = (name) => name === 'pictured' ? pictured() : join(data, `${name}.glb`);
export const pvs = (name) => once(join(made, `${name}.pvs`), (to) => enfilade('bake', model(name), '-o', to, '--rays', '10k'));
/** With view cells, whose rows narrow those of cells. */
export const viewCells = (name) => once(join(made, `${name}-views.pvs`), (to) => enfilade('bake', model(name), '-o', to, '--rays', '10k', '--view-cells', 'auto'));
export const glb = (name) => once(join(made, `${name}.glb`), (to) => enfilade('export', pvs(name), '--model', model(name), '-o', to));
export const folder = (name) => once(join(made, `${name}-packed`), (to) => enfilade('pack', pvs(name), '--model', model(name), '-o', to));
export const path = (name) => JSON.parse(readFileSync(join(data, `${name}.path.json`), 'utf8'));
