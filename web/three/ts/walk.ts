import { Building, View, ready, type Mode } from '@enfilade/runtime';
import { Group, type Camera, type Object3D } from 'three';
import { Ahead } from './ahead.js';
import { Boxes } from './boxes.js';
import { Eye } from './eye.js';
import { Files } from './files.js';
import { MANIFEST, readManifest, type Manifest } from './manifest.js';
import { Parts } from './parts.js';
import { Plan } from './plan.js';
import { Shown } from './shown.js';
import { Source } from './source.js';

/** What is left as it is if it isn't said. */
export interface WalkOptions {
  /** Most bytes of what is held: vertices, indices, pictures. 256 MB. */
  readonly budget?: number;
}

const BUDGET = 256 * 2 ** 20;
/** Chunks that are fetched at once: over HTTP/1.1 a browser sends six, and keeps the others in the order of their urgency. More: the nearest comes later.
 * Fewer: the line is idle while a request is on its way. */
const AT_ONCE = 12;
/** Chunks of objects that a frame needs and that are not under way: no more are known. */
const MOST_LATE = 64;

/** What there is once the manifest and the `.pvs` file are read. */
interface Opened {
  readonly manifest: Manifest;
  readonly building: Building;
  readonly view: View;
  readonly plan: Plan;
  readonly source: Source;
  readonly parts: Parts;
  readonly ahead: Ahead;
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
  /** How many of them are on the line. */
  private onLine = 0;
  /** Chunks that have room in the plan, and are not there. */
  private readonly wanted = new Set<number>();
  private readonly failed = new Set<number>();
  /** Chunks of objects that the last frame needs and that may come: the first few that are not under way. */
  private readonly lateChunks = new Uint32Array(MOST_LATE);
  private late = 0;
  /** Whether one is to come, or under way. */
  private isWaiting = false;
  /** Chunks that are held, and that a new plan has not asked for yet. */
  private readonly spare = new Set<number>();
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
    const { view, plan, shown, ahead } = opened;
    this.eye.take(camera, this.scene);
    const { matrix, position } = this.eye;
    // It takes memory, where the list of objects is.
    if (plan.isOff) this.renew(opened);
    const objects = view.cull(matrix.elements, position, mode);
    shown.set(objects);
    plan.prefetch.frame(view, matrix.elements, position, performance.now() / 1000);
    for (let step = plan.prefetch.next(); step; step = plan.prefetch.next()) this.take(opened, step.chunk, step.load);
    this.missing = this.drawBoxes(opened, objects);
    ahead.take(position, view.homes());
    this.fetch(opened);
  }

  /** Hides an object in all frames, or no longer. */
  hide(object: number, isHidden: boolean): void {
    if (isHidden) this.hidden.add(object);
    else this.hidden.delete(object);
    this.known.parts.setShown(object, this.isShown(this.known, object));
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
    opened.plan.prefetch.free();
    opened.ahead.free();
    opened.view.free();
    opened.building.free();
  }

  private get known(): Opened {
    if (!this.opened) throw new Error('the walk is not ready yet, or has ended: await walk.ready first');
    return this.opened;
  }

  private async open(budget: number): Promise<void> {
    await ready;
    const manifest = readManifest(await this.files.manifest());
    const building = new Building(await this.files.read(manifest.pvs));
    if (this.isEnded) return building.free();
    try {
      check(manifest, building);
      const plan = new Plan(building, manifest, budget);
      const source = new Source(manifest, this.files, (text) => this.fail(text));
      const parts = new Parts(building.objects, this.group);
      const shown = new Shown(building.objects, (object, isShown) => parts.setShown(object, isShown && !this.hidden.has(object)));
      const boxes = new Boxes(building, manifest.origin);
      const ahead = new Ahead(building, plan.chunkOf, boxes.corners, manifest.origin, manifest.chunks.length);
      this.group.add(boxes.lines);
      this.group.position.fromArray(manifest.origin);
      this.opened = { manifest, building, view: new View(building), plan, ahead, source, parts, shown, boxes, size: this.files.bytes - manifest.pvs.bytes + sizeOf(manifest) };
    } catch (error) {
      building.free();
      throw error;
    }
  }

  /** Takes a step of the plan: what it would load has room from now on, and is fetched when it is near. */
  private take(opened: Opened, chunk: number, isLoad: boolean): void {
    const { plan, parts } = opened;
    if (isLoad) {
      this.spare.delete(chunk);
      if (!parts.holds(chunk) && !this.failed.has(chunk)) this.wanted.add(chunk);
      plan.prefetch.loaded(chunk);
    } else {
      this.wanted.delete(chunk);
      if (parts.holds(chunk)) this.letGo(opened, chunk);
    }
  }

  /** Fetches what is seen and not there, then what may be seen soon. */
  private fetch(opened: Opened): void {
    const { ahead: { order, count } } = opened;
    for (let i = 0; i < this.late && this.onLine < AT_ONCE; i++) this.ask(opened, this.lateChunks[i]!, 'high');
    // The line is theirs alone.
    if (this.isWaiting) return;
    for (let i = 0; i < count && this.onLine < AT_ONCE; i++) this.ask(opened, order[i]!, 'low');
  }

  private ask(opened: Opened, chunk: number, urgency: RequestPriority): void {
    if (this.wanted.has(chunk) && !this.asked.has(chunk)) void this.load(opened, chunk, urgency);
  }

  /** Asks for the next chunk as soon as one has come, before it is read. */
  private leaveLine(): void {
    this.onLine--;
    if (this.opened) this.fetch(this.opened);
  }

  private async load(opened: Opened, chunk: number, urgency: RequestPriority): Promise<void> {
    const { plan, source, parts, manifest } = opened;
    this.asked.add(chunk);
    this.onLine++;
    try {
      const arrived = await source.read(chunk, urgency, () => this.leaveLine());
      if (this.isEnded || !this.wanted.has(chunk)) return source.letGo(chunk);
      const prepared = parts.prepare(manifest.chunks[chunk]!.file, arrived);
      plan.learn(chunk, prepared.bytes);
      if (!this.makeRoom(opened, prepared.bytes)) {
        // It is larger than it was taken for: the next plan knows.
        source.letGo(chunk);
        return this.renew(opened);
      }
      this.wanted.delete(chunk);
      parts.add(chunk, prepared);
      for (const { object } of prepared.parts) parts.setShown(object, this.isShown(opened, object));
    } catch (error) {
      if (this.isEnded) return;
      this.fail((error as Error).message);
      this.failed.add(chunk);
      this.wanted.delete(chunk);
    } finally {
      this.asked.delete(chunk);
    }
  }

  /** Makes a new plan; what is held stays until it is asked for, or its room is needed. */
  private renew({ plan, parts }: Opened): void {
    plan.renew();
    this.wanted.clear();
    for (const chunk of parts.chunks) this.spare.add(chunk);
  }

  /** Makes room for so many bytes; `false`: there is not enough. */
  private makeRoom(opened: Opened, bytes: number): boolean {
    const { plan, parts } = opened;
    for (const chunk of this.spare) {
      if (parts.bytes + bytes <= plan.budget) break;
      this.letGo(opened, chunk);
    }
    return parts.bytes + bytes <= plan.budget;
  }

  private letGo({ parts, source }: Opened, chunk: number): void {
    this.spare.delete(chunk);
    parts.remove(chunk);
    source.letGo(chunk);
  }

  private isShown({ shown }: Opened, object: number): boolean {
    return shown.has(object) && !this.hidden.has(object);
  }

  /** Draws the boxes of what is not there, and gives their number. */
  private drawBoxes({ boxes, parts, plan }: Opened, objects: Uint32Array): number {
    boxes.clear();
    let missing = 0;
    this.late = 0;
    this.isWaiting = false;
    for (let i = 0; i < objects.length; i++) {
      const object = objects[i]!;
      if (parts.has(object)) continue;
      boxes.add(object);
      missing++;
      this.isLate(plan.chunkOf[object]!);
    }
    boxes.show();
    return missing;
  }

  /** An object of a chunk is late. */
  private isLate(chunk: number): void {
    const isAsked = this.asked.has(chunk);
    // What has failed, or does not fit into the budget, does not come.
    if (!isAsked && !this.wanted.has(chunk)) return;
    this.isWaiting = true;
    if (isAsked || this.late === MOST_LATE) return;
    for (let i = 0; i < this.late; i++) if (this.lateChunks[i] === chunk) return;
    this.lateChunks[this.late++] = chunk;
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
    throw new Error(`${MANIFEST}: objects: is ${manifest.objects}, and ${manifest.pvs.file} has ${building.objects}`);
  }
}

function sizeOf({ pvs, chunks, meshes, pictures }: Manifest): number {
  return [pvs, ...chunks, ...meshes, ...pictures].reduce((sum, { bytes }) => sum + bytes, 0);
}
