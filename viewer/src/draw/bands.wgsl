// What a frame draws of tubes, as the library's `tubes` has it (drawn.rs): bands between two rings. rings.wgsl works each ring out once, and
// tubes.wgsl its corners.

struct Bands {
    // The first band of those with 4, 8 ... 4096 sides, eleven in all, and how many there are.
    first: array<vec4u, 3>,
    // What thin tubes are drawn as: 0 as they are; 1 a pixel wide, with the weight of what they are; 2 two pixels wide.
    thin: u32,
    // 1: sides as colours, and lines at sections.
    shows: u32,
    // Pixels of a metre at a distance of one.
    focal: f32,
    // How much wider than they are thin tubes may be.
    most: f32,
    // Where both rings are: a section, and 64ths of the way to the next (6 bits). The tube (30 bits) and the wall (2). The object (24 bits), and the
    // sides of the rings (4 each).
    bands: array<vec4u>,
}

// Where a ring of a band lies.
struct Ring {
    // On the curve.
    middle: vec3f,
    radius: f32,
    // Unit vectors across it: at no angle, and at a right one. Their cross product leads along the curve.
    x: vec3f,
    // The radius of the hole.
    hole: f32,
    y: vec3f,
}

const TURN = 6.28318530717958647692;

fn unit_or(v: vec3f, other: vec3f) -> vec3f {
    let size = length(v);
    return select(other, v / size, size > 0.0);
}

fn unit(v: vec3f) -> vec3f {
    return unit_or(v, vec3f(1.0, 0.0, 0.0));
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
