// Boxes that are asked about: drawn into nothing, before the depth of what was drawn so far.

struct Camera {
    clip: mat4x4f,
    cut: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;

@vertex
fn corner(@builtin(vertex_index) i: u32, @location(0) least: vec3f, @location(1) most: vec3f) -> @builtin(position) vec4f {
    // Six faces of two triangles: corner 0 to 3 around a face, and whose axis it is across.
    let face = i / 6u;
    let at = array<vec2u, 6>(vec2u(0, 0), vec2u(1, 0), vec2u(1, 1), vec2u(0, 0), vec2u(1, 1), vec2u(0, 1))[i % 6u];
    let axis = face >> 1u;
    var side: vec3u;
    side[axis] = face & 1u;
    side[(axis + 1u) % 3u] = at.x;
    side[(axis + 2u) % 3u] = at.y;
    let place = camera.clip * vec4f(select(least, most, side == vec3u(1u)), 1.0);
    // Nearer than any object is drawn for its rank (see scene.wgsl), so that none is hidden by what it lies on.
    return vec4f(place.xy, place.z * (1.0 + 0x1p-15f), place.w);
}
