// The rings of bands, worked out from sections. As the library's `tubes` has it (frame.rs, between.rs). Follows bands.wgsl.

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

// Place; and in the last word the radius as a half, 14 bits of the roll, and 2 of where the tangent comes from.
@group(0) @binding(0) var<storage, read> sections: array<vec4u>;
@group(0) @binding(1) var<storage, read> tubes: array<Tube>;
@group(0) @binding(2) var<storage, read> list: Bands;
// Two a band.
@group(0) @binding(3) var<storage, read_write> rings: array<Ring>;

const CIRCLE = 0u;
const BEFORE = 1u;
const AFTER = 2u;

fn section_place(i: u32) -> vec3f {
    return bitcast<vec3f>(sections[i].xyz);
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

struct Frame {
    place: vec3f,
    tangent: vec3f,
    // Unit vectors across it: at no angle, and at a right one.
    axes: mat2x3f,
    radius: f32,
}

// The ring at a section.
fn ring_at(i: u32, tube: Tube) -> Frame {
    let section = sections[i];
    let t = tangent(i, tube);
    let axes = across(t);
    let turn = turned_by(f32(section.w >> 16u & 0x3fffu) / 16384.0);
    let turned = mat2x3f(axes * turn, axes * vec2f(-turn.y, turn.x));
    return Frame(bitcast<vec3f>(section.xyz), t, turned, unpack2x16float(section.w).x * tube.scale);
}

// A vector across one tangent, turned with it to another one the shortest way.
fn carried(v: vec3f, a: vec3f, b: vec3f) -> vec3f {
    let half = 1.0 + dot(a, b);
    if half > 0.0 { return v - (a + b) * (dot(v, b) / half); }
    return v;
}

// The ring at so many 64ths of the way from a section to the next: along a cubic with the tangents of both, as long as an arc's.
fn ring_between(i: u32, step: u32, tube: Tube) -> Frame {
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
    return Frame(mix(first, last, share), t, mat2x3f(x, cross(t, x)), mix(begin.radius, close.radius, share));
}

@compute @workgroup_size(64)
fn ring(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let number = id.x + 64u * groups.x * id.y;
    if number >= 2u * list.first[2][3] { return; }
    let band = list.bands[number / 2u];
    let tube = tubes[band.z & 0x3fffffffu];
    let at = select(band.x, band.y, number % 2u == 1u);
    var here: Frame;
    if (at & 63u) == 0u { here = ring_at(at >> 6u, tube); } else { here = ring_between(at >> 6u, at & 63u, tube); }
    rings[number] = Ring(tube.origin + here.place, here.radius, here.axes[0], tube.inner * here.radius, here.axes[1]);
}
