// Which objects are drawn, in two passes: those that showed in the frame before, then those whose boxes aren't behind what these have drawn.

struct View {
    clip: mat4x4f,
    eye: vec3f,
    near: f32,
    // Of the picture, pixels.
    size: vec2f,
    // Of this frame; the one before has one less.
    frame: u32,
    // How many objects are asked about, and how many of them are solid: those are first.
    count: u32,
    solid: u32,
    // 1 where the last frame is drawn once more, as it was decided.
    again: u32,
}

struct Box {
    least: vec3f,
    triangles: u32,
    most: vec3f,
    unused: u32,
}

struct Asked {
    object: u32,
    first: u32,
    count: u32,
}

struct Draw {
    count: u32,
    instances: u32,
    first: u32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> view: View;
// By object.
@group(0) @binding(1) var<storage, read> boxes: array<Box>;
// What is in the frustum, and its corners.
@group(0) @binding(2) var<storage, read> list: array<Asked>;
// Objects and triangles that are drawn; then by object the last frame in which it showed, and the last in which it was drawn.
@group(0) @binding(3) var<storage, read_write> states: array<atomic<u32>>;
// Solid things in the order of the list, those of the first pass, then those of the second; then glass likewise.
@group(0) @binding(4) var<storage, read_write> draws: array<Draw>;
@group(0) @binding(5) var pyramid: texture_2d<f32>;

// Invocations in a row of workgroups.
const ROW = 65536u;
const HEAD = 2u;

// Boxes grow by this share of their distance from the eye and of their size, and by this many times the distance of the near plane: more
// than rounding to single precision can move them on their way to the screen. Less: objects that are flush with their boxes lose pixels.
const SLACK = 1e-4;
const NEARS = 4.0;
// Boxes are so much nearer than objects are drawn by their ranks (scene.wgsl), so that none is hidden by what it lies on.
const RANKED = 1.0 + 0x1p-15f;
// Pixels by which rectangles grow: more than rasterisers round corners by, 1/256. Less: edges of objects lose pixels.
const EDGE = 0.0625;
// Most texels of a rectangle, a side. Higher: fewer objects are drawn in vain. Lower: fewer texels are read.
const TEXELS = 8u;

// Whether anything in a box may show before what the pyramid is of.
fn may_show(box: Box) -> bool {
    let away = length(view.eye - (box.least + box.most) * 0.5);
    let slack = SLACK * (away + length(box.most - box.least)) + NEARS * view.near;
    // 1. Its rectangle on the screen, and its nearest depth. What reaches behind the near plane may be anywhere.
    var nearest = 1e30;
    var low = vec2f(1e30);
    var high = vec2f(-1e30);
    for (var i = 0u; i < 8u; i++) {
        let is_most = vec3<bool>((i & 1u) != 0u, (i & 2u) != 0u, (i & 4u) != 0u);
        let place = view.clip * vec4f(select(box.least - slack, box.most + slack, is_most), 1.0);
        nearest = min(nearest, place.w);
        low = min(low, vec2f(place.x, -place.y) / place.w);
        high = max(high, vec2f(place.x, -place.y) / place.w);
    }
    if nearest <= view.near { return true; }
    let first = (low * 0.5 + 0.5) * view.size - EDGE;
    let last = (high * 0.5 + 0.5) * view.size + EDGE;
    if any(last < vec2f(0.0)) || any(first >= view.size) { return false; }
    let from_pixel = vec2u(clamp(first, vec2f(0.0), view.size - 1.0));
    let to_pixel = vec2u(clamp(last, vec2f(0.0), view.size - 1.0));
    // 2. The finest level on which it has few texels.
    var level = 0u;
    while any((to_pixel >> vec2u(level + 1u)) - (from_pixel >> vec2u(level + 1u)) >= vec2u(TEXELS)) { level++; }
    let from_texel = from_pixel >> vec2u(level + 1u);
    let to_texel = to_pixel >> vec2u(level + 1u);
    // 3. It is hidden if all of them are nearer.
    var farthest = 1.0;
    for (var y = from_texel.y; y <= to_texel.y; y++) {
        for (var x = from_texel.x; x <= to_texel.x; x++) {
            farthest = min(farthest, textureLoad(pyramid, vec2u(x, y), level).r);
        }
    }
    return view.near / nearest * RANKED >= farthest;
}

fn draw(i: u32, is_late: bool, asked: Asked, is_drawn: bool) {
    let is_glass = i >= view.solid;
    let at = select(i, i + view.solid, is_glass);
    let late = select(view.solid, view.count - view.solid, is_glass);
    draws[at + select(0u, late, is_late)] = Draw(select(0u, asked.count, is_drawn), 1u, asked.first, 0u);
}

fn count(asked: Asked) {
    atomicStore(&states[HEAD + 2u * asked.object + 1u], view.frame);
    atomicAdd(&states[0], 1u);
    atomicAdd(&states[1], boxes[asked.object].triangles);
}

// What showed in the frame before.
@compute @workgroup_size(64)
fn early(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * ROW + id.x;
    if i >= view.count { return; }
    let asked = list[i];
    let seen_in = atomicLoad(&states[HEAD + 2u * asked.object]);
    let drawn_in = atomicLoad(&states[HEAD + 2u * asked.object + 1u]);
    let is_again = view.again != 0u;
    let is_drawn = select(seen_in + 1u == view.frame, drawn_in == view.frame, is_again);
    draw(i, false, asked, is_drawn);
    draw(i, true, asked, false);
    if is_drawn && !is_again { count(asked); }
}

// What shows besides, by the depth of that.
@compute @workgroup_size(64)
fn late(@builtin(global_invocation_id) id: vec3u) {
    let i = id.y * ROW + id.x;
    if i >= view.count { return; }
    let asked = list[i];
    if !may_show(boxes[asked.object]) { return; }
    atomicStore(&states[HEAD + 2u * asked.object], view.frame);
    if atomicLoad(&states[HEAD + 2u * asked.object + 1u]) == view.frame { return; }
    draw(i, true, asked, true);
    count(asked);
}
