import * as wasm from '../build/enfilade.js';
import type { Building } from './building.js';
import { Lists, check, known, write, writeCamera, type Point } from './memory.js';
import type { View } from './view.js';

/** A shortest way. */
export interface Path {
  /** Its length, and a length that no way is below, metres. */
  readonly metres: number;
  readonly atLeast: number;
  /** Where it starts, passes each portal, and ends: three coordinates each. */
  readonly points: Float64Array;
  /** The portals that it passes, as `View.portals` has them. */
  readonly portals: Uint32Array;
}

/** Finds shortest ways through all portals but windows. Made once for a building. */
export class Paths {
  private readonly raw: wasm.Paths;
  private readonly points = new Lists(Float64Array);
  private readonly portals = new Lists(Uint32Array);

  constructor(building: Building) {
    this.raw = new wasm.Paths(building.raw);
  }

  /** The shortest way between two points through the doors that are open in a view; none if there is no way, or a point is in no cell. */
  path(view: View, from: Point, to: Point): Path | undefined {
    write(0, from);
    write(3, to);
    check(this.raw.find(view.raw));
    const [metres, atLeast] = known() as unknown as [number, number];
    if (metres < 0) return undefined;
    this.raw.points();
    const points = this.points.given().slice();
    this.raw.portals();
    return { metres, atLeast, points, portals: this.portals.given().slice() };
  }

  /** Gives its memory back. */
  free(): void {
    this.raw.free();
  }
}

/** What to do next: load a chunk, or let one go. */
export interface Step {
  readonly load: boolean;
  readonly chunk: number;
  /** To load: the eye has at least so far to go before the chunk may be seen, metres. */
  readonly metres: number;
}

/** What to load next, as one walks: chunks of objects, within a budget of bytes. */
export class Prefetch {
  private readonly raw: wasm.Prefetch;

  /** Nothing is loaded. `chunkOf`: the chunk of each object; `bytes`: what each chunk takes when it is loaded; `budget`: bytes for all. */
  constructor(building: Building, chunkOf: Uint32Array, bytes: Float64Array, budget: number) {
    this.raw = new wasm.Prefetch(building.raw, chunkOf, bytes, budget);
  }

  /** Begins a frame, after `view.cull` of the same camera, at a time in seconds: the number of objects that are seen and not loaded. */
  frame(view: View, viewProjection: ArrayLike<number>, eye: Point, seconds: number): number {
    writeCamera(viewProjection, eye);
    known()[19] = seconds;
    check(this.raw.frame(view.raw));
    return known()[0]!;
  }

  /** What to do next; none: nothing in this frame. A step that is given counts as taken. */
  next(): Step | undefined {
    const kind = this.raw.next();
    if (kind === 0) return undefined;
    const [chunk, metres] = known() as unknown as [number, number];
    return { load: kind === 1, chunk, metres };
  }

  /** A chunk is loaded. */
  loaded(chunk: number): void {
    check(this.raw.loaded(chunk));
  }

  /** A chunk could not be loaded: it is not asked for again. */
  failed(chunk: number): void {
    check(this.raw.failed(chunk));
  }

  /** Bytes of chunks that are loaded and under way: never above the budget. */
  get used(): number {
    return this.raw.used();
  }

  /** Gives its memory back. */
  free(): void {
    this.raw.free();
  }
}
