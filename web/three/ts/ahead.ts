import type { Building } from '@enfilade/runtime';
import type { Vector3 } from 'three';

/** What cells that are so far off need is fetched, metres. More: bytes that no one sees. Less: at 1.4 m/s less than two seconds to fetch it. */
const AHEAD = 3;
/** The order is made again after so many metres. */
const MOVED = 0.5;

/** The chunks that the eye's cells need, then those that the next cells need, the nearest first. Nothing is allocated for a frame. */
export class Ahead {
  /** Chunks, the most urgent first. */
  readonly order: Uint32Array;
  count = 0;
  private readonly at = { x: NaN, y: NaN, z: NaN };
  private home = -2;
  /** By cell: its portals, windows left out: twice the portal, and 1 more towards the first of its cells. */
  private readonly portals: number[][];
  private readonly targets: Int32Array;
  /** By portal: its least and its greatest corner. */
  private readonly boxes: Float64Array;
  private readonly metres: Float64Array;
  private readonly isDone: Uint8Array;
  private readonly reached: Int32Array;
  private readonly taken: Uint8Array;

  constructor(private readonly building: Building, private readonly chunkOf: Uint32Array, chunks: number) {
    this.order = new Uint32Array(chunks);
    this.taken = new Uint8Array(chunks);
    this.portals = Array.from({ length: building.cells }, () => []);
    this.targets = new Int32Array(2 * building.portals);
    this.boxes = new Float64Array(6 * building.portals);
    this.metres = new Float64Array(building.cells);
    this.isDone = new Uint8Array(building.cells);
    this.reached = new Int32Array(building.cells);
    for (let portal = 0; portal < building.portals; portal++) this.know(portal);
  }

  /** Makes the order for an eye in some cells, if it has moved. */
  take(eye: Vector3, homes: Uint32Array): void {
    const home = homes.length > 0 ? homes[0]! : -1;
    const moved = Math.hypot(eye.x - this.at.x, eye.y - this.at.y, eye.z - this.at.z);
    if (home === this.home && moved < MOVED) return;
    this.home = home;
    this.at.x = eye.x;
    this.at.y = eye.y;
    this.at.z = eye.z;
    this.taken.fill(0);
    this.isDone.fill(0);
    this.metres.fill(Infinity);
    this.count = 0;
    let reached = 0;
    for (let i = 0; i < homes.length; i++) {
      this.metres[homes[i]!] = 0;
      this.reached[reached++] = homes[i]!;
    }
    for (let cell = this.nearest(reached); cell >= 0; cell = this.nearest(reached)) {
      this.isDone[cell] = 1;
      this.add(cell);
      reached = this.goOn(cell, reached);
    }
  }

  private know(portal: number): void {
    const { cells: [behind, before], kind, corners } = this.building.portal(portal);
    for (let axis = 0; axis < 3; axis++) {
      let [low, high] = [Infinity, -Infinity];
      for (let at = axis; at < corners.length; at += 3) {
        low = Math.min(low, corners[at]!);
        high = Math.max(high, corners[at]!);
      }
      this.boxes[6 * portal + axis] = low;
      this.boxes[6 * portal + 3 + axis] = high;
    }
    if (kind === 'window') return;
    this.targets.set([before, behind], 2 * portal);
    this.portals[behind]!.push(2 * portal);
    this.portals[before]!.push(2 * portal + 1);
  }

  /** The nearest cell that is not done; -1: none is within reach. */
  private nearest(reached: number): number {
    let best = -1;
    for (let i = 0; i < reached; i++) {
      const cell = this.reached[i]!;
      if (this.isDone[cell] === 0 && (best < 0 || this.metres[cell]! < this.metres[best]!)) best = cell;
    }
    return best;
  }

  /** Reaches the cells behind the portals of a cell: their portals are at least so far from the eye. */
  private goOn(cell: number, reached: number): number {
    const portals = this.portals[cell]!;
    for (let i = 0; i < portals.length; i++) {
      const portal = portals[i]! >> 1, target = this.targets[portals[i]!]!;
      const metres = Math.max(this.metres[cell]!, this.distance(portal));
      if (metres > AHEAD || metres >= this.metres[target]!) continue;
      if (this.metres[target] === Infinity) this.reached[reached++] = target;
      this.metres[target] = metres;
    }
    return reached;
  }

  private distance(portal: number): number {
    const { boxes, at } = this;
    const x = Math.max(boxes[6 * portal]! - at.x, at.x - boxes[6 * portal + 3]!, 0);
    const y = Math.max(boxes[6 * portal + 1]! - at.y, at.y - boxes[6 * portal + 4]!, 0);
    const z = Math.max(boxes[6 * portal + 2]! - at.z, at.z - boxes[6 * portal + 5]!, 0);
    return Math.sqrt(x * x + y * y + z * z);
  }

  private add(cell: number): void {
    const row = this.building.row(cell);
    for (let i = 0; i < row.length; i++) {
      const chunk = this.chunkOf[row[i]!]!;
      if (this.taken[chunk] !== 0) continue;
      this.taken[chunk] = 1;
      this.order[this.count++] = chunk;
    }
  }
}
