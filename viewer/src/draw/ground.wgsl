// Ground: tiles of heights, an instance for each part of one. Corners are taken by their number: cell, triangle, sample.
//
// Neighbours place a sample that they share by the same numbers in the same order, so there is no gap between them.

struct Land {
    // Rows of the camera; the near plane's distance, metres.
    x: vec4f,
    y: vec4f,
    w: vec4f,
    // Towards the sun; and the relief, metres.
    sun: vec4f,
    // Metres from a whole column and row to the eye, and between columns and rows.
    rest: vec2f,
    spacing: vec2f,
    // That column and row, and the raster's last ones.
    whole: vec2i,
    last: vec2i,
    // Metres of a number, and of the eye above the origin.
    step: f32,
    eye: f32,
    // Samples of a tile along a side; bytes of a number; words of a slot.
    side: u32,
    wide: u32,
    words: u32,
    // How it looks: 0 plain, 1 as it looks, 2 by level.
    look: u32,
    // Of the alarm.
    item: u32,
}

@group(0) @binding(0) var<uniform> land: Land;
@group(0) @binding(1) var<storage, read> heights: array<u32>;
// Slot, column and row of the tile in its level; the level, and in further bytes the sides with coarser neighbours, and the part's column and row.
@group(0) @binding(2) var<storage, read> parts: array<vec4u>;
// Parts of a tile, a side.
const PARTS = 4u;

struct Soil {
    @invariant @builtin(position) at: vec4f,
    // From the eye, metres.
    @location(0) place: vec3f,
    @location(1) @interpolate(flat) normal: vec3f,
    // Samples to the east and south in the tile.
    @location(2) sample: vec2f,
    @location(3) @interpolate(flat) level: u32,
}

const NOWHERE = vec4f(0.0, 0.0, 2.0, 1.0);

// North, west, south and east are bits 0 to 3. On the first two, odd samples move onto the one before, on the others onto the one after. See
// mesh.rs of the library.
fn snapped(s: vec2u, coarser: u32) -> vec2u {
    return vec2u(along(s.x, s.y, coarser & 1u, coarser & 4u), along(s.y, s.x, coarser & 2u, coarser & 8u));
}

fn along(k: u32, across: u32, first: u32, second: u32) -> u32 {
    if across == 0u && first != 0u { return k & ~1u; }
    if across == land.side - 1u && second != 0u { return k + (k & 1u); }
    return k;
}

fn number(slot: u32, s: vec2u) -> u32 {
    let at = s.y * land.side + s.x;
    if land.wide == 4u { return heights[slot * land.words + at]; }
    return (heights[slot * land.words + at / 2u] >> (16u * (at & 1u))) & 0xffffu;
}

fn is_void(number: u32) -> bool {
    return number >= select(0xffffu, 0xffffffu, land.wide == 4u);
}

// From the eye, metres.
fn place(tile: vec4u, s: vec2u, number: u32) -> vec3f {
    let at = min(vec2i((tile.yz * (land.side - 1u) + s) << vec2u(tile.w & 0xffu)), land.last);
    let plan = vec2f(at - land.whole) * land.spacing - land.rest;
    return vec3f(plan.x, f32(number) * land.step - land.eye, plan.y);
}

@vertex
fn soil(@builtin(vertex_index) corner: u32, @builtin(instance_index) instance: u32) -> Soil {
    let tile = parts[instance];
    let cells = (land.side - 1u) / PARTS;
    let cell = vec2u((tile.w >> 16u) & 0xffu, tile.w >> 24u) * cells + vec2u(corner / 6u % cells, corner / 6u / cells);
    // All diagonals from the north-east to the south-west.
    var corners = array(vec2u(0u, 0u), vec2u(0u, 1u), vec2u(1u, 0u), vec2u(1u, 0u), vec2u(0u, 1u), vec2u(1u, 1u));
    let first = corner / 3u % 2u * 3u;
    var out: Soil;
    out.at = NOWHERE;
    var p: array<vec3f, 3>;
    for (var k = 0u; k < 3u; k++) {
        let s = snapped(cell + corners[first + k], (tile.w >> 8u) & 0xffu);
        let n = number(tile.x, s);
        if is_void(n) { return out; }
        p[k] = place(tile, s, n);
        if k == corner % 3u { out.sample = vec2f(s); }
    }
    out.place = p[corner % 3u];
    let n = cross(p[1] - p[0], p[2] - p[0]);
    out.normal = select(vec3f(0.0, 1.0, 0.0), normalize(n), dot(n, n) > 0.0);
    out.level = tile.w & 0xffu;
    out.at = vec4f(dot(land.x.xyz, out.place), dot(land.y.xyz, out.place), land.w.w, dot(land.w.xyz, out.place));
    return out;
}

const GRASS = vec3f(0.36, 0.45, 0.22);
const MEADOW = vec3f(0.53, 0.52, 0.33);
const EARTH = vec3f(0.47, 0.39, 0.29);
const ROCK = vec3f(0.47, 0.45, 0.43);

// Grass where it is level, earth where it is steep, rock where nothing holds; higher up it is drier.
fn earth_and_grass(height: f32, n: vec3f) -> vec3f {
    let grass = mix(GRASS, MEADOW, clamp(height / max(land.sun.w, 1.0), 0.0, 1.0));
    let bare = mix(EARTH, ROCK, smoothstep(0.75, 0.55, n.y));
    return mix(grass, bare, smoothstep(0.97, 0.80, n.y));
}

// Fine ones are blue, coarse ones red.
fn of_level(level: u32) -> vec3f {
    var colours = array(
        vec3f(0.35, 0.55, 0.95), vec3f(0.30, 0.80, 0.85), vec3f(0.35, 0.80, 0.45), vec3f(0.75, 0.85, 0.35),
        vec3f(0.98, 0.80, 0.30), vec3f(0.97, 0.60, 0.28), vec3f(0.92, 0.42, 0.32), vec3f(0.80, 0.35, 0.55),
    );
    return colours[min(level, 7u)];
}

// As in full.wgsl.
const SKY = vec3f(0.70, 0.73, 0.77);
const GROUND = vec3f(0.43, 0.40, 0.37);
const SUN = vec3f(1.90, 1.75, 1.50);
// What is far off takes the colour of the air; metres until two thirds of it have.
const AIR = vec3f(0.83, 0.88, 0.93);
const CLEAR = 25000.0;

@fragment
fn colour(in: Soil) -> @location(0) vec4f {
    let n = normalize(in.normal);
    let facing = max(dot(n, land.sun.xyz), 0.0);
    if land.look == 2u {
        let rim = min(in.sample, vec2f(f32(land.side - 1u)) - in.sample);
        let wide = fwidth(in.sample);
        let is_border = any(rim < wide);
        return vec4f(select(of_level(in.level) * (0.55 + 0.45 * facing), vec3f(0.1), is_border), 1.0);
    }
    let base = earth_and_grass(in.place.y + land.eye, n);
    if land.look == 0u { return vec4f(base * (0.6 + 0.5 * facing), 1.0); }
    // In the sun it is brighter than colours that are shown as they are.
    let light = 0.6 * pow(base, vec3f(2.2)) * (mix(GROUND, SKY, n.y * 0.5 + 0.5) + SUN * facing);
    let seen = pow(1.0 - exp(-1.7 * light), vec3f(1.0 / 2.2));
    return vec4f(mix(AIR, seen, exp(-length(in.place) / CLEAR)), 1.0);
}

@fragment
fn item(in: Soil) -> @location(0) u32 {
    return land.item;
}
