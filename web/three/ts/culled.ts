import { View, type Building, type Mode } from '@enfilade/runtime';
import type { Camera, Object3D } from 'three';
import { Eye } from './eye.js';
import { idOf } from './ids.js';
import { Shown } from './shown.js';

const NONE: readonly Object3D[] = [];

/** A scene that is loaded whole: what can't be seen is hidden, frame by frame. Nothing is allocated for a frame once it is warm. */
export class Culled {
  /** Its culling: doors are opened and shut here. */
  readonly view: View;
  private readonly scene: Object3D;
  private readonly nodes: (Object3D[] | undefined)[];
  private readonly hidden: Uint8Array;
  private readonly shown: Shown;
  private readonly eye = new Eye();

  /**
   * A scene that `enfilade export` wrote and GLTFLoader loaded, and the building of its `.pvs` file. The scene may stand anywhere: its local coordinates
   * are the model's. Throws an `Error` if its nodes have no ids, or ids that the building has not.
   */
  constructor(scene: Object3D, building: Building) {
    this.scene = scene;
    this.nodes = new Array<Object3D[] | undefined>(building.objects);
    this.hidden = new Uint8Array(building.objects);
    let found = 0;
    scene.traverse((node) => {
      const id = idOf(node);
      if (id === undefined) return;
      if (id >= building.objects) throw new Error(`the scene has an object ${id}, and the .pvs file has ${building.objects}: export the model of this file`);
      (this.nodes[id] ??= []).push(node);
      node.visible = false;
      found++;
    });
    if (found === 0) {
      throw new Error('no node of the scene has the id of an object in its extras: load what `enfilade export FILE.pvs --model MODEL -o OUT.glb` writes');
    }
    this.view = new View(building);
    this.shown = new Shown(building.objects, (object, isShown) => this.set(object, isShown));
  }

  /** Hides what the camera can't see. To be called before each frame is drawn. */
  update(camera: Camera, mode: Mode = 'both'): void {
    this.eye.take(camera, this.scene);
    this.shown.set(this.view.cull(this.eye.matrix.elements, this.eye.position, mode));
  }

  /** Hides an object in all frames, or no longer. */
  hide(object: number, isHidden: boolean): void {
    this.hidden[object] = isHidden ? 1 : 0;
    this.set(object, this.shown.has(object));
  }

  /** Shows all again, and gives the memory of the culling back. */
  dispose(): void {
    for (const nodes of this.nodes) for (const node of nodes ?? NONE) node.visible = true;
    this.view.free();
  }

  private set(object: number, isShown: boolean): void {
    const nodes = this.nodes[object] ?? NONE;
    for (let i = 0; i < nodes.length; i++) nodes[i]!.visible = isShown && this.hidden[object] === 0;
  }
}
