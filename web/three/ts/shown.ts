/** The objects of the last frame. Tells what comes and what goes, and allocates nothing. */
export class Shown {
  /** By object: the number of the last frame that has it. */
  private readonly frames: Uint32Array;
  private readonly last: Uint32Array;
  private length = 0;
  private frame = 1;
  private readonly tell: (object: number, isShown: boolean) => void;

  /** No object is shown. `tell` is called with what comes and goes. */
  constructor(objects: number, tell: (object: number, isShown: boolean) => void) {
    this.frames = new Uint32Array(objects);
    this.last = new Uint32Array(objects);
    this.tell = tell;
  }

  /** Takes the objects of a frame, each once. */
  set(objects: Uint32Array): void {
    const before = this.frame;
    this.frame = before + 1;
    for (let i = 0; i < objects.length; i++) {
      const object = objects[i]!;
      if (this.frames[object] !== before) this.tell(object, true);
      this.frames[object] = this.frame;
    }
    for (let i = 0; i < this.length; i++) {
      const object = this.last[i]!;
      if (this.frames[object] !== this.frame) this.tell(object, false);
    }
    this.last.set(objects);
    this.length = objects.length;
  }

  /** Whether the last frame has an object. */
  has(object: number): boolean {
    return this.frames[object] === this.frame;
  }
}
