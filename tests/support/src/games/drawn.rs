//! Faces for levels of Quake 2, Quake 3 and Source: polygons, meshes, patches and displacements.

use super::{Game, Writer, built, laid_out};

/// What a face is made of.
#[derive(Clone, Debug)]
pub enum Shape {
    Polygon,
    /// Quake 3: triangles, counter-clockwise.
    Mesh(Vec<[i32; 3]>),
    /// Quake 3: the corners are control points, as many along both sides as given.
    Patch([i32; 2]),
    /// Quake 3.
    Billboard,
    /// Source.
    Displacement(Displacement),
}

/// A displacement of a face with four corners.
#[derive(Clone, Debug)]
pub struct Displacement {
    pub power: i32,
    pub start: [f32; 3],
    /// By vertex: a direction, and how far.
    pub moved: Vec<[f32; 4]>,
    /// Bits of the first vertices that are drawn; the others are.
    pub drawn: u32,
}

/// A texture: a name, and what the level says of it. Quake 2 and Source have no contents there.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Texture {
    pub name: &'static str,
    pub flags: u32,
    pub contents: u32,
}

/// A face.
#[derive(Clone, Debug)]
pub struct Face {
    /// Of a polygon, counter-clockwise from where it is seen.
    pub corners: Vec<[f32; 3]>,
    pub shape: Shape,
    pub texture: Texture,
    /// The leaf that names it; 0 for none.
    pub leaf: usize,
}

/// The three rooms with faces, by model, the world first.
pub fn level_with_faces(game: Game, models: &[Vec<Face>], entities: &str) -> Vec<u8> {
    let (w, mut lumps) = built(game);
    let all: Vec<&Face> = models.iter().flatten().collect();
    let mut textures: Vec<Texture> = all.iter().map(|face| face.texture).collect();
    textures.sort_unstable();
    textures.dedup();
    lumps[0] = [entities.as_bytes(), &[0]].concat();
    if game == Game::Quake3 {
        quake3(&w, &mut lumps, &all, &textures);
    } else if game.is_source() {
        source(&w, &mut lumps, &all, &textures);
    } else {
        quake2(&w, &mut lumps, &all, &textures);
    }

    // Faces of models, and of leaves.
    let [.., of_leaves, of_models, _, _] = game.lumps();
    let world = lumps[of_models].clone();
    lumps[of_models] = Vec::new();
    let mut first = 0;
    for model in models {
        let mut bytes = world.clone();
        let at = if game == Game::Quake3 { 24 } else { 40 };
        bytes[at..at + 8].copy_from_slice(&w.ints(&[first, model.len() as i32]));
        lumps[of_models].extend(bytes);
        first += model.len() as i32;
    }
    let (marks, at, size) = match game {
        Game::Quake2 => (9, 20, 28),
        Game::Qbism => (9, 36, 52),
        Game::Quake3 => (5, 32, 48),
        Game::Source(25) => (16, 36, 56),
        Game::Source(19) => (16, 20, 56),
        _ => (16, 20, 32),
    };
    let is_wide = at > 20;
    let number = |n: usize| if is_wide { w.int(n as i32).to_vec() } else { w.short(n as i32).to_vec() };
    let mut count = 0;
    for leaf in 1..lumps[of_leaves].len() / size {
        let own: Vec<usize> = (0..all.len()).filter(|&face| all[face].leaf == leaf).collect();
        let fields = [number(count), number(own.len())].concat();
        lumps[of_leaves][leaf * size + at..][..fields.len()].copy_from_slice(&fields);
        lumps[marks].extend(own.iter().flat_map(|&face| number(face)));
        count += own.len();
    }
    laid_out(&w, &lumps)
}

/// A level with a face of each kind, in no order of a real one.
pub fn sample(game: Game) -> Vec<u8> {
    let corners = vec![[5., -2., -1.], [9., -2., -1.], [9., 2., -1.], [5., 2., -1.]];
    let points = (0..9u8).map(|k| [7., f32::from(k % 3) - 1., f32::from(k / 3) - 1.]).collect();
    let of = |corners: &Vec<[f32; 3]>, shape, name, flags, contents| {
        let texture = Texture { name, flags, contents };
        Face { corners: corners.clone(), shape, texture, leaf: 3 }
    };
    let ground = Displacement { power: 2, start: corners[2], moved: vec![[0., 0., 1., 0.25]; 25], drawn: !2 };
    let mut world = vec![of(&corners, Shape::Polygon, "base/floor", 0, 1), of(&corners, Shape::Polygon, "base/day", 0x4, 1)];
    let mut door = vec![of(&corners, Shape::Polygon, "base/door", 0, 1)];
    if game == Game::Quake3 {
        world.push(of(&points, Shape::Patch([3, 3]), "base/curtain", 0, 0x20));
        world.push(of(&points, Shape::Billboard, "base/flare", 0, 1));
        door.push(of(&corners, Shape::Mesh(vec![[0, 1, 2], [0, 2, 3]]), "base/door", 0, 1));
    } else if game.is_source() {
        world.push(of(&corners, Shape::Displacement(ground), "base/ground", 0x800, 0));
    }
    let entities = "{\n\"classname\" \"worldspawn\"\n}\n{\n\"classname\" \"func_door\"\n\"model\" \"*1\"\n}\n";
    level_with_faces(game, &[world, door], entities)
}

fn texture_of(textures: &[Texture], face: &Face) -> i32 {
    textures.iter().position(|texture| *texture == face.texture).unwrap() as i32
}

/// A name, and zeros behind it.
fn named(name: &str, size: usize) -> Vec<u8> {
    let mut bytes = name.as_bytes().to_vec();
    bytes.resize(size, 0);
    bytes
}

fn quake3(w: &Writer, lumps: &mut [Vec<u8>], all: &[&Face], textures: &[Texture]) {
    for texture in textures {
        lumps[1].extend(named(texture.name, 64));
        lumps[1].extend(w.ints(&[texture.flags as i32, texture.contents as i32]));
    }
    for face in all {
        let (vertices, corners) = ((lumps[10].len() / 44) as i32, (lumps[11].len() / 4) as i32);
        for p in &face.corners {
            lumps[10].extend([w.floats(p), vec![0; 32]].concat());
        }
        let count = face.corners.len() as i32;
        let (kind, triangles, patch) = match &face.shape {
            Shape::Polygon => (1, (2..count).map(|k| [0, k - 1, k]).collect(), [0, 0]),
            Shape::Patch(size) => (2, Vec::new(), *size),
            Shape::Mesh(triangles) => (3, triangles.clone(), [0, 0]),
            Shape::Billboard => (4, Vec::new(), [0, 0]),
            Shape::Displacement(_) => panic!("Quake 3 has no displacements"),
        };
        // Clockwise in the file.
        lumps[11].extend(triangles.iter().flat_map(|[a, b, c]| w.ints(&[*a, *c, *b])));
        let head = [texture_of(textures, face), -1, kind, vertices, count, corners, 3 * triangles.len() as i32];
        lumps[13].extend([w.ints(&head), vec![0; 68], w.ints(&patch)].concat());
    }
}

fn quake2(w: &Writer, lumps: &mut [Vec<u8>], all: &[&Face], textures: &[Texture]) {
    for texture in textures {
        // An axis of a texel a unit.
        let axes = w.floats(&[1., 0., 0., 0., 0., 1., 0., 0.]);
        lumps[5].extend([axes, w.ints(&[texture.flags as i32, 0]), named(texture.name, 32), w.ints(&[-1])].concat());
    }
    for face in all {
        let (first, count) = chain(w, [2, 11, 12], lumps, face, w.game == Game::Qbism);
        let texture = texture_of(textures, face);
        let bytes = if w.game == Game::Qbism {
            [vec![0; 8], w.ints(&[first, count, texture]), vec![0; 8]].concat()
        } else {
            [vec![0; 4], w.int(first).to_vec(), w.shorts(&[count, texture]), vec![0; 8]].concat()
        };
        lumps[6].extend(bytes);
    }
}

/// Adds the corners of a face as edges, to lumps of vertices, edges and surface edges; the first of these, and how many.
fn chain(w: &Writer, of: [usize; 3], lumps: &mut [Vec<u8>], face: &Face, is_wide: bool) -> (i32, i32) {
    let [vertices, edges, surface_edges] = of;
    let (first, count) = ((lumps[surface_edges].len() / 4) as i32, face.corners.len() as i32);
    // Clockwise in the file.
    for (k, p) in (0..count).zip(face.corners.iter().rev()) {
        lumps[vertices].extend(w.floats(p));
        let ends = [first + k, first + (k + 1) % count];
        lumps[edges].extend(if is_wide { w.ints(&ends) } else { w.shorts(&ends) });
        lumps[surface_edges].extend(w.int(first + k));
    }
    (first, count)
}

fn source(w: &Writer, lumps: &mut [Vec<u8>], all: &[&Face], textures: &[Texture]) {
    let is_wide = w.game == Game::Source(25);
    for (i, texture) in (0..).zip(textures) {
        // An axis of 1/4 texel a unit.
        let axes = w.floats(&[0.25, 0., 0., 0., 0., 0.25, 0., 0.]);
        lumps[6].extend([axes, vec![0; 32], w.ints(&[texture.flags as i32, i])].concat());
        lumps[2].extend([w.floats(&[0.5, 0.25, 0.125]), w.ints(&[i, 64, 64, 64, 64])].concat());
        let name = lumps[43].len() as i32;
        lumps[44].extend(w.int(name));
        lumps[43].extend(named(texture.name, texture.name.len() + 1));
    }
    for face in all {
        let (first, count) = chain(w, [3, 12, 13], lumps, face, is_wide);
        let own = if let Shape::Displacement(own) = &face.shape { displacement(w, lumps, own) } else { -1 };
        let texture = texture_of(textures, face);
        let bytes = if is_wide {
            [vec![0; 8], w.ints(&[first, count, texture, own]), vec![0; 48]].concat()
        } else {
            [vec![0; 4], w.int(first).to_vec(), w.shorts(&[count, texture, own]), vec![0; 42]].concat()
        };
        lumps[7].extend(bytes);
    }
}

/// Adds a displacement; its number.
fn displacement(w: &Writer, lumps: &mut [Vec<u8>], own: &Displacement) -> i32 {
    let size = if w.game == Game::Source(25) { 232 } else { 176 };
    let number = lumps[26].len() / size;
    let first = (lumps[33].len() / 20) as i32;
    let head = [w.floats(&own.start), w.ints(&[first, 0, own.power])].concat();
    lumps[26].extend(&head);
    lumps[26].extend(vec![0; size - 40 - head.len()]);
    lumps[26].extend(w.int(own.drawn as i32));
    lumps[26].extend(vec![0xff; 36]);
    lumps[33].extend(own.moved.iter().flat_map(|moved| [w.floats(moved), vec![0; 4]].concat()));
    number as i32
}
