// A model with a picture on its walls: the repository's have none.

import { deflateSync, crc32 } from 'node:zlib';

/** A square picture of two colours. */
function png(size) {
  const chunk = (name, data) => {
    const body = Buffer.concat([Buffer.from(name), data]);
    const [length, check] = [Buffer.alloc(4), Buffer.alloc(4)];
    length.writeUInt32BE(data.length);
    check.writeUInt32BE(crc32(body) >>> 0);
    return Buffer.concat([length, body, check]);
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(size, 0);
  header.writeUInt32BE(size, 4);
  header.set([8, 2], 8);
  const rows = Buffer.alloc(size * (1 + 3 * size));
  for (let y = 0; y < size; y++) {
    for (let x = 0; x < size; x++) rows.set((x < size / 2) === (y < size / 2) ? [230, 40, 40] : [40, 60, 230], y * (1 + 3 * size) + 1 + 3 * x);
  }
  return Buffer.concat([Buffer.from([137, 80, 78, 71, 13, 10, 26, 10]), chunk('IHDR', header), chunk('IDAT', deflateSync(rows)), chunk('IEND', Buffer.alloc(0))]);
}

/** A `.glb` with a picture of 16 by 16 on all of one material's meshes, laid on from above. */
export function textured(glb, material) {
  const length = glb.readUInt32LE(12);
  const root = JSON.parse(glb.subarray(20, 20 + length));
  const parts = [glb.subarray(28 + length, 28 + length + root.buffers[0].byteLength)];
  let end = parts[0].length;
  const add = (bytes) => {
    const padded = Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4)]);
    root.bufferViews.push({ buffer: 0, byteOffset: end, byteLength: bytes.length });
    parts.push(padded);
    end += padded.length;
    return root.bufferViews.length - 1;
  };
  if (end % 4 !== 0) add(Buffer.alloc(0));
  for (const { primitives } of root.meshes) {
    for (const primitive of primitives) {
      if (primitive.material !== material) continue;
      const { count } = root.accessors[primitive.attributes.POSITION];
      const places = Buffer.alloc(8 * count);
      for (let i = 0; i < count; i++) {
        places.writeFloatLE((i % 3) / 2, 8 * i);
        places.writeFloatLE((i % 5) / 4, 8 * i + 4);
      }
      root.accessors.push({ bufferView: add(places), componentType: 5126, count, type: 'VEC2' });
      primitive.attributes.TEXCOORD_0 = root.accessors.length - 1;
    }
  }
  root.images = [{ bufferView: add(png(16)), mimeType: 'image/png' }];
  root.textures = [{ source: 0 }];
  root.materials[material].pbrMetallicRoughness.baseColorTexture = { index: 0 };
  root.buffers[0].byteLength = end;
  let text = Buffer.from(JSON.stringify(root));
  text = Buffer.concat([text, Buffer.alloc((4 - (text.length % 4)) % 4, ' ')]);
  const head = Buffer.alloc(20);
  head.write('glTF');
  [2, 28 + text.length + end, text.length].forEach((number, i) => head.writeUInt32LE(number, 4 + 4 * i));
  head.write('JSON', 16);
  const middle = Buffer.alloc(8);
  middle.writeUInt32LE(end);
  middle.write('BIN\0', 4);
  return Buffer.concat([head, text, middle, ...parts]);
}
