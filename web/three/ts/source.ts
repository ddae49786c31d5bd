import { Texture, type Matrix4 } from 'three';
import type { Files } from './files.js';
import { ownGeometry, sizeOf } from './geometry.js';
import { gunzip } from './gunzip.js';
import { readGlb, type Contents, type Piece } from './glb.js';
import type { Chunk, Manifest } from './manifest.js';
import { Pool } from './pool.js';

/** A picture, and its bytes with its smaller copies. */
interface Picture {
  readonly texture: Texture;
  readonly bytes: number;
}

/** A chunk that came. */
export interface Arrived {
  readonly own: [number, Piece][];
  /** Objects with shared meshes: ids, meshes, and where they stand. */
  readonly placed: [number, SharedMesh, Matrix4][];
  /** Bytes of what it shares with others, as if it were alone. */
  readonly sharedBytes: number;
}

/** A mesh that objects share. */
export interface SharedMesh {
  readonly piece: Piece;
  /** Its file, for its materials. */
  readonly file: string;
}

/** A file of shared meshes. */
interface Meshes {
  readonly contents: Contents;
  readonly bytes: number;
}

/** Gives chunks with all that they need. */
export class Source {
  private readonly manifest: Manifest;
  private readonly files: Files;
  private readonly fail: (text: string) => void;
  private readonly numbers = new Map<string, number>();
  private readonly pictures = new Pool<Picture>((number) => this.picture(number), ({ texture }) => {
    (texture.image as Partial<ImageBitmap>).close?.();
    texture.dispose();
  });
  private readonly meshes = new Pool<Meshes>((number) => this.meshFile(number), () => undefined);

  /** `fail` gets the texts of what did not come. */
  constructor(manifest: Manifest, files: Files, fail: (text: string) => void) {
    this.manifest = manifest;
    this.files = files;
    this.fail = fail;
    manifest.pictures.forEach(({ file }, i) => this.numbers.set(file, i));
  }

  /** Reads a chunk. Its objects are the manifest's; else, or if it does not come, throws an `Error`. What it shares is held until `letGo`.
   * `whenHere` is called once all its bytes are here, or won't come. */
  async read(number: number, urgency: RequestPriority, whenHere: () => void): Promise<Arrived> {
    const chunk = this.manifest.chunks[number]!;
    const pictures = this.picturesOf(chunk).map((picture) => this.pictures.take(picture));
    const meshes = chunk.meshes.map((file) => this.meshes.take(file));
    try {
      const all = Promise.all([this.files.read(chunk, urgency), Promise.all(pictures), Promise.all(meshes)]);
      const [bytes, came, files] = await all.finally(whenHere);
      const contents = await this.parse(chunk.file, bytes);
      const ids = new Set<number>([...contents.own, ...contents.placed].map(([id]) => id));
      for (const id of ids) if (!isIn(chunk, id)) throw new Error(`${chunk.file}: has object ${id}, which the manifest has elsewhere`);
      const placed = contents.placed.map(([id, mesh, matrix]): [number, SharedMesh, Matrix4] => [id, this.shared(chunk, files, mesh), matrix]);
      const sharedBytes = [...came, ...files].reduce((sum, held) => sum + held.bytes, 0);
      return { own: contents.own, placed, sharedBytes };
    } catch (error) {
      this.letGo(number);
      throw error;
    }
  }

  /** The chunk needs nothing any more. */
  letGo(number: number): void {
    const chunk = this.manifest.chunks[number]!;
    this.picturesOf(chunk).forEach((picture) => this.pictures.letGo(picture));
    chunk.meshes.forEach((file) => this.meshes.letGo(file));
  }

  private picturesOf(chunk: Chunk): number[] {
    return [...chunk.pictures, ...chunk.meshes.flatMap((file) => this.manifest.meshes[file]!.pictures)];
  }

  private shared(chunk: Chunk, files: Meshes[], mesh: number): SharedMesh {
    const at = chunk.meshes.findIndex((number) => {
      const { meshes: [first, end] } = this.manifest.meshes[number]!;
      return first! <= mesh && mesh < end!;
    });
    const piece = files[at]?.contents.shared.get(mesh);
    if (!piece) throw new Error(`${chunk.file}: has mesh ${mesh}, which is in none of its files`);
    return { piece, file: this.manifest.meshes[chunk.meshes[at]!]!.file };
  }

  private async parse(file: string, bytes: Uint8Array<ArrayBuffer>): Promise<Contents> {
    try {
      return await readGlb(await gunzip(bytes), (picture) => this.named(picture));
    } catch (error) {
      throw new Error(`${file}: ${(error as Error).message}`);
    }
  }

  private named(file: string): Promise<Texture> {
    const picture = this.pictures.get(this.numbers.get(file) ?? -1);
    return picture ? picture.then(({ texture }) => texture) : Promise.reject(new Error(`its picture ${file} is not in the manifest's list`));
  }

  private async meshFile(number: number): Promise<Meshes> {
    const entry = this.manifest.meshes[number]!;
    const contents = await this.parse(entry.file, await this.files.read(entry));
    // A mesh may be there as it is and mirrored.
    const bytes = [...contents.shared.values()].reduce((sum, { geometry }) => sum + sizeOf(ownGeometry(geometry, false)), 0);
    return { contents, bytes };
  }

  /** A picture; a white one if it does not come. */
  private async picture(number: number): Promise<Picture> {
    try {
      const bytes = await this.files.read(this.manifest.pictures[number]!);
      return picture(await createImageBitmap(new Blob([bytes]), { premultiplyAlpha: 'none', colorSpaceConversion: 'none' }));
    } catch (error) {
      this.fail((error as Error).message);
      return picture(await createImageBitmap(new ImageData(new Uint8ClampedArray(4).fill(255), 1, 1)));
    }
  }
}

function picture(image: ImageBitmap): Picture {
  return { texture: new Texture(image), bytes: Math.ceil((image.width * image.height * 16) / 3) };
}

function isIn({ objects }: Chunk, id: number): boolean {
  for (let at = 0; at < objects.length; at += 2) if (objects[at]! <= id && id < objects[at + 1]!) return true;
  return false;
}
