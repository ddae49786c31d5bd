import { View, type Building, type Mode } from '@enfilade/runtime';
import { CameraHelper, Matrix4, PerspectiveCamera, Vector3 } from 'three';
import { Doors } from './doors.js';
import { Graph, megabytes, number } from './graph.js';
import type { Model } from './model.js';
import { element } from './page.js';
import { Plan } from './plan.js';
import type { Stage } from './stage.js';
import type { Walker } from './walker.js';

/** Metres from the floor to the eye. */
const EYE = 1.6;

/** A walk in one model. */
export class Tour {
  mode: Mode = 'both';
  readonly doors: Doors;
  private readonly plan: Plan;
  private readonly graph = new Graph(element<HTMLCanvasElement>('graph'));
  /** Counts what the frustum has. */
  private readonly frustum: View;
  private readonly matrix = new Matrix4();
  private frozen: { camera: PerspectiveCamera; helper: CameraHelper } | undefined;

  constructor(readonly model: Model, private readonly stage: Stage, private readonly walker: Walker) {
    this.doors = new Doors(model, stage.scene);
    this.plan = new Plan(element<HTMLCanvasElement>('plan'), model);
    this.frustum = new View(model.building);
    const [eye, at] = start(model.building);
    walker.eye.copy(eye);
    walker.look(at);
  }

  get isFrozen(): boolean {
    return this.frozen !== undefined;
  }

  /** Freezes what is culled by, or resumes. */
  freeze(): void {
    if (this.frozen) {
      this.frozen.helper.removeFromParent();
      this.frozen.helper.dispose();
      this.frozen = undefined;
      return;
    }
    const camera = this.stage.camera.clone();
    camera.updateMatrixWorld(true);
    // Drawn so far.
    const shown = camera.clone();
    shown.far = 12;
    shown.updateProjectionMatrix();
    const helper = new CameraHelper(shown);
    this.stage.scene.add(helper);
    this.frozen = { camera, helper };
  }

  /** Whether the eye may go somewhere: walls are in no cell. */
  passes(from: Vector3, to: Vector3): boolean {
    const { building } = this.model;
    return (building.cellOf(to) >= 0 || building.cellOf(from) < 0) && !this.doors.stops(from, to);
  }

  /** Goes to a point of the plan. */
  goTo(clientX: number, clientY: number): void {
    const at = this.plan.at(clientX, clientY, this.walker.eye.y);
    if (this.model.building.cellOf(at) >= 0) this.walker.eye.copy(at);
  }

  /** Draws a frame after some seconds. */
  frame(seconds: number): void {
    const { stage, walker, model } = this;
    walker.step(seconds, stage.camera, (from, to) => this.passes(from, to));
    const by = this.frozen?.camera ?? stage.camera;
    model.update(by, this.mode);
    stage.draw();
    const { triangles } = model.view.counts();
    this.matrix.multiplyMatrices(by.projectionMatrix, by.matrixWorldInverse);
    this.frustum.cull(this.matrix.elements, by.position, 'frustum');
    const all = this.frustum.counts().triangles;
    this.graph.add(triangles, all, model.walk?.bytes ?? 0);
    this.tell(triangles, all);
  }

  dispose(): void {
    if (this.frozen) this.freeze();
    this.doors.dispose();
    this.frustum.free();
    this.model.dispose();
  }

  private tell(triangles: number, all: number): void {
    const { model, walker, stage } = this;
    const { camera, renderer } = stage;
    const plan = element('plan');
    const wide = 2 * Math.atan(Math.tan((camera.fov * Math.PI) / 360) * camera.aspect);
    if (!plan.hidden) this.plan.draw(walker.eye, walker.yaw, wide);
    if (!element('graph').hidden) this.graph.draw(model.walk?.size ?? 0);
    const cell = model.building.cellOf(walker.eye);
    const place = cell < 0 ? 'in no cell' : model.building.cellName(cell) || `cell ${cell}`;
    const parts = [
      place,
      this.mode + (this.isFrozen ? ', frozen' : ''),
      `${number(model.view.counts().objects)} objects`,
      `${number(triangles)} of ${number(all)} triangles`,
      `${renderer.info.render.calls} draw calls`,
    ];
    if (model.walk) parts.push(`${megabytes(model.walk.bytes)} fetched`, `${megabytes(model.walk.held)} held`, `${model.walk.missing} missing`);
    element('line').textContent = `${parts.join(' · ')} · H: keys`;
  }
}

/** Where a walk begins, and where it looks: before the door that shows most cells from indoors; else in the middle. */
function start(building: Building): [Vector3, Vector3] {
  let best: [Vector3, Vector3] | undefined;
  let most = 0;
  const outdoors = widest(building);
  for (let i = 0; i < building.portals; i++) {
    const { kind, corners, cells, shut } = building.portal(i);
    if (kind === 'window') continue;
    const before = beforeDoor(corners);
    for (const [eye, middle] of before) {
      const cell = building.cellOf(eye);
      // A door that is shut shows nothing; openings count less: many are gaps, high up.
      const isInside = cells.includes(cell) && cell !== outdoors;
      const shown = isInside ? building.cellRow(cell).length * (kind === 'door' && !shut ? 1 : 0.01) : 0;
      if (shown > most) [most, best] = [shown, [eye, middle]];
    }
  }
  const { x, y, z } = building.origin;
  return best ?? [new Vector3(x, y + EYE, z), new Vector3(x, y + EYE, z - 1)];
}

/** The cell that sees most objects. */
function widest(building: Building): number {
  let [best, most] = [-1, 0];
  for (let cell = 0; cell < building.cells; cell++) {
    const { length } = building.row(cell);
    if (length > most) [best, most] = [cell, length];
  }
  return best;
}

/** On both sides of an upright opening: where one stands, and its middle. */
function beforeDoor(corners: Float64Array): [Vector3, Vector3][] {
  const [a, b, c] = [0, 3, 6].map((at) => new Vector3().fromArray(corners, at)) as [Vector3, Vector3, Vector3];
  const across = b.sub(a).cross(c.sub(a)).normalize();
  if (Math.abs(across.y) > 0.1) return [];
  const middle = new Vector3();
  let low = Infinity;
  for (let at = 0; at < corners.length; at += 3) {
    middle.add(new Vector3().fromArray(corners, at));
    low = Math.min(low, corners[at + 1]!);
  }
  middle.divideScalar(corners.length / 3).setY(low + EYE);
  return [2.5, -2.5].map((side) => [middle.clone().addScaledVector(across, side), middle]);
}
