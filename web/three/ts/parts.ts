import { Matrix4, type BufferGeometry, type Object3D } from 'three';
import { Batch } from './batch.js';
import { layoutOf, ownGeometry, sizeOf } from './geometry.js';
import type { Piece } from './glb.js';
import { Materials } from './materials.js';
import type { Arrived, SharedMesh } from './source.js';

/** Bytes of an instance: its matrix. */
const INSTANCE = 64;

/** A part of an object in a batch. */
interface Part {
  readonly batch: Batch;
  readonly instance: number;
  readonly next: Part | undefined;
}

/** A geometry in a batch. */
interface Placed {
  readonly batchKey: string;
  readonly batch: Batch;
  readonly number: number;
  users: number;
}

/** A part to be added. */
export interface New {
  readonly object: number;
  readonly geometry: BufferGeometry;
  readonly look: string;
  readonly piece: Piece;
  readonly matrix: Matrix4;
  /** Where a shared geometry is kept; none: it is the object's own. */
  readonly shared: Map<boolean, Placed> | undefined;
  readonly isMirrored: boolean;
}

/** A chunk that can be added. */
export interface Prepared {
  readonly parts: readonly New[];
  readonly bytes: number;
}

/** A chunk that is held. */
interface Held {
  readonly objects: readonly number[];
  readonly placed: readonly Placed[];
  readonly bytes: number;
}

/** The parts of all objects that are there, in few draw calls. */
export class Parts {
  /** Bytes of all chunks; what several share is counted with each. */
  bytes = 0;
  private readonly parent: Object3D;
  private readonly first: (Part | undefined)[];
  private readonly held = new Map<number, Held>();
  private readonly batches = new Map<string, Batch>();
  private readonly materials = new Materials();
  /** Geometries of shared meshes that are in batches: as they are, and mirrored. */
  private readonly shared = new WeakMap<Piece, Map<boolean, Placed>>();

  constructor(objects: number, parent: Object3D) {
    this.first = new Array<Part | undefined>(objects);
    this.parent = parent;
  }

  /** Whether an object is there. */
  has(object: number): boolean {
    return this.first[object] !== undefined;
  }

  /** Chunks that are held. */
  get chunks(): IterableIterator<number> {
    return this.held.keys();
  }

  /** Whether a chunk is held. */
  holds(chunk: number): boolean {
    return this.held.has(chunk);
  }

  setShown(object: number, isShown: boolean): void {
    for (let part = this.first[object]; part; part = part.next) part.batch.setShown(part.instance, isShown);
  }

  /** The parts of a chunk that came, and their bytes. */
  prepare(file: string, arrived: Arrived): Prepared {
    const own = arrived.own.map(([object, piece]) => this.own(object, piece, file));
    const shared = arrived.placed.map(([object, mesh, matrix]) => this.placed(object, mesh, matrix));
    const geometries = own.reduce((sum, { geometry }) => sum + sizeOf(geometry), 0);
    return { parts: [...own, ...shared], bytes: geometries + INSTANCE * (own.length + shared.length) + arrived.sharedBytes };
  }

  /** Adds the objects of a chunk, hidden. */
  add(chunk: number, { parts: all, bytes }: Prepared): void {
    const placed: Placed[] = [];
    for (const [key, parts] of grouped(all)) {
      const batch = this.batch(key, parts);
      for (const part of parts) placed.push(this.put(key, batch, part));
    }
    this.held.set(chunk, { objects: all.map(({ object }) => object), placed, bytes });
    this.bytes += bytes;
  }

  /** Removes the objects of a chunk. */
  remove(chunk: number): void {
    const held = this.held.get(chunk);
    if (!held) return;
    this.held.delete(chunk);
    this.bytes -= held.bytes;
    for (const object of held.objects) {
      for (let part = this.first[object]; part; part = part.next) part.batch.removeInstance(part.instance);
      this.first[object] = undefined;
    }
    for (const placed of held.placed) {
      if (--placed.users === 0) placed.batch.removeGeometry(placed.number);
    }
    for (const key of new Set(held.placed.map(({ batchKey }) => batchKey))) this.tidy(key);
  }

  dispose(): void {
    for (const chunk of [...this.held.keys()]) this.remove(chunk);
  }

  private own(object: number, piece: Piece, file: string): New {
    const isMirrored = piece.matrix.determinant() < 0;
    const geometry = ownGeometry(piece.geometry, isMirrored);
    return { object, geometry, look: Materials.key(piece.material, file), piece, matrix: piece.matrix, shared: undefined, isMirrored };
  }

  private placed(object: number, { piece, file }: SharedMesh, place: Matrix4): New {
    const matrix = new Matrix4().multiplyMatrices(place, piece.matrix);
    const isMirrored = matrix.determinant() < 0;
    let shared = this.shared.get(piece);
    if (!shared) this.shared.set(piece, shared = new Map());
    return { object, geometry: ownGeometry(piece.geometry, isMirrored), look: Materials.key(piece.material, file), piece, matrix, shared, isMirrored };
  }

  /** The batch of some parts, with room for them. */
  private batch(key: string, parts: New[]): Batch {
    let batch = this.batches.get(key);
    const [{ look, piece }] = parts as [New];
    if (!batch) {
      batch = new Batch(this.materials.take(look, piece.material), look, this.parent);
      this.batches.set(key, batch);
    }
    const vertices = parts.reduce((sum, { geometry }) => sum + geometry.getAttribute('position').count, 0);
    const indices = parts.reduce((sum, { geometry }) => sum + geometry.getIndex()!.count, 0);
    batch.reserve(vertices, indices, parts.length);
    return batch;
  }

  private put(batchKey: string, batch: Batch, part: New): Placed {
    let placed = part.shared?.get(part.isMirrored);
    if (!placed || placed.users === 0) {
      placed = { batchKey, batch, number: batch.addGeometry(part.geometry), users: 0 };
      part.shared?.set(part.isMirrored, placed);
    }
    placed.users++;
    const instance = batch.addInstance(placed.number, part.matrix);
    this.first[part.object] = { batch, instance, next: this.first[part.object] };
    return placed;
  }

  private tidy(key: string): void {
    const batch = this.batches.get(key);
    if (!batch?.isEmpty) return batch?.shrink();
    batch.dispose();
    this.materials.letGo(batch.look);
    this.batches.delete(key);
  }
}

/** Parts by the keys of their batches. */
function grouped(parts: readonly New[]): Map<string, New[]> {
  const groups = new Map<string, New[]>();
  for (const part of parts) {
    const key = `${part.look}: ${layoutOf(part.geometry)}`;
    const group = groups.get(key);
    if (group) group.push(part);
    else groups.set(key, [part]);
  }
  return groups;
}
