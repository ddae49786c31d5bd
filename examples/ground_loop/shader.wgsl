// Patches of ground, an instance each, coloured by level. Corners are taken by their number: cell, triangle, sample.

struct Land {
    clip: mat4x4f,
    // Metres between columns and rows; the raster's last ones.
    spacing: vec2f,
    last: vec2u,
    // Metres of a number; samples of a tile along a side; bytes of a number; words of a slot.
    step: f32,
    side: u32,
    wide: u32,
    words: u32,
}

@group(0) @binding(0) var<uniform> land: Land;
@group(0) @binding(1) var<storage, read> heights: array<u32>;
// Slot, column and row of the tile in its level; the level, and in the second byte the sides with coarser neighbours.
@group(0) @binding(2) var<storage, read> patches: array<vec4u>;

struct Corner {
    @invariant @builtin(position) at: vec4f,
    @location(0) place: vec3f,
    @location(1) @interpolate(flat) level: u32,
}

// As `terrain::snapped`: on a side with a coarser neighbour, a sample that the neighbour lacks moves onto one that it has.
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

@vertex
fn corner(@builtin(vertex_index) index: u32, @builtin(instance_index) instance: u32) -> Corner {
    let tile = patches[instance];
    let cells = land.side - 1u;
    let cell = vec2u(index / 6u % cells, index / 6u / cells);
    // As `terrain::drawn`: all diagonals from the north-east to the south-west.
    var corners = array(vec2u(0u, 0u), vec2u(0u, 1u), vec2u(1u, 0u), vec2u(1u, 0u), vec2u(0u, 1u), vec2u(1u, 1u));
    var out: Corner;
    var is_void = false;
    for (var k = 0u; k < 3u; k++) {
        let s = snapped(cell + corners[index / 3u % 2u * 3u + k], tile.w >> 8u);
        let number = number(tile.x, s);
        is_void |= number >= select(0xffffu, 0xffffffu, land.wide == 4u);
        if k == index % 3u {
            let at = min((tile.yz * cells + s) << vec2u(tile.w & 0xffu), land.last);
            let plan = (vec2f(at) - 0.5 * vec2f(land.last)) * land.spacing;
            out.place = vec3f(plan.x, f32(number) * land.step, plan.y);
        }
    }
    out.level = tile.w & 0xffu;
    // A triangle with a void is drawn nowhere.
    out.at = select(land.clip * vec4f(out.place, 1.0), vec4f(0.0, 0.0, 2.0, 1.0), is_void);
    return out;
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4f {
    let normal = normalize(cross(dpdx(in.place), dpdy(in.place)));
    let light = 0.35 + 0.65 * abs(dot(normal, vec3f(0.36, 0.80, 0.48)));
    let coarse = f32(min(in.level, 6u)) / 6.0;
    return vec4f(mix(vec3f(0.45, 0.75, 0.40), vec3f(0.90, 0.45, 0.30), coarse) * light, 1.0);
}
