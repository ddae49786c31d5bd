//! Points over floors: where eyes are likely to be.

use super::Scene;
use super::bulk::{FLOOR_NORMAL, bulk};
use super::rays::RayScene;
use crate::math::geom::{Aabb, Plane, clip, newell};
use crate::math::random::SplitMix;
use glam::DVec3;

/// Nearly horizontal triangles, sampled by area.
pub(crate) struct Floors {
    /// Cumulative area, up to a constant factor.
    areas: Vec<(f64, [DVec3; 3])>,
    /// Height of points above their floor, metres.
    off: f64,
    /// Size of the model without its ground, metres.
    size: f64,
}

/// Largest height of an eye over an uncovered floor, as a share of the model's diagonal without its ground.
const UNDER_THE_SKY: f64 = 0.02;

impl Floors {
    /// Floors of all opaque triangles: less steep than a roof.
    pub fn of(scene: &Scene) -> Self {
        let opaque = scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone());
        Self::new(scene, opaque.map(|t| scene.corners(t as usize)), FLOOR_NORMAL)
    }

    /// Floors of these triangles: those whose unit normal has a vertical component above `level`, up or down. A large ground counts only
    /// near walls.
    pub fn new(scene: &Scene, triangles: impl Iterator<Item = [DVec3; 3]>, level: f64) -> Self {
        let part = bulk(scene);
        let (mut areas, mut sum) = (Vec::new(), 0.0);
        let mut add = |c: [DVec3; 3]| {
            let n = newell(&c.map(|p| p - c[0]));
            if n.y.abs() > level * n.length() {
                sum += n.length();
                areas.push((sum, c));
            }
        };
        for corners in triangles {
            match part {
                Some(part) => within(corners, part).into_iter().for_each(&mut add),
                None => add(corners),
            }
        }
        let size = part.unwrap_or(scene.bounds()).diagonal();
        Self { areas, off: 4.0 * scene.tolerance().clearance, size }
    }

    /// A random point just above a floor; `None` without floors.
    pub fn draw(&self, random: &mut SplitMix) -> Option<DVec3> {
        let at = random.unit() * self.areas.last()?.0;
        let (_, c) = self.areas[self.areas.partition_point(|a| a.0 <= at).min(self.areas.len() - 1)];
        let (u, v) = (random.unit(), random.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some(c[0] + (c[1] - c[0]) * u + (c[2] - c[0]) * v + DVec3::Y * self.off)
    }

    /// Eyes between floors and the surfaces above, more often at low heights.
    pub fn eyes(&self, rays: &RayScene<'_>, count: usize, random: &mut SplitMix) -> Vec<DVec3> {
        let sky = UNDER_THE_SKY * self.size;
        let eye = |_| {
            let foot = self.draw(random)?;
            let height = rays.first_opaque(foot, DVec3::Y, f64::INFINITY).map_or(sky, |hit| hit.t);
            let share = random.unit();
            Some(foot + DVec3::Y * (height * (0.1 + 0.8 * share * share)))
        };
        (0..count).map_while(eye).collect()
    }
}

/// The part of a triangle within a box in plan.
pub(crate) fn within(corners: [DVec3; 3], part: Aabb) -> Vec<[DVec3; 3]> {
    let sides = [(DVec3::X, part.max.x), (-DVec3::X, -part.min.x), (DVec3::Z, part.max.z), (-DVec3::Z, -part.min.z)];
    if corners.iter().all(|&p| sides.iter().all(|&(n, d)| n.dot(p) <= d)) {
        return vec![corners];
    }
    let rest = sides.into_iter().fold(corners.to_vec(), |rest, (n, d)| clip(&rest, &Plane { n, d }, 0.0));
    (2..rest.len()).map(|k| [rest[0], rest[k - 1], rest[k]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// Two storeys of sixty floors of 1 x 1 m with walls around them, and a ground that extends by `ground` to all sides.
    fn scene(ground: f64) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut add = |at: DVec3, u: DVec3, v: DVec3| {
            let (node, role, triangles) = ("part".into(), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
            let positions = vec![at, at + u, at + u + v, at + v];
            builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
        };
        for i in 0..120 {
            add(DVec3::new(f64::from(i % 12), f64::from(i / 60) * 3.0, f64::from(i / 12 % 5)), DVec3::X, DVec3::Z);
        }
        let (x, z) = (DVec3::X * 12.0, DVec3::Z * 5.0);
        for (at, along) in [(DVec3::ZERO, x), (DVec3::ZERO, z), (z, x), (x, z)] {
            add(at, along, DVec3::Y * 6.0);
        }
        let far = DVec3::new(-ground, -0.1, -ground);
        add(far, DVec3::X * 2.0 * ground, DVec3::Z * 2.0 * ground);
        builder.finish("scene").unwrap()
    }

    #[test]
    fn eyes_stay_near_what_stands_on_a_wide_ground() {
        let near = |ground: f64| {
            let scene = scene(ground);
            let eyes = Floors::of(&scene).eyes(&RayScene::new(&scene), 400, &mut SplitMix::new(1));
            let house = Aabb { min: DVec3::ZERO, max: DVec3::new(12.0, 9.0, 5.0) };
            (eyes.len(), eyes.iter().filter(|&&eye| house.inflated(4.0).contains(eye + scene.origin)).count())
        };
        let (all, on_fields) = (near(2000.0), near(10.0));
        assert_eq!(all, (400, 400));
        // A yard still counts.
        assert!(on_fields.0 == 400 && on_fields.1 > 200 && on_fields.1 < 400, "{on_fields:?}");
    }
}
