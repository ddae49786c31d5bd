//! A scene as triangles for the graphics processor: objects one after the other, those that may be seen through last. Leaves of doors, which
//! move, are drawn by [`super::leaves`], and tubes by [`super::tubes`].
//!
//! How light falls on a face comes with it, so that fragments have nothing to work out: on a software driver they are what costs the most.

use enfilade::ObjectId;
use enfilade::scene::{Role, Scene};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Most objects: their number, and one for what no object is, shares a word with the light. More would take another word a corner.
pub const MOST_OBJECTS: usize = (1 << 24) - 1;
/// Where light comes from, about a unit vector; surfaces are lit from both sides.
const LIGHT: DVec3 = DVec3::new(0.36, 0.80, 0.48);

/// Triangles, as [`super::geometry::Geometry`] has them.
pub struct Triangles {
    /// x, y and z as `f32`, metres relative to the scene's origin.
    pub places: Vec<[u32; 3]>,
    /// Three numbers of places a triangle.
    pub corners: Vec<u32>,
    /// The object, and in the highest byte the light.
    pub words: Vec<u32>,
}

/// Where objects are among the corners, three a triangle.
pub struct Mesh {
    /// How many triangles there are.
    pub triangles: u32,
    /// By object.
    pub ranges: Vec<Range<u32>>,
    /// By object: whether it isn't drawn; empty: all are.
    pub is_hidden: Vec<bool>,
    /// Boxes of objects.
    bounds: Vec<[Vec3; 2]>,
}

impl Mesh {
    /// Lays a scene out. `is_leaf`: the triangles that are left out.
    ///
    /// # Errors
    ///
    /// Where it has more than [`MOST_OBJECTS`] objects.
    pub fn new(scene: &Scene, is_leaf: &[bool]) -> Result<(Self, Triangles), String> {
        if scene.objects.len() > MOST_OBJECTS {
            return Err(format!("{} objects: the viewer draws {MOST_OBJECTS} at most", scene.objects.len()));
        }
        let mut order: Vec<usize> = (0..scene.objects.len()).collect();
        order.sort_by_key(|&o| (seen_through_rank(scene, o), o));
        let mut ranges = vec![0..0; order.len()];
        let (places, numbers) = welded(scene);
        let of_meshes = scene.objects.iter().filter(|object| !object.is_tube());
        let count: usize = of_meshes.map(|object| object.triangles.len()).sum();
        let (mut corners, mut words) = (Vec::with_capacity(3 * count), Vec::with_capacity(count));
        for object in order {
            let start = corners.len() as u32;
            let is_tube = scene.objects[object].is_tube();
            let triangles = if is_tube { 0..0 } else { scene.objects[object].triangles.clone() };
            for t in triangles.map(|t| t as usize).filter(|&t| !is_leaf[t]) {
                corners.extend(scene.triangles[t].map(|position| numbers[position as usize]));
                words.push(word(scene.corners(t), object as u32));
            }
            ranges[object] = start..corners.len() as u32;
        }
        let bounds = scene.objects.iter().map(|o| [o.bounds.min.as_vec3(), o.bounds.max.as_vec3()]).collect();
        let mesh = Self { triangles: words.len() as u32, ranges, is_hidden: Vec::new(), bounds };
        Ok((mesh, Triangles { places, corners, words }))
    }

    /// The number of what no object of the scene is: leaves that were made.
    pub fn made(&self) -> u32 {
        self.ranges.len() as u32
    }

    /// The corners of an object that are drawn.
    pub fn drawn(&self, object: ObjectId) -> Range<u32> {
        let Range { start, end } = self.ranges[object.index()];
        if self.is_hidden(object) { start..start } else { start..end }
    }

    /// Whether an object isn't drawn.
    pub fn is_hidden(&self, object: ObjectId) -> bool {
        self.is_hidden.get(object.index()).is_some_and(|&hidden| hidden)
    }

    /// Which shell around an eye an object begins in.
    pub fn shell(&self, object: ObjectId, eye: Vec3) -> i32 {
        let [least, most] = self.bounds[object.index()];
        let away = (eye.clamp(least, most) - eye).length_squared();
        // Squared, so half of the logarithm's shells.
        (away.max(1e-4).log2() * 0.5 * SHELLS) as i32
    }
}

/// Places of a scene, each once, and the number of the place of each of its positions; those of tubes have none.
fn welded(scene: &Scene) -> (Vec<[u32; 3]>, Vec<u32>) {
    // Adding zero makes -0 and 0 the same bits.
    let bits = |p: &DVec3| (p.as_vec3() + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut is_of_tube = vec![false; if scene.tubes.tubes.is_empty() { 0 } else { scene.positions.len() }];
    for object in scene.objects.iter().filter(|object| object.is_tube()) {
        let triangles = &scene.triangles[object.triangles.start as usize..object.triangles.end as usize];
        triangles.as_flattened().iter().for_each(|&position| is_of_tube[position as usize] = true);
    }
    let is_wanted = |position: &u32| !is_of_tube.get(*position as usize).is_some_and(|&is| is);
    let numbered = scene.positions.iter().zip(0..).filter(|(_, position)| is_wanted(position));
    let mut keyed: Vec<([u32; 3], u32)> = numbered.map(|(p, position)| (bits(p), position)).collect();
    keyed.sort_unstable();
    let (mut places, mut numbers) = (Vec::new(), vec![0; scene.positions.len()]);
    for (place, position) in keyed {
        if places.last() != Some(&place) {
            places.push(place);
        }
        numbers[position as usize] = places.len() as u32 - 1;
    }
    (places, numbers)
}

/// A triangle's object and light.
pub fn word(triangle: [DVec3; 3], object: u32) -> u32 {
    object | u32::from(light(triangle)) << 24
}

/// Solid things, then doors, then glass and what engines do not draw.
fn seen_through_rank(scene: &Scene, object: usize) -> u8 {
    match &scene.objects[object] {
        o if o.glass || o.role == Role::Helper => 2,
        o if o.role == Role::Door => 1,
        _ => 0,
    }
}

/// How light a face is, 255 at most.
fn light([a, b, c]: [DVec3; 3]) -> u8 {
    let n = (b - a).cross(c - a).normalize_or(DVec3::Y);
    // Turned up and down differ, so that ceilings aren't floors.
    let lit = 0.55 + 0.30 * n.dot(LIGHT).abs() + 0.08 * n.y.abs() + 0.07 * n.x.abs();
    (lit.min(1.0) * 255.0) as u8
}

/// Shells around the eye to twice its distance: what is nearer is drawn first, so that what it hides costs little. More: less is shaded
/// twice. Fewer: longer runs.
const SHELLS: f32 = 2.0;

/// Runs of corners to draw: of neighbours one.
#[derive(Default)]
pub struct Runs {
    /// Opaque objects.
    pub solid: Vec<Range<u32>>,
    /// Transparent objects, drawn as screens.
    pub transparent: Vec<Range<u32>>,
    keys: Vec<(i32, u32, u32)>,
}

impl Runs {
    /// Of some objects, near ones first where there is an `eye`. `is_transparent`, by object.
    pub fn set(&mut self, mesh: &Mesh, objects: &[ObjectId], is_transparent: &[bool], eye: Option<Vec3>) {
        self.keys.clear();
        self.keys.extend(objects.iter().map(|o| {
            let shell = eye.map_or(0, |eye| mesh.shell(*o, eye));
            (shell, mesh.ranges[o.index()].start, o.0)
        }));
        self.keys.sort_unstable();
        self.solid.clear();
        self.transparent.clear();
        for &(_, _, object) in &self.keys {
            let runs = if is_transparent[object as usize] { &mut self.transparent } else { &mut self.solid };
            let range = mesh.drawn(ObjectId(object));
            if range.is_empty() {
                continue;
            }
            match runs.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => runs.push(range),
            }
        }
    }
}
