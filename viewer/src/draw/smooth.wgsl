// From four samples a pixel to one. Follows shade.wgsl.

@group(0) @binding(3) var samples: texture_depth_multisampled_2d;

const SAMPLES_A_PIXEL = 4;

fn sample_at(p: vec2i, sample: i32) -> f32 {
    let last = vec2i(textureDimensions(samples)) - 1;
    return textureLoad(samples, clamp(p, vec2i(0), last), sample);
}

struct Depth {
    @builtin(frag_depth) depth: f32,
}

// The nearest sample.
@fragment
fn nearest(@builtin(position) at: vec4f) -> Depth {
    let p = vec2i(at.xy);
    var depth = 0.0;
    for (var i = 0; i < SAMPLES_A_PIXEL; i++) { depth = max(depth, sample_at(p, i)); }
    return Depth(depth);
}

// As `over`, with the mean of the lines that samples have.
@fragment
fn over_smooth(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2i(at.xy);
    let pixel = 2.0 * view.tangent.y / f32(textureDimensions(samples).y);
    let corner = textureLoad(corners, p / 2, 0).r;
    var sum = 0.0;
    for (var i = 0; i < SAMPLES_A_PIXEL; i++) {
        let d = sample_at(p, i);
        if d <= 0.0 {
            sum += 1.0;
            continue;
        }
        let across = abs(sample_at(p - vec2i(1, 0), i) + sample_at(p + vec2i(1, 0), i) - 2.0 * d);
        let down = abs(sample_at(p - vec2i(0, 1), i) + sample_at(p + vec2i(0, 1), i) - 2.0 * d);
        sum += corner * (1.0 - strength(d) * smoothstep(0.5, 1.6, max(across, down) / (d * pixel)));
    }
    return vec4f(vec3f(sum / f32(SAMPLES_A_PIXEL)), 1.0);
}
