import type { Portal } from '@enfilade/runtime';
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshStandardMaterial, Ray, Vector3, type Scene } from 'three';
import type { Model } from './model.js';

/** A door is opened from so far, metres. */
const REACH = 4;
/** A leaf is as high as its opening within this share, as wide within that, and as thick at most, metres. */
const HIGH = 0.75;
const WIDE = [0.3, 1.2] as const;
const THICK = 0.15;
/** A leaf is so near to its opening, metres. */
const NEAR = 0.2;

interface Door {
  readonly number: number;
  readonly corners: Vector3[];
  readonly middle: Vector3;
  readonly isShutInModel: boolean;
  /** The objects that stand in the opening, or beside it, as its leaves. */
  readonly leaves: number[];
  panel: Mesh | undefined;
  isOpen: boolean;
}

/** The doors of a model: they stand as in the model, until one opens or shuts them. */
export class Doors {
  private readonly doors: Door[] = [];
  private readonly material = new MeshStandardMaterial({ color: 0x8a6a48, roughness: 0.8, side: DoubleSide });

  constructor(private readonly model: Model, private readonly scene: Scene) {
    const { building, view } = model;
    const slabs = slabsOf(model);
    for (let number = 0; number < building.portals; number++) {
      const portal = building.portal(number);
      if (portal.kind !== 'door') continue;
      const door = doorOf(number, portal);
      door.leaves.push(...slabs.filter((slab) => isLeaf(slab, door)).map(({ object }) => object));
      this.doors.push(door);
      view.setOpen(number, door.isOpen);
    }
  }

  get count(): number {
    return this.doors.length;
  }

  /** Opens or shuts the nearest door that a ray meets, or else the nearest before the eye. */
  use(eye: Vector3, way: Vector3): 'opened' | 'shut' | undefined {
    const ray = new Ray(eye, way);
    const met = this.doors.filter((door) => hits(ray, door));
    const before = this.doors.filter(({ middle }) => middle.distanceTo(eye) < REACH / 2 && way.dot(middle.clone().sub(eye).normalize()) > 0.7);
    const near = (a: Door, b: Door): number => a.middle.distanceTo(eye) - b.middle.distanceTo(eye);
    const door = [...met.sort(near), ...before.sort(near)][0];
    if (!door) return undefined;
    this.set(door, !door.isOpen);
    return door.isOpen ? 'opened' : 'shut';
  }

  /** Whether a way leads through a door that is shut. */
  stops(from: Vector3, to: Vector3): boolean {
    const way = to.clone().sub(from);
    const length = way.length();
    const ray = new Ray(from, way.normalize());
    return this.doors.some((door) => !door.isOpen && hits(ray, door, length));
  }

  dispose(): void {
    for (const { panel } of this.doors) panel?.removeFromParent();
  }

  private set(door: Door, isOpen: boolean): void {
    door.isOpen = isOpen;
    this.model.view.setOpen(door.number, isOpen);
    // A door that stands as in the model is drawn by its own leaves.
    const isAsFound = isOpen !== door.isShutInModel;
    for (const leaf of door.leaves) this.model.hide(leaf, !isAsFound);
    if (!door.panel && !isOpen && !isAsFound) {
      door.panel = new Mesh(geometryOf(door), this.material);
      this.scene.add(door.panel);
    }
    if (door.panel) door.panel.visible = !isOpen && !isAsFound;
  }
}

function doorOf(number: number, portal: Portal): Door {
  const corners: Vector3[] = [];
  for (let at = 0; at < portal.corners.length; at += 3) corners.push(new Vector3().fromArray(portal.corners, at));
  const middle = corners.reduce((sum, corner) => sum.add(corner), new Vector3()).divideScalar(corners.length);
  return { number, corners, middle, isShutInModel: portal.shut, leaves: [], panel: undefined, isOpen: !portal.shut };
}

function geometryOf({ corners, middle }: Door): BufferGeometry {
  const positions = corners.flatMap((corner) => corner.clone().sub(middle).toArray());
  const indices = corners.slice(2).flatMap((_, i) => [0, i + 1, i + 2]);
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(positions), 3)).setIndex(indices);
  geometry.computeVertexNormals();
  return geometry.translate(middle.x, middle.y, middle.z);
}

function hits(ray: Ray, { corners }: Door, most = REACH): boolean {
  const at = new Vector3();
  return corners.slice(2).some((corner, i) => {
    return ray.intersectTriangle(corners[0]!, corners[i + 1]!, corner, false, at) !== null && at.distanceTo(ray.origin) <= most;
  });
}

interface Slab {
  readonly object: number;
  readonly least: Vector3;
  readonly greatest: Vector3;
}

/** Objects that are upright and thin. */
function slabsOf({ building }: Model): Slab[] {
  const slabs: Slab[] = [];
  for (let object = 0; object < building.objects; object++) {
    const { box: { min, max } } = building.object(object);
    if (Math.min(max.x - min.x, max.z - min.z) > THICK || max.y - min.y < 1) continue;
    slabs.push({ object, least: new Vector3().copy(min), greatest: new Vector3().copy(max) });
  }
  return slabs;
}

function isLeaf({ least, greatest }: Slab, { corners }: Door): boolean {
  const [low, high] = [corners[0]!.clone(), corners[0]!.clone()];
  for (const corner of corners) {
    low.min(corner);
    high.max(corner);
  }
  const [width, height] = [Math.hypot(high.x - low.x, high.z - low.z), high.y - low.y];
  const [wide, tall] = [Math.max(greatest.x - least.x, greatest.z - least.z), greatest.y - least.y];
  const isNear = (['x', 'y', 'z'] as const).every((axis) => least[axis] < high[axis] + NEAR && greatest[axis] > low[axis] - NEAR);
  return isNear && tall > HIGH * height && tall < height / HIGH && wide > WIDE[0] * width && wide < WIDE[1] * width;
}
