//! Detects skies and other backdrops: shells around everything, visible from inside only, and planes far larger than the model. They bound
//! no room, and their size does not matter.

use super::naming::words;
use crate::math::geom::{self, Aabb};
use glam::DVec3;

/// Words of shells, and of distant backdrops.
const SHELLS: [&str; 14] = [
    "sky",
    "skybox",
    "skydome",
    "skysphere",
    "himmel",
    "ciel",
    "cielo",
    "panorama",
    "hdri",
    "environment",
    "envmap",
    "cubemap",
    "atmosphere",
    "heaven",
];
const BEYOND: [&str; 14] = [
    "water",
    "ocean",
    "sea",
    "skirt",
    "backdrop",
    "background",
    "horizon",
    "cloud",
    "clouds",
    "mountains",
    "skyline",
    "fog",
    "meer",
    "backplate",
];
/// Least width of an unnamed shell, relative to its contents, if it is unlit, and if it is lit. Smaller: the walls of a room are a sky to
/// its furniture.
const WIDE_UNLIT: f64 = 1.5;
const WIDE_LIT: f64 = 2.0;
/// Least number of meshes in a lit shell.
const FEWEST_WITHIN: usize = 8;
/// Least width of a plane beyond the model, relative to the model.
const BEYOND_WIDE: f64 = 1.5;
/// Least width of a named shell, as a share of its contents: below 1 because of spheres with few faces.
const NARROW: f64 = 0.9;
/// Least share of a shell's area that faces its contents.
const INWARD: f64 = 0.95;
/// A mesh is a ground if its height is below this share of its width.
const FLAT: f64 = 0.02;

/// The kind of backdrop by a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Backdrop {
    /// None.
    #[default]
    Unnamed,
    /// Around everything, like a sky.
    Shell,
    /// A distant backdrop.
    Beyond,
}

impl Backdrop {
    /// By the names of a mesh and its material.
    pub fn named(name: &str, material: &str) -> Self {
        let words: Vec<String> = [name, material].iter().flat_map(|text| words(text)).collect();
        let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
        match (has(&SHELLS), has(&BEYOND)) {
            (true, _) => Self::Shell,
            (_, true) => Self::Beyond,
            _ => Self::Unnamed,
        }
    }
}

/// The data of a mesh for this test.
pub(super) struct Shape<'a> {
    pub positions: &'a [DVec3],
    pub triangles: &'a [[u32; 3]],
    pub named: Backdrop,
    pub unlit: bool,
    /// Whether its role was set by hand.
    pub told: bool,
}

/// Which of the meshes of a model are backdrops.
pub(super) fn backdrops(shapes: &[Shape<'_>]) -> Vec<bool> {
    let used = |shape: &Shape<'_>| Aabb::of(shape.triangles.iter().flatten().map(|&i| shape.positions[i as usize]));
    let boxes: Vec<Aabb> = shapes.iter().map(used).collect();
    let width = |b: Aabb| b.size().x.max(b.size().z);
    let is_flat = |b: Aabb| b.size().y < FLAT * width(b);
    let around =
        |is_in: &dyn Fn(usize) -> bool| (0..boxes.len()).filter(|&i| is_in(i)).fold(Aabb::EMPTY, |b, i| b.union(boxes[i]));
    let mut found = vec![false; shapes.len()];
    // 1. Named shells, all parts of a box together.
    let shells: Vec<usize> = (0..shapes.len()).filter(|&i| shapes[i].named == Backdrop::Shell && !shapes[i].told).collect();
    let rest = around(&|i| shapes[i].named == Backdrop::Unnamed && !is_flat(boxes[i]));
    if rest.is_empty() {
        return found;
    }
    let shell = shells.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i]));
    if !shells.is_empty() && surrounds(shell, rest, NARROW) {
        shells.iter().for_each(|&i| found[i] = true);
    }
    for i in (0..shapes.len()).filter(|&i| shapes[i].named == Backdrop::Beyond && !shapes[i].told) {
        found[i] = wider(boxes[i], rest, BEYOND_WIDE);
    }
    // 2. Unnamed ones: the widest first, because shells may contain shells.
    let mut order: Vec<usize> = (0..shapes.len()).filter(|&i| !found[i] && !shapes[i].told && !is_flat(boxes[i])).collect();
    order.sort_by(|&a, &b| width(boxes[b]).total_cmp(&width(boxes[a])).then(a.cmp(&b)));
    for i in order {
        let within: Vec<usize> = (0..shapes.len()).filter(|&k| k != i && !found[k] && !is_flat(boxes[k])).collect();
        let rest = within.iter().fold(Aabb::EMPTY, |b, &k| b.union(boxes[k]));
        let wide = if shapes[i].unlit { WIDE_UNLIT } else { WIDE_LIT };
        if rest.is_empty() || !surrounds(boxes[i], rest, wide) {
            break;
        }
        if !shapes[i].unlit && within.len() < FEWEST_WITHIN || inward(&shapes[i], rest.centre()) < INWARD {
            break;
        }
        found[i] = true;
    }
    found
}

/// True if a box is `times` as wide as another, in both directions, and around it.
fn wider(outer: Aabb, inner: Aabb, times: f64) -> bool {
    let (o, i) = (outer.size(), inner.size());
    o.x >= times * i.x && o.z >= times * i.z
}

/// The same, and also at least as high.
fn surrounds(outer: Aabb, inner: Aabb, times: f64) -> bool {
    wider(outer, inner, times) && outer.max.y >= inner.max.y && outer.touches(&inner)
}

/// The share of a mesh's area that faces a point.
fn inward(shape: &Shape<'_>, point: DVec3) -> f64 {
    let [mut facing, mut all] = [0.0; 2];
    for triangle in shape.triangles {
        let corners = triangle.map(|i| shape.positions[i as usize] - point);
        let normal = geom::newell(&corners);
        let area = normal.length();
        all += area;
        if normal.dot(corners[0]) < 0.0 {
            facing += area;
        }
    }
    if all > 0.0 { facing / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box with sides that face in, or out.
    fn cuboid(size: DVec3, inwards: bool) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let at = |i: u32| DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 1 { size[k] } else { -size[k] }));
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let turned = |[a, b, c]: [u32; 3]| if inwards { [a, c, b] } else { [a, b, c] };
        let triangles = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).map(turned).collect();
        ((0..8).map(at).collect(), triangles)
    }

    #[test]
    fn a_shell_around_all_is_a_sky_and_a_wall_is_none() {
        let house = cuboid(DVec3::new(10.0, 3.0, 8.0), false);
        let of = |size: DVec3, inwards: bool, named: Backdrop, unlit: bool, houses: usize| {
            let shell = cuboid(size, inwards);
            let shape = |(positions, triangles): &'static (Vec<DVec3>, Vec<[u32; 3]>), named, unlit| Shape {
                positions,
                triangles,
                named,
                unlit,
                told: false,
            };
            let mut shapes: Vec<Shape<'_>> = Vec::new();
            let (house, shell) = (Box::leak(Box::new(house.clone())), Box::leak(Box::new(shell)));
            shapes.push(shape(shell, named, unlit));
            (0..houses).for_each(|_| shapes.push(shape(house, Backdrop::Unnamed, false)));
            let found = backdrops(&shapes);
            assert!(!found[1..].contains(&true), "a house is no sky");
            found[0]
        };
        let (large, near) = (DVec3::new(30.0, 20.0, 30.0), DVec3::new(11.0, 4.0, 9.0));
        assert!(of(large, true, Backdrop::Shell, false, 1), "by name");
        assert!(of(large, false, Backdrop::Shell, false, 1), "by name, whatever way it faces");
        assert!(of(near, true, Backdrop::Shell, false, 1), "by name, close around");
        assert!(!of(DVec3::splat(2.0), true, Backdrop::Shell, false, 1), "a thing in the house that is called sky");
        assert!(of(large, true, Backdrop::Unnamed, true, 1), "unlit");
        assert!(!of(near, true, Backdrop::Unnamed, true, 1), "walls around a room, with baked light");
        assert!(!of(large, false, Backdrop::Unnamed, true, 1), "seen from outside");
        assert!(of(large, true, Backdrop::Unnamed, false, 8) && !of(large, true, Backdrop::Unnamed, false, 1));
        let water = DVec3::new(100.0, 0.0, 100.0);
        assert!(of(water, false, Backdrop::Beyond, false, 1) && !of(water, false, Backdrop::Unnamed, false, 1));
    }

    #[test]
    fn names_tell_backdrops() {
        assert_eq!(Backdrop::named("SkyDome.001", ""), Backdrop::Shell);
        assert_eq!(Backdrop::named("Sphere", "sky_texture"), Backdrop::Shell);
        assert_eq!(Backdrop::named("WaterPlane", ""), Backdrop::Beyond);
        assert_eq!(Backdrop::named("skylight", "glass"), Backdrop::Unnamed);
    }
}
