// The scene: flat colours, which come with the objects; or items, the numbers of objects.

struct Camera {
    clip: mat4x4f,
    // What isn't on its front isn't drawn: n . p >= d. All zero but d = -1 where nothing is cut off.
    cut: vec4f,
    eye: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> colours: array<u32>;

// On the screen. Faces that lie on each other would be as far away, and what is seen of them chance: objects are a little nearer by their
// ranks, which come with the colours, by 1.5e-5 of their distance at most. Less drowns in the rounding of depth; more, and what lies on a
// wall sinks into it.
fn placed(place: vec3f, word: u32) -> vec4f {
    let at = camera.clip * vec4f(place, 1.0);
    let rank = f32(colours[word & 0xffffffu] >> 24u);
    return vec4f(at.xy, at.z * (1.0 + rank * 0x1p-20f), at.w);
}

struct Seen {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) colour: vec3f,
}

@vertex
fn seen(@builtin(vertex_index) corner: u32) -> Seen {
    let word = word_of(corner);
    let colour = unpack4x8unorm(colours[word & 0xffffffu]).rgb;
    return Seen(placed(place_of(corner), word), colour * (f32(word >> 24u) / 255.0));
}

@fragment
fn colour(in: Seen) -> @location(0) vec4f {
    return vec4f(in.colour, 1.0);
}

// Of each square of four pixels one shows it: what is behind shows, too, in any order of drawing.
fn is_screen(at: vec4f) -> bool {
    let p = vec2u(at.xy);
    return ((p.x | p.y) & 1u) == 0u;
}

@fragment
fn colour_of_screen(in: Seen) -> @location(0) vec4f {
    if !is_screen(in.at) { discard; }
    return vec4f(in.colour, 1.0);
}

struct Cut {
    @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) colour: vec3f,
    @location(1) before: f32,
}

@vertex
fn seen_in_mirror(@builtin(vertex_index) corner: u32) -> Cut {
    let place = place_of(corner);
    let word = word_of(corner);
    let colour = unpack4x8unorm(colours[word & 0xffffffu]).rgb;
    let before = dot(camera.cut.xyz, place) - camera.cut.w;
    return Cut(camera.clip * vec4f(place, 1.0), colour * (f32(word >> 24u) / 255.0), before);
}

@fragment
fn colour_in_mirror(in: Cut) -> @location(0) vec4f {
    if in.before < 0.0 { discard; }
    // Silvering is a little green.
    return vec4f(in.colour * vec3f(0.90, 0.95, 0.93), 1.0);
}

struct Item {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) object: u32,
}

@vertex
fn item(@builtin(vertex_index) corner: u32) -> Item {
    let word = word_of(corner);
    return Item(placed(place_of(corner), word), (word & 0xffffffu) + 1u);
}

@fragment
fn object(in: Item) -> @location(0) u32 {
    return in.object;
}

@fragment
fn object_of_screen(in: Item) -> @location(0) u32 {
    if !is_screen(in.at) { discard; }
    return in.object;
}
