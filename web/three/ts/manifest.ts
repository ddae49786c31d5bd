// What the files of a packed folder hold: `enfilade pack` writes it, and docs/format.md describes it.

/** Its own name. */
export const MANIFEST = 'manifest.jsonz';

/** A file of the folder. */
export interface Entry {
  /** Its name below the folder, with `/` between parts. */
  readonly file: string;
  readonly bytes: number;
  /** XXH3 of its bytes, 64 bits, in hexadecimal. */
  readonly hash: string;
}

/** A file of objects. */
export interface Chunk extends Entry {
  /** Ids: the first, and the first behind it, for each range. */
  readonly objects: readonly number[];
  /** Numbers of the files with meshes that its objects share with others. */
  readonly meshes: readonly number[];
  /** Numbers of pictures. */
  readonly pictures: readonly number[];
}

/** A file of meshes that objects share. */
export interface MeshFile extends Entry {
  /** Numbers of its meshes: the first, and the first behind it. */
  readonly meshes: readonly number[];
  readonly pictures: readonly number[];
}

/** A packed folder. */
export interface Manifest {
  readonly pvs: Entry;
  /** The hash of the model. */
  readonly model: string;
  /** What positions in the folder are relative to. */
  readonly origin: readonly [number, number, number];
  readonly objects: number;
  readonly chunks: readonly Chunk[];
  readonly meshes: readonly MeshFile[];
  readonly pictures: readonly Entry[];
}

type Fields = Record<string, unknown>;

/** Most bytes of a file: what a buffer of a page may have. */
const MOST_BYTES = 2 ** 31;

function fault(field: string, what: string): Error {
  return new Error(`${MANIFEST}: ${field}: ${what}`);
}

/** Reads the text of a manifest. Throws an `Error` that names the first field that is not as it should be. */
export function readManifest(text: string): Manifest {
  let root: unknown;
  try {
    root = JSON.parse(text);
  } catch (error) {
    throw new Error(`${MANIFEST}: ${(error as Error).message}`);
  }
  const fields = object(root, 'the file');
  if (fields['enfilade'] !== 2) throw fault('enfilade', 'the version of the folder is not 2');
  const origin = list(fields['origin'], 'origin').map((number, i) => finite(number, `origin[${i}]`));
  if (origin.length !== 3) throw fault('origin', 'has to be three numbers');
  const pictures = list(fields['pictures'], 'pictures').map((value, i) => entry(object(value, `pictures[${i}]`), `pictures[${i}]`));
  const files = list(fields['meshes'], 'meshes').map((value, i) => meshFile(object(value, `meshes[${i}]`), `meshes[${i}]`, pictures.length));
  const chunks = list(fields['chunks'], 'chunks').map((value, i) => {
    return chunk(object(value, `chunks[${i}]`), `chunks[${i}]`, files.length, pictures.length);
  });
  const manifest: Manifest = {
    pvs: entry(object(fields['pvs'], 'pvs'), 'pvs'),
    model: hash(fields['model'], 'model', 32),
    origin: origin as [number, number, number],
    objects: whole(fields['objects'], 'objects', 2 ** 32 - 1),
    chunks,
    meshes: files,
    pictures,
  };
  checkNames(manifest);
  checkMeshes(manifest);
  checkObjects(manifest);
  return manifest;
}

function object(value: unknown, at: string): Fields {
  if (typeof value !== 'object' || value === null || Array.isArray(value)) throw fault(at, 'has to be an object');
  return value as Fields;
}

function list(value: unknown, at: string): unknown[] {
  if (!Array.isArray(value)) throw fault(at, 'has to be a list');
  return value;
}

function finite(value: unknown, at: string): number {
  if (typeof value !== 'number' || !Number.isFinite(value)) throw fault(at, 'has to be a number');
  return value;
}

function whole(value: unknown, at: string, most: number): number {
  const number = finite(value, at);
  if (!Number.isInteger(number) || number < 0 || number > most) throw fault(at, `has to be a whole number of at most ${most}`);
  return number;
}

function hash(value: unknown, at: string, digits: number): string {
  if (typeof value !== 'string' || value.length !== digits || !/^[0-9a-f]*$/.test(value)) throw fault(at, `has to be a hash of ${digits} digits`);
  return value;
}

/** Names that stay within the folder: plain words with `/` between them. */
function name(value: unknown, at: string): string {
  const isPlain = typeof value === 'string' && value.length < 256 && value.split('/').every((part) => /^[A-Za-z0-9_-][A-Za-z0-9._-]*$/.test(part));
  if (!isPlain) throw fault(at, `has to be the name of a file in the folder, and is ${JSON.stringify(value)}`);
  return value as string;
}

function entry(fields: Fields, at: string): Entry {
  const bytes = whole(fields['bytes'], `${at}.bytes`, MOST_BYTES);
  return { file: name(fields['file'], `${at}.file`), bytes, hash: hash(fields['hash'], `${at}.hash`, 16) };
}

/** Ascending whole numbers below a count; none if there is no such field. */
function numbers(value: unknown, at: string, below: number): number[] {
  const found = value === undefined ? [] : list(value, at).map((number, i) => whole(number, `${at}[${i}]`, 2 ** 32 - 1));
  found.forEach((number, i) => {
    if (number >= below) throw fault(`${at}[${i}]`, `is ${number}, and there are ${below}`);
    if (i > 0 && number <= found[i - 1]!) throw fault(`${at}[${i}]`, 'has to be greater than the one before');
  });
  return found;
}

/** Ranges: the first, and the first behind it. */
function ranges(value: unknown, at: string): number[] {
  const ends = numbers(value, at, Infinity);
  if (ends.length === 0 || ends.length % 2 !== 0) throw fault(at, 'has to be pairs: the first, and the end');
  return ends;
}

function meshFile(fields: Fields, at: string, pictures: number): MeshFile {
  const meshes = ranges(fields['meshes'], `${at}.meshes`);
  if (meshes.length !== 2) throw fault(`${at}.meshes`, 'has to be one pair');
  return { ...entry(fields, at), meshes, pictures: numbers(fields['pictures'], `${at}.pictures`, pictures) };
}

function chunk(fields: Fields, at: string, files: number, pictures: number): Chunk {
  const meshes = numbers(fields['meshes'], `${at}.meshes`, files);
  return { ...entry(fields, at), objects: ranges(fields['objects'], `${at}.objects`), meshes, pictures: numbers(fields['pictures'], `${at}.pictures`, pictures) };
}

function checkNames(manifest: Manifest): void {
  const known = new Set([MANIFEST]);
  for (const { file } of [manifest.pvs, ...manifest.chunks, ...manifest.meshes, ...manifest.pictures]) {
    if (known.has(file)) throw fault(file, 'is the name of two files');
    known.add(file);
  }
}

/** Shared meshes are numbered through. */
function checkMeshes(manifest: Manifest): void {
  let next = 0;
  manifest.meshes.forEach(({ meshes: [first, end] }, i) => {
    if (first !== next) throw fault(`meshes[${i}].meshes`, `has to begin at ${next}`);
    next = end!;
  });
}

/** Each object is in one chunk. */
function checkObjects(manifest: Manifest): void {
  const all: [number, number, number][] = [];
  manifest.chunks.forEach(({ objects }, i) => {
    for (let at = 0; at < objects.length; at += 2) all.push([objects[at]!, objects[at + 1]!, i]);
  });
  all.sort((a, b) => a[0] - b[0]);
  let next = 0;
  for (const [first, end, i] of all) {
    if (end > manifest.objects) throw fault(`chunks[${i}].objects`, `has objects up to ${end}, and there are ${manifest.objects}`);
    if (first !== next) throw fault(`chunks[${i}].objects`, `object ${Math.min(first, next)} is in ${first < next ? 'two chunks' : 'no chunk'}`);
    next = end;
  }
  if (next !== manifest.objects) throw fault('chunks', `object ${next} is in no chunk`);
}

/** The chunk of each object. */
export function chunkOfObjects(manifest: Manifest): Uint32Array {
  const chunks = new Uint32Array(manifest.objects);
  manifest.chunks.forEach(({ objects }, i) => {
    for (let at = 0; at < objects.length; at += 2) chunks.fill(i, objects[at]!, objects[at + 1]!);
  });
  return chunks;
}

/** All files that a chunk needs, itself too. */
export function filesOf({ meshes, pictures }: Manifest, chunk: Chunk): Entry[] {
  const shared = chunk.meshes.map((number) => meshes[number]!);
  const numbers = [...chunk.pictures, ...shared.flatMap((file) => file.pictures)];
  return [chunk, ...shared, ...numbers.map((number) => pictures[number]!)];
}
