// Lines and faces over the scene, in colours that let it through.

struct Camera {
    clip: mat4x4f,
    cut: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

struct Corner {
    @builtin(position) at: vec4f,
    @location(0) colour: vec4f,
}

@vertex
fn corner(@location(0) place: vec3f, @location(1) colour: vec4f) -> Corner {
    return Corner(camera.clip * vec4f(place, 1.0), colour);
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4f {
    return in.colour;
}
