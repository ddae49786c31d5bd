// Shade in corners and lines along edges, from the depth of what was drawn: shade in half the size, smoothed there, then over the picture.
//
// Based on: Mittring 2007 (shade from depth), Jimenez 2014 (the pattern that turns the samples).

struct View {
    // Tangents of half the opening angles.
    tangent: vec2f,
    // How far things shade each other, metres.
    reach: f32,
    near: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var corners: texture_2d<f32>;

@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

// Depth is 1 at the near plane, 0 far away; nothing is beyond the rim.
fn depth_at(p: vec2i) -> f32 {
    let last = vec2i(textureDimensions(depth)) - 1;
    return textureLoad(depth, clamp(p, vec2i(0), last), 0);
}

fn place(p: vec2f, d: f32) -> vec3f {
    let size = vec2f(textureDimensions(depth));
    let away = view.near / max(d, 1e-12);
    return vec3f((p / size * 2.0 - 1.0) * vec2f(1.0, -1.0) * view.tangent, 1.0) * away;
}

// How dark lines are at a depth. They fade from 80 m to 250 m: ridges of far-off ground would be nothing but lines.
fn strength(d: f32) -> f32 {
    return 0.42 * (1.0 - smoothstep(80.0, 250.0, view.near / d));
}

const SAMPLES: u32 = 8u;

@fragment
fn occlusion(@builtin(position) at: vec4f) -> @location(0) f32 {
    let p = vec2i(at.xy) * 2;
    let d = depth_at(p);
    if d <= 0.0 { return 1.0; }
    let middle = vec2f(p) + 0.5;
    let here = place(middle, d);
    // The face, from those neighbours that are nearer to lying on it.
    let left = depth_at(p - vec2i(1, 0));
    let right = depth_at(p + vec2i(1, 0));
    let above = depth_at(p - vec2i(0, 1));
    let below = depth_at(p + vec2i(0, 1));
    let to_left = abs(left - d) < abs(right - d);
    let to_above = abs(above - d) < abs(below - d);
    let across = select(place(middle + vec2f(1.0, 0.0), right) - here, here - place(middle - vec2f(1.0, 0.0), left), to_left);
    let down = select(place(middle + vec2f(0.0, 1.0), below) - here, here - place(middle - vec2f(0.0, 1.0), above), to_above);
    let normal = normalize(cross(down, across));
    let facing = normal * select(1.0, -1.0, dot(normal, here) > 0.0);
    let pixels = view.reach / (here.z * view.tangent.y) * 0.5 * f32(textureDimensions(depth).y);
    let turn = 6.2831853 * fract(52.9829189 * fract(dot(at.xy, vec2f(0.06711056, 0.00583715))));
    var sum = 0.0;
    for (var i = 0u; i < SAMPLES; i++) {
        let angle = turn + f32(i) * 2.3999632;
        let far = sqrt((f32(i) + 0.5) / f32(SAMPLES)) * clamp(pixels, 4.0, 200.0);
        let q = middle + vec2f(cos(angle), sin(angle)) * far;
        let other = place(q, depth_at(vec2i(q)));
        let to = other - here;
        let away = length(to);
        let rises = dot(to, facing) / max(away, 1e-6);
        sum += max(rises - 0.12, 0.0) * smoothstep(1.0, 0.3, away / view.reach);
    }
    return 1.0 - min(sum / f32(SAMPLES) * 1.9, 0.75);
}

// Over what is about as far away.
@fragment
fn smoothed(@builtin(position) at: vec4f) -> @location(0) f32 {
    let p = vec2i(at.xy);
    let d = depth_at(p * 2);
    let last = vec2i(textureDimensions(corners)) - 1;
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0; i < 9; i++) {
        let q = clamp(p + vec2i(i % 3 - 1, i / 3 - 1), vec2i(0), last);
        let w = max(1.0 - 12.0 * abs(depth_at(q * 2) - d) / max(d, 1e-12), 0.001);
        sum += w * textureLoad(corners, q, 0).r;
        weight += w;
    }
    return sum / weight;
}

@fragment
fn over(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2i(at.xy);
    let d = depth_at(p);
    if d <= 0.0 { return vec4f(1.0); }
    // Depth is linear on a face, in the picture: what bends is an edge.
    let across = abs(depth_at(p - vec2i(1, 0)) + depth_at(p + vec2i(1, 0)) - 2.0 * d);
    let down = abs(depth_at(p - vec2i(0, 1)) + depth_at(p + vec2i(0, 1)) - 2.0 * d);
    let pixel = 2.0 * view.tangent.y / f32(textureDimensions(depth).y);
    let bend = max(across, down) / (d * pixel);
    let line = 1.0 - strength(d) * smoothstep(0.5, 1.6, bend);
    return vec4f(vec3f(textureLoad(corners, p / 2, 0).r * line), 1.0);
}
