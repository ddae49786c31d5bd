// Item buffers of cubes, drawn by compute shaders, after `points.wgsl`. `triangles_of_views` takes one triangle for all faces of a view, draws it
// where it is small, and queues blocks of pixels where it is large; `queued_blocks` draws those. Both run once for each stage.

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
    // NEAREST, IDS or HITS.
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

// For each pixel: the largest 1/w, as bits.
const NEAREST: u32 = 0u;
// The least triangle that has it.
const IDS: u32 = 1u;
// What is see-through and has no less is listed.
const HITS: u32 = 2u;

// Nothing nearer than this is drawn, metres along a face's axis: `NEAR` of `gpu.rs`.
const NEAR: f32 = 1e-6;
// A pixel this near to an edge, in the edge's length times its distance, is on both sides of it. Rounding takes half of that: with less, two
// triangles with an edge in common may both miss a pixel; with more, edges move by more than `EDGE` of `gpu.rs` on large faces.
const SLACK: f32 = 2.4e-7;
// Projected corners are rounded by less than this, pixels: with less, a box may leave a pixel out; with more, boxes grow for nothing.
const PAD: f32 = 0.01;
// Boxes of at most so many pixels are drawn at once. With more, neighbours wait; with less, the queue grows.
const SMALL: i32 = 32;
// Pixels along the edge of a queued block, four times what a workgroup draws at a time.
const BLOCK: i32 = 32;

// No queue holds as many. With as many again a count might begin at 0 anew.
const PLENTY: u32 = 0x10000000u;

// Three corners and the triangle's own index.
@group(0) @binding(1) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(2) var<storage, read> views: array<View>;
@group(0) @binding(3) var<uniform> stage: Stage;
// Row by row, face by face.
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

// A triangle as an eye sees it, on the axes of its cube.
struct Seen {
    corners: array<vec3f, 3>,
    // Normals of the planes through the eye and each edge: a direction within the triangle is on the same side of all three.
    edges: array<vec3f, 3>,
    slack: vec3f,
    // 1/w in a direction of length 1 along w is this times the direction.
    plane: vec3f,
    index: u32,
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

fn see(place: u32, view: u32) -> Seen {
    let own = triangles[place];
    let eye = Point(views[view].eye_high, views[view].eye_low);
    let points = array(point(own.x), point(own.y), point(own.z));
    let a = apart(points[0], eye, view);
    let b = apart(points[1], eye, view);
    let c = apart(points[2], eye, view);
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
    seen.corners = array(a, b, c);
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
    for (var i = 0; i < 3; i++) {
        on.corners[i] = turned(seen.corners[i], face);
        on.edges[i] = turned(seen.edges[i], face);
    }
    on.slack = seen.slack;
    on.plane = turned(seen.plane, face);
    on.index = seen.index;
    return on;
}

fn depths(on: Seen) -> vec3f {
    return vec3f(on.corners[0].z, on.corners[1].z, on.corners[2].z);
}

// On which side of each edge's plane a direction is.
fn sides(on: Seen, direction: vec3f) -> vec3f {
    return vec3f(dot(on.edges[0], direction), dot(on.edges[1], direction), dot(on.edges[2], direction));
}

// Which columns and rows of a face a triangle may be on, first and last; none where the last is before the first.
fn extent(on: Seen) -> vec4i {
    let none = vec4i(0, 0, -1, -1);
    let x = vec3f(on.corners[0].x, on.corners[1].x, on.corners[2].x);
    let y = vec3f(on.corners[0].y, on.corners[1].y, on.corners[2].y);
    let w = depths(on);
    let is_off = max(w.x, max(w.y, w.z)) < NEAR || all(x > w) || all(-x > w) || all(y > w) || all(-y > w);
    if is_off {
        return none;
    }
    let last = i32(stage.size) - 1;
    if min(w.x, min(w.y, w.z)) < NEAR {
        return vec4i(0, 0, last, last);
    }
    // Pixels' middles are at whole numbers.
    let half = f32(stage.size) * 0.5;
    let columns = clamp((x / w + 1.0) * half - 0.5, vec3f(-2.0), vec3f(2.0 * half + 1.0));
    let rows = clamp((y / w + 1.0) * half - 0.5, vec3f(-2.0), vec3f(2.0 * half + 1.0));
    let least = vec2f(min(columns.x, min(columns.y, columns.z)), min(rows.x, min(rows.y, rows.z)));
    let most = vec2f(max(columns.x, max(columns.y, columns.z)), max(rows.x, max(rows.y, rows.z)));
    let start = max(vec2i(ceil(least - PAD)), vec2i(0));
    let end = min(vec2i(floor(most + PAD)), vec2i(last));
    return vec4i(start, end);
}

// Draws a pixel, if the triangle is there.
fn draw(on: Seen, layer: u32, at: vec2i) {
    let size = f32(stage.size);
    let direction = vec3f((2.0 * vec2f(at) + 1.0 - size) / size, 1.0);
    let side = sides(on, direction);
    let is_left = all(side >= -on.slack) && any(side > on.slack);
    let is_right = all(side <= on.slack) && any(side < -on.slack);
    // Less than 0 where the triangle is behind the eye, in the opposite direction.
    let value = dot(on.plane, direction);
    if !(is_left || is_right) || !(value > 0.0 && value <= 1.0 / NEAR) {
        return;
    }
    // No nearer and no farther than its corners.
    let w = depths(on);
    let most = max(w.x, max(w.y, w.z));
    let least = min(w.x, min(w.y, w.z));
    let bits = bitcast<u32>(clamp(value, 1.0 / max(most, NEAR), 1.0 / max(least, NEAR)));
    let pixel = (layer * stage.size + u32(at.y)) * stage.size + u32(at.x);
    let before = atomicLoad(&nearest[pixel]);
    if stage.kind == NEAREST {
        if bits > before {
            atomicMax(&nearest[pixel], bits);
        }
    } else if stage.kind == IDS {
        if bits == before {
            atomicMax(&ids[pixel], ~on.index);
        }
    } else if bits >= before {
        let place = atomicAdd(&hits.count, 1u);
        if place < stage.hits {
            hits.list[3u * place] = pixel;
            hits.list[3u * place + 1u] = on.index;
            hits.list[3u * place + 2u] = bits;
        }
    }
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
    let seen = see(place, view);
    if is_thin(seen) {
        return;
    }
    let start = max(view * 6u, stage.first_face);
    let end = min(view * 6u + 6u, stage.first_face + stage.faces);
    for (var of_views = start; of_views < end; of_views++) {
        let face = of_views % 6u;
        let layer = of_views - stage.first_face;
        let on = on_face(seen, face);
        let box = extent(on);
        let size = box.zw - box.xy + 1;
        if size.x <= 0 || size.y <= 0 {
            continue;
        }
        if size.x * size.y <= SMALL {
            for (var y = box.y; y <= box.w; y++) {
                for (var x = box.x; x <= box.z; x++) {
                    draw(on, layer, vec2i(x, y));
                }
            }
        } else if stage.kind != IDS && atomicLoad(&queue.counts[stage.kind / HITS]) < PLENTY {
            let first = vec2u(box.xy / BLOCK);
            let count = vec2u(box.zw / BLOCK) - first + 1u;
            let blocks = count.x * count.y;
            let queued = atomicAdd(&queue.counts[stage.kind / HITS], blocks);
            for (var i = 0u; i < blocks && queued + i < stage.queued; i++) {
                let at = first + vec2u(i % count.x, i / count.x);
                queue.blocks[queued + i] = vec2u(place, layer << 14u | at.y << 7u | at.x);
            }
        }
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
        let block = queue.blocks[i];
        let layer = block.y >> 14u;
        let of_views = stage.first_face + layer;
        let on = on_face(see(block.x, of_views / 6u), of_views % 6u);
        let corner = vec2i(i32(block.y & 127u), i32(block.y >> 7u & 127u)) * BLOCK;
        if is_off_block(on, corner) {
            continue;
        }
        let box = extent(on);
        let start = max(box.xy, corner);
        let last = min(box.zw, corner + BLOCK - 1);
        for (var y = start.y + i32(local.y); y <= last.y; y += 8) {
            for (var x = start.x + i32(local.x); x <= last.x; x += 8) {
                draw(on, layer, vec2i(x, y));
            }
        }
    }
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
