//! Points over floors: where eyes are likely to be.

use super::Scene;
use super::rays::RayScene;
use crate::geom::newell;
use crate::random::SplitMix;
use glam::DVec3;

/// What is level enough to stand on, drawn from by area.
pub(crate) struct Floors {
    /// Area up to and with each triangle, up to a constant factor.
    areas: Vec<(f64, [DVec3; 3])>,
    /// Points are this far above their floor, metres.
    off: f64,
}

/// A floor's unit normal has at least this vertical part, up or down.
const FLOOR_NORMAL: f64 = 0.7;
/// Where nothing is above a floor, an eye is at most this high, as a share of the model's diagonal.
const UNDER_THE_SKY: f64 = 0.02;

impl Floors {
    /// Of all opaque triangles: what is less steep than a roof.
    pub fn of(scene: &Scene) -> Self {
        let opaque = scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone());
        Self::new(scene, opaque.map(|t| scene.corners(t as usize)), FLOOR_NORMAL)
    }

    /// Of these triangles those whose unit normal has a vertical part above `level`, up or down.
    pub fn new(scene: &Scene, triangles: impl Iterator<Item = [DVec3; 3]>, level: f64) -> Self {
        let (mut areas, mut sum) = (Vec::new(), 0.0);
        for c in triangles {
            let n = newell(&c.map(|p| p - c[0]));
            if n.y.abs() > level * n.length() {
                sum += n.length();
                areas.push((sum, c));
            }
        }
        Self { areas, off: 4.0 * scene.tolerance().clearance }
    }

    /// A point just above a floor; `None` where there is none.
    pub fn draw(&self, random: &mut SplitMix) -> Option<DVec3> {
        let at = random.unit() * self.areas.last()?.0;
        let (_, c) = self.areas[self.areas.partition_point(|a| a.0 <= at).min(self.areas.len() - 1)];
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some(c[0] + (c[1] - c[0]) * u + (c[2] - c[0]) * v + DVec3::Y * self.off)
    }

    /// Eyes between floors and what is above them, lower ones more often.
    pub fn eyes(&self, rays: &RayScene<'_>, count: usize, random: &mut SplitMix) -> Vec<DVec3> {
        let sky = UNDER_THE_SKY * rays.bounds().diagonal();
        let eye = |_| {
            let foot = self.draw(random)?;
            let height = rays.first_opaque(foot, DVec3::Y, f64::INFINITY).map_or(sky, |hit| hit.t);
            let share = random.unit();
            Some(foot + DVec3::Y * (height * (0.1 + 0.8 * share * share)))
        };
        (0..count).map_while(eye).collect()
    }
}
