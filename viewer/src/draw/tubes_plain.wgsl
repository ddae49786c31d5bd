// Tubes in flat colours, less what a section or a mirror cuts away. Follows tubes.wgsl and scene.wgsl.

struct Tubular {
    @invariant @builtin(position) at: vec4f,
    @location(0) colour: vec3f,
    @location(1) along: f32,
    @location(2) before: f32,
    // Its number, from 1.
    @location(3) @interpolate(flat) object: u32,
    @location(4) covers: vec2f,
}

@vertex
fn tubular(@builtin(vertex_index) number: u32) -> Tubular {
    let corner = widened(corner_of(number));
    var colour = unpack4x8unorm(colours[corner.word & 0xffffffu]).rgb;
    if list.shows == 1u { colour = of_sides(corner.sides); }
    let before = dot(camera.cut.xyz, corner.place) - camera.cut.w;
    let lit = colour * light(corner.normal);
    let object = (corner.word & 0xffffffu) + 1u;
    return Tubular(placed(corner.place, corner.word), lit, shown_along(corner), before, object, corner.covers);
}

@fragment
fn colour_of_tube(in: Tubular, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let is_dark = is_line(in.along);
    let weight = weight_of(in.covers);
    if in.before < 0.0 || is_behind(is_front, weight) { discard; }
    return vec4f(in.colour * select(1.0, 0.3, is_dark), weight);
}

@fragment
fn item_of_tube(in: Tubular) -> @location(0) u32 {
    if in.before < 0.0 { discard; }
    return in.object;
}

// It hides what is behind it, and is no item.
@fragment
fn no_item(in: Tubular) -> @location(0) u32 {
    return 0u;
}
