// Triangles. Every shader of the scene begins with this.

// x, y and z of places, which triangles share.
@group(2) @binding(0) var<storage, read> places: array<f32>;
// Three a triangle: numbers of places.
@group(2) @binding(1) var<storage, read> corners_at: array<u32>;
// By triangle: its object, and in the highest byte the light.
@group(2) @binding(2) var<storage, read> words: array<u32>;
// By triangle: its material in the lower half, and its normal in the upper one.
@group(2) @binding(3) var<storage, read> made_of: array<u32>;
// Texture coordinates of corners, two halves each, of those objects that have any.
@group(2) @binding(4) var<storage, read> coordinates: array<u32>;
// By object: what to add to a corner's number to find its coordinates.
@group(2) @binding(5) var<storage, read> first_coordinates: array<u32>;

const NO_COORDINATES = 0xffffffffu;

fn place_of(corner: u32) -> vec3f {
    let i = 3u * corners_at[corner];
    return vec3f(places[i], places[i + 1u], places[i + 2u]);
}

fn word_of(corner: u32) -> u32 {
    return words[corner / 3u];
}

// Its material in the lower half, and its normal in the upper one.
fn made_of_corner(corner: u32) -> u32 {
    return made_of[corner / 3u];
}

fn picture_at_corner(corner: u32, word: u32) -> vec2f {
    let first = first_coordinates[word & 0xffffffu];
    if first == NO_COORDINATES { return vec2f(0.0); }
    return unpack2x16float(coordinates[first + corner]);
}
