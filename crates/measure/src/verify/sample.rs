//! Origins and directions of the check's rays.

use super::cells::Cells;
use super::triangles::Tracer;
use enfilade::CellId;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use enfilade::types::person::EYE_HEIGHT;
use glam::DVec3;

/// See [`AT_PORTAL`].
const AT_OBJECT: f64 = 0.5;

/// Share of rays aimed at a portal; up to [`AT_OBJECT`] at an object; the rest in any direction.
const AT_PORTAL: f64 = 0.3;

/// See [`NEAR_PORTAL`].
const NEAR_WALL: f64 = 0.45;

/// Share of eyes near a portal; up to [`NEAR_WALL`] near a wall: faults are more likely there.
const NEAR_PORTAL: f64 = 0.2;

/// Greatest distance of such eyes from the portal or wall, metres.
const NEAR: f64 = 0.5;
/// Least distance of a view's eye from surfaces, metres.
const ROOM: f64 = 0.15;

/// A random direction, uniform over the sphere (rejection from the cube: basic operations only).
pub(super) fn direction(rng: &mut Prng) -> DVec3 {
    loop {
        let p = DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        let length = p.length();
        if (1e-3..=1.0).contains(&length) {
            return p / length;
        }
    }
}

pub(super) struct Sampler<'t> {
    scene: &'t Scene,
    tracer: &'t Tracer,
    cells: &'t Cells,
    tolerance: f64,
}

impl<'t> Sampler<'t> {
    pub(super) fn new(scene: &'t Scene, tracer: &'t Tracer, cells: &'t Cells, tolerance: f64) -> Self {
        Self { scene, tracer, cells, tolerance }
    }

    /// A cell, an eye in it, a direction. `None` if a few tries find no point safely inside a cell.
    pub(super) fn ray(&self, rng: &mut Prng) -> Option<(CellId, DVec3, DVec3)> {
        let kind = rng.unit();
        let (cell, eye) = if kind < NEAR_PORTAL {
            self.near_portal(rng)
        } else if kind < NEAR_WALL {
            self.near_wall(rng)
        } else {
            None
        }
        .or_else(|| self.anywhere(rng))?;
        let aim = rng.unit();
        let target = if aim < AT_PORTAL {
            self.portal_point(cell, rng)
        } else if aim < AT_OBJECT {
            Some(self.object_point(rng))
        } else {
            None
        };
        let towards = target.and_then(|t| (t - eye).try_normalize());
        Some((cell, eye, towards.unwrap_or_else(|| direction(rng))))
    }

    /// An eye for a view: above a floor if possible, with some room around it.
    pub(super) fn viewpoint(&self, rng: &mut Prng) -> Option<(CellId, DVec3)> {
        let mut any = None;
        for _ in 0..32 {
            let Some((cell, p)) = self.anywhere(rng) else {
                continue;
            };
            let down = self.tracer.first_opaque(p, DVec3::NEG_Y, self.cells.exit(p, DVec3::NEG_Y));
            let eye = down.map_or(p, |(t, _)| p + DVec3::Y * (EYE_HEIGHT - t));
            let sides = DVec3::AXES.into_iter().flat_map(|a| [a, -a]);
            let roomy = || sides.into_iter().all(|d| self.tracer.first_opaque(eye, d, ROOM).is_none());
            if self.cells.locate(eye) == Some(cell) && roomy() {
                return Some((cell, eye));
            }
            any = Some((cell, p));
        }
        any
    }

    /// Cells have equal shares, and open ones a tenth on top; uniform over the cell's volume.
    fn anywhere(&self, rng: &mut Prng) -> Option<(CellId, DVec3)> {
        let open = self.cells.open();
        if self.cells.count() == 0 {
            return None;
        }
        (0..8).find_map(|_| {
            let cell = if !open.is_empty() && rng.chance(0.1) {
                open[rng.below(open.len())]
            } else {
                CellId(rng.below(self.cells.count()) as u32)
            };
            self.cells.point(cell, rng).map(|p| (cell, p))
        })
    }

    /// A point beside a portal, on either side.
    fn near_portal(&self, rng: &mut Prng) -> Option<(CellId, DVec3)> {
        let portals = self.cells.portals();
        let portal = portals.get(rng.below(portals.len()))?;
        let p = polygon_point(&portal.winding, rng);
        let off = self.offset(rng) * if rng.chance(0.5) { 1.0 } else { -1.0 };
        let p = p + portal.plane.n * off;
        self.cells.locate(p).map(|cell| (cell, p))
    }

    /// A point just before an opaque surface.
    fn near_wall(&self, rng: &mut Prng) -> Option<(CellId, DVec3)> {
        let (_, p) = self.anywhere(rng)?;
        let d = direction(rng);
        let (t, _) = self.tracer.first_opaque(p, d, self.cells.exit(p, d))?;
        let p = p + d * (t - self.offset(rng)).max(0.0);
        self.cells.locate(p).map(|cell| (cell, p))
    }

    /// Between twice the tolerance and [`NEAR`], logarithmically uniform.
    fn offset(&self, rng: &mut Prng) -> f64 {
        let least = (2.0 * self.tolerance).min(NEAR);
        least * (NEAR / least).powf(rng.unit())
    }

    fn portal_point(&self, cell: CellId, rng: &mut Prng) -> Option<DVec3> {
        let portals = self.cells.portals_of(cell);
        let portal = portals.get(rng.below(portals.len()))?;
        Some(polygon_point(&self.cells.portals()[*portal].winding, rng))
    }

    /// A point of a random object; objects have equal shares at any size.
    fn object_point(&self, rng: &mut Prng) -> DVec3 {
        let object = &self.scene.objects[rng.below(self.scene.objects.len())];
        let count = object.triangles.len();
        let corners = self.scene.corners(object.triangles.start as usize + rng.below(count));
        polygon_point(&corners, rng)
    }
}

/// A point of a convex polygon: uniform in one of its fan's triangles.
fn polygon_point(polygon: &[DVec3], rng: &mut Prng) -> DVec3 {
    let k = 2 + rng.below(polygon.len() - 2);
    let (mut u, mut v) = (rng.unit(), rng.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    polygon[0] + (polygon[k - 1] - polygon[0]) * u + (polygon[k] - polygon[0]) * v
}
