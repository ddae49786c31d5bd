// Pixels and solid angle of each object, over the faces of an item buffer.

struct Batch {
    // Pixels along a face's edge.
    size: u32,
    // Which face of its cube the first is of.
    first_face: u32,
    objects: u32,
}

// The complement of each pixel's triangle, row by row, face by face; 0 where there is none.
@group(0) @binding(0) var<storage, read> ids: array<u32>;
// The object of each triangle.
@group(0) @binding(1) var<storage, read> owners: array<u32>;
// Solid angle of each pixel of a face, in a unit of the size's.
@group(0) @binding(2) var<storage, read> weights: array<u32>;
// View by view, object by object: pixels, and the sum of weights in two halves, the lesser first.
@group(0) @binding(3) var<storage, read_write> sums: array<atomic<u32>>;
@group(0) @binding(4) var<uniform> batch: Batch;

// Pixels of a row that one invocation looks at.
const RUN: u32 = 16u;

fn add(slot: u32, pixels: u32, low: u32, high: u32) {
    atomicAdd(&sums[slot], pixels);
    let before = atomicAdd(&sums[slot + 1u], low);
    // Whoever makes the lower half overflow carries.
    let carry = high + select(0u, 1u, before + low < low);
    if carry != 0u {
        atomicAdd(&sums[slot + 2u], carry);
    }
}

@compute @workgroup_size(8, 8)
fn count(@builtin(global_invocation_id) id: vec3u) {
    let row = id.y;
    let start = id.x * RUN;
    if row >= batch.size || start >= batch.size {
        return;
    }
    let view = (batch.first_face + id.z) / 6u;
    var object = 0u;
    var pixels = 0u;
    var low = 0u;
    var high = 0u;
    for (var column = start; column < min(start + RUN, batch.size); column++) {
        let seen = ids[(id.z * batch.size + row) * batch.size + column];
        if seen == 0u {
            continue;
        }
        let owner = owners[~seen];
        if owner != object && pixels != 0u {
            add(3u * (view * batch.objects + object), pixels, low, high);
            pixels = 0u;
            low = 0u;
            high = 0u;
        }
        object = owner;
        pixels++;
        let weight = weights[row * batch.size + column];
        low += weight;
        high += select(0u, 1u, low < weight);
    }
    if pixels != 0u {
        add(3u * (view * batch.objects + object), pixels, low, high);
    }
}
