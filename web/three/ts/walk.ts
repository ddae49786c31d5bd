import { Building, Prefetch, View, ready, type Mode } from '@enfilade/runtime';
import { Group, type Camera, type Object3D } from 'three';
import { Boxes } from './boxes.js';
import { Eye } from './eye.js';
import { Files } from './files.js';
import { chunkOfObjects, readManifest, type Manifest } from './manifest.js';
import { Parts } from './parts.js';
import { Shown } from './shown.js';
import { Source } from './source.js';

/** What is left as it is if it isn't said. */
export interface WalkOptions {
  /** Most bytes of what is held: vertices, indices, pictures. 256 MB. */
  readonly budget?: number;
}

const BUDGET = 256 * 2 ** 20;
/** Chunks that are fetched at once. More: the nearest comes later. Fewer: the line is idle while a request is on its way. */
const AT_ONCE = 6;

/** What there is once the manifest and the `.pvs` file are read. */
interface Opened {
  readonly manifest: Manifest;
  readonly building: Building;
  readonly view: View;
  readonly prefetch: Prefetch;
  readonly source: Source;
  readonly parts: Parts;
  readonly shown: Shown;
  readonly boxes: Boxes;
  readonly size: number;
}

/** A walk in a packed folder, which arrives as one walks. Once it is warm, a frame in which nothing arrives allocates nothing. */
export class Walk {
  /** Resolves when frames can be drawn; objects arrive after that. Rejects with an `Error` if the folder is refused. */
  readonly ready: Promise<void>;
  /** What did not come, or is not as the manifest says; boxes stand in its place. */
  readonly errors: string[] = [];
  /** Objects of the last frame that are not there yet; their boxes are drawn. */
  missing = 0;
  private readonly group = new Group();
  private readonly files: Files;
  private readonly eye = new Eye();
  private readonly hidden = new Set<number>();
  private readonly asked = new Set<number>();
  private opened: Opened | undefined;
  private isEnded = false;

  /** Adds a group to a scene, whose local coordinates are the model's. `address`: of the folder or of its manifest. */
  constructor(private readonly scene: Object3D, address: string | URL, options: WalkOptions = {}) {
    this.files = new Files(address);
    this.group.name = 'enfilade';
    scene.add(this.group);
    this.ready = this.open(options.budget ?? BUDGET);
  }

  /** The building. There is none before `ready`. */
  get building(): Building {
    return this.known.building;
  }

  /** Its culling: doors are opened and shut here. There is none before `ready`. */
  get view(): View {
    return this.known.view;
  }

  /** Bytes that were fetched. */
  get bytes(): number {
    return this.files.bytes;
  }

  /** Bytes of all files of the folder. 0 before `ready`. */
  get size(): number {
    return this.opened?.size ?? 0;
  }

  /** Bytes that are held: vertices, indices and pictures of all chunks that are there. What chunks share is counted with each. */
  get held(): number {
    return this.opened?.parts.bytes ?? 0;
  }

  /** Chunks that are under way. */
  get underWay(): number {
    return this.asked.size;
  }

  /** Hides what the camera can't see, and asks for what it may need next. To be called before each frame is drawn. */
  update(camera: Camera, mode: Mode = 'both'): void {
    const opened = this.opened;
    if (!opened) return;
    const { view, prefetch, shown } = opened;
    this.eye.take(camera, this.scene);
    const { matrix, position } = this.eye;
    const objects = view.cull(matrix.elements, position, mode);
    shown.set(objects);
    this.drawBoxes(opened, objects);
    this.missing = prefetch.frame(view, matrix.elements, position, performance.now() / 1000);
    while (this.asked.size < AT_ONCE) {
      const step = prefetch.next();
      if (!step) break;
      if (step.load) void this.load(opened, step.chunk);
      else this.letGo(opened, step.chunk);
    }
  }

  /** Hides an object in all frames, or no longer. */
  hide(object: number, isHidden: boolean): void {
    if (isHidden) this.hidden.add(object);
    else this.hidden.delete(object);
    const { parts, shown } = this.known;
    parts.setShown(object, shown.has(object) && !isHidden);
  }

  /** Ends the walk: removes all from the scene, and gives its memory back. */
  dispose(): void {
    if (this.isEnded) return;
    this.isEnded = true;
    this.files.end();
    this.group.removeFromParent();
    const opened = this.opened;
    this.opened = undefined;
    if (!opened) return;
    opened.parts.dispose();
    opened.boxes.dispose();
    opened.prefetch.free();
    opened.view.free();
    opened.building.free();
  }

  private get known(): Opened {
    if (!this.opened) throw new Error('the walk is not ready yet, or has ended: await walk.ready first');
    return this.opened;
  }

  private async open(budget: number): Promise<void> {
    await ready;
    const manifest = readManifest(await this.files.text('manifest.json'));
    const building = new Building(await this.files.read(manifest.pvs));
    if (this.isEnded) return building.free();
    try {
      check(manifest, building);
      const bytes = Float64Array.from(manifest.chunks, (chunk) => Source.memory(manifest, chunk));
      const prefetch = new Prefetch(building, chunkOfObjects(manifest), bytes, budget);
      const source = new Source(manifest, this.files, (text) => this.fail(text));
      const parts = new Parts(building.objects, this.group);
      const shown = new Shown(building.objects, (object, isShown) => parts.setShown(object, isShown && !this.hidden.has(object)));
      const boxes = new Boxes(building, manifest.origin);
      this.group.add(boxes.lines);
      this.group.position.fromArray(manifest.origin);
      this.opened = { manifest, building, view: new View(building), prefetch, source, parts, shown, boxes, size: sizeOf(manifest) };
    } catch (error) {
      building.free();
      throw error;
    }
  }

  private async load(opened: Opened, chunk: number): Promise<void> {
    const { prefetch, source, parts, shown, manifest } = opened;
    this.asked.add(chunk);
    try {
      const arrived = await source.read(chunk);
      if (this.isEnded) return source.letGo(chunk);
      parts.add(chunk, manifest.chunks[chunk]!.file, arrived);
      for (const [object] of [...arrived.own, ...arrived.placed]) parts.setShown(object, shown.has(object) && !this.hidden.has(object));
      prefetch.loaded(chunk);
    } catch (error) {
      if (this.isEnded) return;
      this.fail((error as Error).message);
      prefetch.failed(chunk);
    } finally {
      this.asked.delete(chunk);
    }
  }

  private letGo({ parts, source }: Opened, chunk: number): void {
    parts.remove(chunk);
    source.letGo(chunk);
  }

  private drawBoxes({ boxes, parts }: Opened, objects: Uint32Array): void {
    boxes.clear();
    for (let i = 0; i < objects.length; i++) {
      const object = objects[i]!;
      if (!parts.has(object)) boxes.add(object);
    }
    boxes.show();
  }

  private fail(text: string): void {
    if (!this.isEnded && !this.errors.includes(text)) this.errors.push(text);
  }
}

/** Whether a `.pvs` file is the one that the folder is of. */
function check(manifest: Manifest, building: Building): void {
  if (building.model !== manifest.model) {
    throw new Error(`${manifest.pvs.file} is of the model ${building.model}, and the folder of ${manifest.model}`);
  }
  if (building.objects !== manifest.objects) {
    throw new Error(`manifest.json: objects: is ${manifest.objects}, and ${manifest.pvs.file} has ${building.objects}`);
  }
}

function sizeOf({ pvs, chunks, meshes, pictures }: Manifest): number {
  return [pvs, ...chunks, ...meshes, ...pictures].reduce((sum, { bytes }) => sum + bytes, 0);
}
