import { Matrix4, Vector3, type Camera, type Object3D } from 'three';

/** A camera as a building sees it. Nothing is allocated for a frame. */
export class Eye {
  /** From the building's coordinates to clip space. */
  readonly matrix = new Matrix4();
  /** In the building's coordinates. */
  readonly position = new Vector3();
  private readonly back = new Matrix4();

  /** Takes a camera. `frame`: an object whose local coordinates are the building's. */
  take(camera: Camera, frame: Object3D): void {
    camera.updateWorldMatrix(true, false);
    frame.updateWorldMatrix(true, false);
    this.back.copy(frame.matrixWorld).invert();
    this.matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(frame.matrixWorld);
    this.position.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(this.back);
  }
}
