// Tubes in flat colours, less what a section or a mirror cuts away. Follows tubes.wgsl and scene.wgsl.

struct Tubular {
    @invariant @builtin(position) at: vec4f,
    // With the weight.
    @location(0) colour: vec4f,
    @location(1) along: f32,
    @location(2) before: f32,
}

@vertex
fn tubular(@builtin(vertex_index) number: u32) -> Tubular {
    let corner = widened(corner_of(number));
    var colour = unpack4x8unorm(colours[corner.word & 0xffffffu]).rgb;
    if list.shows == 1u { colour = of_sides(corner.sides); }
    let before = dot(camera.cut.xyz, corner.place) - camera.cut.w;
    let lit = vec4f(colour * light(corner.normal), corner.weight);
    return Tubular(placed(corner.place, corner.word), lit, shown_along(corner), before);
}

@fragment
fn colour_of_tube(in: Tubular) -> @location(0) vec4f {
    let is_dark = is_line(in.along);
    if in.before < 0.0 { discard; }
    return vec4f(in.colour.rgb * select(1.0, 0.3, is_dark), in.colour.a);
}

struct TubularItem {
    @invariant @builtin(position) at: vec4f,
    @location(0) @interpolate(flat) object: u32,
    @location(1) before: f32,
}

@vertex
fn tubular_item(@builtin(vertex_index) number: u32) -> TubularItem {
    let corner = corner_of(number);
    let before = dot(camera.cut.xyz, corner.place) - camera.cut.w;
    return TubularItem(placed(corner.place, corner.word), (corner.word & 0xffffffu) + 1u, before);
}

@fragment
fn item_of_tube(in: TubularItem) -> @location(0) u32 {
    if in.before < 0.0 { discard; }
    return in.object;
}

// It hides what is behind it, and is no item.
@fragment
fn no_item(in: TubularItem) -> @location(0) u32 {
    return 0u;
}
