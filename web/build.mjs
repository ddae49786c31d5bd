// Builds the packages: `node build.mjs`. It needs cargo with the target wasm32-unknown-unknown, and what package.json names.

import { execFileSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import binaryen from 'binaryen';
import { build } from 'esbuild';

const web = dirname(fileURLToPath(import.meta.url));
const target = process.env.CARGO_TARGET_DIR ?? join(web, '../target');
const run = (program, args, options = {}) => execFileSync(program, args, { stdio: 'inherit', cwd: web, ...options });

/** The module of the run time, and what is made around it. */
function wasm() {
  // Level 2 vectorizes what frames run. Beyond that, only what is marked is inlined, and only loops of a few known turns are unrolled.
  const small = ['-inline-threshold=25', '-unroll-runtime=0', '-unroll-allow-partial=0'];
  const flags = ['target-feature=+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext', ...small.map((flag) => `llvm-args=${flag}`)]
    .map((flag) => `-C ${flag}`).join(' ');
  const env = { ...process.env, CARGO_TARGET_DIR: target, CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS: flags };
  run('cargo', ['build', '-q', '--locked', '-p', 'enfilade-web', '--profile', 'web', '--target', 'wasm32-unknown-unknown'], { env });
  const made = join(web, 'runtime/build');
  rmSync(made, { recursive: true, force: true });
  const compiled = join(target, 'wasm32-unknown-unknown/web/enfilade_web.wasm');
  run('cargo', ['run', '-q', '--locked', '--manifest-path', 'bindgen/Cargo.toml', '--', compiled, made], { env: { ...process.env, CARGO_TARGET_DIR: target } });
  const silent = join(made, 'silent.wasm');
  writeFileSync(silent, withoutPanics(readFileSync(join(made, 'enfilade_bg.wasm'))));
  const features = ['simd', 'bulk-memory', 'nontrapping-float-to-int', 'sign-ext', 'mutable-globals', 'reference-types'];
  const optimize = join(web, 'node_modules/binaryen/bin/wasm-opt');
  const flagsOf = features.map((feature) => `--enable-${feature}`);
  run('node', [optimize, '-Oz', ...flagsOf, '--strip-debug', '--strip-producers', silent, '-o', join(made, 'enfilade.wasm')]);
}

/** What a panic calls first, by the compiler's names; none of it returns. A name that is missed costs bytes and nothing else. */
const PANIC = new RegExp('(^|[<\\[:])core(\\[\\w+\\])?::(panicking::|slice::.*_fail|str::.*_fail|option::\\w+_failed|result::unwrap_failed|cell::panic_)' +
  '|^alloc(\\[\\w+\\])?::(raw_vec::(handle_error|capacity_overflow)|alloc::handle_alloc_error)|::rust_begin_unwind|thread::local::panic_access_error');

/** The module without the texts of panics, which nobody could read: a panic is a trap, with its text and without. */
function withoutPanics(bytes) {
  const module = binaryen.readBinary(bytes);
  binaryen.setDebugInfo(true);
  let panics = 0;
  for (let i = 0; i < module.getNumFunctions(); i++) {
    const { name, base, results } = binaryen.getFunctionInfo(module.getFunctionByIndex(i));
    if (base || results !== binaryen.none || !PANIC.test(name)) continue;
    binaryen.Function.setBody(module.getFunction(name), module.unreachable());
    panics++;
  }
  if (panics < 10) throw new Error(`${panics} functions of panics: the compiler gives them other names`);
  return module.emitBinary();
}

/** The modules that a page loads, and their types. */
async function modules() {
  // What the generated classes call their own memory is nobody else's business.
  const mangleProps = /^__(destroy_into_raw|wbg_ptr)$/;
  const shared = { bundle: true, mangleProps, format: 'esm', minify: true, target: 'es2022', logLevel: 'warning', absWorkingDir: web };
  const external = ['node:fs/promises', '@enfilade/runtime', 'three', 'three/*'];
  rmSync(join(web, 'runtime/dist'), { recursive: true, force: true });
  mkdirSync(join(web, 'runtime/dist'));
  copyFileSync(join(web, 'runtime/build/enfilade.wasm'), join(web, 'runtime/dist/enfilade.wasm'));
  await build({ ...shared, external, entryPoints: ['runtime/ts/index.ts'], outfile: 'runtime/dist/enfilade.js' });
  await build({ ...shared, external, entryPoints: ['runtime/ts/inline.ts'], outfile: 'runtime/dist/enfilade.inline.js', loader: { '.wasm': 'base64' } });
  run('node_modules/.bin/tsc', ['-p', 'runtime', '--emitDeclarationOnly']);
  rmSync(join(web, 'three/dist'), { recursive: true, force: true });
  await build({ ...shared, external, entryPoints: ['three/ts/index.ts'], outfile: 'three/dist/three.js' });
  run('node_modules/.bin/tsc', ['-p', 'three', '--emitDeclarationOnly']);
  await page(shared);
}

/** The page: bundled, with the wasm beside it. */
async function page(shared) {
  rmSync(join(web, 'demo/dist'), { recursive: true, force: true });
  await build({ ...shared, entryPoints: ['demo/ts/main.ts'], outfile: 'demo/dist/demo.js', external: ['node:fs/promises'] });
  copyFileSync(join(web, 'demo/index.html'), join(web, 'demo/dist/index.html'));
  copyFileSync(join(web, 'runtime/dist/enfilade.wasm'), join(web, 'demo/dist/enfilade.wasm'));
}

function size(name) {
  const bytes = readFileSync(join(web, name));
  console.log(`${name}: ${statSync(join(web, name)).size} bytes, ${gzipSync(bytes, { level: 9 }).length} with gzip`);
}

if (!process.argv.includes('--no-wasm')) wasm();
await modules();
size('runtime/dist/enfilade.wasm');
size('runtime/dist/enfilade.js');
size('three/dist/three.js');
size('demo/dist/demo.js');
