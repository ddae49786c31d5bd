//! Plans: horizontal sections of a file's cells, with the portals between them.

use super::picture::{CHARACTER, Colour, Picture, hsv, hue};
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::math::geom;
use enfilade::types::portal::PortalKind;
use glam::{DVec2, DVec3, Vec4};

const PAPER: Colour = [250, 249, 246];
const INK: Colour = [52, 56, 64];

/// The colour of a kind of portal.
pub fn portal_colour(kind: PortalKind) -> Colour {
    match kind {
        PortalKind::Door => [200, 80, 30],
        PortalKind::Window => [40, 130, 210],
        PortalKind::Opening => [40, 150, 80],
    }
}

/// Position of a plan on a picture.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlanView {
    /// The height of the cut, metres, relative to the file's origin.
    pub y: f64,
    /// The least x and z shown, metres.
    min: DVec2,
    /// The greatest x and z.
    max: DVec2,
    /// The picture's pixels at `min`.
    corner: DVec2,
    /// Pixels a metre.
    scale: f64,
}

impl PlanView {
    /// Fits the closed cells at height `y`, and further points (x, z), into a rectangle of pixels. Without such a cell it fits
    /// all objects.
    pub fn fit(file: &PvsFile, y: f64, more: &[DVec2], left: f64, top: f64, width: f64, height: f64) -> Self {
        let around = |points: &mut dyn Iterator<Item = DVec2>| {
            points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
        };
        let corners = file.objects.iter().flat_map(|o| o.bounds).map(|p| DVec2::new(f64::from(p.x), f64::from(p.z)));
        let (min, max) = around(&mut corners.chain(file.objects.is_empty().then_some(DVec2::ZERO)));
        let everything = Self { y, min, max, corner: DVec2::ZERO, scale: 1.0 };
        let closed = file.cells.iter().filter(|cell| !cell.open).flat_map(|cell| &cell.pieces);
        let rooms = around(&mut closed.flat_map(|piece| everything.slice(piece)));
        let (min, max) = if rooms.0.cmple(rooms.1).all() { rooms } else { (min, max) };
        let (min, max) = more.iter().fold((min, max), |(lo, hi), &p| (lo.min(p), hi.max(p)));
        let margin = (max - min).max_element().max(1e-6) * 0.05;
        let (min, max) = (min - margin, max + margin);
        let size = max - min;
        let scale = (width / size.x).min(height / size.y);
        let corner = DVec2::new(left, top) + (DVec2::new(width, height) - size * scale) * 0.5;
        Self { y, min, max, corner, scale }
    }

    /// Pixels of a point (x, z), metres relative to the file's origin; +Z is down.
    pub fn pixel(&self, p: DVec2) -> DVec2 {
        self.corner + (p - self.min) * self.scale
    }

    /// Draws cells and then portals: coloured if `shown` is true, otherwise grey and below.
    pub fn draw(&self, picture: &mut Picture, file: &PvsFile, shown: &dyn Fn(CellId) -> bool) {
        for pass in [false, true] {
            for (c, cell) in file.cells.iter().enumerate().filter(|&(c, _)| shown(CellId(c as u32)) == pass) {
                let full = if cell.open { [214, 228, 214] } else { hsv(hue(c), 0.38, 0.95) };
                for piece in &cell.pieces {
                    let corners: Vec<DVec2> = self.slice(piece).into_iter().map(|p| self.pixel(p)).collect();
                    picture.polygon(&corners, if pass { full } else { [228, 228, 224] }, 1.0);
                }
            }
        }
        // As wide as a wall, but always visible.
        let thickness = (0.15 * self.scale).clamp(0.8, 3.0);
        for pass in [false, true] {
            for portal in file.portals.iter().filter(|portal| portal.cells.iter().any(|&c| shown(c)) == pass) {
                if let Some((a, b)) = self.cut(&portal.winding.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>()) {
                    let colour = if pass { portal_colour(portal.kind) } else { [190, 190, 186] };
                    picture.line(self.pixel(a), self.pixel(b), thickness, colour);
                }
            }
        }
    }

    /// The section of a convex piece at the height of the cut, (x, z), within the plan.
    fn slice(&self, planes: &[Vec4]) -> Vec<DVec2> {
        let (min, max) = (self.min, self.max);
        let corners = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
        let mut polygon: Vec<DVec3> = corners.iter().map(|p| DVec3::new(p.x, self.y, p.y)).collect();
        for plane in planes {
            let plane = geom::Plane { n: plane.truncate().as_dvec3(), d: f64::from(plane.w) };
            polygon = geom::clip(&polygon, &plane, 1e-9);
        }
        polygon.into_iter().map(|p| DVec2::new(p.x, p.z)).collect()
    }

    /// The section of a winding at the height of the cut, (x, z).
    fn cut(&self, winding: &[DVec3]) -> Option<(DVec2, DVec2)> {
        let mut ends =
            winding.iter().zip(winding.iter().cycle().skip(1)).filter(|(a, b)| (a.y <= self.y) != (b.y <= self.y)).map(
                |(a, b)| {
                    let p = *a + (*b - *a) * ((self.y - a.y) / (b.y - a.y));
                    DVec2::new(p.x, p.z)
                },
            );
        Some((ends.next()?, ends.next()?))
    }

    /// Draws the eye and its view: `left` and `right` are the sides of the view as directions (x, z).
    pub fn draw_eye(&self, picture: &mut Picture, eye: DVec2, left: DVec2, right: DVec2) {
        let at = self.pixel(eye);
        let reach = (self.max - self.min).length() * self.scale * 0.14;
        let tips = [left, right].map(|v| at + v.normalize_or_zero() * reach);
        picture.polygon(&[at, tips[0], tips[1]], [230, 60, 60], 0.30);
        for tip in tips {
            picture.line(at, tip, 1.0, [200, 40, 40]);
        }
        picture.line(at, at, 5.0, [200, 30, 30]);
    }
}

/// A plan of a whole file at height `y` (metres, relative to its origin): cells in colours, portals by kind, a legend.
/// `size` is width and height in pixels, 64 or more each.
pub fn plan_picture(file: &PvsFile, y: f64, size: (usize, usize)) -> Picture {
    let (width, height) = (size.0.max(64), size.1.max(64));
    let scale = if width >= 1200 { 2 } else { 1 };
    let legend = CHARACTER * scale * 2;
    let mut picture = Picture::new(width, height, PAPER);
    let plan = PlanView::fit(file, y, &[], 4.0, 4.0, width as f64 - 8.0, (height - legend) as f64 - 8.0);
    plan.draw(&mut picture, file, &|_| true);
    let top = (height - legend) as i64;
    picture.fill(0, top, width as i64, legend as i64, [255; 3], 1.0);
    picture.fill(0, top, width as i64, 1, INK, 0.3);
    let mut x = 6;
    let line = top + (legend / 4) as i64;
    let title = format!("{} cells, y = {:.2} m", file.cells.len(), y + file.origin.y);
    picture.text(x, line, scale, &title, INK);
    x += ((title.len() + 2) * CHARACTER * scale) as i64;
    for (name, kind) in [("door", PortalKind::Door), ("window", PortalKind::Window), ("opening", PortalKind::Opening)] {
        picture.fill(x, line + 3 * scale as i64, (12 * scale) as i64, (2 * scale) as i64, portal_colour(kind), 1.0);
        picture.text(x + (16 * scale) as i64, line, scale, name, INK);
        x += ((name.len() * CHARACTER + 32) * scale) as i64;
    }
    picture
}
