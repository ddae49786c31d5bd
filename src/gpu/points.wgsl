// Points to 48 bits a coordinate.

struct Point {
    high: vec3f,
    low: vec3f,
}

// Each coordinate in two parts, three a point.
@group(0) @binding(0) var<storage, read> positions: array<vec2f>;

fn point(index: u32) -> Point {
    let x = positions[3u * index];
    let y = positions[3u * index + 1u];
    let z = positions[3u * index + 2u];
    return Point(vec3f(x.x, y.x, z.x), vec3f(x.y, y.y, z.y));
}

// Great parts cancel before small ones are added; going through whole numbers with a 0 that no compiler knows keeps compilers from taking
// the sums in another order.
fn difference(end: Point, start: Point, zero: u32) -> vec3f {
    let great = bitcast<vec3u>(end.high - start.high) ^ vec3u(zero);
    return bitcast<vec3f>(great) + (end.low - start.low);
}

