//! Front and back faces as seen by rays: from behind the walls of a level, only backs are visible.

use crate::math::random::SplitMix;
use crate::scene::rays::RayScene;
use glam::DVec3;

/// Rays from far outside.
const RAYS: usize = 256;
/// Backs dominate if they exceed fronts by this factor.
const MANY: usize = 3;

/// Ray queries for front and back faces.
pub struct Facing<'s> {
    rays: &'s RayScene<'s>,
    /// From far outside, more fronts than backs are visible, as on buildings with outer walls.
    pub outside_in: bool,
    /// From far outside, far more backs than fronts are visible, as on levels of inner walls only.
    pub shows_backs: bool,
}

impl<'s> Facing<'s> {
    /// Casts rays from outside.
    pub fn new(rays: &'s RayScene<'s>) -> Self {
        let mut facing = Self { rays, outside_in: false, shows_backs: false };
        let mut random = SplitMix::new(0);
        let mut point = || DVec3::from_array(std::array::from_fn(|_| random.unit()));
        let bounds = rays.bounds();
        let (mut backs, mut fronts) = (0usize, 0usize);
        for _ in 0..RAYS {
            let to = bounds.min + bounds.size() * point();
            let away = (point() * 2.0 - 1.0).normalize_or(DVec3::Y) * (2.0 * bounds.diagonal());
            match facing.shown(to + away, -away) {
                1 => backs += 1,
                -1 => fronts += 1,
                _ => {}
            }
        }
        (facing.outside_in, facing.shows_backs) = (backs < fronts, backs > MANY * fronts);
        facing
    }

    /// The result of a ray: 1 for a back, -1 for a front, 0 for nothing.
    fn shown(&self, from: DVec3, direction: DVec3) -> i32 {
        let Some(hit) = self.rays.first_opaque(from, direction, f64::INFINITY) else { return 0 };
        let [a, b, c] = self.rays.scene().corners(hit.triangle as usize);
        if (b - a).cross(c - a).dot(direction) > 0.0 { 1 } else { -1 }
    }

    /// Numbers of backs and fronts hit by `rays` rays from a point.
    pub fn around(&self, from: DVec3, rays: usize, seed: u64) -> [usize; 2] {
        let mut random = SplitMix::new(seed);
        let mut counts = [0; 2];
        for _ in 0..rays {
            let direction = DVec3::from_array(std::array::from_fn(|_| 2.0 * random.unit() - 1.0));
            match self.shown(from, direction) {
                1 => counts[0] += 1,
                -1 => counts[1] += 1,
                _ => {}
            }
        }
        counts
    }
}
