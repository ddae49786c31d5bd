import type { BufferGeometry, Material, Matrix4, Mesh, Object3D, Texture } from 'three';
import { GLTFLoader, type GLTFLoaderPlugin, type GLTFParser } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { idOf } from './ids.js';

/** A mesh and how it looks. */
export interface Piece {
  /** It may have vertices that its triangles don't use. */
  readonly geometry: BufferGeometry;
  readonly material: Material;
  /** To the coordinates of the file. */
  readonly matrix: Matrix4;
}

/** What a file has. */
export interface Contents {
  /** Objects with meshes of their own: ids and meshes. */
  readonly own: [number, Piece][];
  /** Objects with shared meshes: ids, numbers of meshes, and where they stand. */
  readonly placed: [number, number, Matrix4][];
  /** Shared meshes, by their numbers. */
  readonly shared: Map<number, Piece>;
}

/** Gives the picture with a name below the folder. */
export type PictureOf = (file: string) => Promise<Texture>;

/** Reads a file of a packed folder. */
export async function readGlb(bytes: Uint8Array<ArrayBuffer>, pictureOf: PictureOf): Promise<Contents> {
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new Pictures(parser, pictureOf));
  const { scene } = await loader.parseAsync(bytes.buffer, '');
  scene.updateMatrixWorld(true);
  const contents: Contents = { own: [], placed: [], shared: new Map() };
  scene.traverse((node) => sort(node, contents));
  return contents;
}

function sort(node: Object3D, contents: Contents): void {
  const id = idOf(node);
  const number = node.userData['mesh'] as unknown;
  const pieces = meshesOf(node);
  if (id !== undefined && typeof number === 'number') contents.placed.push([id, number, node.matrixWorld]);
  else if (id !== undefined) pieces.forEach((piece) => contents.own.push([id, piece]));
  else if (typeof number === 'number' && pieces[0]) contents.shared.set(number, pieces[0]);
}

/** The meshes of a node: those with several materials are a group. */
function meshesOf(node: Object3D): Piece[] {
  const isMesh = (object: Object3D): object is Mesh<BufferGeometry, Material> => (object as Partial<Mesh>).isMesh === true;
  const meshes = isMesh(node) ? [node] : node.children.filter((child) => idOf(child) === undefined).filter(isMesh);
  return meshes.map(({ geometry, material, matrixWorld }) => ({ geometry, material, matrix: matrixWorld }));
}

/** Gives the loader pictures that are here already, so that each is in memory once. */
class Pictures implements GLTFLoaderPlugin {
  readonly name = 'enfilade pictures';
  private readonly parser: GLTFParser;
  private readonly pictureOf: PictureOf;

  constructor(parser: GLTFParser, pictureOf: PictureOf) {
    this.parser = parser;
    this.pictureOf = pictureOf;
  }

  beforeRoot(): null {
    const images = (this.parser.json as { images?: { uri?: unknown }[] }).images ?? [];
    const known = (this.parser as unknown as { sourceCache: Record<number, Promise<Texture>> }).sourceCache;
    images.forEach(({ uri }, i) => {
      // Chunks name pictures from their own folder.
      const file = typeof uri === 'string' ? uri.replace(/^\.\.\//, '') : '';
      known[i] = this.pictureOf(file);
    });
    return null;
  }
}
