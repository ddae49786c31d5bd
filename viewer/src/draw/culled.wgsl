// What was culled, as one layer of grey glass over what was drawn.

@group(0) @binding(0) var drawn: texture_depth_2d;
@group(0) @binding(1) var layer_depth: texture_depth_2d;
@group(0) @binding(2) var layer: texture_2d<f32>;

const GLASS = vec3f(0.36, 0.44, 0.56);
const OPACITY = 0.30;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2u(at.xy);
    // Depth is 1 at the near plane and 0 far away.
    let depth = textureLoad(layer_depth, p, 0);
    if depth == 0.0 || depth < textureLoad(drawn, p, 0) { discard; }
    // Its light shows its shape.
    let light = dot(textureLoad(layer, p, 0).rgb, vec3f(0.30, 0.59, 0.11));
    return vec4f(GLASS * (0.5 + light), OPACITY);
}
