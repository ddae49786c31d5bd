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
    normals: u32,
    rough: u32,
    shine: u32,
    normal_scale: f32,
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
// The pictures again, as numbers.
@group(1) @binding(6) var numbers: texture_2d_array<f32>;

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

fn lit_corner(corner: u32) -> Lit {
    let place = place_of(corner);
    let word = word_of(corner);
    let made = made_of_corner(corner);
    let at = picture_at_corner(corner, word);
    return Lit(placed(place, word), place, at, made & 0xffffu, unpacked(made >> 16u));
}

@vertex
fn lit(@builtin(vertex_index) corner: u32) -> Lit {
    return lit_corner(corner);
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

// What a material is at a point.
struct Spot {
    colour: vec4f,
    emissive: vec3f,
    roughness: f32,
    metallic: f32,
    // Towards the eye.
    normal: vec3f,
}

// A face's normal, leaned by a picture: texture coordinates say where its x and y lead, without tangents in the model (Schüler 2013).
fn leaned(n: vec3f, s: Surface, at: vec2f, dx: vec2f, dy: vec2f, px: vec3f, py: vec3f) -> vec3f {
    let lean = textureSampleGrad(numbers, repeating, at, s.normals, dx, dy).xyz * 2.0 - 1.0;
    // The screen's y leads down.
    let a = cross(n, py);
    let b = cross(px, n);
    let t = a * dx.x + b * dy.x;
    // A picture's y leads up, and its v down.
    let u = -(a * dx.y + b * dy.y);
    let most = max(dot(t, t), dot(u, u));
    if most <= 0.0 { return n; }
    let tilted = s.normal_scale * lean.xy * inverseSqrt(most);
    return normalize(t * tilted.x + u * tilted.y + n * max(lean.z, 0.05));
}

fn spot_of(in: Lit) -> Spot {
    let s = surfaces[in.surface];
    let at = in.picture_at;
    let dx = dpdx(at);
    let dy = dpdy(at);
    let px = dpdx(in.place);
    let py = dpdy(in.place);
    // Models are wound both ways: a face is lit on the side that is seen.
    let n = in.normal * select(-1.0, 1.0, dot(in.normal, camera.eye.xyz - in.place) >= 0.0);
    var spot = Spot(s.colour, s.emissive.rgb, s.emissive.w, s.metallic, n);
    if s.picture != NO_PICTURE { spot.colour *= textureSampleGrad(pictures, repeating, at, s.picture, dx, dy); }
    if s.shine != NO_PICTURE { spot.emissive *= textureSampleGrad(pictures, repeating, at, s.shine, dx, dy).rgb; }
    if s.rough != NO_PICTURE {
        let rough = textureSampleGrad(numbers, repeating, at, s.rough, dx, dy);
        spot.roughness *= rough.g;
        spot.metallic *= rough.b;
    }
    if s.normals != NO_PICTURE { spot.normal = leaned(n, s, at, dx, dy, px, py); }
    return spot;
}

fn shaded(in: Lit, at: Spot) -> vec3f {
    let s = surfaces[in.surface];
    let base = at.colour.rgb;
    let away = camera.eye.xyz - in.place;
    if s.kind == 2u { return sky(-away); }
    if s.kind == 1u { return pow(base, vec3f(1.0 / 2.2)); }
    let eye = normalize(away);
    let n = at.normal;
    // Walls that meet differ a little, though nothing shines on them.
    let tilt = 1.0 + 0.10 * n.x + 0.05 * n.z;
    let ambient = mix(GROUND, SKY, n.y * 0.5 + 0.5) * tilt;
    let facing = dot(n, sun.towards.xyz);
    var direct = vec3f(0.0);
    if facing > 0.0 { direct = SUN * sunlight(in.place, n); }
    let roughness = at.roughness;
    let gloss = (1.0 - roughness) * (1.0 - roughness);
    let mirrored = reflect(-eye, n);
    let around = mix(GROUND, SKY, smoothstep(-0.4, 0.4, mirrored.y));
    let f0 = mix(vec3f(0.04), base, at.metallic);
    let fresnel = f0 + (max(vec3f(1.0 - roughness), f0) - f0) * pow(1.0 - max(dot(n, eye), 0.0), 5.0);
    let shine = pow(max(dot(mirrored, sun.towards.xyz), 0.0), mix(8.0, 200.0, gloss)) * mix(0.1, 2.0, gloss);
    let diffuse = base * (1.0 - at.metallic) * (ambient + direct * max(facing, 0.0));
    let specular = fresnel * (around * max(gloss, at.metallic) + direct * shine);
    return shown(diffuse + specular + at.emissive);
}

@fragment
fn nothing() {}

@fragment
fn solid(in: Lit) -> @location(0) vec4f {
    return vec4f(shaded(in, spot_of(in)), 1.0);
}

// Pictures with holes.
@fragment
fn masked(in: Lit) -> @location(0) vec4f {
    let spot = spot_of(in);
    if spot.colour.a < surfaces[in.surface].cutoff { discard; }
    return vec4f(shaded(in, spot), 1.0);
}

// Of each square of four pixels one shows it.
fn is_screen(at: vec4f) -> bool {
    let p = vec2u(at.xy);
    return ((p.x | p.y) & 1u) == 0u;
}

// What is seen along it reflects more.
fn pane(in: Lit) -> vec4f {
    let spot = spot_of(in);
    let away = camera.eye.xyz - in.place;
    let along = 1.0 - abs(dot(in.normal, normalize(away)));
    let gloss = 1.0 - spot.roughness;
    return vec4f(shaded(in, spot), clamp(spot.colour.a + gloss * 0.5 * pow(along, 5.0), 0.0, 1.0));
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
fn sky_pixel(in: Sky) -> @location(0) vec4f {
    return vec4f(sky(in.direction), 1.0);
}

@vertex
fn shadow(@builtin(vertex_index) corner: u32) -> @builtin(position) vec4f {
    return sun.clip * vec4f(place_of(corner), 1.0);
}
