//! The bulk of a model: the box around nearly all walls, without a much larger ground and without the sky.

use super::{Object, Role, Scene};
use crate::math::geom::{Aabb, newell};
use glam::DVec3;

/// Largest vertical component of a wall's unit normal, up or down; a floor's is larger.
pub(crate) const FLOOR_NORMAL: f64 = 0.7;
/// Least height of a wall, as a share of its length. Larger: long facades do not count. Smaller: the edges of a ground slab do.
const LEAST_HEIGHT: f64 = 0.01;
/// One wall in this many is an outlier on each side. Larger: a fence or a far hut counts. Smaller: wings of a building are left out.
const FEW: usize = 100;
/// Most triangles in the sample.
const LOOKED_AT: usize = 100_000;
/// Margin around the other walls, as a share of their longer side. Smaller: no space in front of a house. Larger: fields count.
const AROUND: f64 = 0.25;
/// Least width of a building, as a share of its length. Larger: long ones do not count. Smaller: a lone wall does.
const WIDE: f64 = 0.05;
/// Largest share of the model's ground for the bulk to be used. Larger: buildings lose their yards. Smaller: fields count.
const SPARSE: f64 = 0.25;

/// The box around nearly all walls, as high as the model; `None` if it is not a small part of the model, and there is no sky.
pub(crate) fn bulk(scene: &Scene) -> Option<Aabb> {
    let is_sky = |o: &Object| o.role == Role::Sky;
    let below = scene.objects.iter().filter(|o| !is_sky(o)).fold(Aabb::EMPTY, |b, o| b.union(o.bounds));
    let has_sky = scene.objects.iter().any(is_sky) && !below.is_empty();
    let whole = if has_sky { below } else { scene.bounds() };
    around_walls(scene, whole).or(has_sky.then_some(whole))
}

fn around_walls(scene: &Scene, whole: Aabb) -> Option<Aabb> {
    let each = scene.triangles.len() / LOOKED_AT + 1;
    let opaque = scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone()).step_by(each);
    let is_wall = |c: &[DVec3; 3]| {
        let n = newell(&c.map(|p| p - c[0]));
        let size = Aabb::of(*c).size();
        n.y.abs() <= FLOOR_NORMAL * n.length() && size.y >= LEAST_HEIGHT * size.max_element()
    };
    let walls: Vec<[DVec3; 3]> = opaque.map(|t| scene.corners(t as usize)).filter(is_wall).collect();
    let span = |axis: usize| {
        let mut ends = [Vec::with_capacity(walls.len()), Vec::with_capacity(walls.len())];
        for corners in &walls {
            let bounds = Aabb::of(*corners);
            ends[0].push(bounds.min[axis]);
            ends[1].push(bounds.max[axis]);
        }
        let few = walls.len() / FEW;
        let last = walls.len().checked_sub(1 + few)?;
        let [least, most] = [(0, few), (1, last)].map(|(end, k)| *ends[end].select_nth_unstable_by(k, f64::total_cmp).1);
        Some([least, most])
    };
    let spans = [span(0)?, span(2)?];
    let sizes = spans.map(|[least, most]| most - least);
    let (width, length) = (sizes[0].min(sizes[1]), sizes[0].max(sizes[1]));
    let around = AROUND * length;
    let [x, z] = spans.map(|[least, most]| [least - around, most + around]);
    let is_sparse = (x[1] - x[0]) * (z[1] - z[0]) < SPARSE * whole.size().x * whole.size().z;
    let part = Aabb {
        min: DVec3::new(x[0].max(whole.min.x), whole.min.y, z[0].max(whole.min.z)),
        max: DVec3::new(x[1].min(whole.max.x), whole.max.y, z[1].min(whole.max.z)),
    };
    (is_sparse && width >= WIDE * length).then_some(part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// `houses` boxes of 10 x 3 x 8 m without floors, 12 m apart along x, and a square ground that extends by `ground` to all sides.
    fn scene(houses: usize, ground: f64) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut add = |corners: [DVec3; 4]| {
            let (node, role, triangles) = ("part".into(), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role, opaque: true, positions: corners.to_vec(), triangles }).unwrap();
        };
        for house in 0..houses {
            let corner = |x: f64, z: f64| DVec3::new(12.0 * house as f64 + 10.0 * x, 0.0, 8.0 * z);
            let around = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            for k in 0..4 {
                let (a, b) = (around[k], around[(k + 1) % 4]);
                add([a, b, b + 3.0 * DVec3::Y, a + 3.0 * DVec3::Y]);
            }
        }
        let far = |x: f64, z: f64| DVec3::new(ground * x, 0.0, ground * z);
        add([far(-1.0, -1.0), far(1.0, -1.0), far(1.0, 1.0), far(-1.0, 1.0)]);
        builder.finish("houses").unwrap()
    }

    fn lone_wall() -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let (u, v) = (DVec3::X * 10.0, DVec3::Y * 3.0);
        for positions in
            [vec![DVec3::ZERO, u, u + v, v], vec![DVec3::ZERO, 2.0 * u, 2.0 * u + 20.0 * DVec3::Z, 20.0 * DVec3::Z]]
        {
            let (node, role, triangles) = ("part".into(), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
        }
        builder.finish("wall").unwrap()
    }

    #[test]
    fn a_house_on_a_wide_ground_stands_where_its_walls_are() {
        let scene = scene(1, 500.0);
        let part = bulk(&scene).expect("the ground is wide");
        let (min, max) = (part.min + scene.origin, part.max + scene.origin);
        assert!((min - DVec3::new(-2.5, 0.0, -2.5)).length() < 1e-9 && (max - DVec3::new(12.5, 3.0, 10.5)).length() < 1e-9);
    }

    #[test]
    fn a_sky_is_no_part_of_where_a_model_stands() {
        let mut with_sky = scene(1, 12.0);
        let ground = with_sky.objects.last_mut().unwrap();
        (ground.role, ground.opaque) = (Role::Sky, false);
        let house = bulk(&with_sky).expect("a part of all");
        assert!((house.size() - DVec3::new(10.0, 3.0, 8.0)).length() < 1e-9, "{house:?}");
    }

    #[test]
    fn a_yard_a_village_and_a_ground_without_walls_are_whole() {
        assert_eq!(bulk(&scene(1, 12.0)), None);
        assert_eq!(bulk(&scene(12, 960.0)).map(|part| part.size().x > 142.0), Some(true), "a street");
        assert_eq!(bulk(&scene(0, 500.0)), None);
        // A lone wall of 10 m beside a floor of 20 x 20 m.
        assert_eq!(bulk(&lone_wall()), None);
    }
}
