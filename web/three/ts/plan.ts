import { Prefetch, type Building } from '@enfilade/runtime';
import { chunkOfObjects, filesOf, type Manifest } from './manifest.js';

/** Bytes in memory for each byte of a file, before any has come: vertices and indices are compressed. */
const GUESS = 4;
/** What has not come yet is taken for so many times the mean of what came. More: memory stays unused. Less: what came must be let go at once. */
const CAUTION = 1.2;
/** Sizes that are off by this share of the budget, all together, make a new plan. Less: it is made again too often. */
const OFF = 0.1;

/** What to load next, by sizes in memory: they are known once a chunk has come, and guessed before. */
export class Plan {
  /** The plan of today. */
  prefetch: Prefetch;
  /** Bytes of each chunk by its plan. */
  private readonly assumed: Float64Array;
  private readonly files: Float64Array;
  /** Bytes of each chunk that has come once. */
  private readonly known: Float64Array;
  private filesOfKnown = 0;
  private allKnown = 0;
  private off = 0;
  /** The chunk of each object. */
  readonly chunkOf: Uint32Array;

  constructor(private readonly building: Building, manifest: Manifest, readonly budget: number) {
    const chunks = manifest.chunks;
    this.chunkOf = chunkOfObjects(manifest);
    this.files = Float64Array.from(chunks, (chunk) => filesOf(manifest, chunk).reduce((sum, { bytes }) => sum + bytes, 0));
    this.known = new Float64Array(chunks.length);
    this.assumed = this.files.map((bytes) => GUESS * bytes);
    this.prefetch = new Prefetch(building, this.chunkOf, this.assumed, budget);
  }

  /** Bytes that a chunk is taken for. */
  bytesOf(chunk: number): number {
    return this.known[chunk] || this.assumed[chunk]!;
  }

  /** A chunk takes so many bytes. */
  learn(chunk: number, bytes: number): void {
    if (this.known[chunk] !== 0) return;
    this.known[chunk] = bytes;
    this.allKnown += bytes;
    this.filesOfKnown += this.files[chunk]!;
    this.off += bytes - this.assumed[chunk]!;
  }

  /** Whether sizes are off by too much. */
  get isOff(): boolean {
    return Math.abs(this.off) > OFF * this.budget;
  }

  /** Makes a new plan, which knows of nothing that is loaded. */
  renew(): void {
    const mean = this.filesOfKnown > 0 ? this.allKnown / this.filesOfKnown : GUESS;
    for (let chunk = 0; chunk < this.assumed.length; chunk++) this.assumed[chunk] = this.known[chunk] || CAUTION * mean * this.files[chunk]!;
    this.off = 0;
    this.prefetch.free();
    this.prefetch = new Prefetch(this.building, this.chunkOf, this.assumed, this.budget);
  }
}
