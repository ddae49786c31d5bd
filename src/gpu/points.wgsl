// Points with 48 bits per coordinate.

struct Point {
    high: vec3f,
    low: vec3f,
}

// Each coordinate in two parts; three coordinates per point.
@group(0) @binding(0) var<storage, read> positions: array<vec2f>;

fn point(index: u32) -> Point {
    let x = positions[3u * index];
    let y = positions[3u * index + 1u];
    let z = positions[3u * index + 2u];
    return Point(vec3f(x.x, y.x, z.x), vec3f(x.y, y.y, z.y));
}

// High parts cancel before low parts are added. The integer operation with a 0 unknown to the compiler prevents it from reordering the
// sums.
fn difference(end: Point, start: Point, zero: u32) -> vec3f {
    let great = bitcast<vec3u>(end.high - start.high) ^ vec3u(zero);
    return bitcast<vec3f>(great) + (end.low - start.low);
}

