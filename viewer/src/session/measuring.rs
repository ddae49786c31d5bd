//! Clicks that measure, and what is written at points of the scene: lengths, and names of rooms.

use super::Session;
use crate::draw::lines::Overlay;
use crate::go::bounds;
use crate::measure::{Label, Measure, Point, on_screen, snapped};
use crate::overlays::SIGHT;
use enfilade::CellId;
use enfilade::scene::rays::Hit;
use glam::{DVec2, DVec3};
use std::collections::HashSet;

/// Sides of triangles that end within this of each other, metres, are one edge.
const SAME: f64 = 1e-5;
/// Faces that meet with a larger cosine between their normals are one (2.6 degrees): the side between them is no edge.
const FLAT: f64 = 0.999;
/// Names of rooms fade from the first of these distances on, metres, and are gone at the second.
const FADES: [f64; 2] = [12.0, 45.0];
/// Text of a name, points: near, and far away.
const SIZES: [f32; 2] = [18.0, 10.0];
/// Text of a length, points.
const LENGTH: f32 = 14.0;
/// A smaller area, square metres, isn't written: of a room whose floor is elsewhere, such as a gallery around stairs.
const LEAST: f64 = 0.5;
/// A name nearer to the eye than this, metres, is in the way.
const IN_THE_WAY: f64 = 0.4;

impl Session<'_> {
    /// Begins to measure, or ends it and forgets all lengths.
    pub(super) fn toggle_measuring(&mut self) {
        self.measure = Measure { is_on: !self.measure.is_on, ..Measure::default() };
        if self.measure.is_on {
            self.tell("click two points; Escape ends".to_owned());
        }
    }

    /// Measures from or to what a point of the screen (normalised device coordinates) shows.
    pub(super) fn measure_at(&mut self, at: DVec2) {
        let Some(hit) = self.ahead(at) else { return };
        let place = self.motion.walker.eye + self.camera().ray(at).normalize() * hit.t;
        let point = self.snapped(&hit, place);
        self.measure.add(point);
    }

    fn snapped(&self, hit: &Hit, place: DVec3) -> Point {
        let triangle = hit.triangle as usize;
        let own = self.corners_now(triangle);
        // A side is an edge unless a face that lies on goes on behind it.
        let (object, scene) = (&self.document.building.scene.objects[hit.object.index()], &self.document.building.scene);
        let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or(DVec3::Y);
        let model = scene.corners(triangle);
        let is_edge = |side: usize| {
            let ends = [model[side], model[(side + 1) % 3]];
            let goes_on = |other: [DVec3; 3]| {
                let has = |p: &DVec3| other.iter().any(|q| p.distance(*q) < SAME);
                ends.iter().all(has) && normal(other).dot(normal(model)).abs() > FLAT
            };
            !object.triangles.clone().any(|t| t != hit.triangle && goes_on(scene.corners(t as usize)))
        };
        snapped(&self.camera(), self.size(), place, own, &is_edge)
    }

    /// Corners of a triangle; of a door's leaf, where it is now.
    fn corners_now(&self, triangle: usize) -> [DVec3; 3] {
        let doors = &self.renderer.doors;
        if doors.is_leaf[triangle] {
            let drawn = doors.doors.iter().flat_map(|door| door.drawn());
            let is_it = |of: Option<(_, u32)>| of.is_some_and(|(_, t)| t as usize == triangle);
            if let Some((corners, _)) = drawn.into_iter().find(|(_, facet)| is_it(facet.and_then(|f| f.of))) {
                return corners;
            }
        }
        self.document.building.scene.corners(triangle)
    }

    /// Lines of this frame's lengths.
    pub(super) fn lay_lengths_over(&self, overlay: &mut Overlay) {
        for measured in &self.measure.done {
            let [a, b] = measured.ends.map(|end| end.at.as_vec3());
            overlay.line_through(a, b, SIGHT);
        }
    }

    /// Labels of the scene: names of rooms whose cells are reached, and lengths.
    pub fn labels(&self, cells: &[CellId]) -> Vec<Label> {
        let mut labels = if self.view.layers.names { self.names(cells) } else { Vec::new() };
        let camera = self.camera();
        for measured in &self.measure.done {
            let middle = (measured.ends[0].at + measured.ends[1].at) * 0.5;
            let at = on_screen(&camera, self.size(), middle);
            labels.extend(at.map(|at| Label { at, text: measured.text(), size: LENGTH, opacity: 1.0, yields: false }));
        }
        let first = self.measure.first.and_then(|first| on_screen(&camera, self.size(), first.at));
        labels.extend(first.map(|at| Label { at, text: "+".to_owned(), size: LENGTH, opacity: 1.0, yields: false }));
        labels
    }

    /// Names and areas of rooms whose cells are reached, the nearest first; with a section in view, of the rooms that it cuts.
    fn names(&self, cells: &[CellId]) -> Vec<Label> {
        let reached: HashSet<CellId> = cells.iter().copied().collect();
        let (camera, eye) = (self.camera(), self.motion.walker.eye);
        let section = self.section().filter(|section| section.before(eye) < 0.0);
        let label = |room: &crate::start::rooms::Room| {
            let largest = room.pieces.iter().max_by(|a, b| a.area.total_cmp(&b.area))?;
            let (bounds, mut middle) = (bounds(room), largest.bounds.centre());
            if let Some(section) = section {
                // On the cut, where nothing of the room hides it.
                middle -= section.n * section.before(middle);
                if !bounds.contains(middle) {
                    return None;
                }
            } else if !reached.contains(&room.cell) {
                return None;
            }
            let away = middle.distance(eye);
            let opacity = ((FADES[1] - away) / (FADES[1] - FADES[0])).clamp(0.0, 1.0) as f32;
            if opacity <= 0.0 || away < IN_THE_WAY {
                return None;
            }
            let at = on_screen(&camera, self.size(), middle)?;
            let name = &self.document.building.file.cells[room.cell.index()].name;
            let text = if room.area < LEAST { name.clone() } else { format!("{name}\n{:.1} m²", room.area) };
            let size = SIZES[1] + (SIZES[0] - SIZES[1]) * opacity;
            Some((away, Label { at, text, size, opacity, yields: true }))
        };
        let mut labels: Vec<(f64, Label)> =
            self.document.rooms().iter().filter(|room| room.is_named).filter_map(label).collect();
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        labels.into_iter().map(|(_, mark)| mark).collect()
    }
}
