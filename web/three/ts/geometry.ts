import { BufferAttribute, BufferGeometry, type InterleavedBufferAttribute, type TypedArray } from 'three';

type Part = BufferAttribute | InterleavedBufferAttribute;

/** The vertices that a mesh's triangles use, and no others: meshes of a file share their vertices. `isMirrored`: triangles turn the other way. */
export function ownGeometry(from: BufferGeometry, isMirrored: boolean): BufferGeometry {
  const position = from.getAttribute('position');
  const index = from.getIndex();
  const count = index ? index.count : position.count;
  let [first, last] = [position.count, -1];
  for (let i = 0; i < count; i++) {
    const vertex = index ? index.getX(i) : i;
    first = Math.min(first, vertex);
    last = Math.max(last, vertex);
  }
  const made = new BufferGeometry();
  const vertices = Math.max(last + 1 - first, 0);
  for (const name of Object.keys(from.attributes)) made.setAttribute(name, copy(from.attributes[name]!, first, vertices));
  const indices = vertices > 65535 ? new Uint32Array(count) : new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const corner = isMirrored && i % 3 !== 0 ? i + (i % 3 === 1 ? 1 : -1) : i;
    indices[i] = (index ? index.getX(corner) : corner) - first;
  }
  made.setIndex(new BufferAttribute(indices, 1));
  return made;
}

/** The numbers of some vertices, as they are stored. */
function copy(attribute: Part, first: number, count: number): BufferAttribute {
  const isApart = 'data' in attribute;
  const array: TypedArray = isApart ? attribute.data.array : attribute.array;
  const [stride, offset] = isApart ? [attribute.data.stride, attribute.offset] : [attribute.itemSize, 0];
  const { itemSize, normalized } = attribute;
  const made = new (array.constructor as { new (length: number): TypedArray })(count * itemSize);
  for (let i = 0; i < count; i++) {
    for (let k = 0; k < itemSize; k++) made[i * itemSize + k] = array[(first + i) * stride + offset + k]!;
  }
  return new BufferAttribute(made, itemSize, normalized);
}

/** What geometries of one batch have in common. */
export function layoutOf(geometry: BufferGeometry): string {
  const names = Object.keys(geometry.attributes).sort();
  return names.map((name) => {
    const { array, itemSize, normalized } = geometry.attributes[name] as BufferAttribute;
    return `${name} ${array.constructor.name} ${itemSize} ${normalized}`;
  }).join(', ');
}

/** Bytes of vertices and indices. */
export function sizeOf(geometry: BufferGeometry): number {
  const vertices = geometry.getAttribute('position').count;
  const stride = Object.values(geometry.attributes).reduce((sum, { array, itemSize }) => sum + itemSize * array.BYTES_PER_ELEMENT, 0);
  return vertices * stride + 4 * (geometry.getIndex()?.count ?? 0);
}
