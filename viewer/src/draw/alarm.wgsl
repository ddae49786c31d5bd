// Holds what was drawn against what there is: where the one is farther off than the other, something is missing.

@group(0) @binding(0) var drawn: texture_depth_2d;
@group(0) @binding(1) var whole: texture_depth_2d;
@group(0) @binding(2) var items: texture_2d<u32>;
// Missed pixels of all objects, then of each.
@group(0) @binding(3) var<storage, read_write> missed: array<atomic<u32>>;

struct Near {
    // The item of the ground; and how far from there other tiles may show it, pixels.
    item: u32,
    far: i32,
}

@group(0) @binding(4) var<uniform> near: Near;

// Ground is drawn here, or as near as other tiles may have put it.
fn has_ground(p: vec2i) -> bool {
    let last = vec2i(textureDimensions(drawn)) - 1;
    for (var y = -near.far; y <= near.far; y++) {
        for (var x = -near.far; x <= near.far; x++) {
            let q = clamp(p + vec2i(x, y), vec2i(0), last);
            if textureLoad(items, q, 0).r == near.item && textureLoad(drawn, q, 0) > 0.0 { return true; }
        }
    }
    return false;
}

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2u(at.xy);
    // Depth is 1 at the near plane and 0 far away. Of things that lie on each other, a rank says which shows (see scene.wgsl); rows may have
    // left out that one, which nobody could tell.
    if textureLoad(drawn, p, 0) * (1.0 + 0x1p-15f) >= textureLoad(whole, p, 0) { discard; }
    if textureLoad(items, p, 0).r == near.item && has_ground(vec2i(p)) { discard; }
    atomicAdd(&missed[0], 1u);
    atomicAdd(&missed[textureLoad(items, p, 0).r], 1u);
    return vec4f(1.0, 0.0, 1.0, 1.0);
}
