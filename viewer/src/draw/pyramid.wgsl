// The farthest depth of squares of pixels, level by level. Depth is 1 at the near plane and 0 far away: the farthest is the least.
//
// A level has half the texels of the one before, rounded up. So texel (x, y) of level k stands for the pixels from (x, y) * 2^(k+1) on that
// are in the picture, and for no other, at any size.

@group(0) @binding(0) var pixels: texture_depth_2d;
@group(0) @binding(1) var samples: texture_depth_multisampled_2d;
@group(0) @binding(2) var finer: texture_2d<f32>;
@group(0) @binding(3) var level: texture_storage_2d<r32float, write>;
// Width and height of what is read, in its first words: textures are larger than the levels that they hold.
@group(0) @binding(4) var<uniform> size: vec4u;

const SAMPLES_A_PIXEL = 4;

fn at(id: vec3u, i: u32) -> vec2u {
    return min(2u * id.xy + vec2u(i & 1u, i >> 1u), size.xy - 1u);
}

fn put(id: vec3u, farthest: f32) {
    if all(2u * id.xy < size.xy) { textureStore(level, id.xy, vec4f(farthest, 0.0, 0.0, 0.0)); }
}

@compute @workgroup_size(8, 8)
fn of_pixels(@builtin(global_invocation_id) id: vec3u) {
    var farthest = 1.0;
    for (var i = 0u; i < 4u; i++) { farthest = min(farthest, textureLoad(pixels, at(id, i), 0)); }
    put(id, farthest);
}

@compute @workgroup_size(8, 8)
fn of_samples(@builtin(global_invocation_id) id: vec3u) {
    var farthest = 1.0;
    for (var i = 0u; i < 4u; i++) {
        for (var s = 0; s < SAMPLES_A_PIXEL; s++) { farthest = min(farthest, textureLoad(samples, at(id, i), s)); }
    }
    put(id, farthest);
}

@compute @workgroup_size(8, 8)
fn of_finer(@builtin(global_invocation_id) id: vec3u) {
    var farthest = 1.0;
    for (var i = 0u; i < 4u; i++) { farthest = min(farthest, textureLoad(finer, at(id, i), 0).r); }
    put(id, farthest);
}
