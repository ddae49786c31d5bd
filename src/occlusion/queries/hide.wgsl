// Occlusion queries, appended to `points.wgsl`. `corner` and `hides` draw occluders: never nearer than they are, and never on a pixel that
// they do not cover. `rectangle` and `asks` draw queried boxes: on every pixel where they may be visible, and never farther than they are.
// Depth is near/w: it decreases with distance.

struct Camera {
    // The eye in two parts, metres.
    eye_high: vec3f,
    // Distance of the near plane along `w`, metres.
    near: f32,
    eye_low: vec3f,
    // Always 0, unknown to the compiler.
    zero: u32,
    // Rows of projection times rotation.
    x: vec3f,
    // Positions have the rounding error of points this much farther away, metres.
    grain: f32,
    y: vec3f,
    // Upper bound of a direction's length, and of the sum of the lengths of its three terms.
    reach: f32,
    w: vec3f,
    // Pixels.
    width: f32,
    // The direction through the picture's centre, 1 m along the view direction; and its changes per half pixel.
    middle: vec3f,
    height: f32,
    across: vec3f,
    up: vec3f,
}

struct Triangle {
    corners: vec3u,
    // For each edge (from the first corner on), the third corner of the adjacent triangle of the same object.
    partners: vec3u,
}

struct Asked {
    // The pixels where the box may be visible.
    first: vec2f,
    end: vec2f,
    // The planes where rays enter and leave the box: near/w at the first pixel, and its steps in x and in y; the fourth component is above
    // 0 for planes towards the eye, which come first.
    planes: array<vec4f, 6>,
}

@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(2) var<uniform> camera: Camera;
@group(0) @binding(3) var<storage, read> boxes: array<Asked>;

// Above the error of sums and products, relative to the product of the factors' lengths: 32 roundings, of which at most 24 add up. Smaller:
// triangles cover pixels beyond their edges. Larger: they end before their edges, and walls of many objects have cracks.
const ROUNDING: f32 = 32.0 / 16777216.0;
// Above the relative error of two divisions.
const QUOTIENT: f32 = 1e-6;
const NOBODY: u32 = 0xffffffffu;

// The direction through a pixel's centre, 1 m along the view direction.
fn direction(at: vec2f) -> vec3f {
    return camera.middle + (2.0 * at.x - camera.width) * camera.across + (camera.height - 2.0 * at.y) * camera.up;
}

fn apart(end: Point, start: Point) -> vec3f {
    return difference(end, start, camera.zero);
}

// The length to which a vector's error is proportional.
fn size(v: vec3f) -> f32 {
    return length(v) + camera.grain;
}

// The plane through the eye and an edge, and the error bound of its products with directions.
fn edge(a: vec3f, b: vec3f, along: vec3f) -> vec4f {
    // From the nearer end.
    let start = select(b, a, dot(a, a) < dot(b, b));
    return vec4f(cross(start, along), ROUNDING * camera.reach * size(start) * size(along));
}

// Whether a direction is certainly on the inner side of an edge.
fn is_inside(edge: vec4f, side: f32, direction: vec3f) -> bool {
    return side * dot(edge.xyz, direction) > edge.w;
}

// A triangle relative to the eye.
struct Face {
    // Its corners.
    corners: array<vec3f, 3>,
    edges: array<vec4f, 3>,
    // Depth is the product with a direction; the fourth component bounds its error.
    plane: vec4f,
    // A lower bound of the farthest corner's depth, and the depth above which a point may be in front of the near plane.
    range: vec2f,
    // The eye's side: 1 or -1; 0 if uncertain.
    side: f32,
}

fn face(ids: vec3u) -> Face {
    let eye = Point(camera.eye_high, camera.eye_low);
    let points = array(point(ids.x), point(ids.y), point(ids.z));
    let a = apart(points[0], eye);
    let b = apart(points[1], eye);
    let c = apart(points[2], eye);
    let ab = apart(points[1], points[0]);
    let bc = apart(points[2], points[1]);
    let ca = apart(points[0], points[2]);
    // From the nearest corner, for the least rounding error.
    var start = a;
    var u = ab;
    var v = -ca;
    if dot(b, b) < dot(start, start) {
        start = b;
        u = bc;
        v = -ab;
    }
    if dot(c, c) < dot(start, start) {
        start = c;
        u = ca;
        v = -bc;
    }
    let normal = cross(u, v);
    let volume = dot(normal, start);
    let error = ROUNDING * size(u) * size(v);
    let off = error * size(start);
    // Upper bound of the plane's distance from the eye, times the normal's length.
    let most = abs(volume) + off;
    let w = vec3f(dot(camera.w, a), dot(camera.w, b), dot(camera.w, c));
    let w_off = ROUNDING * vec3f(size(a), size(b), size(c));
    let farthest = max(w.x + w_off.x, max(w.y + w_off.y, w.z + w_off.z));
    let nearest = min(w.x - w_off.x, min(w.y - w_off.y, w.z - w_off.z));
    var out: Face;
    out.corners = array(a, b, c);
    out.edges = array(edge(a, b, ab), edge(b, c, bc), edge(c, a, ca));
    out.side = select(0.0, sign(volume), abs(volume) > off);
    out.plane = vec4f(normal * out.side, error * camera.reach) * (camera.near / most);
    out.range = vec2f(camera.near / farthest * (1.0 - QUOTIENT), 2.0);
    if nearest < camera.near {
        out.range.y = (abs(volume) - off) / most * (1.0 - QUOTIENT);
    }
    return out;
}

// A lower bound of a triangle's depth at a pixel that it covers; below 0 if it may be in front of the near plane.
fn depth(plane: vec4f, range: vec2f, direction: vec3f) -> f32 {
    let value = dot(plane.xyz, direction);
    if value + plane.w > range.y {
        return -1.0;
    }
    return min(max(value - plane.w, range.x), 1.0);
}

struct Corner {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) ab: vec4f,
    @location(2) @interpolate(flat) bc: vec4f,
    @location(3) @interpolate(flat) ca: vec4f,
    @location(4) @interpolate(flat) plane: vec4f,
    @location(5) @interpolate(flat) range: vec2f,
    @location(6) @interpolate(flat) side: f32,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = index / 3u;
    let own = face(triangles[triangle].corners);
    var v = own.corners[0];
    if index % 3u == 1u {
        v = own.corners[1];
    } else if index % 3u == 2u {
        v = own.corners[2];
    }
    var at = vec4f(dot(camera.x, v), dot(camera.y, v), camera.near, dot(camera.w, v));
    // Seen edge-on: moved out of the depth range, like the other two corners.
    if own.side == 0.0 {
        at = vec4f(0.0, 0.0, 2.0, 1.0);
    }
    return Corner(at, triangle, own.edges[0], own.edges[1], own.edges[2], own.plane, own.range, own.side);
}

@fragment
fn hides(seen: Corner) -> @builtin(frag_depth) f32 {
    let towards = direction(seen.at.xy);
    let ab = is_inside(seen.ab, seen.side, towards);
    let bc = is_inside(seen.bc, seen.side, towards);
    let ca = is_inside(seen.ca, seen.side, towards);
    var least = depth(seen.plane, seen.range, towards);
    if !(ab && bc && ca) {
        least = min(least, beyond(seen.triangle, seen.side, vec3<bool>(ab, bc, ca), towards));
    }
    if least < 0.0 {
        discard;
    }
    return least;
}

// For a pixel that is not certainly inside one edge: a lower bound of the depth of the adjacent triangle there, if both triangles together
// certainly cover the pixel; otherwise below 0.
fn beyond(triangle: u32, side: f32, inside: vec3<bool>, towards: vec3f) -> f32 {
    let own = triangles[triangle];
    var ids = vec3u(NOBODY);
    if inside.y && inside.z {
        ids = vec3u(own.corners.yx, own.partners.x);
    } else if inside.z && inside.x {
        ids = vec3u(own.corners.zy, own.partners.y);
    } else if inside.x && inside.y {
        ids = vec3u(own.corners.xz, own.partners.z);
    }
    if ids.z == NOBODY {
        return -1.0;
    }
    let other = face(ids);
    // With the eye on its other side, it is folded over this one.
    let is_covered = other.side == side
        && is_inside(other.edges[1], side, towards)
        && is_inside(other.edges[2], side, towards);
    return select(-1.0, depth(other.plane, other.range, towards), is_covered);
}

struct Rectangle {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) asked: u32,
    @location(1) @interpolate(flat) own: u32,
}

// A box is drawn as one rectangle for each plane towards the eye, at the depth of that plane, so that devices reject hidden rectangles
// early.
@vertex
fn rectangle(@builtin(vertex_index) index: u32) -> Rectangle {
    let asked = index / 18u;
    let own = index % 18u / 6u;
    let k = index % 6u;
    let right = k == 1u || k == 2u || k == 4u;
    let below = k == 2u || k == 4u || k == 5u;
    let first = boxes[asked].first;
    let plane = boxes[asked].planes[own];
    if plane.w < 0.0 {
        return Rectangle(vec4f(0.0, 0.0, 2.0, 1.0), asked, own);
    }
    let pixel = select(first, boxes[asked].end, vec2<bool>(right, below));
    let at = 2.0 * pixel / vec2f(camera.width, camera.height) - 1.0;
    return Rectangle(vec4f(at.x, -at.y, depth_at(plane, pixel - 0.5 - first), 1.0), asked, own);
}

fn depth_at(plane: vec4f, steps: vec2f) -> f32 {
    return plane.x + plane.y * steps.x + plane.z * steps.y;
}

@fragment
fn asks(seen: Rectangle) {
    let steps = seen.at.xy - 0.5 - boxes[seen.asked].first;
    var own = 0.0;
    var enter = 2.0;
    var leave = 0.0;
    for (var i = 0u; i < 6u; i++) {
        let plane = boxes[seen.asked].planes[i];
        let depth = depth_at(plane, steps);
        if i == seen.own {
            own = depth;
        }
        if plane.w > 0.0 {
            enter = min(enter, depth);
        } else {
            leave = max(leave, depth);
        }
    }
    // If rays enter through another plane, that plane's rectangle decides.
    if leave > enter || own > enter {
        discard;
    }
}
