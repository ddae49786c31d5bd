// What scene.wgsl draws, less what a section cuts away.

fn before(place: vec3f) -> f32 {
    return dot(camera.cut.xyz, place) - camera.cut.w;
}

struct SeenCut {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) colour: vec3f,
    @location(1) before: f32,
}

@vertex
fn seen_cut(@builtin(vertex_index) corner: u32) -> SeenCut {
    let place = place_of(corner);
    let word = word_of(corner);
    let colour = unpack4x8unorm(colours[word & 0xffffffu]).rgb;
    return SeenCut(placed(place, word), colour * (f32(word >> 24u) / 255.0), before(place));
}

@fragment
fn colour_cut(in: SeenCut) -> @location(0) vec4f {
    if in.before < 0.0 { discard; }
    return vec4f(in.colour, 1.0);
}

@fragment
fn colour_of_screen_cut(in: SeenCut) -> @location(0) vec4f {
    if in.before < 0.0 || !is_screen(in.at) { discard; }
    return vec4f(in.colour, 1.0);
}

struct ItemCut {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) object: u32,
    @location(1) before: f32,
}

@vertex
fn item_cut(@builtin(vertex_index) corner: u32) -> ItemCut {
    let place = place_of(corner);
    let word = word_of(corner);
    return ItemCut(placed(place, word), (word & 0xffffffu) + 1u, before(place));
}

@fragment
fn object_cut(in: ItemCut) -> @location(0) u32 {
    if in.before < 0.0 { discard; }
    return in.object;
}

@fragment
fn object_of_screen_cut(in: ItemCut) -> @location(0) u32 {
    if in.before < 0.0 || !is_screen(in.at) { discard; }
    return in.object;
}
