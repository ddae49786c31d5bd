// What both sides know of wasm's memory. Nothing here allocates once it is warm.

import * as wasm from '../build/enfilade.js';

let memory: WebAssembly.Memory | undefined;
/** What goes to a call and comes back: numbers. */
let numbers = new Float64Array(0);
/** What comes back: where a list is, and its length. */
let list = new Uint32Array(0);

/** Takes the module, compiled or as bytes. */
export async function start(source: Promise<Response | BufferSource> | BufferSource): Promise<void> {
  memory = (await wasm.default({ module_or_path: source })).memory;
}

/** The numbers. Ask again after each call: memory may have grown. */
export function known(): Float64Array {
  if (!memory) throw new Error('the module is not loaded yet: await ready first');
  if (numbers.buffer !== memory.buffer) {
    numbers = new Float64Array(memory.buffer, wasm.numbers(), 32);
    list = new Uint32Array(memory.buffer, wasm.list(), 2);
  }
  return numbers;
}

/** Throws what a call that failed says. */
export function check(worked: boolean): void {
  if (!worked) throw new Error(wasm.fault());
}

/** A point, or a vector of any engine. */
export interface Point {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** A box: its least and its greatest corner. */
export interface Box {
  readonly min: Point;
  readonly max: Point;
}

/** Writes a point. */
export function write(at: number, point: Point): void {
  const to = known();
  to[at] = point.x;
  to[at + 1] = point.y;
  to[at + 2] = point.z;
}

/** Writes a box. */
export function writeBox(box: Box): void {
  write(0, box.min);
  write(3, box.max);
}

/** Writes a camera: a matrix, column by column, and an eye. */
export function writeCamera(viewProjection: ArrayLike<number>, eye: Point): void {
  if (viewProjection.length !== 16) throw new Error(`a matrix of ${viewProjection.length} numbers: it has 16`);
  // `set` allocates.
  const to = known();
  for (let i = 0; i < 16; i++) to[i] = viewProjection[i]!;
  write(16, eye);
}

type Kind<T> = { new (buffer: ArrayBufferLike, at: number, length: number): T; readonly BYTES_PER_ELEMENT: number };

/** Lists that the other side keeps in one place: a view of each length is made once. */
export class Lists<T extends Uint32Array | Float64Array> {
  private readonly kind: Kind<T>;
  private buffer: ArrayBufferLike | undefined;
  private place = 0;
  private views: (T | undefined)[] = [];

  constructor(kind: Kind<T>) {
    this.kind = kind;
  }

  /** The list that a call has given. It holds until the next call of that kind, or until memory grows. */
  given(): T {
    const { buffer } = known();
    const place = list[0]!, length = list[1]!;
    if (buffer !== this.buffer || place !== this.place) {
      this.buffer = buffer;
      this.place = place;
      this.views = [];
    }
    return this.views[length] ??= new this.kind(buffer, place, length);
  }
}
