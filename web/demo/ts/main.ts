import type { Mode } from '@enfilade/runtime';
import { Vector3 } from 'three';
import { fromFiles, fromFolder, type Model } from './model.js';
import { element, listKeys, say } from './page.js';
import { Stage } from './stage.js';
import { Tour } from './tour.js';
import { Walker } from './walker.js';

const MODES: Record<string, Mode> = { Digit1: 'none', Digit2: 'frustum', Digit3: 'portals', Digit4: 'pvs', Digit5: 'both' };
const NO_WEBGL = 'This page needs WebGL2, which this browser does not have, or has turned off.';
/** A frame moves the eye by no more than this, seconds. */
const LONGEST = 0.1;

const canvas = element<HTMLCanvasElement>('view');
let tour: Tour | undefined;
let walker: Walker | undefined;
let isLost = false;
const dropped: { pvs?: File; glb?: File } = {};

function begin(): void {
  listKeys();
  let stage: Stage;
  try {
    stage = new Stage(canvas, restored, () => {
      isLost = true;
      say('The graphics were lost; they come back when the browser restores them.');
    });
  } catch {
    say(NO_WEBGL, true);
    return;
  }
  walker = new Walker(canvas, (x, y) => use(stage, x, y));
  window.addEventListener('resize', () => stage.resize());
  window.addEventListener('keydown', (event) => key(event, stage));
  element('plan').addEventListener('click', (event) => tour?.goTo(event.clientX, event.clientY));
  listenForFiles(stage);
  let last = performance.now();
  stage.renderer.setAnimationLoop((now) => {
    const seconds = Math.max(0, Math.min(LONGEST, (now - last) / 1000));
    last = now;
    if (isLost) return;
    if (tour) tour.frame(seconds);
    else stage.draw();
    tellErrors();
  });
  void open(stage);
}

function restored(): void {
  isLost = false;
  say('');
}

/** The folder that the address names, or that the page lies in; else files are asked for. */
async function open(stage: Stage): Promise<void> {
  const named = new URLSearchParams(location.search).get('pack');
  const folder = new URL(named === null ? '.' : named.endsWith('.jsonz') || named.endsWith('/') ? named : `${named}/`, location.href);
  if (folder.origin !== location.origin) return say(`${folder.origin} is another origin: only folders beside this page are opened.`, true);
  if (named === null) {
    const answer = await fetch(new URL('manifest.jsonz', folder), { method: 'HEAD' }).catch(() => undefined);
    if (!answer?.ok) {
      element('start').hidden = false;
      return;
    }
  }
  say('Opening the building…');
  await start(stage, () => fromFolder(stage.scene, folder));
}

function listenForFiles(stage: Stage): void {
  const take = (files: Iterable<File>): void => {
    for (const file of files) {
      if (file.name.toLowerCase().endsWith('.pvs')) dropped.pvs = file;
      else if (file.name.toLowerCase().endsWith('.glb')) dropped.glb = file;
      else return say(`${file.name} is no .pvs or .glb file.`, true);
    }
    const { pvs, glb } = dropped;
    if (!pvs || !glb) return say(pvs ? 'Now its .glb, please.' : 'Now its .pvs, please.');
    delete dropped.pvs;
    delete dropped.glb;
    say('Opening the building…');
    void start(stage, async () => fromFiles(stage.scene, await pvs.arrayBuffer(), await glb.arrayBuffer()));
  };
  window.addEventListener('dragover', (event) => {
    event.preventDefault();
    element('start').classList.add('over');
  });
  window.addEventListener('dragleave', () => element('start').classList.remove('over'));
  window.addEventListener('drop', (event) => {
    event.preventDefault();
    element('start').classList.remove('over');
    take(event.dataTransfer?.files ?? []);
  });
  element<HTMLInputElement>('files').addEventListener('change', (event) => {
    const input = event.target as HTMLInputElement;
    take(input.files ?? []);
    input.value = '';
  });
}

async function start(stage: Stage, make: () => Promise<Model>): Promise<void> {
  let model: Model;
  try {
    model = await make();
  } catch (error) {
    return say((error as Error).message, true);
  }
  tour?.dispose();
  tour = new Tour(model, stage, walker!);
  element('start').hidden = true;
  for (const id of ['line', 'graph', 'cross']) element(id).hidden = false;
  say('WASD: walk · arrows or drag: look · E: doors · M: plan · H: all keys', false, 8);
  canvas.focus();
}

function key(event: KeyboardEvent, stage: Stage): void {
  if (event.ctrlKey || event.altKey || event.metaKey || event.repeat || event.target instanceof HTMLInputElement) return;
  const { code } = event;
  if (code === 'KeyH') return toggle('keys');
  if (!tour) return;
  const mode = MODES[code];
  if (mode) {
    tour.mode = mode;
    say(`Culling: ${mode}`, false, 2);
  } else if (code === 'KeyM') toggle('plan');
  else if (code === 'KeyG') toggle('graph');
  else if (code === 'KeyE') use(stage, window.innerWidth / 2, window.innerHeight / 2);
  else if (code === 'KeyF') {
    tour.freeze();
    say(tour.isFrozen ? 'Frozen: the culling stays, and the eye goes on.' : 'The culling goes on.', false, 3);
  } else if (code === 'KeyV' && walker) {
    walker.walls = !walker.walls;
    say(walker.walls ? 'Walls stop the eye.' : 'The eye goes through walls.', false, 3);
  } else if (code === 'KeyL') lock();
}

function lock(): void {
  if (document.pointerLockElement) return document.exitPointerLock();
  // A browser may refuse it: dragging works as before.
  void Promise.resolve(canvas.requestPointerLock()).catch(() => undefined);
}

function toggle(id: string): void {
  element(id).hidden = !element(id).hidden;
}

/** Opens or shuts the door at a point of the window. */
function use(stage: Stage, x: number, y: number): void {
  if (!tour || !walker) return;
  const { camera } = stage;
  const way = new Vector3((2 * x) / window.innerWidth - 1, 1 - (2 * y) / window.innerHeight, 0.5).unproject(camera).sub(camera.position).normalize();
  const done = tour.doors.use(walker.eye, way);
  if (done) say(done === 'opened' ? 'The door is open.' : 'The door is shut.', false, 2);
}

function tellErrors(): void {
  const errors = tour?.model.walk?.errors;
  if (errors && errors.length > 0) say(`${errors.length} files did not come: ${errors[errors.length - 1]}`, true);
}

begin();
