import * as wasm from '../build/enfilade.js';
import { Lists, check, known, write, type Box, type Point } from './memory.js';

/** What a portal is. */
export type PortalKind = 'door' | 'window' | 'opening';

/** A portal: an opening between two cells. */
export interface Portal {
  /** The cells behind and before it. */
  readonly cells: readonly [number, number];
  readonly kind: PortalKind;
  /** Whether a leaf shuts it in the model. */
  readonly shut: boolean;
  /** Its corners: three coordinates each, metres. */
  readonly corners: Float64Array;
  /** The same in any bake of the model. */
  readonly key: string;
}

/** An object. */
export interface ObjectFacts {
  readonly box: Box;
  readonly triangles: number;
  /** The first index in a buffer with the triangles of all objects in the order of their ids, and the first behind it. */
  readonly indices: readonly [number, number];
  /** The node of the model that it is a part of. */
  readonly node: string;
}

const KINDS: readonly PortalKind[] = ['door', 'window', 'opening'];

/** A building: a `.pvs` file. All positions are the model's own, metres, Y up. */
export class Building {
  /** Numbers of objects, cells and portals; their ids are below these. */
  readonly objects: number;
  readonly cells: number;
  readonly portals: number;
  /** Metres by which portals, cells and rows may be off. */
  readonly tolerance: number;
  /** What the file's own numbers are relative to. */
  readonly origin: Point;
  /** The hash of its model: `enfilade info` prints it. */
  readonly model: string;
  /** @internal */
  readonly raw: wasm.Building;
  private readonly ids = new Lists(Uint32Array);
  private readonly points = new Lists(Float64Array);

  /** Reads a `.pvs` file. Throws an `Error` with the program's text if it can't be read. */
  constructor(bytes: Uint8Array) {
    known();
    this.raw = new wasm.Building(bytes);
    this.raw.facts();
    const [objects, cells, portals, tolerance, x, y, z] = [...known()] as [number, number, number, number, number, number, number];
    this.objects = objects;
    this.cells = cells;
    this.portals = portals;
    this.tolerance = tolerance;
    this.origin = { x, y, z };
    this.model = this.raw.model();
  }

  /** The cell of a point; -1: it is in none. */
  cellOf(point: Point): number {
    write(0, point);
    return this.raw.cellOf();
  }

  /** The objects that can be seen from a cell, ascending. The list holds until the next call. */
  row(cell: number): Uint32Array {
    check(this.raw.row(cell));
    return this.ids.given();
  }

  /** The cells that can be seen from a cell, ascending. The list holds until the next call. */
  cellRow(cell: number): Uint32Array {
    check(this.raw.cellRow(cell));
    return this.ids.given();
  }

  /** The name of a cell. */
  cellName(cell: number): string {
    return this.raw.cellName(cell);
  }

  /** Facts of an object. */
  object(object: number): ObjectFacts {
    check(this.raw.object(object));
    const [ax, ay, az, bx, by, bz, triangles, first, end] = [...known()] as [number, number, number, number, number, number, number, number, number];
    const box = { min: { x: ax, y: ay, z: az }, max: { x: bx, y: by, z: bz } };
    return { box, triangles, indices: [first, end], node: this.raw.objectName(object) };
  }

  /** Facts of a portal. */
  portal(portal: number): Portal {
    check(this.raw.sides(portal));
    const [behind, before, kind, shut] = [...known()] as [number, number, number, number];
    check(this.raw.corners(portal));
    const corners = this.points.given().slice();
    return { cells: [behind, before], kind: KINDS[kind]!, shut: shut !== 0, corners, key: this.raw.portalKey(portal) };
  }

  /** The portal with a key; -1: there is none. */
  portalWithKey(key: string): number {
    return this.raw.portal(key);
  }

  /** Gives its memory back. What was made from it goes on. */
  free(): void {
    this.raw.free();
  }
}

/** The hash of a file's bytes, as manifests have it: XXH3, 64 bits, in hexadecimal. */
export function hash(bytes: Uint8Array): string {
  known();
  return wasm.hash(bytes);
}
