// The scene as it looks: materials, pictures, the sun with its shadows, light from the sky; or what casts shadows.

struct Camera {
    clip: mat4x4f,
    cut: vec4f,
    eye: vec4f,
}

struct Surface {
    colour: vec4f,
    // Red, green and blue; and the roughness.
    emissive: vec4f,
    metallic: f32,
    cutoff: f32,
    picture: u32,
    // 1: no light changes it; 2: the sky is seen through it.
    kind: u32,
}

struct Sun {
    clip: mat4x4f,
    // A unit vector; and how far from a face its shadow is looked up, metres.
    towards: vec4f,
}

const NO_PICTURE: u32 = 0xffffffffu;

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> colours: array<u32>;
@group(1) @binding(0) var<uniform> sun: Sun;
@group(1) @binding(1) var<storage, read> surfaces: array<Surface>;
@group(1) @binding(2) var pictures: texture_2d_array<f32>;
@group(1) @binding(3) var repeating: sampler;
@group(1) @binding(4) var shadows: texture_depth_2d;
@group(1) @binding(5) var comparing: sampler_comparison;

struct Lit {
    @invariant @builtin(position) at: vec4f,
    @location(0) place: vec3f,
    @location(1) picture_at: vec2f,
    @location(2) @interpolate(flat) surface: u32,
    @location(3) @interpolate(flat) normal: vec3f,
}

// A unit vector of two bytes, on an octahedron.
fn unpacked(word: u32) -> vec3f {
    let p = unpack4x8snorm(word).xy;
    var n = vec3f(p, 1.0 - abs(p.x) - abs(p.y));
    let t = max(-n.z, 0.0);
    n.x -= select(-t, t, n.x >= 0.0);
    n.y -= select(-t, t, n.y >= 0.0);
    return normalize(n);
}

// As in scene.wgsl, to the bit.
fn placed(place: vec3f, word: u32) -> vec4f {
    let at = camera.clip * vec4f(place, 1.0);
    let rank = f32(colours[word & 0xffffffu] >> 24u);
    return vec4f(at.xy, at.z * (1.0 + rank * 0x1p-20f), at.w);
}

@vertex
fn lit(
    @location(0) place: vec3f,
    @location(1) object: u32,
    @location(2) picture_at: vec2f,
    @location(3) word: u32,
) -> Lit {
    return Lit(placed(place, object), place, picture_at, word & 0xffffu, unpacked(word >> 16u));
}

// 0 to 1: how much of the sun shows. The sampler takes four texels, which smooths rims.
fn sunlight(place: vec3f, n: vec3f) -> f32 {
    let at = sun.clip * vec4f(place + n * sun.towards.w, 1.0);
    return textureSampleCompareLevel(shadows, comparing, at.xy * vec2f(0.5, -0.5) + 0.5, at.z);
}

const SKY = vec3f(0.70, 0.73, 0.77);
const GROUND = vec3f(0.43, 0.40, 0.37);
const SUN = vec3f(1.90, 1.75, 1.50);

// To what a screen shows: bright things come near to white and don't pass it.
fn shown(light: vec3f) -> vec3f {
    return pow(1.0 - exp(-1.7 * light), vec3f(1.0 / 2.2));
}

fn sky(direction: vec3f) -> vec3f {
    let up = clamp(normalize(direction).y, 0.0, 1.0);
    return mix(vec3f(0.83, 0.88, 0.93), vec3f(0.42, 0.60, 0.84), sqrt(up));
}

fn base(in: Lit) -> vec4f {
    let s = surfaces[in.surface];
    let dx = dpdx(in.picture_at);
    let dy = dpdy(in.picture_at);
    if s.picture == NO_PICTURE { return s.colour; }
    return s.colour * textureSampleGrad(pictures, repeating, in.picture_at, s.picture, dx, dy);
}

fn shaded(in: Lit, base: vec3f) -> vec3f {
    let s = surfaces[in.surface];
    let away = camera.eye.xyz - in.place;
    if s.kind == 2u { return sky(-away); }
    if s.kind == 1u { return pow(base, vec3f(1.0 / 2.2)); }
    let eye = normalize(away);
    // Models are wound both ways: a face is lit on the side that is seen.
    let n = in.normal * select(-1.0, 1.0, dot(in.normal, away) >= 0.0);
    // Walls that meet differ a little, though nothing shines on them.
    let tilt = 1.0 + 0.10 * n.x + 0.05 * n.z;
    let ambient = mix(GROUND, SKY, n.y * 0.5 + 0.5) * tilt;
    let facing = dot(n, sun.towards.xyz);
    var direct = vec3f(0.0);
    if facing > 0.0 { direct = SUN * sunlight(in.place, n); }
    let roughness = s.emissive.w;
    let gloss = (1.0 - roughness) * (1.0 - roughness);
    let mirrored = reflect(-eye, n);
    let around = mix(GROUND, SKY, smoothstep(-0.4, 0.4, mirrored.y));
    let f0 = mix(vec3f(0.04), base, s.metallic);
    let fresnel = f0 + (max(vec3f(1.0 - roughness), f0) - f0) * pow(1.0 - max(dot(n, eye), 0.0), 5.0);
    let spot = pow(max(dot(mirrored, sun.towards.xyz), 0.0), mix(8.0, 200.0, gloss)) * mix(0.1, 2.0, gloss);
    let diffuse = base * (1.0 - s.metallic) * (ambient + direct * max(facing, 0.0));
    let specular = fresnel * (around * max(gloss, s.metallic) + direct * spot);
    return shown(diffuse + specular + s.emissive.rgb);
}

@fragment
fn nothing() {}

@fragment
fn solid(in: Lit) -> @location(0) vec4f {
    return vec4f(shaded(in, base(in).rgb), 1.0);
}

// Pictures with holes.
@fragment
fn masked(in: Lit) -> @location(0) vec4f {
    let colour = base(in);
    if colour.a < surfaces[in.surface].cutoff { discard; }
    return vec4f(shaded(in, colour.rgb), 1.0);
}

// Of each square of four pixels one shows it.
fn is_screen(at: vec4f) -> bool {
    let p = vec2u(at.xy);
    return ((p.x | p.y) & 1u) == 0u;
}

// What is seen along it reflects more.
fn pane(in: Lit) -> vec4f {
    let colour = base(in);
    let away = camera.eye.xyz - in.place;
    let along = 1.0 - abs(dot(in.normal, normalize(away)));
    let gloss = 1.0 - surfaces[in.surface].emissive.w;
    return vec4f(shaded(in, colour.rgb), clamp(colour.a + gloss * 0.5 * pow(along, 5.0), 0.0, 1.0));
}

// Blended.
@fragment
fn glass(in: Lit) -> @location(0) vec4f {
    return pane(in);
}

// Depth alone of what is seen through, as a screen: what the alarm compares with.
@fragment
fn screen_depth(@builtin(position) at: vec4f) {
    if !is_screen(at) { discard; }
}

struct Sky {
    @builtin(position) at: vec4f,
    @location(0) direction: vec3f,
}

// Everywhere, as far away as it gets.
@vertex
fn everywhere(@builtin(vertex_index) i: u32) -> Sky {
    let p = vec2f(f32(i & 1u), f32(i >> 1u)) * 4.0 - 1.0;
    let rows = transpose(camera.clip);
    let x = rows[0].xyz;
    let y = rows[1].xyz;
    let w = rows[3].xyz;
    return Sky(vec4f(p, 0.0, 1.0), x * (p.x / dot(x, x)) + y * (p.y / dot(y, y)) + w / dot(w, w));
}

@fragment
fn heaven(in: Sky) -> @location(0) vec4f {
    return vec4f(sky(in.direction), 1.0);
}

@vertex
fn shadow(@location(0) place: vec3f) -> @builtin(position) vec4f {
    return sun.clip * vec4f(place, 1.0);
}
