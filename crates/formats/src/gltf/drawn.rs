//! Adds what nodes draw: primitives in the world, with roles and materials, and tubes.

use super::bent::{self, Weights};
use super::data::{broken, entry};
use super::document::{Material, Primitive};
use super::motion;
use super::placement::Placement;
use super::primitive::Part;
use super::tubes::{self, Tube};
use super::{Drawn, Importer, Joints, Visit};
use crate::helpers;
use crate::lines::Line;
use enfilade::math::geom::Aabb;
use enfilade::scene::builder::Facts;
use enfilade::scene::sky::Backdrop;
use enfilade::scene::{ImportError, Mesh, Role};
use glam::{DAffine3, DVec3};
use std::rc::Rc;

/// A mesh drawn by a node.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    mesh: usize,
    instance: Option<Placement>,
    /// World transform of the mesh in the file's pose.
    world: DAffine3,
    /// Whether an animation moves the node or an ancestor.
    moves: bool,
}

/// A primitive in the world.
struct Placed {
    positions: Vec<DVec3>,
    /// Bounds of all poses; `None` if it has only one.
    reach: Option<Aabb>,
    /// Whether an animation or a skeleton may move or bend it.
    moves: bool,
}

impl Importer<'_> {
    /// Adds visible geometry.
    pub(super) fn add(
        &mut self,
        name: &str,
        mesh: usize,
        visit: &Visit,
        instance: Option<Placement>,
        parts: &[Option<Part>],
        tube: Option<&Tube>,
    ) -> Result<(), ImportError> {
        if self.add_tubes(name, mesh, visit, instance, tube)? {
            return Ok(());
        }
        let world = instance.map_or(visit.parent, |instance| visit.parent * instance.transform());
        let place = Place { node: visit.node, mesh, instance, world, moves: visit.moves || visit.is_body };
        for (i, part) in parts.iter().enumerate() {
            if let Some(part) = part {
                let node = if parts.len() > 1 { format!("{name}/{i}") } else { name.to_owned() };
                self.add_part((name, node), visit, &place, i, part)?;
            }
        }
        Ok(())
    }

    /// Adds a primitive of a mesh: `i`, named after a node, under a name of its own.
    fn add_part(
        &mut self,
        (name, node): (&str, String),
        visit: &Visit,
        place: &Place,
        i: usize,
        part: &Part,
    ) -> Result<(), ImportError> {
        let primitive = &self.document.meshes[place.mesh].primitives[i];
        let material = primitive.material.map(|m| entry(&self.document.materials, m, "material")).transpose()?;
        let mut visit = *visit;
        self.name_part(&mut visit, name, material, i == 0);
        let Placed { positions, reach, moves } = self.placed(place, primitive, part)?;
        let may_move = (moves || visit.fades) && !visit.by_hand;
        if may_move && matches!(visit.role, Role::Structure | Role::Unknown) {
            visit.role = Role::Furnishing;
        }
        let by_physics = visit.is_body && !visit.moves && !visit.fades;
        *if by_physics { &mut self.bodies } else { &mut self.moved } += usize::from(may_move && i == 0);
        let hides = !may_move && !matches!(visit.role, Role::Door | Role::Window | Role::Helper | Role::Sky);
        self.authored.furnish(visit.room, &positions);
        let glass = visit.glass.unwrap_or_else(|| material.is_some_and(|m| self.shows_through(primitive, m)));
        let Place { node: number, mesh, instance, world, .. } = *place;
        let mirrored = world.matrix3.determinant() < 0.0;
        self.drawn.push(Drawn { node: number, mesh, primitive: i, is_tube: false, instance });
        if let Some((look, coordinates)) = self.looks.as_ref().and_then(|l| l.of(&self.buffers, [mesh, i], part)) {
            let coordinates = coordinates.into_iter().map(|triangle| turned(triangle, mirrored));
            self.builder.look(look, coordinates.collect());
        }
        let triangles = part.triangles.iter().map(|&triangle| turned(triangle, mirrored)).collect();
        let mesh = Mesh { node, role: visit.role, opaque: hides && !glass, positions, triangles };
        self.builder.facts(Facts {
            reach: reach.filter(|_| may_move),
            group: visit.level.map(|level| level.group),
            unlit: material.is_some_and(Material::is_unlit),
            told: visit.by_hand,
            backdrop: Backdrop::named(name, material.map_or("", |m| m.name())),
        });
        if glass {
            self.builder.add_glass(mesh)
        } else if hides {
            self.builder.add(mesh)
        } else {
            self.builder.add_moving(mesh)
        }
    }

    /// Applies what the names of a node and of a primitive's material say, and counts it.
    fn name_part(&mut self, visit: &mut Visit, name: &str, material: Option<&Material>, is_first: bool) {
        visit.is_named(self.naming.of(name, material.map_or("", |m| m.name())));
        self.by_name.count(visit.role, !visit.told);
        let has_name = |name: &str| self.names.contains(name);
        let of_material = helpers::Mesh { name, material: material.map(|m| m.name()), has_name: Some(&has_name) };
        let is_lower = visit.level.is_some_and(|level| !level.is_finest);
        if !visit.by_hand && (visit.helper || is_lower || helpers::is_helper(of_material)) {
            (visit.role, visit.glass) = (Role::Helper, Some(false));
        }
        if visit.role == Role::Helper && is_first {
            self.helpers.count(name);
        }
    }

    /// Whether a material lets one see through a primitive.
    fn shows_through(&self, primitive: &Primitive, material: &Material) -> bool {
        let has_alpha = || {
            primitive.attributes.colour.is_some()
                || primitive.material.is_none_or(|m| !self.alpha.is_one(m) || self.motion.changes(m))
        };
        material.transmits() || material.has_alpha_mode() && has_alpha()
    }

    /// The vertices of a primitive in the world, and the bounds of all poses.
    fn placed(&mut self, place: &Place, primitive: &Primitive, part: &Part) -> Result<Placed, ImportError> {
        let (document, root) = (self.document, self.root);
        let Place { node, mesh, instance, world, moves } = *place;
        let weights = document.node(node).weights.as_deref().unwrap_or(&document.meshes[mesh].weights);
        let ranges = self.motion.weights(node);
        let morphed = bent::morph(&self.buffers, primitive, part, weights, ranges, &mut self.morphs_read)?;
        let range = morphed.range.unwrap_or_default();
        if let Some(joints) = document.node(node).skin.map(|skin| self.joints_of(skin)).transpose()?
            && let Some(weights) = Weights::read(&self.buffers, primitive, part, joints.len())?
        {
            let positions = weights.bend(&joints, &morphed.positions);
            if !joints.moves && range.is_empty() {
                return Ok(Placed { positions, reach: None, moves: true });
            }
            let points = || morphed.positions.iter().map(|&p| [p, p]).collect();
            let range = if range.is_empty() { points() } else { range };
            let reach = weights.sweep(document, &self.motion, &joints, &range, root)?;
            return Ok(Placed { positions, reach: Some(reach), moves: true });
        }
        let positions: Vec<DVec3> = morphed.positions.iter().map(|&p| world.transform_point3(p)).collect();
        if !moves && range.is_empty() {
            return Ok(Placed { positions, reach: None, moves: false });
        }
        let within = if range.is_empty() { Aabb::of(finite(morphed.positions)) } else { Aabb::of(finite(range.concat())) };
        let instanced = |p: DVec3| instance.map_or(p, |instance| instance.transform().transform_point3(p));
        let reach = match within.is_empty() {
            true => None,
            false => Some(self.motion.sweep(document, node, &motion::corners(within).map(instanced), root)?),
        };
        Ok(Placed { positions, reach, moves: true })
    }

    /// The joints of a skin, read once.
    fn joints_of(&mut self, skin: usize) -> Result<Rc<Joints>, ImportError> {
        if let Some(joints) = self.joints.get(&skin) {
            return Ok(Rc::clone(joints));
        }
        let of = entry(&self.document.skins, skin, "skin")?;
        let joints = Rc::new(Joints::read(self.document, &self.buffers, of, &self.motion, self.root)?);
        self.joints.insert(skin, Rc::clone(&joints));
        Ok(joints)
    }

    /// Adds the tubes of a node with a mesh. Returns true if they replace the whole mesh.
    fn add_tubes(
        &mut self,
        name: &str,
        mesh: usize,
        visit: &Visit,
        instance: Option<Placement>,
        tube: Option<&Tube>,
    ) -> Result<bool, ImportError> {
        let world = instance.map_or(visit.parent, |instance| visit.parent * instance.transform());
        let stands_for_mesh = tube.is_some_and(|tube| !tube.points.is_empty());
        let default = self.tube_radius.map(|radius| Tube::of_radius(radius / tubes::scale(&world).unwrap_or(1.0)));
        let has_lines = self.document.meshes[mesh].primitives.iter().any(tubes::is_of_lines);
        let Some(given) = tube.or(default.as_ref()).filter(|_| stands_for_mesh || has_lines) else { return Ok(false) };
        let (place, tube) = (if tube.is_some() { "extras.enfilade.tube" } else { "its lines" }, given);
        let scale = match tubes::scale(&world) {
            Some(scale) => scale,
            None if stands_for_mesh || default.is_some() => return Ok(false),
            None => return Err(broken(format!("node {name}: a tube needs the same scale in all directions"))),
        };
        let shape = tube.shape(scale);
        if stands_for_mesh && self.builder.has_tubes() {
            let points: Vec<DVec3> = tube.points.iter().map(|&p| world.transform_point3(p.into())).collect();
            let line = Line { name, place: &format!("node {name}: {place}"), points: &points, ..tube.line(shape) };
            self.add_line(&line, [mesh, 0], visit, instance)?;
            return Ok(true);
        }
        let document = self.document;
        for (i, primitive) in document.meshes[mesh].primitives.iter().enumerate().filter(|_| !stands_for_mesh) {
            if tubes::is_of_lines(primitive) {
                self.lines_of_tubes.insert((mesh, i));
            }
            for points in tubes::polylines(&self.buffers, primitive)? {
                let points: Vec<DVec3> = points.iter().map(|&p| world.transform_point3(p)).collect();
                let closed = tube.closed || primitive.mode == Some(tubes::LOOP);
                let place = format!("node {name}: {place}");
                let line = Line { name, place: &place, points: &points, closed, ..tube.line(shape) };
                self.add_line(&line, [mesh, i], visit, instance)?;
            }
        }
        Ok(false)
    }

    fn add_line(
        &mut self,
        line: &Line<'_>,
        [mesh, primitive]: [usize; 2],
        visit: &Visit,
        instance: Option<Placement>,
    ) -> Result<(), ImportError> {
        let part = Part { positions: Vec::new(), vertices: Vec::new(), triangles: Vec::new() };
        if let Some((look, _)) = self.looks.as_ref().and_then(|l| l.of(&self.buffers, [mesh, primitive], &part)) {
            self.builder.look(look, Vec::new());
        }
        self.authored.furnish(visit.room, line.points);
        self.drawn.push(Drawn { node: visit.node, mesh, primitive, is_tube: true, instance });
        self.lines.add(&mut self.builder, line)
    }
}

/// Finite points only.
fn finite(points: Vec<DVec3>) -> impl Iterator<Item = DVec3> {
    points.into_iter().filter(|p| p.is_finite())
}

/// The corners of a triangle, reversed if its node is mirrored.
fn turned<T>([a, b, c]: [T; 3], mirrored: bool) -> [T; 3] {
    if mirrored { [a, c, b] } else { [a, b, c] }
}
