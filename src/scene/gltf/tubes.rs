//! Tubes of a document: lines with a radius, and nodes whose extras say that their mesh is a tube.

use super::super::lines::Line;
use super::super::{ImportError, Place, Role};
use super::data::{Buffers, broken};
use super::document::Primitive;
use super::primitive::Part;
use super::{Drawn, Importer, Placement, Visit};
use crate::tubes::Shape;
use glam::{DAffine3, DVec3};
use serde::Deserialize;

/// `extras.enfilade.tube` of a node; lengths in the node's own unit.
#[derive(Deserialize, Clone)]
#[serde(deny_unknown_fields)]
pub(super) struct Tube {
    radius: f64,
    /// Radius of the hole.
    #[serde(default)]
    inner: f64,
    /// Without faces at its ends.
    #[serde(default)]
    open: bool,
    /// The last point is followed by the first one.
    #[serde(default)]
    closed: bool,
    /// Goes smoothly through the points.
    #[serde(default)]
    smooth: bool,
    /// Instead of the node's mesh; without any, the lines of the mesh are meant.
    #[serde(default)]
    points: Vec<[f64; 3]>,
}

/// Of lengths: scales that differ by more make circles something else.
const EVEN: f64 = 1e-6;

impl Importer<'_> {
    /// Adds the tubes of a node with a mesh. True if they stand for the whole mesh.
    pub(super) fn add_tubes(
        &mut self,
        name: &str,
        mesh: usize,
        visit: &Visit,
        instance: Option<Placement>,
        tube: Option<&Tube>,
    ) -> Result<bool, ImportError> {
        let world = instance.map_or(visit.parent, |instance| visit.parent * instance.transform());
        let stands_for_mesh = tube.is_some_and(|tube| !tube.points.is_empty());
        let default = self.tube_radius.map(|radius| Tube {
            radius: radius / scale(&world).unwrap_or(1.0),
            inner: 0.0,
            open: false,
            closed: false,
            smooth: false,
            points: Vec::new(),
        });
        let Some(tube) = tube.or(default.as_ref()) else { return Ok(false) };
        let scale = match scale(&world) {
            Some(scale) => scale,
            None if stands_for_mesh => return Ok(false),
            None => return Err(broken(format!("node {name}: a tube whose scale isn't the same in all directions"))),
        };
        let shape = Shape { radius: tube.radius * scale, inner: tube.inner * scale, capped: !tube.open };
        if stands_for_mesh && self.builder.has_tubes() {
            let points: Vec<DVec3> = tube.points.iter().map(|&p| world.transform_point3(p.into())).collect();
            self.add_line(name, [visit.node, mesh, 0], instance, &points, tube, shape)?;
            return Ok(true);
        }
        let document = self.document;
        for (i, primitive) in document.meshes[mesh].primitives.iter().enumerate().filter(|_| !stands_for_mesh) {
            if is_of_lines(primitive) {
                self.lines_of_tubes.insert((mesh, i));
            }
            for points in polylines(&self.buffers, primitive)? {
                let points: Vec<DVec3> = points.iter().map(|&p| world.transform_point3(p)).collect();
                let closed = tube.closed || primitive.mode == Some(LOOP);
                let tube = Tube { closed, ..tube.clone() };
                self.add_line(name, [visit.node, mesh, i], instance, &points, &tube, shape)?;
            }
        }
        Ok(false)
    }

    fn add_line(
        &mut self,
        name: &str,
        [node, mesh, primitive]: [usize; 3],
        instance: Option<Placement>,
        points: &[DVec3],
        tube: &Tube,
        shape: Shape,
    ) -> Result<(), ImportError> {
        let part = Part { positions: Vec::new(), vertices: Vec::new(), triangles: Vec::new() };
        if let Some((look, _)) = self.looks.as_ref().and_then(|l| l.of(&self.buffers, [mesh, primitive], &part)) {
            self.builder.look(look, Vec::new());
        }
        let place = format!("node {name}: extras.enfilade.tube");
        // Tubes bound no rooms.
        let (role, &Tube { closed, smooth, .. }) = (Role::Furnishing, tube);
        let line = Line { name, place: &place, role, points, closed, smooth, shape };
        self.drawn.push(Drawn { node, mesh, primitive, instance });
        self.lines.add(&mut self.builder, &line)
    }
}

/// How much larger things are in the world, if that is the same in all directions.
fn scale(world: &DAffine3) -> Option<f64> {
    let axes = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis];
    let scale = axes[0].length();
    let is_even = axes.iter().all(|axis| (axis.length() / scale - 1.0).abs() <= EVEN);
    let is_square = [(0, 1), (1, 2), (2, 0)].iter().all(|&(i, j)| axes[i].dot(axes[j]).abs() <= EVEN * scale * scale);
    (is_even && is_square && scale > 0.0).then_some(scale)
}

/// Modes of primitives: pairs of points, a ring, a line through all.
const PAIRS: u64 = 1;
const LOOP: u64 = 2;
const STRIP: u64 = 3;

/// True for a primitive of lines.
pub(super) fn is_of_lines(primitive: &Primitive) -> bool {
    matches!(primitive.mode, Some(PAIRS..=STRIP))
}

/// The lines of a primitive in its mesh's own coordinates, none of other primitives. Pairs of which one begins where the one before it ends
/// are one line.
fn polylines(buffers: &Buffers<'_>, primitive: &Primitive) -> Result<Vec<Vec<DVec3>>, ImportError> {
    let Some(position) = primitive.attributes.position.filter(|_| is_of_lines(primitive)) else { return Ok(Vec::new()) };
    buffers.refuse_filters(position)?;
    let positions = buffers.accessor(position, &["VEC3"])?;
    let indices = match primitive.indices {
        Some(index) => {
            buffers.refuse_filters(index)?;
            Some(buffers.accessor(index, &["SCALAR"])?).filter(|indices| indices.holds_indices())
        }
        None => None,
    };
    let number = |k: usize| indices.as_ref().map_or(u32::try_from(k).ok(), |indices| indices.index(k));
    let count = indices.as_ref().map_or(positions.count(), |indices| indices.count());
    let at = |k: usize| {
        let p = number(k).and_then(|number| positions.get(number as usize));
        let [x, y, z, _] = p.ok_or_else(|| {
            ImportError::malformed(Place::File, format!("a line's vertex {k} is beyond {} vertices", positions.count()))
        })?;
        Ok(DVec3::new(x, y, z))
    };
    if primitive.mode != Some(PAIRS) {
        return Ok(vec![(0..count).map(at).collect::<Result<_, ImportError>>()?]);
    }
    let mut lines: Vec<Vec<DVec3>> = Vec::new();
    for pair in 0..count / 2 {
        let [a, b] = [at(2 * pair)?, at(2 * pair + 1)?];
        match lines.last_mut().filter(|line| line.last() == Some(&a)) {
            Some(line) => line.push(b),
            None => lines.push(vec![a, b]),
        }
    }
    Ok(lines)
}
