import { View, type Building } from '@enfilade/runtime';
import { Matrix4, PerspectiveCamera, Vector3 } from 'three';

/** What cells that are so far off need is fetched, metres. More: bytes that no one sees. Less: at 1.4 m/s less than two seconds to fetch it. */
const AHEAD = 3;
/** Objects that are not seen from where the eye is, turned any way, are fetched within so many metres. More: bytes that no one sees. Less: what is seen after a
 * step comes late. */
const FAR = 20;
/** Objects in steps of so many metres are as near as each other. */
const STEP = 2;
/** The order is made again after so many metres. */
const MOVED = 0.5;
/** Who has moved so far since the last order goes on so many times as far: what is seen from there comes next. More: what another way would show comes late.
 * Less: what is far off and shows behind a corner comes late. */
const ON = 3;
/** A longer move is a jump, metres. */
const JUMP = 2;

/** Ways to look, and what is up then: all around. */
const WAYS = [[0, 0, -1, 0, 1, 0], [1, 0, 0, 0, 1, 0], [-1, 0, 0, 0, 1, 0], [0, 0, 1, 0, 1, 0], [0, -1, 0, 0, 0, -1], [0, 1, 0, 0, 0, 1]] as const;

/** From the eye to clip space, for each way. */
function around(): Matrix4[] {
  return WAYS.map(([x, y, z, ux, uy, uz]) => {
    const camera = new PerspectiveCamera(90, 1, 0.01, 1000);
    camera.up.set(ux, uy, uz);
    camera.lookAt(new Vector3(x, y, z));
    camera.updateMatrixWorld(true);
    return new Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
  });
}

/**
 * The chunks of what the eye sees if it turns, then of what it sees if it goes on, then those that its cells need, then those that the next cells need, each
 * the nearest first. Nothing is allocated for a frame.
 */
export class Ahead {
  /** Chunks, the most urgent first. */
  readonly order: Uint32Array;
  count = 0;
  private readonly at = new Vector3(NaN, NaN, NaN);
  /** Where it may be soon. */
  private readonly next = new Vector3();
  /** Looks around. All doors are open for it: they may open. */
  private readonly view: View;
  private readonly around = around();
  private readonly matrix = new Matrix4();
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
  /** Chunks of a cell that are not taken yet: which, the step of each, and how many there are of each step. */
  private readonly found: Uint32Array;
  private readonly steps: Uint8Array;
  private readonly counts = new Uint32Array(FAR / STEP + 1);

  /** `corners`: of each object the least and the greatest, relative to `origin`. */
  constructor(
    private readonly building: Building,
    private readonly chunkOf: Uint32Array,
    private readonly corners: Float32Array,
    private readonly origin: readonly [number, number, number],
    chunks: number,
  ) {
    this.view = new View(building);
    this.order = new Uint32Array(chunks);
    this.found = new Uint32Array(chunks);
    this.steps = new Uint8Array(chunks);
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
    if (home === this.home && eye.distanceTo(this.at) < MOVED) return;
    this.home = home;
    this.next.copy(eye).sub(this.at);
    const isJump = !(this.next.length() < JUMP);
    this.next.multiplyScalar(ON).add(eye);
    this.at.copy(eye);
    this.taken.fill(0);
    this.isDone.fill(0);
    this.metres.fill(Infinity);
    this.count = 0;
    this.lookAround(this.at);
    // In no cell, all would be seen.
    if (!isJump && this.building.cellOf(this.next) >= 0) this.lookAround(this.next);
    let reached = 0;
    for (let i = 0; i < homes.length; i++) {
      this.metres[homes[i]!] = 0;
      this.reached[reached++] = homes[i]!;
    }
    for (let cell = this.nearest(reached); cell >= 0; cell = this.nearest(reached)) {
      this.isDone[cell] = 1;
      this.add(this.building.row(cell), FAR);
      reached = this.goOn(cell, reached);
    }
  }

  /** Gives its memory back. */
  free(): void {
    this.view.free();
  }

  private lookAround(from: Vector3): void {
    for (let way = 0; way < this.around.length; way++) {
      this.matrix.makeTranslation(-from.x, -from.y, -from.z).premultiply(this.around[way]!);
      this.add(this.view.cull(this.matrix.elements, from, 'both'), Infinity);
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
    return gap(this.boxes, 6 * portal, this.at.x, this.at.y, this.at.z);
  }

  /** Adds the chunks of objects that are not too far off, the nearest first. */
  private add(row: Uint32Array, far: number): void {
    const { at, origin, counts, steps, found, order } = this;
    counts.fill(0);
    let chunks = 0;
    for (let i = 0; i < row.length; i++) {
      const object = row[i]!, chunk = this.chunkOf[object]!;
      const metres = gap(this.corners, 6 * object, at.x - origin[0], at.y - origin[1], at.z - origin[2]);
      if (metres >= far || this.taken[chunk] === DONE) continue;
      const step = Math.min(Math.floor(metres / STEP), counts.length - 2);
      if (this.taken[chunk] === FOUND) {
        if (step < steps[chunk]!) steps[chunk] = step;
        continue;
      }
      this.taken[chunk] = FOUND;
      steps[chunk] = step;
      found[chunks++] = chunk;
    }
    for (let i = 0; i < chunks; i++) counts[steps[found[i]!]! + 1]!++;
    for (let step = 1; step < counts.length; step++) counts[step]! += counts[step - 1]!;
    for (let i = 0; i < chunks; i++) {
      const chunk = found[i]!;
      order[this.count + counts[steps[chunk]!]!++] = chunk;
      this.taken[chunk] = DONE;
    }
    this.count += chunks;
  }
}

/** A chunk that the cell needs, and one that is in the order. */
const FOUND = 1;
const DONE = 2;

/** How far a point is from a box. */
function gap(boxes: Float32Array | Float64Array, box: number, x: number, y: number, z: number): number {
  const dx = Math.max(boxes[box]! - x, x - boxes[box + 3]!, 0);
  const dy = Math.max(boxes[box + 1]! - y, y - boxes[box + 4]!, 0);
  const dz = Math.max(boxes[box + 2]! - z, z - boxes[box + 5]!, 0);
  return Math.sqrt(dx * dx + dy * dy + dz * dz);
}
