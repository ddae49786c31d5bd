// The right half of another picture, and a line between the two.

@group(0) @binding(0) var other: texture_2d<f32>;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2u(at.xy);
    let middle = textureDimensions(other).x / 2u;
    if p.x < middle { discard; }
    if p.x < middle + 2u { return vec4f(1.0); }
    return textureLoad(other, p, 0);
}
