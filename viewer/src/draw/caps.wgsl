// Caps of what a section cuts: first how often each pixel of the plane is inside of something, then a flat colour where it is.

struct Camera {
    clip: mat4x4f,
    cut: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var counts: texture_2d<f32>;

@vertex
fn corner(@location(0) place: vec3f) -> @builtin(position) vec4f {
    let at = camera.clip * vec4f(place, 1.0);
    // Before faces that lie in the plane, whatever their ranks (see scene.wgsl).
    return vec4f(at.xy, at.z * (1.0 + 0x1p-15f), at.w);
}

@fragment
fn count(@builtin(front_facing) is_front: bool) -> @location(0) vec4f {
    return vec4f(select(-1.0, 1.0, is_front));
}

@fragment
fn cap(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if abs(textureLoad(counts, vec2u(at.xy), 0).r) < 0.5 { discard; }
    return vec4f(0.27, 0.29, 0.33, 1.0);
}
