// Tubes, in the place of geometry.wgsl: corners of rings, by their number. Follows bands.wgsl.

// Two a band.
@group(2) @binding(0) var<storage, read> rings: array<Ring>;
@group(2) @binding(1) var<storage, read> list: Bands;
// By object: its material.
@group(2) @binding(2) var<storage, read> materials: array<u32>;

// The lower bits of a corner's number are its number among those with as many sides, the upper ones which number of sides that is.
const OF_BUCKET = 27u;

struct Corner {
    // On the curve; where that leads; from there to the corner, of a length of 1, and how many radii; the radius; and whether
    // the ring has more than four sides.
    middle: vec3f,
    tangent: vec3f,
    spoke: vec3f,
    scale: f32,
    radius: f32,
    is_finer: bool,
    place: vec3f,
    normal: vec3f,
    // The object, and in the highest byte the light.
    word: u32,
    // Half of the width that there is, and of the one that is drawn, in one unit: weights are of pixels, since they are not linear on the way.
    covers: vec2f,
    // 0 at the band's first ring, 1 at the second.
    along: f32,
    // Which number of sides the finer ring has.
    sides: u32,
}

// How light a face is, as mesh.rs has it.
fn light(n: vec3f) -> f32 {
    let lit = 0.55 + 0.30 * abs(dot(n, vec3f(0.36, 0.80, 0.48))) + 0.08 * abs(n.y) + 0.07 * abs(n.x);
    return min(lit, 1.0);
}

fn corner_of(number: u32) -> Corner {
    // 1. Which band, which ring of it, which corner of that.
    let bucket = number >> OF_BUCKET;
    let finer = 4u << bucket;
    let of_bucket = number & ((1u << OF_BUCKET) - 1u);
    let number_of_band = list.first[bucket / 4u][bucket % 4u] + (of_bucket >> (3u + bucket));
    let band = list.bands[number_of_band].zw;
    let ring = of_bucket >> (2u + bucket) & 1u;
    let side = of_bucket & (finer - 1u);
    // 2. Which ring. Walls: outer, inner, at the first ring, at the last.
    let wall = band.x >> 30u;
    let is_second = select(ring == 1u, select(wall == 3u, ring == 0u, wall == 1u), wall > 0u);
    let is_hole = wall == 1u || (wall == 2u && ring == 0u) || (wall == 3u && ring == 1u);
    let coarser = bucket - (band.y >> (24u + 4u * ring) & 15u);
    let of_ring = finer >> coarser;
    let k = side >> coarser;
    // 3. Where it is.
    let here = rings[2u * number_of_band + select(0u, 1u, is_second)];
    let turn = turned_by(f32(k) / f32(of_ring));
    let outwards = here.x * turn.x + here.y * turn.y;
    let along = cross(here.x, here.y);
    var normal = select(outwards, -outwards, wall == 1u);
    if wall == 2u { normal = -along; }
    if wall == 3u { normal = along; }
    let word = (band.y & 0xffffffu) | u32(light(normal) * 255.0) << 24u;
    let radius = select(here.radius, here.hole, is_hole);
    let place = here.middle + radius * outwards;
    let scale = radius / here.radius;
    return Corner(here.middle, along, outwards, scale, here.radius, of_ring > 4u, place, normal, word, vec2f(1.0), f32(ring), bucket);
}

// The root of a half.
const HALF = 0.70710678;

// For the camera: thin tubes are wider, if they are to be. Both ways lead through the same numbers, so that both are at the same place to the bit.
fn widened(corner: Corner) -> Corner {
    var out = corner;
    let deep = max((camera.clip * vec4f(corner.middle, 1.0)).w, 0.0);
    let least = 0.5 * f32(list.thin) * deep / list.focal;
    // A ring of 4 or 8 sides is less wide than its circle, by where its corners are as seen from the eye; more are taken as 8.
    let side = unit(cross(corner.tangent, camera.eye.xyz - corner.middle));
    let along = abs(vec2f(dot(side, corner.spoke), dot(side, cross(corner.tangent, corner.spoke))));
    let wide = max(max(along.x, along.y), select(0.0, (along.x + along.y) * HALF, corner.is_finer));
    let drawn = select(corner.radius, clamp(least / wide, corner.radius, corner.radius * list.most), list.thin > 0u);
    out.place = corner.middle + corner.scale * drawn * corner.spoke;
    if list.thin == 1u { out.covers = vec2f(corner.radius, drawn * wide); }
    return out;
}

// Of what is drawn, what there is.
fn weight_of(covers: vec2f) -> f32 {
    return min(covers.x / covers.y, 1.0);
}

// What weighs less is blended. A weight of 1 is a little less once it is interpolated.
const WHOLE = 0.999;

// What is blended is seen once: its near side. In a mirror, the other way round.
fn is_behind(is_front: bool, weight: f32) -> bool {
    let rows = transpose(camera.clip);
    return weight < WHOLE && is_front == (dot(cross(rows[0].xyz, rows[1].xyz), rows[3].xyz) > 0.0);
}

fn place_of(corner: u32) -> vec3f {
    return corner_of(corner).place;
}

fn word_of(corner: u32) -> u32 {
    return corner_of(corner).word;
}

fn made_of_corner(corner: u32) -> u32 {
    return materials[corner_of(corner).word & 0xffffffu];
}

fn picture_at_corner(corner: u32, word: u32) -> vec2f {
    return vec2f(0.0);
}

// What is shown of sides: few are blue, 64 and more red.
fn of_sides(sides: u32) -> vec3f {
    var colours = array(
        vec3f(0.35, 0.55, 0.95), vec3f(0.30, 0.80, 0.85), vec3f(0.35, 0.80, 0.45), vec3f(0.98, 0.80, 0.30), vec3f(0.92, 0.42, 0.32),
    );
    return colours[min(sides, 4u)];
}

// Where it is along its band, if lines are shown there: elsewhere they aren't.
fn shown_along(corner: Corner) -> f32 {
    return select(0.5, corner.along, list.shows == 1u);
}

// At sections, a line.
fn is_line(along: f32) -> bool {
    return min(along, 1.0 - along) < fwidth(along);
}
