//! The scene builder, for all importers: checks numbers, drops and counts degenerate triangles, splits large meshes.

use super::objects::split_objects;
use super::pipes::{self, Prisms};
use super::sky::{self, Backdrop, Shape};
use super::{Hints, ImportError, ImportOptions, Look, Material, Object, Place, Role, Scene, Source, Trace};
use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::types::hints::Leaves;
use crate::types::note::Note;
use enfilade_tubes::{MOST_SECTIONS, Tubes};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Per cent of the triangles. Smaller: a note for glass halls. Larger: no note for a building with see-through walls.
const MUCH: f64 = 30.0;
/// Largest coordinate, metres: beyond it, squares and their products lose the precision of a metre.
const FARTHEST: f64 = 1e12;
/// Scenes have `u32` indices, with at worst three corners per triangle.
const MOST_TRIANGLES: usize = (u32::MAX / 3) as usize;
/// Most repeats of a texture across a triangle: with more, only its mean is visible. Also half of the range of half precision, in which
/// texture coordinates are drawn.
const MOST_REPEATS: f32 = 32_768.0;

/// One mesh primitive in the model's own coordinates: metres, +Y up, `f64`.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Node name or GlobalId.
    pub node: String,
    /// Its role.
    pub role: Role,
    /// Whether it hides what is behind it.
    pub opaque: bool,
    /// Corners.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`; checked by [`SceneBuilder::add`].
    pub triangles: Vec<[u32; 3]>,
}

/// Optional facts about a mesh.
#[derive(Clone, Copy, Debug, Default)]
pub struct Facts {
    /// A box around all of its poses, in the model's own coordinates.
    pub reach: Option<Aabb>,
    /// Group of meshes that are drawn or hidden together: levels of detail of one thing.
    pub group: Option<u32>,
    /// Whether its material is unlit.
    pub unlit: bool,
    /// The kind of backdrop by its name and its material's name.
    pub backdrop: Backdrop,
    /// Whether its role was set by hand, so that its name and shape do not matter.
    pub told: bool,
}

/// An added mesh, without its triangles of zero area.
#[derive(Debug)]
struct Added {
    mesh: Mesh,
    /// For prisms around tubes: the tubes, and, by piece, triangles and segments.
    tubes: Tubes,
    pieces: Vec<[Range<u32>; 2]>,
    glass: bool,
    /// Number among the added meshes.
    number: u32,
    look: Look,
    facts: Facts,
    /// Numbers of the dropped triangles, ascending.
    dropped: Vec<u32>,
}

impl Added {
    fn shape(&self) -> Shape<'_> {
        Shape {
            positions: &self.mesh.positions,
            triangles: &self.mesh.triangles,
            named: self.facts.backdrop,
            unlit: self.facts.unlit,
            told: self.facts.told || !matches!(self.mesh.role, Role::Unknown | Role::Structure),
        }
    }

    /// The original numbers of its triangles.
    fn numbers(&self) -> Vec<u32> {
        let mut dropped = self.dropped.iter().peekable();
        let all = 0..(self.mesh.triangles.len() + self.dropped.len()) as u32;
        all.filter(|t| dropped.next_if(|d| *d == t).is_none()).collect()
    }
}

/// Collects meshes and hints into a [`Scene`].
#[derive(Debug)]
pub struct SceneBuilder {
    options: ImportOptions,
    meshes: Vec<Added>,
    /// Number of added meshes, including empty ones.
    handed_in: u32,
    /// Look and facts of the next mesh.
    look: Look,
    facts: Facts,
    materials: Vec<Material>,
    number_of_material: HashMap<String, u32>,
    count: usize,
    degenerate: usize,
    /// Number of triangles with a corner that is not finite or too far away, and the first mesh with one.
    broken: usize,
    first_broken: Option<String>,
    /// In the model's own coordinates; moved to the origin by [`SceneBuilder::finish`].
    pub hints: Hints,
    /// The source of the scene.
    pub source: Source,
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new(options: &ImportOptions, source: Source) -> Self {
        Self {
            options: options.clone(),
            meshes: Vec::new(),
            handed_in: 0,
            look: Look::default(),
            facts: Facts::default(),
            materials: Vec::new(),
            number_of_material: HashMap::new(),
            count: 0,
            degenerate: 0,
            broken: 0,
            first_broken: None,
            hints: Hints::default(),
            source,
        }
    }

    /// Whether the origin and look of triangles are recorded ([`ImportOptions::trace`]).
    pub fn is_traced(&self) -> bool {
        self.options.trace
    }

    /// The value of [`ImportOptions::smallest_hole`].
    pub fn smallest_hole(&self) -> Option<f64> {
        self.options.smallest_hole
    }

    /// Whether pipes become tubes, if there are many ([`ImportOptions::tubes`]).
    pub fn has_tubes(&self) -> bool {
        self.options.tubes
    }

    /// Sets the look of the next mesh, if traced: its material, and texture coordinates by triangle (or none). Materials with the same name
    /// are one. Coordinates that repeat a texture more than 32,768 times across a triangle, or are not finite, become zeros.
    pub fn look(&mut self, material: Material, texture_coordinates: Vec<[[f32; 2]; 3]>) {
        if self.is_traced() {
            let mut texture_coordinates = texture_coordinates;
            texture_coordinates.iter_mut().filter(|t| !can_be_seen(t)).for_each(|t| *t = Default::default());
            let number = *self.number_of_material.entry(material.name.clone()).or_insert(self.materials.len() as u32);
            if number as usize == self.materials.len() {
                self.materials.push(material);
            }
            self.look = Look { material: Some(number), texture_coordinates };
        }
    }

    /// Sets the facts of the next mesh.
    pub fn facts(&mut self, facts: Facts) {
        self.facts = facts;
    }

    /// Counts triangles against [`ImportOptions::max_triangles`]. [`SceneBuilder::add`] does so itself; importers call it for triangles
    /// used elsewhere (the surfaces of rooms), before they make them.
    pub fn count(&mut self, triangles: usize) -> Result<(), ImportError> {
        self.count = self.counted_with(triangles)?;
        Ok(())
    }

    /// The count plus `triangles`; fails beyond the limit.
    fn counted_with(&self, triangles: usize) -> Result<usize, ImportError> {
        let limit = self.options.max_triangles.min(MOST_TRIANGLES);
        let count = self.count.saturating_add(triangles);
        if count > limit { Err(ImportError::TooLarge { limit }) } else { Ok(count) }
    }

    /// Adds a mesh. Fails on indices out of range, and more triangles than the options allow. Triangles without area, up to the rounding of
    /// their own coordinates, and those with a corner that is not finite (or beyond 1e12 m) are dropped and counted.
    pub fn add(&mut self, mesh: Mesh) -> Result<(), ImportError> {
        let glass = !mesh.opaque && !matches!(mesh.role, Role::Door | Role::Window | Role::Helper | Role::Sky);
        self.push(mesh, glass)
    }

    /// As [`SceneBuilder::add`], for a mesh with a transparent material: for doors and windows, [`Mesh::opaque`] does not state that.
    pub fn add_glass(&mut self, mesh: Mesh) -> Result<(), ImportError> {
        self.push(mesh, true)
    }

    /// As [`SceneBuilder::add`], for a mesh that hides nothing because it may move, not because it is transparent.
    pub fn add_moving(&mut self, mesh: Mesh) -> Result<(), ImportError> {
        self.push(mesh, false)
    }

    fn push(&mut self, mut mesh: Mesh, glass: bool) -> Result<(), ImportError> {
        self.count(mesh.triangles.len())?;
        let n = mesh.positions.len();
        if let Some(bad) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= n) {
            return Err(ImportError::malformed(Place::File, format!("{}: vertex index {bad} of {n} vertices", mesh.node)));
        }
        let dropped = self.drop_degenerate(&mut mesh);
        let (number, look) = (self.handed_in, std::mem::take(&mut self.look));
        let facts = std::mem::take(&mut self.facts);
        self.handed_in += 1;
        if !mesh.triangles.is_empty() {
            let (tubes, pieces) = (Tubes::default(), Vec::new());
            self.meshes.push(Added { mesh, tubes, pieces, glass, number, look, facts, dropped });
        }
        Ok(())
    }

    /// Adds tubes in the model's own coordinates, as one mesh. Fails if they have more sections than the options allow triangles. If a
    /// scene has few of them, or [`ImportOptions::tubes`] is off, they become triangles.
    pub fn add_tubes(&mut self, node: String, role: Role, tubes: Tubes) -> Result<(), ImportError> {
        if !self.options.tubes {
            // Before any allocation.
            self.counted_with(pipes::triangles(&tubes))?;
            return self.add(pipes::mesh(node, role, &tubes));
        }
        self.count(tubes.sections.len())?;
        let mesh = Mesh { node, role, opaque: true, positions: Vec::new(), triangles: Vec::new() };
        let (number, look) = (self.handed_in, std::mem::take(&mut self.look));
        let facts = std::mem::take(&mut self.facts);
        self.handed_in += 1;
        if !tubes.tubes.is_empty() {
            let (pieces, dropped) = (Vec::new(), Vec::new());
            self.meshes.push(Added { mesh, tubes, pieces, glass: false, number, look, facts, dropped });
        }
        Ok(())
    }

    /// Whether there is no mesh yet.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// Makes the triangles of tubes.
    fn finish_tubes(&mut self) -> Result<(), ImportError> {
        let segments = |added: &Added| added.tubes.tubes.iter().map(|tube| tube.segments().len()).sum::<usize>();
        let are_few = self.meshes.iter().map(segments).sum::<usize>() < pipes::FEWEST_SEGMENTS;
        let mut meshes = std::mem::take(&mut self.meshes);
        for added in meshes.iter_mut().filter(|added| !added.tubes.tubes.is_empty()) {
            let (node, role, counted) = (added.mesh.node.clone(), added.mesh.role, added.tubes.sections.len());
            if are_few {
                added.mesh = pipes::mesh(node, role, &std::mem::take(&mut added.tubes));
                added.dropped = self.drop_degenerate(&mut added.mesh);
            } else {
                let made = pipes::prisms(node, role, &added.tubes, self.options.triangles_of_tubes());
                Prisms { mesh: added.mesh, tubes: added.tubes, pieces: added.pieces } = made;
            }
            self.count(added.mesh.triangles.len().saturating_sub(counted))?;
            if !added.mesh.positions.iter().all(is_sound) {
                return Err(ImportError::NotFinite { node: added.mesh.node.clone() });
            }
        }
        meshes.retain(|added| !added.mesh.triangles.is_empty());
        self.meshes = meshes;
        Ok(())
    }

    /// Sets the role of skies and other backdrops, in formats without types.
    fn find_backdrops(&mut self) {
        if !["glTF", "OBJ", "PLY", "STL"].contains(&self.source.format.as_str()) {
            return;
        }
        let found = sky::backdrops(&self.meshes.iter().map(Added::shape).collect::<Vec<_>>());
        let mut names = Vec::new();
        for added in self.meshes.iter_mut().zip(found).filter_map(|(added, found)| found.then_some(added)) {
            (added.mesh.role, added.mesh.opaque, added.glass) = (Role::Sky, false, false);
            names.push(added.mesh.node.clone());
        }
        if !names.is_empty() {
            let more = if names.len() > 3 { ", ..." } else { "" };
            names.truncate(3);
            let what = format!(
                "{}{more}: taken for the sky or a backdrop, so it hides nothing and bounds no room; if it is a wall or a ground, give it \
                 the role structure in MODEL.roles.json",
                names.join(", ")
            );
            self.source.notes.push(Note::taken(what));
        }
    }

    /// Counts triangles that an importer leaves out because a corner is not finite.
    pub fn leave_out(&mut self, node: &str, triangles: usize) {
        self.broken += triangles;
        self.first_broken.get_or_insert_with(|| node.to_owned());
    }

    /// Removes triangles without area or with invalid corners from a mesh. Returns their numbers.
    fn drop_degenerate(&mut self, mesh: &mut Mesh) -> Vec<u32> {
        let (positions, mut dropped, mut next, mut broken) = (&mesh.positions, Vec::new(), 0.., 0);
        mesh.triangles.retain(|t| {
            let corners = t.map(|i| positions[i as usize]);
            let has_place = corners.iter().all(is_sound);
            let is_kept = has_place && has_area(corners);
            broken += usize::from(!has_place);
            dropped.extend(next.next().filter(|_| !is_kept));
            is_kept
        });
        self.degenerate += dropped.len() - broken;
        if broken > 0 {
            self.leave_out(&mesh.node, broken);
        }
        dropped
    }

    /// Builds the scene. The origin is the centre of the bounding box, rounded to whole metres; equal corners of an object are merged.
    pub fn finish(mut self, name: &str) -> Result<Scene, ImportError> {
        self.finish_tubes()?;
        self.find_backdrops();
        let used = |m: &Mesh| Aabb::of(m.triangles.iter().flatten().map(|&i| m.positions[i as usize]));
        let bounds = self.meshes.iter().fold(Aabb::EMPTY, |b, added| b.union(used(&added.mesh)));
        if bounds.is_empty() {
            return Err(self.first_broken.map_or(ImportError::Empty, |node| ImportError::NotFinite { node }));
        }
        self.note_losses();
        let origin = bounds.centre().round();
        let (mut positions, mut triangles, mut objects, mut tubes) = (Vec::new(), Vec::new(), Vec::new(), Tubes::default());
        let mut groups: BTreeMap<u32, Vec<ObjectId>> = BTreeMap::new();
        let mut trace = self.begin_trace();
        for mut added in self.meshes {
            let whole = 0..added.mesh.triangles.len() as u32;
            let parts = if added.pieces.is_empty() { vec![[whole, 0..0]] } else { std::mem::take(&mut added.pieces) };
            trace.iter_mut().for_each(|trace| added.enter(trace, parts.len()));
            let Added { mesh, glass, facts: Facts { reach, group, .. }, .. } = added;
            if tubes.sections.len() + added.tubes.sections.len() >= MOST_SECTIONS {
                return Err(ImportError::Sections { limit: MOST_SECTIONS });
            }
            let first = tubes.append(added.tubes, -origin);
            for [part, segments] in parts {
                let mut welded = HashMap::with_capacity(part.len());
                let start = triangles.len() as u32;
                let mut bounds = Aabb::EMPTY;
                for triangle in &mesh.triangles[part.start as usize..part.end as usize] {
                    triangles.push(triangle.map(|i| {
                        let p = mesh.positions[i as usize] - origin;
                        // Adding zero makes -0.0 equal to 0.0.
                        *welded.entry((p + 0.0).to_array().map(f64::to_bits)).or_insert_with(|| {
                            bounds = bounds.with(p);
                            positions.push(p);
                            positions.len() as u32 - 1
                        })
                    }));
                }
                let triangles = start..triangles.len() as u32;
                let (node, role, opaque) = (mesh.node.clone(), mesh.role, mesh.opaque);
                let segments = if segments.is_empty() { 0..0 } else { segments.start + first..segments.end + first };
                if let Some(group) = group {
                    groups.entry(group).or_default().push(ObjectId(objects.len() as u32));
                }
                let around = |reach: Aabb| Aabb { min: reach.min - origin, max: reach.max - origin }.union(bounds);
                let reach = reach.map(around);
                objects.push(Object { node, role, opaque, glass, triangles, segments, bounds, reach });
            }
        }
        let together = joined(groups.into_values(), &mut objects);
        self.source.notes.extend(see_through(&objects, &self.source.format));
        let hints = moved(self.hints, origin);
        let (name, source) = (name.to_owned(), self.source);
        let whole = Scene { name, source, origin, positions, triangles, objects, tubes, together, hints, trace };
        let mut scene = split_objects(whole, self.options.object_triangles);
        let count = scene.tube_count();
        scene.source.notes.extend(count.map(|count| Note::detail(count.to_string())));
        Ok(scene)
    }
}

/// Hints relative to an origin.
fn moved(mut hints: Hints, origin: DVec3) -> Hints {
    for s in &mut hints.storeys {
        s.elevation -= origin.y;
    }
    for p in hints.rooms.iter_mut().flat_map(|r| r.surface.iter_mut().flatten()) {
        *p -= origin;
    }
    for p in hints.openings.iter_mut().flat_map(|o| o.winding.iter_mut()) {
        *p -= origin;
    }
    if let Some(Leaves { leaves, portals, walls, shutters: _ }) = &mut hints.leaves {
        leaves.iter_mut().flatten().for_each(|plane| plane.d -= plane.n.dot(origin));
        let windings = portals.iter_mut().map(|p| &mut p.winding).chain(walls);
        windings.flatten().for_each(|p| *p -= origin);
    }
    hints
}

/// Groups of at least two objects. Each object of a group gets the reach of the whole group.
fn joined(groups: impl Iterator<Item = Vec<ObjectId>>, objects: &mut [Object]) -> Vec<Vec<ObjectId>> {
    let groups: Vec<Vec<ObjectId>> = groups.filter(|group| group.len() > 1).collect();
    for group in &groups {
        let reach = group.iter().fold(Aabb::EMPTY, |b, o| b.union(objects[o.index()].extent()));
        group.iter().for_each(|o| objects[o.index()].reach = Some(reach));
    }
    groups
}

/// A note if much is see-through: exporters of glTF and OBJ often mark whole buildings so.
fn see_through(objects: &[Object], format: &str) -> Option<Note> {
    let count = |is_counted: &dyn Fn(&Object) -> bool| {
        objects.iter().filter(|o| is_counted(o)).map(|o| o.triangles.len()).sum::<usize>()
    };
    let (all, clear) = (count(&|_| true), count(&|o| !o.opaque && o.glass));
    let percent = 100.0 * clear as f64 / all.max(1) as f64;
    (percent >= MUCH && ["glTF", "OBJ"].contains(&format)).then(|| {
        Note::cost(format!(
            "{percent:.0} % of the triangles have see-through materials and hide nothing; if they are walls, give them the role opaque in MODEL.roles.json"
        ))
    })
}

/// True if coordinates are finite and within 1e12 m.
fn is_sound(p: &DVec3) -> bool {
    // A NaN fails the comparison, too.
    p.abs().cmple(DVec3::splat(FARTHEST)).all()
}

/// A name of limited length for an object: every object of a mesh repeats it, so a file with one endless name must not fill the memory.
pub fn short_name(name: &str) -> String {
    const LONGEST: usize = 200;
    match name.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &name[..end]),
        None => name.to_owned(),
    }
}

/// Whether a texture with these coordinates shows more than its mean.
fn can_be_seen(corners: &[[f32; 2]; 3]) -> bool {
    let repeats = |k: usize| {
        let along = corners.map(|corner| corner[k]);
        along.iter().copied().fold(f32::NEG_INFINITY, f32::max) - along.iter().copied().fold(f32::INFINITY, f32::min)
    };
    corners.as_flattened().iter().all(|x| x.is_finite()) && repeats(0).max(repeats(1)) <= MOST_REPEATS
}

/// True if the triangle's least height is above the rounding error of its coordinates: below it, the triangle is a segment and its normal
/// is noise.
fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (b - a).cross(c - a).length() > 4.0 * f64::EPSILON * largest * longest
}

impl SceneBuilder {
    /// A trace without meshes, if one is asked for; takes the materials.
    fn begin_trace(&mut self) -> Option<Trace> {
        self.options.trace.then(|| Trace {
            looks: vec![Look::default(); self.handed_in as usize],
            materials: std::mem::take(&mut self.materials),
            ..Trace::default()
        })
    }

    /// Adds notes on triangles that were dropped or left out.
    fn note_losses(&mut self) {
        if self.degenerate > 0 {
            self.source.notes.push(Note::detail(format!("{} triangles without area dropped", self.degenerate)));
        }
        if let Some(node) = &self.first_broken {
            let count = self.broken;
            let what = format!("{count} triangles left out: a corner is not a finite number (first in {node})");
            self.source.notes.push(Note::fault(what));
        }
    }
}

impl Added {
    /// Enters a mesh of this many objects into a trace, which takes its look.
    fn enter(&mut self, trace: &mut Trace, objects: usize) {
        trace.meshes.extend(std::iter::repeat_n(self.number, objects));
        trace.triangles.extend(self.numbers());
        trace.looks[self.number as usize] = std::mem::take(&mut self.look);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f64; 3]; 3]) -> Mesh {
        let positions = corners.map(DVec3::from).to_vec();
        Mesh { node: "m".into(), role: Role::Unknown, opaque: true, positions, triangles: vec![[0, 1, 2]] }
    }

    fn builder(max_triangles: usize) -> SceneBuilder {
        SceneBuilder::new(&ImportOptions { max_triangles, ..ImportOptions::default() }, Source::default())
    }

    #[test]
    fn triangles_without_area_are_dropped_and_counted() {
        let mut b = builder(10);
        b.add(triangle([[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [0.3, 0.3, 0.3]])).unwrap();
        b.add(triangle([[1e7, 0.0, 0.0], [1e7, 1.0, 0.0], [1e7, 0.0, 1e-9]])).unwrap();
        b.add(triangle([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1e-9]])).unwrap();
        let scene = b.finish("s").unwrap();
        assert_eq!(scene.triangles.len(), 1);
        assert_eq!(scene.source.notes, ["2 triangles without area dropped"]);
    }

    #[test]
    fn the_limit_is_on_the_sum_and_equal_corners_are_welded() {
        let mut b = builder(2);
        let mut twice = triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        twice.positions.extend([[0.0, 1.0, -0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]].map(DVec3::from));
        twice.triangles.push([3, 4, 5]);
        b.add(twice).unwrap();
        assert!(matches!(b.count(1), Err(ImportError::TooLarge { limit: 2 })));
        let scene = b.finish("s").unwrap();
        assert_eq!((scene.positions.len(), scene.triangles), (4, vec![[0, 1, 2], [2, 1, 3]]));
    }

    #[test]
    fn a_trace_counts_what_was_dropped() {
        let mut b = SceneBuilder::new(&ImportOptions { trace: true, ..ImportOptions::default() }, Source::default());
        b.add(triangle([[0.1; 3], [0.2; 3], [0.3; 3]])).unwrap();
        let mut mesh = triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        mesh.triangles = vec![[0, 0, 1], [0, 1, 2], [1, 1, 1], [2, 1, 0]];
        let red = Material::matt("red", [1.0, 0.0, 0.0, 1.0]);
        b.look(red.clone(), vec![[[0.5; 2]; 3]; 4]);
        b.add(mesh).unwrap();
        b.add(triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])).unwrap();
        let trace = b.finish("s").unwrap().trace.unwrap();
        assert_eq!((trace.meshes, trace.triangles, trace.materials), (vec![1, 2], vec![1, 3, 0], vec![red]));
        let materials: Vec<Option<u32>> = trace.looks.iter().map(|look| look.material).collect();
        assert_eq!(materials, [None, Some(0), None]);
        assert_eq!(trace.looks[1].texture_coordinates.len(), 4);
    }

    #[test]
    fn numbers_that_mean_nothing_are_refused() {
        for bad in [f64::NAN, f64::INFINITY, -1e13] {
            let broken = || triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, bad, 0.0]]);
            let mut alone = builder(9);
            alone.add(broken()).unwrap();
            assert!(matches!(alone.finish("s"), Err(ImportError::NotFinite { node }) if node == "m"), "{bad}");
            // Among others it is left out, and reported.
            let mut beside = builder(9);
            beside.add(broken()).unwrap();
            beside.add(triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])).unwrap();
            let scene = beside.finish("s").unwrap();
            assert_eq!(scene.triangles.len(), 1);
            assert_eq!(scene.source.notes, ["1 triangles left out: a corner is not a finite number (first in m)"]);
        }
        let mut mesh = triangle([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        mesh.triangles.push([0, 1, 3]);
        assert!(matches!(builder(9).add(mesh), Err(ImportError::Malformed { .. })));
        assert!(matches!(builder(9).finish("s"), Err(ImportError::Empty)));
    }
}
