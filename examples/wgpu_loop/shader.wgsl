// Flat colours, darker where a surface is turned from the light; either side of a triangle shows.

@group(0) @binding(0) var<uniform> clip: mat4x4f;

struct Corner {
    @builtin(position) at: vec4f,
    @location(0) place: vec3f,
    @location(1) @interpolate(flat) colour: vec4f,
}

@vertex
fn corner(@location(0) place: vec3f, @location(1) colour: vec4f) -> Corner {
    return Corner(clip * vec4f(place, 1.0), place, colour);
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4f {
    let normal = normalize(cross(dpdx(in.place), dpdy(in.place)));
    let light = 0.45 + 0.55 * abs(dot(normal, vec3f(0.36, 0.80, 0.48)));
    return vec4f(in.colour.rgb * light, 1.0);
}
