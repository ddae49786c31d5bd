import type { Object3D } from 'three';

/** The id of the object that a node is, from its extras: `enfilade export` and `enfilade pack` write it. `undefined`: it is none. */
export function idOf(node: Object3D): number | undefined {
  const extras = node.userData['enfilade'] as unknown;
  const id = typeof extras === 'object' && extras !== null ? (extras as { object?: unknown }).object : extras;
  return typeof id === 'number' && Number.isInteger(id) && id >= 0 ? id : undefined;
}
