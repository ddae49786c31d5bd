//! The plan of a storey as SVG: walls of the model, tinted cells, portals by kind.

use super::html::escape;
use super::storeys::{Storey, is_named};
use enfilade::file::{FilePortal, PvsFile};
use enfilade::math::geom::{Plane, clip};
use enfilade::scene::{Role, Scene};
use enfilade::types::portal::PortalKind;
use enfilade::{CellId, PortalId};
use glam::{DVec2, DVec3, Vec4};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;
use std::fmt::Write;

/// Shorter lines, pixels, are not drawn.
const LEAST_LINE: f64 = 0.05;

/// Portals whose normal has a greater cosine with the vertical (45 degrees) are not drawn in a plan.
const LEVEL: f32 = 0.7;

/// A plan's width and greatest height, in the units of its SVG.
const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 640.0;
/// Margin around it.
const MARGIN: f64 = 14.0;
/// Margin below it, for the scale.
const FOOT: f64 = 26.0;
/// Furniture is cut at this part of that height: above seats, below table tops.
const THINGS: f64 = 0.5;
/// Maximum lines of walls in a plan; beyond it furniture is left out, then walls.
const MOST_LINES: usize = 20_000;
/// A portal gets no number if another number is nearer than this, in units of the SVG.
const NUMBER: [f64; 2] = [15.0, 8.0];
/// Tints of cells in the style sheet.
const TINTS: usize = 7;

/// Tooltip of a cell.
pub type Note<'n> = &'n dyn Fn(CellId) -> String;

/// Draws plans at one scale and position, so that storeys match.
pub struct Plans<'f> {
    file: &'f PvsFile,
    scene: &'f Scene,
    /// The least x and z shown, metres.
    min: DVec2,
    /// The greatest x and z.
    max: DVec2,
    /// Units of the SVG a metre.
    scale: f64,
    numbers_portals: bool,
}

impl<'f> Plans<'f> {
    /// For the storeys of a file and its scene.
    pub fn new(file: &'f PvsFile, scene: &'f Scene, storeys: &[Storey]) -> Self {
        let bounds = scene.bounds();
        let flat = |p: DVec3| DVec2::new(p.x, p.z);
        let (min, max) = (flat(bounds.min), flat(bounds.max));
        let mut plans = Self { file, scene, min, max, scale: 1.0, numbers_portals: false };
        let (mut min, mut max) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for storey in storeys {
            for cell in &storey.cells {
                for p in plans.outline(*cell, storey).into_iter().flatten() {
                    (min, max) = (min.min(p), max.max(p));
                }
            }
        }
        if min.cmple(max).all() {
            // Includes the walls around them and some space outside.
            let air = 0.015 * (max - min).max_element() + 0.4;
            (plans.min, plans.max) = ((min - air).max(plans.min), (max + air).min(plans.max));
        }
        let size = (plans.max - plans.min).max(DVec2::splat(1e-6));
        plans.scale = ((WIDTH - 2.0 * MARGIN) / size.x).min((HEIGHT - 2.0 * MARGIN) / size.y);
        plans
    }

    /// With the number of each portal beside it.
    pub fn with_numbers(self) -> Self {
        Self { numbers_portals: true, ..self }
    }

    /// A storey as SVG, each cell with its note.
    pub fn svg(&self, storey: &Storey, title: &str, note: Note<'_>) -> String {
        let height = (self.max.y - self.min.y) * self.scale + 2.0 * MARGIN + FOOT;
        let mut out = format!(
            "<svg class=\"plan\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\" aria-label=\"{}\">\n",
            escape(title)
        );
        let mut labels = String::new();
        let outlines: Vec<(CellId, Vec<Vec<DVec2>>)> =
            storey.cells.iter().map(|&c| (c, self.outline(c, storey))).filter(|o| !o.1.is_empty()).collect();
        for ((cell, rings), tint) in outlines.iter().zip(tints(&outlines)) {
            let cell = *cell;
            let _ = writeln!(
                out,
                "<path class=\"cell t{}\" fill-rule=\"evenodd\" d=\"{}\"><title>{}</title></path>",
                tint,
                rings.iter().map(|ring| self.path(ring, true)).collect::<String>(),
                escape(&note(cell))
            );
            self.label(cell, rings, &mut labels);
        }
        for (class, lines) in [
            ("thing", self.lines(storey.floor + THINGS * storey.cut, true)),
            ("wall", self.lines(storey.floor + storey.cut, false)),
        ] {
            if !lines.is_empty() {
                let _ = writeln!(out, "<path class=\"{class}\" d=\"{lines}\"/>");
            }
        }
        self.portals(storey, &mut out);
        if self.numbers_portals {
            self.numbers(storey, &mut out);
        }
        out.push_str(&labels);
        self.bar(height, &mut out);
        out.push_str("</svg>\n");
        out
    }

    /// The position of a point (x, z) in the SVG.
    pub fn at(&self, p: DVec2) -> DVec2 {
        let middle = (WIDTH - 2.0 * MARGIN - (self.max.x - self.min.x) * self.scale) / 2.0;
        DVec2::new(MARGIN + middle, MARGIN) + (p - self.min) * self.scale
    }

    fn path(&self, points: &[DVec2], closed: bool) -> String {
        let mut out = String::new();
        for (i, p) in points.iter().enumerate() {
            let p = self.at(*p);
            let _ = write!(out, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, p.x, p.y);
        }
        if closed && !points.is_empty() {
            out.push('Z');
        }
        out
    }

    /// A cell's rings at the storey's cut; if it does not reach there, at half its own height.
    fn outline(&self, cell: CellId, storey: &Storey) -> Vec<Vec<DVec2>> {
        let at_cut = self.sliced(cell, storey.floor + storey.cut);
        if !at_cut.is_empty() {
            return at_cut;
        }
        let sides = self.file.cells[cell.index()].pieces.iter().flat_map(|piece| {
            let level = |p: &&Vec4| p.y.abs() > 0.99;
            piece.iter().filter(level).map(|p| f64::from(p.w) / f64::from(p.y))
        });
        let (low, high) = sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(y), b.max(y)));
        if low < high { self.sliced(cell, 0.5 * (low + high)) } else { Vec::new() }
    }

    /// The union of a cell's pieces at a height.
    fn sliced(&self, cell: CellId, y: f64) -> Vec<Vec<DVec2>> {
        // Pieces meet within rounding; grown by this, they overlap.
        let grown = 2e-5 * (self.max - self.min).length();
        let (min, max) = (self.min, self.max);
        let shown = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)].map(|p| DVec3::new(p.x, y, p.y));
        let slice = |planes: &Vec<Vec4>| {
            let mut polygon = shown.to_vec();
            for plane in planes {
                let n = plane.truncate().as_dvec3();
                let across = DVec2::new(n.x, n.z).length();
                polygon = clip(&polygon, &Plane { n, d: f64::from(plane.w) + grown * across }, 1e-9);
            }
            polygon.iter().map(|p| [p.x, p.z]).collect::<Vec<[f64; 2]>>()
        };
        let slices = self.file.cells[cell.index()].pieces.iter().map(slice).filter(|s| s.len() > 2);
        let parts: Vec<Vec<Vec<[f64; 2]>>> = slices.map(|s| vec![s]).collect();
        let none: Vec<Vec<Vec<[f64; 2]>>> = Vec::new();
        let united = if parts.len() > 1 { parts.overlay(&none, OverlayRule::Subject, FillRule::NonZero) } else { parts };
        let rings = united.into_iter().flatten().map(|ring| ring.into_iter().map(DVec2::from).collect::<Vec<_>>());
        // Rings larger than a dot of the picture.
        let visible = |ring: &Vec<DVec2>| area(ring).abs() * self.scale * self.scale > 0.5;
        rings.filter(visible).collect()
    }

    /// Section of the scene's opaque triangles at a height: of furniture, or of all else.
    fn lines(&self, y: f64, furniture: bool) -> String {
        let mut out = String::new();
        let mut count = 0;
        let wanted = self.scene.objects.iter().filter(|o| o.opaque && (o.role == Role::Furnishing) == furniture);
        for object in wanted.filter(|o| o.bounds.min.y < y && o.bounds.max.y > y) {
            for tri in object.triangles.clone() {
                let [a, b, c] = self.scene.corners(tri as usize);
                let ends: Vec<DVec2> = [(a, b), (b, c), (c, a)]
                    .into_iter()
                    .filter(|(p, q)| (p.y <= y) != (q.y <= y))
                    .map(|(p, q)| p.lerp(q, (y - p.y) / (q.y - p.y)))
                    .map(|p| DVec2::new(p.x, p.z).clamp(self.min, self.max))
                    .collect();
                if let [p, q] = ends[..]
                    && p.distance(q) * self.scale > LEAST_LINE
                {
                    count += 1;
                    if count > MOST_LINES {
                        return if furniture { String::new() } else { out };
                    }
                    out.push_str(&self.path(&[p, q], false));
                }
            }
        }
        out
    }

    /// Portals of a storey's cells at the height of its rooms; those only above or below belong to another storey.
    fn portals_on(&self, storey: &Storey) -> impl Iterator<Item = (PortalId, &FilePortal)> {
        let [low, high] = [storey.floor - 0.5 * storey.cut, storey.floor + 2.0 * storey.cut];
        let is_on = move |portal: &FilePortal| {
            let heights = || portal.winding.iter().map(|p| f64::from(p.y));
            heights().any(|y| y >= low) && heights().any(|y| y <= high)
        };
        let has_cell = |portal: &FilePortal| portal.cells.iter().any(|cell| storey.cells.binary_search(cell).is_ok());
        let all = (0..).map(PortalId).zip(&self.file.portals);
        all.filter(move |(_, portal)| has_cell(portal) && is_on(portal))
    }

    /// Numbers of portals, if there is room.
    fn numbers(&self, storey: &Storey, out: &mut String) {
        let mut taken: Vec<DVec2> = Vec::new();
        for (id, portal) in self.portals_on(storey) {
            let points = portal.winding.iter().map(|p| DVec2::new(p.x.into(), p.z.into()));
            let at = self.at(self.inside(points.sum::<DVec2>() / portal.winding.len().max(1) as f64));
            let is_free = taken.iter().all(|other| (other.x - at.x).abs() > NUMBER[0] || (other.y - at.y).abs() > NUMBER[1]);
            if is_free {
                taken.push(at);
                let _ = writeln!(out, "<text class=\"id\" x=\"{:.1}\" y=\"{:.1}\">{id}</text>", at.x, at.y + 3.0);
            }
        }
    }

    /// Portals of a storey's cells: standing ones as a line, lying ones as a dashed outline.
    fn portals(&self, storey: &Storey, out: &mut String) {
        let kinds = [PortalKind::Opening, PortalKind::Window, PortalKind::Door];
        let [mut lying, mut standing] = [const { [const { String::new() }; 3] }; 2];
        for (_, portal) in self.portals_on(storey) {
            let k = kinds.iter().position(|&k| k == portal.kind).unwrap_or(0);
            if portal.plane.y.abs() > LEVEL {
                let ring: Vec<DVec2> =
                    portal.winding.iter().map(|p| self.inside(DVec2::new(p.x.into(), p.z.into()))).collect();
                lying[k].push_str(&self.path(&ring, true));
            } else if let Some((a, b)) = ends(portal) {
                standing[k].push_str(&self.path(&[self.inside(a), self.inside(b)], false));
            }
        }
        for (k, class) in ["opening", "window", "door"].iter().enumerate() {
            for (lines, how) in [(&lying[k], " lying"), (&standing[k], "")] {
                if !lines.is_empty() {
                    let _ = writeln!(out, "<path class=\"portal {class}{how}\" d=\"{lines}\"/>");
                }
            }
        }
    }

    fn inside(&self, p: DVec2) -> DVec2 {
        p.clamp(self.min, self.max)
    }

    /// The cell's name if it fits, else its number.
    fn label(&self, cell: CellId, rings: &[Vec<DVec2>], out: &mut String) {
        let (p, free) = roomiest(rings);
        let (at, room) = (self.at(p), free * self.scale);
        let name = &self.file.cells[cell.index()].name;
        let number = cell.to_string();
        // Bold characters are about 0.62 of their size wide.
        let fits = |text: &str, size: f64| {
            let half = 0.31 * size * text.chars().count() as f64;
            let rows = [-0.5, 0.0, 0.5].map(|k| p.y + k * size / self.scale);
            let wide = rows.into_iter().map(|y| free_across(rings, DVec2::new(p.x, y))).fold(f64::INFINITY, f64::min);
            half <= 0.94 * wide * self.scale && 0.45 * size <= room
        };
        let text = if is_named(name, cell) && fits(name, 12.0) { name.as_str() } else { &number };
        let Some(size) = [13.0, 11.0, 9.0].into_iter().find(|&size| fits(text, size)) else { return };
        let _ = writeln!(
            out,
            "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" style=\"font-size:{size}px\">{}</text>",
            at.x,
            at.y + 0.36 * size,
            escape(text)
        );
    }

    /// The scale: a length of 1, 2 or 5 times a power of ten.
    fn bar(&self, height: f64, out: &mut String) {
        let most = 0.22 * WIDTH / self.scale;
        let ten = 10f64.powf(most.log10().floor());
        let metres = [5.0, 2.0, 1.0].into_iter().map(|k| k * ten).find(|&m| m <= most).unwrap_or(ten);
        let (x, y, length) = (MARGIN, height - 9.0, metres * self.scale);
        let _ = writeln!(
            out,
            "<path class=\"axis\" d=\"M{x} {:.1}V{y:.1}H{:.1}V{:.1}\"/><text x=\"{:.1}\" y=\"{y:.1}\">{metres} m</text>",
            y - 5.0,
            x + length,
            y - 5.0,
            x + length + 7.0
        );
    }
}

/// A tint for each outline: the least used that no earlier neighbour has.
fn tints(outlines: &[(CellId, Vec<Vec<DVec2>>)]) -> Vec<usize> {
    /// Cells within this distance are neighbours, metres.
    const WALL: f64 = 0.5;
    let around = |rings: &Vec<Vec<DVec2>>| {
        let all = || rings.iter().flatten().copied();
        [all().fold(DVec2::INFINITY, DVec2::min) - WALL, all().fold(DVec2::NEG_INFINITY, DVec2::max) + WALL]
    };
    let boxes: Vec<[DVec2; 2]> = outlines.iter().map(|o| around(&o.1)).collect();
    let (mut found, mut used): (Vec<usize>, [usize; TINTS]) = (Vec::new(), [0; TINTS]);
    for (i, [min, max]) in boxes.iter().enumerate() {
        let beside = |&(k, _): &(usize, &usize)| boxes[k][0].cmple(*max).all() && min.cmple(boxes[k][1]).all();
        let taken: Vec<usize> = found.iter().enumerate().filter(beside).map(|(_, &tint)| tint).collect();
        let free = (0..TINTS).filter(|t| !taken.contains(t)).min_by_key(|&t| used[t]);
        let tint = free.unwrap_or(i % TINTS);
        used[tint] += 1;
        found.push(tint);
    }
    found
}

/// The ends of a standing portal in plan.
fn ends(portal: &FilePortal) -> Option<(DVec2, DVec2)> {
    let along = DVec2::new((-portal.plane.z).into(), portal.plane.x.into()).try_normalize()?;
    let flat = portal.winding.iter().map(|p| DVec2::new(p.x.into(), p.z.into()));
    let least = flat.clone().min_by(|a, b| along.dot(*a).total_cmp(&along.dot(*b)))?;
    let most = flat.max_by(|a, b| along.dot(*a).total_cmp(&along.dot(*b)))?;
    Some((least, most))
}

/// The signed area of a ring.
fn area(ring: &[DVec2]) -> f64 {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum::<f64>() / 2.0
}

/// Horizontal distance from a point to the nearest ring.
fn free_across(rings: &[Vec<DVec2>], p: DVec2) -> f64 {
    let edges = rings.iter().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)));
    let crossing = edges.filter(|(a, b)| (a.y > p.y) != (b.y > p.y));
    crossing.map(|(a, b)| (a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)) - p.x).abs()).fold(f64::INFINITY, f64::min)
}

/// The point inside rings that is farthest from them, by a refined grid, and its distance.
fn roomiest(rings: &[Vec<DVec2>]) -> (DVec2, f64) {
    const STEPS: i32 = 14;
    const CALM: f64 = 0.06;
    let all = || rings.iter().flatten();
    let min = all().copied().reduce(DVec2::min).unwrap_or_default();
    let max = all().copied().reduce(DVec2::max).unwrap_or_default();
    let edges = || rings.iter().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)));
    let free = |p: DVec2| {
        let crosses =
            |(a, b): &(&DVec2, &DVec2)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y));
        let inside = edges().filter(crosses).count() % 2 == 1;
        let distance = |(a, b): (&DVec2, &DVec2)| {
            let s = ((p - *a).dot(*b - *a) / (*b - *a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            p.distance(a.lerp(*b, s))
        };
        let near = edges().map(distance).fold(f64::INFINITY, f64::min);
        if inside { near } else { -near }
    };
    let middle = (min + max) / 2.0;
    let mut best = (middle, f64::NEG_INFINITY);
    let mut half = (max - min) / 2.0;
    for _ in 0..3 {
        let centre = best.0;
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let p = centre + half * DVec2::new(f64::from(i), f64::from(j)) / f64::from(STEPS);
                let f = free(p);
                // Among places with similar room, prefer the one nearer to the middle.
                let calm = |(p, f): (DVec2, f64)| f - CALM * p.distance(middle);
                if calm((p, f)) > calm(best) {
                    best = (p, f);
                }
            }
        }
        half *= 2.0 / f64::from(STEPS);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_differ() {
        let square = |x: f64, y: f64| vec![[(x, y), (x + 4., y), (x + 4., y + 4.), (x, y + 4.)].map(DVec2::from).to_vec()];
        let rooms: Vec<_> = (0..30).map(|i| (CellId(i), square(4.2 * f64::from(i % 6), 4.2 * f64::from(i / 6)))).collect();
        let found = tints(&rooms);
        for (i, a) in found.iter().enumerate() {
            for (k, b) in found.iter().enumerate().skip(i + 1) {
                let beside = (i % 6).abs_diff(k % 6) <= 1 && (i / 6).abs_diff(k / 6) <= 1;
                assert!(a < &TINTS && !(beside && a == b), "{i} {k}");
            }
        }
        assert!((0..TINTS).all(|t| found.contains(&t)));
    }

    #[test]
    fn a_label_stands_where_there_is_room() {
        let l = [(0., 0.), (10., 0.), (10., 4.), (2., 4.), (2., 12.), (0., 12.)].map(|(x, y)| DVec2::new(x, y)).to_vec();
        let (p, free) = roomiest(&[l]);
        assert!((free - 2.0).abs() < 0.2 && p.x > 1.5 && p.y < 3.0, "{p} {free}");
        assert!(
            (free_across(&[[(0., 0.), (9., 0.), (0., 9.)].map(DVec2::from).to_vec()], DVec2::new(4., 3.)) - 2.0).abs()
                < 1e-12
        );
        // Around a hole.
        let square = |a: f64, b: f64| [(a, a), (b, a), (b, b), (a, b)].map(|(x, y)| DVec2::new(x, y)).to_vec();
        let (p, free) = roomiest(&[square(0., 10.), square(2., 8.)]);
        assert!((free - 2f64.sqrt() * 0.828).abs() < 0.25 && free > 0.9, "{p} {free}");
    }
}
