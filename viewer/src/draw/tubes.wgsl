// Tubes, in the place of geometry.wgsl: corners are worked out from sections by their number. As the library's `tubes` has it (frame.rs,
// between.rs, drawn.rs).

struct Tube {
    origin: vec3f,
    // Radius of the hole over the outer radius.
    inner: f32,
    // Its sections: the first, and past the last.
    first: u32,
    end: u32,
    closed: u32,
    // Radii are multiplied by it.
    scale: f32,
}

struct Bands {
    // The first corner of those with 8, 16 ... 4096 sides, ten in all; corners of 4 sides come before.
    first: array<vec4u, 3>,
    // What thin tubes are drawn as: 0 as they are; 1 a pixel wide, with the weight of what they are; 2 two pixels wide.
    thin: u32,
    // 1: sides as colours, and lines at sections.
    shows: u32,
    // Pixels of a metre at a distance of one.
    focal: f32,
    // How much wider than they are thin tubes may be.
    most: f32,
    // Where both rings are: a section, and 64ths of the way to the next (6 bits). The tube (30 bits) and the wall (2). The object (24 bits), and
    // the sides of the rings (4 each).
    bands: array<vec4u>,
}

// Place; and in the last word the radius as a half, 14 bits of the roll, and 2 of where the tangent comes from.
@group(2) @binding(0) var<storage, read> sections: array<vec4u>;
@group(2) @binding(1) var<storage, read> tubes: array<Tube>;
@group(2) @binding(2) var<storage, read> list: Bands;
// By object: its material.
@group(2) @binding(3) var<storage, read> materials: array<u32>;

const TURN = 6.28318530717958647692;
const CIRCLE = 0u;
const BEFORE = 1u;
const AFTER = 2u;

fn section_place(i: u32) -> vec3f {
    return bitcast<vec3f>(sections[i].xyz);
}

fn unit_or(v: vec3f, other: vec3f) -> vec3f {
    let size = length(v);
    return select(other, v / size, size > 0.0);
}

fn unit(v: vec3f) -> vec3f {
    return unit_or(v, vec3f(1.0, 0.0, 0.0));
}

// The tangent of a section between two others.
fn tangent_between(before: u32, i: u32, after: u32) -> vec3f {
    let kind = sections[i].w >> 30u;
    let u = section_place(i) - section_place(before);
    let v = section_place(after) - section_place(i);
    if kind == BEFORE { return unit(u); }
    if kind == AFTER { return unit(v); }
    let uu = dot(u, u);
    let vv = dot(v, v);
    if uu == 0.0 || vv == 0.0 { return unit(u + v); }
    return unit(u * (vv / (uu + vv)) + v * (uu / (uu + vv)));
}

// The tangent at an open end, whose chord leads along a circle: the mirror image of that of the section beside it.
fn tangent_at_end(chord: vec3f, beside: u32, tube: Tube) -> vec3f {
    let along = unit(chord);
    if beside == tube.first || beside + 1u == tube.end { return along; }
    let other = tangent_between(beside - 1u, beside, beside + 1u);
    return unit(2.0 * dot(along, other) * along - other);
}

fn tangent(i: u32, tube: Tube) -> vec3f {
    let is_first = i == tube.first;
    let is_last = i + 1u == tube.end;
    let before = select(i - 1u, tube.end - 1u, is_first);
    let after = select(i + 1u, tube.first, is_last);
    if tube.closed == 1u || !(is_first || is_last) { return tangent_between(before, i, after); }
    let kind = sections[i].w >> 30u;
    let beside = select(before, after, is_first);
    let chord = (section_place(beside) - section_place(i)) * select(-1.0, 1.0, is_first);
    if kind == select(BEFORE, AFTER, is_first) { return unit(chord); }
    return tangent_at_end(chord, beside, tube);
}

const DOWN = -0.9123;

fn across(t: vec3f) -> mat2x3f {
    let sign = select(1.0, -1.0, t.z < DOWN);
    let a = -1.0 / (sign + t.z);
    let b = t.x * t.y * a;
    return mat2x3f(vec3f(1.0 + sign * t.x * t.x * a, sign * b, -sign * t.x), vec3f(b, sign + t.y * t.y * a, -t.y));
}

struct Ring {
    place: vec3f,
    tangent: vec3f,
    // Unit vectors across it: at no angle, and at a right one.
    axes: mat2x3f,
    radius: f32,
}

// Cosine and sine of a share of a turn, to single precision: drivers may be off by 2^-11, with which rings are a thousandth too wide.
fn turned_by(share: f32) -> vec2f {
    let quarter = round(4.0 * share);
    let r = TURN * (share - 0.25 * quarter);
    let rr = r * r;
    let s = r * (1.0 - rr / 6.0 * (1.0 - rr / 20.0 * (1.0 - rr / 42.0 * (1.0 - rr / 72.0))));
    let c = 1.0 - rr / 2.0 * (1.0 - rr / 12.0 * (1.0 - rr / 30.0 * (1.0 - rr / 56.0)));
    let odd = (i32(quarter) & 1) == 1;
    let turn = select(vec2f(c, s), vec2f(-s, c), odd);
    return select(turn, -turn, (i32(quarter) & 2) == 2);
}

// The ring at a section.
fn ring_at(i: u32, tube: Tube) -> Ring {
    let section = sections[i];
    let t = tangent(i, tube);
    let axes = across(t);
    let turn = turned_by(f32(section.w >> 16u & 0x3fffu) / 16384.0);
    let turned = mat2x3f(axes * turn, axes * vec2f(-turn.y, turn.x));
    return Ring(bitcast<vec3f>(section.xyz), t, turned, unpack2x16float(section.w).x * tube.scale);
}

// A vector across one tangent, turned with it to another one the shortest way.
fn carried(v: vec3f, a: vec3f, b: vec3f) -> vec3f {
    let half = 1.0 + dot(a, b);
    if half > 0.0 { return v - (a + b) * (dot(v, b) / half); }
    return v;
}

// The ring at so many 64ths of the way from a section to the next: along a cubic with the tangents of both, as long as an arc's.
fn ring_between(i: u32, step: u32, tube: Tube) -> Ring {
    let begin = ring_at(i, tube);
    let close = ring_at(select(i + 1u, tube.first, i + 1u == tube.end), tube);
    let chord = close.place - begin.place;
    let size = length(chord);
    let along = unit_or(chord, begin.tangent);
    let b = begin.place + begin.tangent * (size * 2.0 / 3.0 / (1.0 + max(dot(begin.tangent, along), 0.0)));
    let c = close.place - close.tangent * (size * 2.0 / 3.0 / (1.0 + max(dot(close.tangent, along), 0.0)));
    let share = f32(step) / 64.0;
    let bc = mix(b, c, share);
    let first = mix(mix(begin.place, b, share), bc, share);
    let last = mix(bc, mix(c, close.place, share), share);
    let t = unit_or(last - first, begin.tangent);
    let a = carried(begin.axes[0], begin.tangent, t);
    let x = unit_or(mix(a, carried(close.axes[0], close.tangent, t), share), a);
    return Ring(mix(first, last, share), t, mat2x3f(x, cross(t, x)), mix(begin.radius, close.radius, share));
}

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
    // Of what is drawn, what there is.
    weight: f32,
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
    // 1. Which band, which side of it, which corner of that.
    var sides = 0u;
    var start = 0u;
    var first = 0u;
    for (var k = 0u; k < 10u && number >= list.first[k / 4u][k % 4u]; k++) {
        let next = list.first[k / 4u][k % 4u];
        first += (next - start) / (24u << k);
        start = next;
        sides = k + 1u;
    }
    let finer = 4u << sides;
    let band = list.bands[first + (number - start) / (6u * finer)];
    let side = (number - start) / 6u % finer;
    let corner = number % 6u;
    let ring = select(0u, 1u, corner == 2u || corner == 3u || corner == 5u);
    let next = select(0u, 1u, corner == 1u || corner == 4u || corner == 5u);
    // 2. Which ring. Walls: outer, inner, at the first ring, at the last.
    let wall = band.z >> 30u;
    let tube = tubes[band.z & 0x3fffffffu];
    let is_second = select(ring == 1u, select(wall == 3u, ring == 0u, wall == 1u), wall > 0u);
    let is_hole = wall == 1u || (wall == 2u && ring == 0u) || (wall == 3u && ring == 1u);
    let at = select(band.x, band.y, is_second);
    let of_ring = 4u << (band.w >> (24u + 4u * ring) & 15u);
    let k = (side + next) % finer * of_ring / finer;
    // 3. Where it is.
    var here: Ring;
    if (at & 63u) == 0u { here = ring_at(at >> 6u, tube); } else { here = ring_between(at >> 6u, at & 63u, tube); }
    let outwards = here.axes * turned_by(f32(k) / f32(of_ring));
    let middle = tube.origin + here.place;
    let radius = here.radius;
    let t = here.tangent;
    let scale = select(1.0, tube.inner, is_hole);
    var normal = select(outwards, -outwards, wall == 1u);
    if wall == 2u { normal = -t; }
    if wall == 3u { normal = t; }
    let word = (band.w & 0xffffffu) | u32(light(normal) * 255.0) << 24u;
    let place = middle + scale * radius * outwards;
    return Corner(middle, t, outwards, scale, radius, of_ring > 4u, place, normal, word, 1.0, f32(ring), sides);
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
    if list.thin == 1u { out.weight = min(corner.radius / (drawn * wide), 1.0); }
    return out;
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
