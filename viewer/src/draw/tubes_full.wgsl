// Tubes as they look, less what a section or a mirror cuts away. Follows tubes.wgsl and full.wgsl.

struct LitTube {
    @invariant @builtin(position) at: vec4f,
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) @interpolate(flat) surface: u32,
    @location(3) covers: vec2f,
    @location(4) along: f32,
    @location(5) before: f32,
    @location(6) @interpolate(flat) shown: vec3f,
}

@vertex
fn lit_tube(@builtin(vertex_index) number: u32) -> LitTube {
    let corner = widened(corner_of(number));
    let before = dot(camera.cut.xyz, corner.place) - camera.cut.w;
    let material = materials[corner.word & 0xffffffu];
    let shown = select(vec3f(0.0), of_sides(corner.sides), list.shows == 1u);
    let at = placed(corner.place, corner.word);
    return LitTube(at, corner.place, corner.normal, material, corner.covers, shown_along(corner), before, shown);
}

fn colour_of_lit(in: LitTube) -> vec4f {
    let weight = weight_of(in.covers);
    let lit = Lit(in.at, in.place, vec2f(0.0), in.surface, normalize(in.normal));
    let spot = spot_of(lit);
    let is_dark = is_line(in.along);
    if any(in.shown > vec3f(0.0)) { return vec4f(in.shown * select(light(lit.normal), 0.3, is_dark), weight); }
    return vec4f(shaded(lit, spot), weight);
}

@fragment
fn solid_tube(in: LitTube) -> @location(0) vec4f {
    let seen = colour_of_lit(in);
    if in.before < 0.0 || seen.a < WHOLE { discard; }
    return seen;
}

// What is blended: once shade and edges are there, which come from depth.
@fragment
fn thin_tube(in: LitTube, @builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    let seen = colour_of_lit(in);
    if in.before < 0.0 || seen.a >= WHOLE || is_behind(is_front, seen.a) { discard; }
    return seen;
}
