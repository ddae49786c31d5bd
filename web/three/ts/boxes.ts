import type { Building } from '@enfilade/runtime';
import { BufferAttribute, BufferGeometry, DynamicDrawUsage, LineBasicMaterial, LineSegments } from 'three';

/** Corners of a box that its edges join; a bit of a corner: whether it is at the box's greatest x, y and z. */
const EDGES = [0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7];

/** The boxes of objects that are seen and not there: one draw call. */
export class Boxes {
  readonly lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x6a7f95 }));
  /** By object: its least and its greatest corner, relative to the origin. */
  readonly corners: Float32Array;
  private position = new BufferAttribute(new Float32Array(0), 3);
  private room = 0;
  private count = 0;

  constructor(building: Building, origin: readonly [number, number, number]) {
    this.corners = new Float32Array(6 * building.objects);
    for (let object = 0; object < building.objects; object++) {
      const { min, max } = building.object(object).box;
      this.corners.set([min.x - origin[0], min.y - origin[1], min.z - origin[2], max.x - origin[0], max.y - origin[1], max.z - origin[2]], 6 * object);
    }
    this.lines.frustumCulled = false;
    this.lines.matrixAutoUpdate = false;
    this.lines.visible = false;
  }

  /** Begins a frame. */
  clear(): void {
    this.count = 0;
  }

  /** Adds the box of an object. */
  add(object: number): void {
    if (this.count === this.room) this.grow();
    const array = this.position.array as Float32Array;
    for (let corner = 0; corner < 8; corner++) {
      for (let axis = 0; axis < 3; axis++) {
        array[24 * this.count + 3 * corner + axis] = this.corners[6 * object + 3 * (corner >> axis & 1) + axis]!;
      }
    }
    this.count++;
  }

  /** Ends a frame. */
  show(): void {
    this.lines.visible = this.count > 0;
    this.lines.geometry.setDrawRange(0, EDGES.length * this.count);
    if (this.count > 0) this.position.needsUpdate = true;
  }

  dispose(): void {
    this.lines.removeFromParent();
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }

  private grow(): void {
    const old = this.position.array;
    this.room = Math.max(64, 2 * this.room);
    this.position = new BufferAttribute(new Float32Array(24 * this.room), 3).setUsage(DynamicDrawUsage);
    this.position.array.set(old);
    const indices = new Uint32Array(EDGES.length * this.room);
    indices.forEach((_, i) => (indices[i] = EDGES[i % EDGES.length]! + 8 * Math.floor(i / EDGES.length)));
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry().setAttribute('position', this.position).setIndex(new BufferAttribute(indices, 1));
  }
}
