import { Building, View, ready, type Mode } from '@enfilade/runtime';
import { Culled, Walk } from '@enfilade/three';
import type { Camera, Object3D, Scene } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

/** A building that one walks in, whole or as it arrives. */
export interface Model {
  readonly building: Building;
  readonly view: View;
  /** The model's folder; none: it is here whole. */
  readonly walk: Walk | undefined;
  update(camera: Camera, mode: Mode): void;
  hide(object: number, isHidden: boolean): void;
  dispose(): void;
}

/** A `.pvs` file with its model, both whole. */
export async function fromFiles(scene: Scene, pvs: ArrayBuffer, glb: ArrayBuffer): Promise<Model> {
  await ready;
  const building = new Building(new Uint8Array(pvs));
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  let loaded: Object3D;
  let culled: Culled;
  try {
    loaded = (await loader.parseAsync(glb, '')).scene;
    culled = new Culled(loaded, building);
  } catch (error) {
    building.free();
    throw error;
  }
  // Nothing moves: matrices are computed once.
  loaded.updateMatrixWorld(true);
  loaded.matrixWorldAutoUpdate = false;
  scene.add(loaded);
  return {
    building,
    view: culled.view,
    walk: undefined,
    update: (camera, mode) => culled.update(camera, mode),
    hide: (object, isHidden) => culled.hide(object, isHidden),
    dispose: () => {
      loaded.removeFromParent();
      culled.dispose();
      building.free();
    },
  };
}

/** A packed folder. */
export async function fromFolder(scene: Scene, address: URL): Promise<Model> {
  const walk = new Walk(scene, address);
  try {
    await walk.ready;
  } catch (error) {
    walk.dispose();
    throw error;
  }
  return {
    building: walk.building,
    view: walk.view,
    walk,
    update: (camera, mode) => walk.update(camera, mode),
    hide: (object, isHidden) => walk.hide(object, isHidden),
    dispose: () => walk.dispose(),
  };
}
