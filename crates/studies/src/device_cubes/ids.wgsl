// Item buffers of cubes, drawn by compute shaders, after `points.wgsl`, in stages. `triangles_of_views` takes one triangle for all faces of a view; it
// draws what is small and queues blocks of pixels of what is large, which `queued_blocks` draws. `tiles` notes what is hidden behind large ones.

struct View {
    // The eye in two parts, metres.
    eye_high: vec3f,
    // Holds 0, which no compiler can know.
    zero: u32,
    eye_low: vec3f,
    // The cube's axes.
    x: vec3f,
    y: vec3f,
    z: vec3f,
}

struct Stage {
    // LARGE, SMALL, IDS or HITS.
    kind: u32,
    // The triangles that it draws.
    first: u32,
    end: u32,
    // Pixels along a face's edge.
    size: u32,
    // Faces drawn together, and which face of its cube the first is of: six a view, but the first view may begin in its middle.
    faces: u32,
    first_face: u32,
    // Most blocks that the queue holds, and most hits that the list holds.
    queued: u32,
    hits: u32,
}

// The largest 1/w of each pixel, of large triangles, which hide most, and then of small ones.
const LARGE: u32 = 0u;
const SMALL: u32 = 1u;
// The least triangle that has it.
const IDS: u32 = 2u;
// What is see-through and has no less is listed.
const HITS: u32 = 3u;

// Nothing nearer than this is drawn, metres along a face's axis: `NEAR` of `gpu.rs`.
const NEAR: f32 = 1e-6;
// A pixel this near to an edge, in the edge's length times its distance, is on both sides of it. Rounding takes half of that: with less, two
// triangles with an edge in common may both miss a pixel; with more, edges move by more than `EDGE` of `gpu.rs` on large faces.
const SLACK: f32 = 2.4e-7;
// Projected corners are rounded by less than this, pixels: with less, a box may leave a pixel out; with more, boxes grow for nothing.
const PAD: f32 = 0.01;
// Boxes of more pixels are of large triangles. With more, neighbours wait for one that draws; with less, the queue grows.
const FEW: i32 = 64;
// Pixels along the edge of a queued block, and of a tile.
const BLOCK: i32 = 64;
const TILE: i32 = 8;

// No queue holds as many. With as many again a count might begin at 0 anew.
const PLENTY: u32 = 0x10000000u;

// Three corners and the triangle's own index.
@group(0) @binding(1) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<uniform> stage: Stage;
// The largest 1/w of each pixel, as bits, row by row, face by face; then the least of each tile's, likewise.
@group(0) @binding(4) var<storage, read_write> nearest: array<atomic<u32>>;
// The complement of the triangle's index; 0 where there is none.
@group(0) @binding(5) var<storage, read_write> ids: array<atomic<u32>>;

struct Queue {
    // How many there are of opaque and of see-through triangles, even if they don't fit.
    counts: array<atomic<u32>, 2>,
    // The triangle's place; face, row and column of the block.
    blocks: array<vec2u>,
}
@group(0) @binding(6) var<storage, read_write> queue: Queue;

struct Hits {
    // How many there are, even if they don't fit.
    count: atomic<u32>,
    // Pixel, triangle, depth.
    list: array<u32>,
}
@group(0) @binding(7) var<storage, read_write> hits: Hits;
// A bit for each opaque triangle, view by view: whether it was the nearest somewhere, when it was drawn. No other can be in the end.
@group(0) @binding(8) var<storage, read_write> marks: array<atomic<u32>>;

// A triangle as an eye sees it, on the axes of its cube.
struct Seen {
    // Normals of the planes through the eye and each edge: a direction within the triangle is on the same side of all three.
    edges: array<vec3f, 3>,
    slack: vec3f,
    // 1/w in a direction of length 1 along w is this times the direction.
    plane: vec3f,
    index: u32,
}

// Where a triangle may be on a face: first and last column and row, none if the last is before the first; and bounds of 1/w, least and greatest.
struct Extent {
    first: vec2i,
    last: vec2i,
    range: vec2f,
}

// The difference of two points on the cube's axes.
fn apart(end: Point, start: Point, view: u32) -> vec3f {
    let v = difference(end, start, views[view].zero);
    return vec3f(dot(views[view].x, v), dot(views[view].y, v), dot(views[view].z, v));
}

// An edge's plane, the same to the bit whichever triangle it is of: from the corner of the lesser index.
fn edge(start: vec3f, end: vec3f, along: vec3f, is_turned: bool) -> vec3f {
    let normal = cross(select(start, end, is_turned), select(along, -along, is_turned));
    return select(normal, -normal, is_turned);
}

fn corners_of(place: u32, view: u32) -> array<vec3f, 3> {
    let own = triangles[place];
    let eye = Point(views[view].eye_high, views[view].eye_low);
    return array(apart(point(own.x), eye, view), apart(point(own.y), eye, view), apart(point(own.z), eye, view));
}

fn see(place: u32, view: u32, corners: array<vec3f, 3>) -> Seen {
    let own = triangles[place];
    let points = array(point(own.x), point(own.y), point(own.z));
    let a = corners[0];
    let b = corners[1];
    let c = corners[2];
    let ab = apart(points[1], points[0], view);
    let bc = apart(points[2], points[1], view);
    let ca = apart(points[0], points[2], view);
    let normal = cross(ab, bc);
    // From the nearest corner: what it is rounded by is least.
    var anchor = a;
    if dot(b, b) < dot(anchor, anchor) {
        anchor = b;
    }
    if dot(c, c) < dot(anchor, anchor) {
        anchor = c;
    }
    var seen: Seen;
    seen.edges = array(edge(a, b, ab, own.x > own.y), edge(b, c, bc, own.y > own.z), edge(c, a, ca, own.z > own.x));
    seen.slack = SLACK * vec3f(length(a) * length(ab), length(b) * length(bc), length(c) * length(ca));
    seen.plane = normal / dot(normal, anchor);
    seen.index = own.w;
    return seen;
}

// Seen edge-on, or not a triangle.
fn is_thin(seen: Seen) -> bool {
    return !(max(abs(seen.plane.x), max(abs(seen.plane.y), abs(seen.plane.z))) < 1e30);
}

// On a face's axes: along columns, along rows, into it.
fn turned(v: vec3f, face: u32) -> vec3f {
    let cyclic = select(select(v, v.zxy, face < 4u), v.yzx, face < 2u);
    return vec3f(cyclic.xy, select(cyclic.z, -cyclic.z, face % 2u == 1u));
}

fn on_face(seen: Seen, face: u32) -> Seen {
    var on: Seen;
    on.edges = array(turned(seen.edges[0], face), turned(seen.edges[1], face), turned(seen.edges[2], face));
    on.slack = seen.slack;
    on.plane = turned(seen.plane, face);
    on.index = seen.index;
    return on;
}

// On which side of each edge's plane a direction is.
fn sides(on: Seen, direction: vec3f) -> vec3f {
    return vec3f(dot(on.edges[0], direction), dot(on.edges[1], direction), dot(on.edges[2], direction));
}

fn extent(corners: array<vec3f, 3>, face: u32) -> Extent {
    let a = turned(corners[0], face);
    let b = turned(corners[1], face);
    let c = turned(corners[2], face);
    let x = vec3f(a.x, b.x, c.x);
    let y = vec3f(a.y, b.y, c.y);
    let w = vec3f(a.z, b.z, c.z);
    let most = max(w.x, max(w.y, w.z));
    let least = min(w.x, min(w.y, w.z));
    let range = 1.0 / max(vec2f(most, least), vec2f(NEAR));
    if most < NEAR || all(x > w) || all(-x > w) || all(y > w) || all(-y > w) {
        return Extent(vec2i(0), vec2i(-1), range);
    }
    let last = i32(stage.size) - 1;
    if least < NEAR {
        return Extent(vec2i(0), vec2i(last), range);
    }
    // Pixels' middles are at whole numbers.
    let half = f32(stage.size) * 0.5;
    let columns = clamp((x / w + 1.0) * half - 0.5, vec3f(-2.0), vec3f(2.0 * half + 1.0));
    let rows = clamp((y / w + 1.0) * half - 0.5, vec3f(-2.0), vec3f(2.0 * half + 1.0));
    let start = vec2f(min(columns.x, min(columns.y, columns.z)), min(rows.x, min(rows.y, rows.z)));
    let end = vec2f(max(columns.x, max(columns.y, columns.z)), max(rows.x, max(rows.y, rows.z)));
    return Extent(max(vec2i(ceil(start - PAD)), vec2i(0)), min(vec2i(floor(end + PAD)), vec2i(last)), range);
}

// Whether all tiles that a small triangle may be on are nearer than it.
fn is_hidden(at: Extent, layer: u32) -> bool {
    let across = (i32(stage.size) + TILE - 1) / TILE;
    let base = i32(stage.faces * stage.size * stage.size) + i32(layer) * across * across;
    let bits = bitcast<u32>(at.range.y);
    for (var y = at.first.y / TILE; y <= at.last.y / TILE; y++) {
        for (var x = at.first.x / TILE; x <= at.last.x / TILE; x++) {
            if bits >= atomicLoad(&nearest[base + y * across + x]) {
                return false;
            }
        }
    }
    return true;
}

// Draws a pixel, if the triangle is there; whether it is the nearest so far.
fn draw(on: Seen, range: vec2f, layer: u32, at: vec2i) -> bool {
    let pixel = (layer * stage.size + u32(at.y)) * stage.size + u32(at.x);
    let before = atomicLoad(&nearest[pixel]);
    if bitcast<u32>(range.y) < before {
        return false;
    }
    let size = f32(stage.size);
    let direction = vec3f((2.0 * vec2f(at) + 1.0 - size) / size, 1.0);
    let side = sides(on, direction);
    let is_left = all(side >= -on.slack) && any(side > on.slack);
    let is_right = all(side <= on.slack) && any(side < -on.slack);
    // Less than 0 where the triangle is behind the eye, in the opposite direction.
    let value = dot(on.plane, direction);
    if !(is_left || is_right) || !(value > 0.0 && value <= 1.0 / NEAR) {
        return false;
    }
    // No nearer and no farther than its corners.
    let bits = bitcast<u32>(clamp(value, range.x, range.y));
    if stage.kind == IDS {
        if bits == before {
            atomicMax(&ids[pixel], ~on.index);
        }
    } else if stage.kind == HITS {
        if bits >= before {
            let place = atomicAdd(&hits.count, 1u);
            if place < stage.hits {
                hits.list[3u * place] = pixel;
                hits.list[3u * place + 1u] = on.index;
                hits.list[3u * place + 2u] = bits;
            }
        }
    } else if bits > before {
        return bits >= atomicMax(&nearest[pixel], bits);
    }
    return bits >= before;
}

fn mark_of(place: u32, view: u32) -> u32 {
    return view * ((stage.end + 31u) / 32u) + place / 32u;
}

fn is_marked(place: u32, view: u32) -> bool {
    return (atomicLoad(&marks[mark_of(place, view)]) >> (place % 32u) & 1u) == 1u;
}

@compute @workgroup_size(64)
fn triangles_of_views(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let place = stage.first + (group.y * groups.x + group.x) * 64u + index;
    let view = group.z;
    if place >= stage.end {
        return;
    }
    if stage.kind == IDS && !is_marked(place, view) {
        return;
    }
    let corners = corners_of(place, view);
    let start = max(view * 6u, stage.first_face);
    let end = min(view * 6u + 6u, stage.first_face + stage.faces);
    var seen: Seen;
    var is_seen = false;
    var is_nearest = false;
    for (var of_views = start; of_views < end; of_views++) {
        let face = of_views % 6u;
        let layer = of_views - stage.first_face;
        let at = extent(corners, face);
        let size = at.last - at.first + 1;
        if size.x <= 0 || size.y <= 0 {
            continue;
        }
        if size.x * size.y > FEW {
            if stage.kind == LARGE || stage.kind == HITS {
                queue_blocks(place, layer, at);
            }
            continue;
        }
        if stage.kind == LARGE || (stage.kind != IDS && is_hidden(at, layer)) {
            continue;
        }
        if !is_seen {
            seen = see(place, view, corners);
            is_seen = true;
        }
        if is_thin(seen) {
            return;
        }
        let on = on_face(seen, face);
        for (var y = at.first.y; y <= at.last.y; y++) {
            for (var x = at.first.x; x <= at.last.x; x++) {
                let drawn = draw(on, at.range, layer, vec2i(x, y));
                is_nearest = is_nearest || drawn;
            }
        }
    }
    if is_nearest && stage.kind == SMALL {
        atomicOr(&marks[mark_of(place, view)], 1u << (place % 32u));
    }
}

fn queue_blocks(place: u32, layer: u32, at: Extent) {
    let first = vec2u(at.first / BLOCK);
    let count = vec2u(at.last / BLOCK) - first + 1u;
    let blocks = count.x * count.y;
    let list = stage.kind / HITS;
    if atomicLoad(&queue.counts[list]) >= PLENTY {
        return;
    }
    let queued = atomicAdd(&queue.counts[list], blocks);
    for (var i = 0u; i < blocks && queued + i < stage.queued; i++) {
        let block = first + vec2u(i % count.x, i / count.x);
        queue.blocks[queued + i] = vec2u(place, layer << 14u | block.y << 7u | block.x);
    }
}

// Of each block, eight by eight pixels at a time.
@compute @workgroup_size(8, 8)
fn queued_blocks(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let end = min(atomicLoad(&queue.counts[stage.kind / HITS]), stage.queued);
    for (var i = group.x; i < end; i += groups.x) {
        let place = queue.blocks[i].x;
        let block = queue.blocks[i].y;
        let layer = block >> 14u;
        let face = (stage.first_face + layer) % 6u;
        let view = (stage.first_face + layer) / 6u;
        if stage.kind == IDS && !is_marked(place, view) {
            continue;
        }
        let corners = corners_of(place, view);
        let seen = see(place, view, corners);
        let on = on_face(seen, face);
        let corner = vec2i(i32(block & 127u), i32(block >> 7u & 127u)) * BLOCK;
        if is_thin(seen) || is_off_block(on, corner) {
            continue;
        }
        let at = extent(corners, face);
        let start = max(at.first, corner);
        let last = min(at.last, corner + BLOCK - 1);
        var is_nearest = false;
        for (var y = start.y + i32(local.y); y <= last.y; y += 8) {
            for (var x = start.x + i32(local.x); x <= last.x; x += 8) {
                let drawn = draw(on, at.range, layer, vec2i(x, y));
                is_nearest = is_nearest || drawn;
            }
        }
        if is_nearest && stage.kind == LARGE {
            atomicOr(&marks[mark_of(place, view)], 1u << (place % 32u));
        }
    }
}

// The least of each tile's pixels, 0 where one shows nothing.
@compute @workgroup_size(8, 8)
fn tiles(@builtin(global_invocation_id) tile: vec3u) {
    let across = (stage.size + u32(TILE) - 1u) / u32(TILE);
    if tile.x >= across || tile.y >= across {
        return;
    }
    var least = 0xffffffffu;
    let end = min((tile.xy + 1u) * u32(TILE), vec2u(stage.size));
    for (var y = tile.y * u32(TILE); y < end.y; y++) {
        for (var x = tile.x * u32(TILE); x < end.x; x++) {
            least = min(least, atomicLoad(&nearest[(tile.z * stage.size + y) * stage.size + x]));
        }
    }
    let base = stage.faces * stage.size * stage.size + tile.z * across * across;
    atomicStore(&nearest[base + tile.y * across + tile.x], least);
}

// Whether no pixel of a block is within the triangle: all of it is on one side of one edge and on the other side of another.
fn is_off_block(on: Seen, corner: vec2i) -> bool {
    let size = f32(stage.size);
    let middle = sides(on, vec3f((2.0 * vec2f(corner) + f32(BLOCK) - size) / size, 1.0));
    let reach = f32(BLOCK) / size;
    let across = abs(sides(on, vec3f(reach, 0.0, 0.0))) + abs(sides(on, vec3f(0.0, reach, 0.0)));
    let slack = across + 2.0 * on.slack;
    return any(middle > slack) && any(middle < -slack);
}
