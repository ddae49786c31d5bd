import * as wasm from '../build/enfilade.js';
import type { Building } from './building.js';
import { Lists, check, known, writeBox, writeCamera, type Box, type Point } from './memory.js';

/** What is culled by: nothing, the frustum, portals, the row of the eye's cell, or portals and rows, which is the best of these. */
export type Mode = 'none' | 'frustum' | 'portals' | 'pvs' | 'both';

const MODES: Partial<Record<string, number>> = { none: 0, frustum: 1, portals: 2, pvs: 3, both: 4 };

/** Numbers of a frame. */
export interface Counts {
  readonly cells: number;
  readonly portals: number;
  readonly objects: number;
  readonly triangles: number;
  /** Small objects that were left out. */
  readonly small: number;
}

/** One camera's culling. Views of one building are independent of each other. Nothing is allocated for a frame once it is warm. */
export class View {
  /** @internal */
  readonly raw: wasm.View;
  private readonly seen = new Lists(Uint32Array);
  private readonly reached = new Lists(Uint32Array);
  private readonly around = new Lists(Uint32Array);
  private readonly made = new Lists(Uint32Array);

  /** A view with all doors open. */
  constructor(building: Building) {
    this.raw = new wasm.View(building.raw);
  }

  /**
   * Culls a frame: the objects to draw, each once, in a list that holds until the next call.
   *
   * `viewProjection`: 16 numbers, column by column, from the model's coordinates to the clip space of any API; `eye`: where the camera is. A matrix that
   * is not finite shows everything, and an eye in no cell everything in the frustum.
   */
  cull(viewProjection: ArrayLike<number>, eye: Point, mode: Mode = 'both'): Uint32Array {
    const number = MODES[mode];
    if (number === undefined) throw new Error(`no mode "${mode}": there are ${Object.keys(MODES).join(', ')}`);
    writeCamera(viewProjection, eye);
    this.raw.cull(number);
    return this.seen.given();
  }

  /** The last frame as ranges of an index buffer with the triangles of all objects in the order of their ids: each the first, and the first behind. */
  runs(): Uint32Array {
    this.raw.runs();
    return this.made.given();
  }

  /** The cells that the last frame reached, the eye's own first. */
  cells(): Uint32Array {
    this.raw.cells();
    return this.reached.given();
  }

  /** The cells that the eye of the last frame was in: several on a border; none: everything in the frustum is drawn. */
  homes(): Uint32Array {
    this.raw.homes();
    return this.around.given();
  }

  /** The portals that the last frame saw through, nearest first: twice a portal, and 1 more against its direction. */
  portals(): Uint32Array {
    this.raw.portals();
    return this.made.given();
  }

  /** Numbers of the last frame. */
  counts(): Counts {
    this.raw.counts();
    const [cells, portals, objects, triangles, small] = [...known()] as [number, number, number, number, number];
    return { cells, portals, objects, triangles, small };
  }

  /** Opens or shuts a portal, for later frames. */
  setOpen(portal: number, open: boolean): void {
    check(this.raw.setOpen(portal, open));
  }

  /** Whether a portal is open. */
  isOpen(portal: number): boolean {
    return this.raw.isOpen(portal);
  }

  /** Doors as they stand in the model. */
  doorsAsFound(): void {
    this.raw.asFound();
  }

  /** Leaves out what covers fewer than `pixels` in pictures of `width` by `height`; 0: nothing. */
  setMinPixels(pixels: number, width: number, height: number): void {
    this.raw.setMinPixels(pixels, width, height);
  }

  /** The slots of the movers that the last frame may show, in a list that holds until the next call. */
  movers(movers: Movers): Uint32Array {
    check(this.raw.movers(movers.raw));
    return this.made.given();
  }

  /** Gives its memory back. */
  free(): void {
    this.raw.free();
  }
}

/** Things that move, by their boxes, for any number of views of a building. */
export class Movers {
  /** @internal */
  readonly raw: wasm.Movers;

  /** None yet. */
  constructor(building: Building) {
    this.raw = new wasm.Movers(building.raw);
  }

  /** Adds a mover, and gives its number. */
  insert(box: Box): number {
    writeBox(box);
    check(this.raw.insert());
    return known()[0]!;
  }

  /** Moves a mover. */
  set(mover: number, box: Box): void {
    writeBox(box);
    check(this.raw.set(mover));
  }

  /** Removes a mover. */
  remove(mover: number): void {
    check(this.raw.remove(mover));
  }

  /** The slot of a mover: a small number, which is used again when it is removed. */
  static slot(mover: number): number {
    return mover % 4294967296;
  }

  /** Gives its memory back. */
  free(): void {
    this.raw.free();
  }
}
