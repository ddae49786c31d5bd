//! Lengths between points that a person clicks: corners, edges and faces of the model.

use enfilade::runtime::Camera;
use glam::{DVec2, DVec3};

/// Distance of a click from the corner that it means, pixels.
const CORNER: f64 = 14.0;
/// Distance of a click from the edge that it means, pixels.
const EDGE: f64 = 9.0;
/// Faces whose normals have a larger cosine than this are parallel (0.8 degrees).
const PARALLEL: f64 = 0.9999;
/// A point behind the eye, or so near to its plane, metres, is nowhere on the screen.
const NEAR: f64 = 1e-3;

/// The feature that a click met.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum On {
    /// A corner of a triangle.
    Corner,
    /// An edge of one where faces meet.
    Edge,
    /// The face.
    Face,
}

/// A point of a measurement.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Point {
    /// Metres relative to the origin.
    pub at: DVec3,
    /// The normal of the face that was met.
    pub normal: DVec3,
    /// A corner, an edge or a face.
    pub on: On,
}

/// Two points.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Measured {
    /// From one to the other.
    pub ends: [Point; 2],
}

/// Measurements, and one that is begun.
#[derive(Clone, Default, Debug)]
pub struct Measure {
    /// Whether clicks measure.
    pub is_on: bool,
    /// The first point of the next.
    pub first: Option<Point>,
    /// All of them.
    pub done: Vec<Measured>,
}

/// Text at a point of the picture.
#[derive(Clone, PartialEq, Debug)]
pub struct Label {
    /// The middle, pixels.
    pub at: DVec2,
    /// The text.
    pub text: String,
    /// Size of the text, points.
    pub size: f32,
    /// 0 (invisible) to 1.
    pub opacity: f32,
    /// It is left out where it would lie on a label before it.
    pub yields: bool,
}

impl Measured {
    /// Metres.
    pub fn length(&self) -> f64 {
        self.ends[0].at.distance(self.ends[1].at)
    }

    /// Along x, y (up) and z, metres.
    pub fn along(&self) -> DVec3 {
        (self.ends[1].at - self.ends[0].at).abs()
    }

    /// How far the faces are apart, metres, if they are parallel.
    pub fn between_faces(&self) -> Option<f64> {
        let [a, b] = self.ends;
        let is_parallel = a.normal.dot(b.normal).abs() > PARALLEL;
        is_parallel.then(|| a.normal.dot(b.at - a.at).abs())
    }

    /// In words.
    pub fn text(&self) -> String {
        let d = self.along();
        let between = self.between_faces().filter(|d| *d > 0.0).map(|d| format!("\n{d:.3} m between the faces"));
        format!("{:.3} m\ndx {:.3}, dy {:.3}, dz {:.3}{}", self.length(), d.x, d.y, d.z, between.unwrap_or_default())
    }
}

impl Measure {
    /// Another point.
    pub fn add(&mut self, point: Point) {
        match self.first.take() {
            Some(first) => self.done.push(Measured { ends: [first, point] }),
            None => self.first = Some(point),
        }
    }
}

/// Where a point is on the screen, pixels from its upper left corner; `None` behind the eye.
pub fn on_screen(camera: &Camera, size: [u32; 2], p: DVec3) -> Option<DVec2> {
    let v = p - camera.eye.as_dvec3();
    let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3().dot(v));
    let [width, height] = size.map(f64::from);
    (w > NEAR).then(|| DVec2::new((0.5 + 0.5 * x / w) * width, (0.5 - 0.5 * y / w) * height))
}

/// The point that a click on a triangle means. `at`: where it met the triangle; `is_edge`: whether faces meet in the triangle's side with this
/// number, from the corner with the same number to the next.
pub fn snapped(camera: &Camera, size: [u32; 2], at: DVec3, corners: [DVec3; 3], is_edge: &dyn Fn(usize) -> bool) -> Point {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(DVec3::Y);
    let point = |at, on| Point { at, normal, on };
    let Some(clicked) = on_screen(camera, size, at) else { return point(at, On::Face) };
    let off = |p: &DVec3| on_screen(camera, size, *p).map_or(f64::INFINITY, |p| p.distance(clicked));
    let corner = corners.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    if let Some(corner) = corner.filter(|p| off(p) <= CORNER) {
        return point(corner, On::Corner);
    }
    let nearest = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        a + (b - a) * ((at - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let edges = (0..3).filter(|&i| is_edge(i)).map(nearest);
    match edges.min_by(|a, b| off(a).total_cmp(&off(b))).filter(|p| off(p) <= EDGE) {
        Some(edge) => point(edge, On::Edge),
        None => point(at, On::Face),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [800, 600];

    fn camera() -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 4.0 / 3.0)
    }

    #[test]
    fn a_click_snaps_to_a_corner_then_an_edge_then_nothing() {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, -4.0));
        let click = |x: f64, y: f64, edges: [bool; 3]| {
            let point = snapped(&camera(), SIZE, DVec3::new(x, y, -4.0), corners, &|i| edges[i]);
            (point.on, point.at)
        };
        assert_eq!(click(-0.98, -0.97, [true; 3]), (On::Corner, corners[0]));
        let (on, at) = click(0.1, -0.97, [true; 3]);
        assert!(on == On::Edge && at.distance(DVec3::new(0.1, -1.0, -4.0)) < 1e-9, "{at}");
        // The diagonal of a square is no edge.
        assert_eq!(click(0.0, 0.0, [true, false, true]).0, On::Face);
        assert_eq!(click(-0.5, -0.5, [true; 3]), (On::Face, DVec3::new(-0.5, -0.5, -4.0)));
    }

    #[test]
    fn lengths_are_told_along_the_axes_and_between_parallel_faces() {
        let point = |x, y, z, normal| Point { at: DVec3::new(x, y, z), normal, on: On::Face };
        let mut measure = Measure::default();
        measure.add(point(0.0, 0.0, 0.0, DVec3::X));
        assert!(measure.done.is_empty());
        measure.add(point(-3.0, 0.0, 4.0, DVec3::NEG_X));
        let [measured] = measure.done[..] else { panic!("one") };
        assert_eq!(measured.text(), "5.000 m\ndx 3.000, dy 0.000, dz 4.000\n3.000 m between the faces");
        let turned = Measured { ends: [measured.ends[0], point(1.0, 0.0, 0.0, DVec3::Y)] };
        assert_eq!((turned.length(), turned.between_faces()), (1.0, None));
    }

    #[test]
    fn the_middle_of_the_view_is_the_middle_of_the_screen() {
        let middle = on_screen(&camera(), SIZE, DVec3::new(0.0, 0.0, -7.0)).unwrap();
        assert!(middle.distance(DVec2::new(400.0, 300.0)) < 1e-3, "{middle}");
        assert_eq!(on_screen(&camera(), SIZE, DVec3::new(0.0, 0.0, 7.0)), None);
    }
}
