//! Points over floors: where eyes are likely to be.

use super::Scene;
use super::rays::RayScene;
use crate::geom::{Aabb, Plane, clip, newell};
use crate::random::SplitMix;
use glam::DVec3;

/// What is level enough to stand on, drawn from by area.
pub(crate) struct Floors {
    /// Area up to and with each triangle, up to a constant factor.
    areas: Vec<(f64, [DVec3; 3])>,
    /// Points are this far above their floor, metres.
    off: f64,
    /// How large what stands on the ground is, metres.
    size: f64,
}

/// A floor's unit normal has at least this vertical part, up or down.
const FLOOR_NORMAL: f64 = 0.7;
/// Where nothing is above a floor, an eye is at most this high, as a share of the diagonal of what stands there.
const UNDER_THE_SKY: f64 = 0.02;

/// One triangle in so many, on each side, tells nothing of where a model stands. More: a ground of a few large triangles counts. Less: wings of a
/// building are left out.
const FEW: usize = 100;
/// How far around the rest eyes may be, as a share of its size. Less: nobody stands before a house. More: fields fill up with eyes.
const AROUND: f64 = 0.25;
/// And only where that is less than this share of the model's ground. More: buildings lose their yards, and eyes move for nothing.
const SPARSE: f64 = 0.25;

impl Floors {
    /// Of all opaque triangles: what is less steep than a roof. A ground that goes on far beyond what stands on it counts near that.
    pub fn of(scene: &Scene) -> Self {
        let opaque = scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone());
        let corners = opaque.map(|t| scene.corners(t as usize));
        match bulk(scene) {
            None => Self::new(scene, corners, FLOOR_NORMAL),
            Some((sides, size)) => Self { size, ..Self::new(scene, corners.flat_map(|c| within(c, &sides)), FLOOR_NORMAL) },
        }
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
        Self { areas, off: 4.0 * scene.tolerance().clearance, size: scene.bounds().diagonal() }
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

/// Upright planes around where nearly all triangles are, if most of the ground is outside of them; and the diagonal of that, metres.
fn bulk(scene: &Scene) -> Option<([Plane; 4], f64)> {
    let bounds = scene.bounds();
    let span = |axis: DVec3| {
        let middle = |t: usize| scene.corners(t).iter().map(|p| axis.dot(*p)).sum::<f64>() / 3.0;
        let mut at: Vec<f64> = (0..scene.triangles.len()).map(middle).collect();
        at.sort_unstable_by(f64::total_cmp);
        let few = at.len() / FEW;
        let (least, most) = (*at.get(few)?, *at.get(at.len() - 1 - few)?);
        let around = AROUND * (most - least);
        Some([least - around, most + around])
    };
    let [x, z] = [span(DVec3::X)?, span(DVec3::Z)?];
    let whole = bounds.size();
    let is_sparse = (x[1] - x[0]) * (z[1] - z[0]) < SPARSE * whole.x * whole.z;
    let sides = [(DVec3::X, x[1]), (-DVec3::X, -x[0]), (DVec3::Z, z[1]), (-DVec3::Z, -z[0])];
    let size = DVec3::new(x[1] - x[0], whole.y, z[1] - z[0]);
    is_sparse.then(|| (sides.map(|(n, d)| Plane { n, d }), size.length()))
}

/// What of a triangle lies behind all planes.
fn within(corners: [DVec3; 3], sides: &[Plane; 4]) -> Vec<[DVec3; 3]> {
    let reach = Aabb::of(corners);
    if sides.iter().all(|side| side.n.dot(if side.n.min_element() < 0.0 { reach.min } else { reach.max }) <= side.d) {
        return vec![corners];
    }
    let rest = sides.iter().fold(corners.to_vec(), |rest, side| clip(&rest, side, 0.0));
    (2..rest.len()).map(|k| [rest[0], rest[k - 1], rest[k]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// Two storeys of sixty floors of 1 x 1 m, and a ground that reaches so far to all sides.
    fn scene(ground: f64) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut add = |min: DVec3, size: DVec3| {
            let positions =
                [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, z)| min + size * DVec3::new(x, 0.0, z)).to_vec();
            let (node, role, triangles) = ("slab".into(), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
        };
        for i in 0..120 {
            add(DVec3::new(f64::from(i % 12), f64::from(i / 60) * 3.0, f64::from(i / 12 % 5)), DVec3::ONE);
        }
        add(DVec3::new(-ground, -0.1, -ground), DVec3::splat(2.0 * ground));
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
        // A yard stays one.
        assert!(on_fields.0 == 400 && on_fields.1 > 200 && on_fields.1 < 400, "{on_fields:?}");
    }
}
