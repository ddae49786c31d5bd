import { BatchedMesh, type BufferGeometry, type Material, type Matrix4, type Object3D } from 'three';

/** A batch that grows gets room for so many times what it needs. More: room that is never used. Less: it is copied more often. */
const ROOM = 1.25;
/** A batch that uses less than this share of its room gives some back. */
const LEAST_USED = 0.5;

/** The meshes of one material and one layout of vertices: one draw call. */
export class Batch {
  readonly mesh: BatchedMesh;
  /** Vertices, indices and instances in use. */
  private vertices = 0;
  private indices = 0;
  private instances = 0;
  private shown = 0;
  private readonly sizes = new Map<number, [vertices: number, indices: number]>();

  /** `look`: the name of the material. */
  constructor(material: Material, readonly look: string, parent: Object3D) {
    this.mesh = new BatchedMesh(1, 1, 1, material);
    this.mesh.perObjectFrustumCulled = false;
    this.mesh.frustumCulled = false;
    // What is seen through is drawn from the far to the near.
    this.mesh.sortObjects = material.transparent;
    this.mesh.matrixAutoUpdate = false;
    this.mesh.visible = false;
    parent.add(this.mesh);
  }

  get isEmpty(): boolean {
    return this.instances === 0;
  }

  /** Makes room for what will be added. */
  reserve(vertices: number, indices: number, instances: number): void {
    if (this.mesh.unusedVertexCount < vertices || this.mesh.unusedIndexCount < indices) {
      this.mesh.optimize();
      if (this.mesh.unusedVertexCount < vertices || this.mesh.unusedIndexCount < indices) {
        this.mesh.setGeometrySize(Math.ceil((this.vertices + vertices) * ROOM), Math.ceil((this.indices + indices) * ROOM));
      }
    }
    if (this.instances + instances > this.mesh.maxInstanceCount) this.mesh.setInstanceCount(Math.ceil((this.instances + instances) * ROOM));
  }

  /** Adds a geometry, for which there is room, and gives its number. */
  addGeometry(geometry: BufferGeometry): number {
    const size: [number, number] = [geometry.getAttribute('position').count, geometry.getIndex()!.count];
    this.vertices += size[0];
    this.indices += size[1];
    const number = this.mesh.addGeometry(geometry);
    this.sizes.set(number, size);
    return number;
  }

  /** Adds an instance of a geometry, hidden, and gives its number. */
  addInstance(geometry: number, matrix: Matrix4): number {
    const instance = this.mesh.addInstance(geometry);
    this.mesh.setMatrixAt(instance, matrix);
    this.mesh.setVisibleAt(instance, false);
    this.instances++;
    return instance;
  }

  setShown(instance: number, isShown: boolean): void {
    if (this.mesh.getVisibleAt(instance) === isShown) return;
    this.mesh.setVisibleAt(instance, isShown);
    this.shown += isShown ? 1 : -1;
    this.mesh.visible = this.shown > 0;
  }

  removeInstance(instance: number): void {
    this.setShown(instance, false);
    this.mesh.deleteInstance(instance);
    this.instances--;
  }

  /** Removes a geometry without instances. */
  removeGeometry(geometry: number): void {
    const [vertices, indices] = this.sizes.get(geometry)!;
    this.sizes.delete(geometry);
    this.mesh.deleteGeometry(geometry);
    this.vertices -= vertices;
    this.indices -= indices;
  }

  /** Gives room back that is not used, after something was removed. */
  shrink(): void {
    const { geometry } = this.mesh;
    const position = geometry.getAttribute('position') as typeof geometry.attributes[string] | undefined;
    if (!position || this.sizes.size === 0 || this.vertices > position.count * LEAST_USED) return;
    this.mesh.optimize();
    this.mesh.setGeometrySize(Math.ceil(this.vertices * ROOM), Math.ceil(this.indices * ROOM));
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.dispose();
  }
}
