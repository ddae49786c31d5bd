// What tests call: a scene that is drawn with what was culled, and with everything.

import * as three from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import * as runtime from '@enfilade/runtime';
import { Culled, Walk, readManifest } from '@enfilade/three';

const canvas = document.getElementById('view');
const renderer = new three.WebGLRenderer({ canvas, preserveDrawingBuffer: true });
renderer.setSize(canvas.width, canvas.height, false);
const scene = new three.Scene();
scene.background = new three.Color(0x87a7c7);
const sun = new three.DirectionalLight(0xffffff, 2);
sun.position.set(1, 2, 0.5);
scene.add(new three.HemisphereLight(0xffffff, 0x806040, 2), sun);
const camera = new three.PerspectiveCamera(60, canvas.width / canvas.height, 0.1, 1000);

function look({ eye, target }) {
  camera.position.fromArray(eye);
  camera.lookAt(...target);
}

function pixels(into) {
  const gl = renderer.getContext();
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, into);
  return into;
}

const [some, all] = [0, 1].map(() => new Uint8Array(4 * canvas.width * canvas.height));

/** Draws a frame twice: pixels that differ, and what was drawn. */
function compare(model, frame, mode) {
  look(frame);
  model.update(camera, mode);
  renderer.render(scene, camera);
  const { calls, triangles } = renderer.info.render;
  pixels(some);
  model.update(camera, 'none');
  renderer.render(scene, camera);
  const whole = { calls: renderer.info.render.calls, triangles: renderer.info.render.triangles };
  pixels(all);
  let differ = 0;
  for (let i = 0; i < some.length; i += 4) if (some[i] !== all[i] || some[i + 1] !== all[i + 1] || some[i + 2] !== all[i + 2]) differ++;
  return { differ, calls, triangles, whole };
}

const kept = [];

/** Draws a frame, and keeps its pixels. */
function keep(model, mode) {
  model.update(camera, mode);
  renderer.render(scene, camera);
  kept.push({ pixels: pixels(new Uint8Array(some.length)), triangles: renderer.info.render.triangles });
}

/** Draws a frame with everything: how many pixels differ from those of the kept frame, and the triangles of both. */
function differ(model, frame, number) {
  look(frame);
  model.update(camera, 'none');
  renderer.render(scene, camera);
  pixels(all);
  const old = kept[number];
  let count = 0;
  for (let i = 0; i < all.length; i += 4) if (old.pixels[i] !== all[i] || old.pixels[i + 1] !== all[i + 1] || old.pixels[i + 2] !== all[i + 2]) count++;
  return { pixels: count, triangles: old.triangles, all: renderer.info.render.triangles };
}

async function bytes(address) {
  return new Uint8Array(await (await fetch(address)).arrayBuffer());
}

async function culled(pvs, glb) {
  await runtime.ready;
  const building = new runtime.Building(await bytes(pvs));
  const { scene: loaded } = await new GLTFLoader().parseAsync((await bytes(glb)).buffer, '');
  scene.add(loaded);
  return { model: new Culled(loaded, building), building, loaded };
}

Object.assign(window, { three, runtime, Culled, Walk, readManifest, scene, camera, renderer, look, compare, keep, differ, culled, bytes });
window.isReady = runtime.ready.then(() => true);
