// What full.wgsl draws, less what a section cuts away.

struct LitCut {
    @invariant @builtin(position) at: vec4f,
    @location(0) place: vec3f,
    @location(1) picture_at: vec2f,
    @location(2) @interpolate(flat) surface: u32,
    @location(3) @interpolate(flat) normal: vec3f,
    @location(4) before: f32,
}

@vertex
fn lit_cut(@builtin(vertex_index) corner: u32) -> LitCut {
    let whole = lit_corner(corner);
    let before = dot(camera.cut.xyz, whole.place) - camera.cut.w;
    return LitCut(whole.at, whole.place, whole.picture_at, whole.surface, whole.normal, before);
}

fn whole(in: LitCut) -> Lit {
    return Lit(in.at, in.place, in.picture_at, in.surface, in.normal);
}

@fragment
fn nothing_cut(in: LitCut) {
    if in.before < 0.0 { discard; }
}

@fragment
fn solid_cut(in: LitCut) -> @location(0) vec4f {
    if in.before < 0.0 { discard; }
    let lit = whole(in);
    return vec4f(shaded(lit, spot_of(lit)), 1.0);
}

@fragment
fn masked_cut(in: LitCut) -> @location(0) vec4f {
    if in.before < 0.0 { discard; }
    let lit = whole(in);
    let spot = spot_of(lit);
    if spot.colour.a < surfaces[in.surface].cutoff { discard; }
    return vec4f(shaded(lit, spot), 1.0);
}

@fragment
fn glass_cut(in: LitCut) -> @location(0) vec4f {
    if in.before < 0.0 { discard; }
    return pane(whole(in));
}

@fragment
fn screen_depth_cut(in: LitCut) {
    if in.before < 0.0 || !is_screen(in.at) { discard; }
}
