// Which triangles are drawn and seen, which are drawn in vain, and which are culled. Follows scene.wgsl.

// How many pixels triangles of each kind fill, whatever lies before them; how many indirect draws there are; then a bit a triangle: whether
// it is drawn; then a bit a triangle: whether it is seen.
@group(1) @binding(0) var<storage, read_write> marks: array<atomic<u32>>;
// By pixel: the number of the triangle that is seen there, from 1; 0 where there is none.
@group(1) @binding(1) var numbers: texture_2d<u32>;
// Indirect draws: corners, instances, first corner, first instance.
@group(1) @binding(2) var<storage, read> draws: array<u32>;

const HEAD = 4u;
const SEEN = 0u;
const IN_VAIN = 1u;
const CULLED = 2u;

// Words of either half.
fn half_of() -> u32 {
    return (arrayLength(&marks) - HEAD) / 2u;
}

fn is_marked(half: u32, triangle: u32) -> bool {
    return (atomicLoad(&marks[HEAD + half * half_of() + triangle / 32u]) >> (triangle % 32u) & 1u) == 1u;
}

fn kind(triangle: u32) -> u32 {
    if is_marked(1u, triangle) { return SEEN; }
    return select(CULLED, IN_VAIN, is_marked(0u, triangle));
}

struct Numbered {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) @interpolate(flat) light: f32,
}

@vertex
fn numbered(@builtin(vertex_index) corner: u32) -> Numbered {
    let word = word_of(corner);
    return Numbered(placed(place_of(corner), word), corner / 3u, f32(word >> 24u) / 255.0);
}

@fragment
fn number(in: Numbered) -> @location(0) u32 {
    return in.triangle + 1u;
}

@fragment
fn number_of_screen(in: Numbered) -> @location(0) u32 {
    if !is_screen(in.at) { discard; }
    return in.triangle + 1u;
}

// Leaves of doors hide what is behind them, and are not counted.
@fragment
fn no_number(in: Numbered) -> @location(0) u32 {
    return 0u;
}

@compute @workgroup_size(8, 8)
fn see(@builtin(global_invocation_id) at: vec3u) {
    if any(at.xy >= textureDimensions(numbers)) { return; }
    let number = textureLoad(numbers, at.xy, 0).r;
    if number == 0u { return; }
    let triangle = number - 1u;
    let word = HEAD + half_of() + triangle / 32u;
    let bit = 1u << (triangle % 32u);
    // Most pixels are of triangles that others have marked.
    if (atomicLoad(&marks[word]) & bit) == 0u { atomicOr(&marks[word], bit); }
}

// What the device decided to draw.
@compute @workgroup_size(64)
fn spread(@builtin(global_invocation_id) at: vec3u) {
    if at.x >= atomicLoad(&marks[3]) { return; }
    let first = draws[4u * at.x + 2u] / 3u;
    let count = draws[4u * at.x] / 3u;
    for (var triangle = first; triangle < first + count; triangle++) {
        atomicOr(&marks[HEAD + triangle / 32u], 1u << (triangle % 32u));
    }
}

@fragment
fn fill(in: Numbered) {
    atomicAdd(&marks[kind(in.triangle)], 1u);
}

fn tint(in: Numbered) -> vec4f {
    let colour = select(vec3f(0.98, 0.60, 0.13), vec3f(0.42, 0.78, 0.40), is_marked(1u, in.triangle));
    return vec4f(colour * in.light, 1.0);
}

@fragment
fn tinted(in: Numbered) -> @location(0) vec4f {
    return tint(in);
}

@fragment
fn tinted_screen(in: Numbered) -> @location(0) vec4f {
    if !is_screen(in.at) { discard; }
    return tint(in);
}
