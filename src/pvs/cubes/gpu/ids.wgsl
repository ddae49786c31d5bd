// Item buffers, after `points.wgsl`. `corner` and `nearest` draw what is opaque; `corner` and `before` list what is see-through and no farther.

struct Face {
    // The eye in two parts, metres.
    eye_high: vec3f,
    // Pixels along the face's edge.
    size: f32,
    eye_low: vec3f,
    // Holds 0, which no compiler can know.
    zero: u32,
    // Unit vectors along columns, rows, and into the face.
    x: vec3f,
    // This face's first pixel of those drawn together.
    first: u32,
    y: vec3f,
    // Most hits that the list holds.
    capacity: u32,
    into: vec3f,
    // Nothing nearer than this is drawn, metres along `into`.
    near: f32,
}

// Three corners and the triangle's own index.
@group(0) @binding(1) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(2) var<uniform> face: Face;

struct Corner {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    // 1/w of the triangle's plane in a direction of length 1 along w is this times the direction.
    @location(1) @interpolate(flat) plane: vec3f,
    // Bounds of 1/w over the triangle.
    @location(2) @interpolate(flat) range: vec2f,
}

// The difference of two points on the face's axes.
fn apart(end: Point, start: Point) -> vec3f {
    let v = difference(end, start, face.zero);
    return vec3f(dot(face.x, v), dot(face.y, v), dot(face.into, v));
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let ids = triangles[index / 3u];
    let eye = Point(face.eye_high, face.eye_low);
    let points = array(point(ids.x), point(ids.y), point(ids.z));
    let a = apart(points[0], eye);
    let b = apart(points[1], eye);
    let c = apart(points[2], eye);
    let normal = cross(apart(points[1], points[0]), apart(points[2], points[0]));
    // From the nearest corner: what it is rounded by is least.
    var anchor = a;
    if dot(b, b) < dot(anchor, anchor) {
        anchor = b;
    }
    if dot(c, c) < dot(anchor, anchor) {
        anchor = c;
    }
    let plane = normal / dot(normal, anchor);
    let w = vec3f(a.z, b.z, c.z);
    let most = max(w.x, max(w.y, w.z));
    let least = min(w.x, min(w.y, w.z));
    var out: Corner;
    out.triangle = ids.w;
    out.plane = plane;
    out.range = vec2f(1.0 / max(most, face.near), 1.0 / max(least, face.near));
    var v = a;
    if index % 3u == 1u {
        v = b;
    } else if index % 3u == 2u {
        v = c;
    }
    // Rows go down, as on a picture.
    out.at = vec4f(v.x, -v.y, face.near, v.z);
    // Seen edge-on: beyond the far end of depth, with the other two corners.
    if !(max(abs(plane.x), max(abs(plane.y), abs(plane.z))) < 1e30) {
        out.at = vec4f(0.0, 0.0, 2.0, 1.0);
    }
    return out;
}

// What goes into the depth buffer, 0 to 1: `near / w`.
fn depth(seen: Corner) -> f32 {
    let direction = vec3f((2.0 * seen.at.xy - face.size) / face.size, 1.0);
    return face.near * clamp(dot(seen.plane, direction), seen.range.x, seen.range.y);
}

struct Nearest {
    @location(0) triangle: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn nearest(seen: Corner) -> Nearest {
    return Nearest(seen.triangle + 1u, depth(seen));
}

struct Hits {
    // How many there are, even if they don't fit.
    count: atomic<u32>,
    // Pixel, triangle, depth.
    list: array<u32>,
}

@group(1) @binding(0) var opaque_depth: texture_depth_2d;
@group(1) @binding(1) var<storage, read_write> hits: Hits;

@fragment
fn before(seen: Corner) {
    let at = vec2u(seen.at.xy);
    let own = depth(seen);
    if own >= textureLoad(opaque_depth, at, 0) {
        let place = atomicAdd(&hits.count, 1u);
        if place < face.capacity {
            hits.list[3u * place] = face.first + at.y * u32(face.size) + at.x;
            hits.list[3u * place + 1u] = seen.triangle;
            hits.list[3u * place + 2u] = bitcast<u32>(own);
        }
    }
}
