// A mirror: what was drawn for it lies on the same pixels.

struct Camera {
    clip: mat4x4f,
    cut: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(1) @binding(0) var seen: texture_2d<f32>;

@vertex
fn corner(@location(0) place: vec3f) -> @builtin(position) vec4f {
    return camera.clip * vec4f(place, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4f) -> @location(0) vec4f {
    return vec4f(textureLoad(seen, vec2u(at.xy), 0).rgb, 1.0);
}
