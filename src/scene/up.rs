//! Whether a model lies on its side: floors are few large planes, walls are many small ones, and objects stand on floors.
//!
//! A missing note is better than a wrong one: evidence against weighs more than evidence for it.

use super::{Scene, triangle_area};
use crate::math::geom::newell;
use crate::types::note::Note;
use glam::DVec3;
use std::collections::HashMap;

/// A triangle faces an axis if its normal's cosine with it is above this (8 degrees).
const ALONG: f64 = 0.99;
/// A triangle is parallel to an axis if that cosine is below this (1.1 degrees); in between it is slanted.
const ACROSS: f64 = 0.02;
/// Resolution of plane offsets along an axis, as a share of the diagonal. Smaller: floors with a step fall apart. Larger: storeys are
/// merged.
const PLANE: f64 = 1.0 / 2000.0;
/// Largest planes of an axis that are compared: the floors and ceilings of two storeys.
const PLANES: usize = 4;
/// Least ratio of the area of the largest planes along Z to those along X and along Y. In a dozen upright buildings and levels, those along
/// Y have at least 1.26 times the area of others.
const MORE: f64 = 1.25;
/// Least ratio of all area that faces Z to that facing Y: the facade of a block of flats is its largest plane, but its floors have more
/// area.
const SHARE: f64 = 0.9;
/// Least share of these largest planes in the total area. Smaller: a heap of rocks has planes by chance.
const LEAST: f64 = 0.01;
/// The areas that face X and Y are then both walls: least ratio of the smaller to the larger. Smaller: the ends of a high corridor pass for
/// walls, and its sides for floors.
const WALLS: f64 = 0.25;
/// Largest excess of area slanted to Z over that slanted to Y, as a share of all area. Larger: a wrong note for upright round towers.
/// Smaller: also for roofs along Y.
const SLANTED: f64 = 0.2;
/// Largest excess of components that start on common planes along Y over those along Z, as a share of all. Larger: a wrong note for walls
/// without floors on one ground. Smaller: no note for rooms in a row.
const STAND: f64 = 0.1;
/// Least number of components for this test.
const THINGS: usize = 8;

/// A note if a scene with +Y as the up direction seems to lie on its side.
pub fn note(scene: &Scene) -> Option<Note> {
    is_on_its_side(scene).then(|| Note::fault("its largest planes face along Z: if +Z is up, give --up z"))
}

/// Whether a scene has its floors along Z.
pub(crate) fn is_on_its_side(scene: &Scene) -> bool {
    let Faces { all, largest: [x, y, z], along, slanted } = Faces::of(scene);
    let has_floors = z >= MORE * x.max(y) && along[2] >= SHARE * along[1] && z >= LEAST * all;
    let has_walls = x.min(y) > 0.0 && along[0].min(along[1]) >= WALLS * along[0].max(along[1]);
    has_floors && has_walls && slanted[2] <= slanted[1] + SLANTED * all && !stands(scene)
}

/// Areas, square metres; arrays are by axis.
struct Faces {
    all: f64,
    /// Area of the largest [`PLANES`] planes of each axis.
    largest: [f64; 3],
    /// Area of all triangles that face each axis.
    along: [f64; 3],
    slanted: [f64; 3],
}

impl Faces {
    fn of(scene: &Scene) -> Self {
        let plane = scene.bounds().diagonal() * PLANE;
        let mut planes: [HashMap<i64, f64>; 3] = Default::default();
        let (mut all, mut along, mut slanted) = (0.0, [0.0; 3], [0.0; 3]);
        for t in 0..scene.triangles.len() {
            let corners = scene.corners(t);
            let area = triangle_area(corners);
            let normal = newell(&corners.map(|p| p - corners[0])).normalize_or_zero();
            all += area;
            for k in 0..3 {
                if normal[k].abs() > ALONG {
                    along[k] += area;
                    let at = (corners[0] + corners[1] + corners[2])[k] / 3.0;
                    *planes[k].entry((at / plane).round() as i64).or_default() += area;
                } else if normal[k].abs() > ACROSS {
                    slanted[k] += area;
                }
            }
        }
        let largest = |planes: &HashMap<i64, f64>| {
            let mut areas: Vec<f64> = planes.values().copied().collect();
            areas.sort_by(|a, b| b.total_cmp(a));
            areas.iter().take(PLANES).sum::<f64>()
        };
        Self { all, largest: planes.each_ref().map(largest), along, slanted }
    }
}

/// Whether more connected components (over common corners) start on the same few planes along Y than along Z.
fn stands(scene: &Scene) -> bool {
    let mut number: HashMap<[u64; 3], usize> = HashMap::new();
    let (mut parent, mut lowest): (Vec<usize>, Vec<DVec3>) = (Vec::new(), Vec::new());
    for t in 0..scene.triangles.len() {
        let [a, b, c] = scene.corners(t).map(|p| {
            // Adding zero makes -0.0 equal to 0.0.
            let corner = *number.entry((DVec3::ZERO + p).to_array().map(f64::to_bits)).or_insert(parent.len());
            if corner == parent.len() {
                parent.push(corner);
                lowest.push(p);
            }
            root(&mut parent, corner)
        });
        for other in [b, c] {
            let (one, other) = (root(&mut parent, a), root(&mut parent, other));
            parent[other] = one;
            lowest[one] = lowest[one].min(lowest[other]);
        }
    }
    let things: Vec<DVec3> = (0..parent.len()).filter(|&i| parent[i] == i).map(|i| lowest[i]).collect();
    let plane = scene.bounds().diagonal() * PLANE;
    let together = |k: usize| {
        let mut counts: HashMap<i64, usize> = HashMap::new();
        things.iter().for_each(|low| *counts.entry((low[k] / plane).round() as i64).or_default() += 1);
        let mut counts: Vec<usize> = counts.into_values().collect();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        counts.iter().take(PLANES).sum::<usize>() as f64
    };
    things.len() >= THINGS && together(1) > together(2) + STAND * things.len() as f64
}

/// The representative of the connected component of `corner`.
fn root(parent: &mut [usize], mut corner: usize) -> usize {
    while parent[corner] != corner {
        parent[corner] = parent[parent[corner]];
        corner = parent[corner];
    }
    corner
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};
    use std::f64::consts::TAU;

    /// Quads, +Y up.
    #[derive(Clone, Default)]
    struct Model(Vec<[DVec3; 4]>);

    impl Model {
        /// Walls around a polygon in plan (x, z) from `low` to `high`; also a floor and a ceiling if it has four corners and `is_closed`.
        fn walls(mut self, plan: &[(f64, f64)], [low, high]: [f64; 2], is_closed: bool) -> Self {
            let at = |i: usize, y: f64| DVec3::new(plan[i % plan.len()].0, y, plan[i % plan.len()].1);
            let quads = (0..plan.len()).map(|i| [at(i, low), at(i + 1, low), at(i + 1, high), at(i, high)]);
            self.0.extend(quads);
            if is_closed {
                self.0.extend([low, high].map(|y| [at(0, y), at(1, y), at(2, y), at(3, y)]));
            }
            self
        }

        /// A closed box from a corner (x, y, z) with a size.
        fn block(self, (x, y, z): (f64, f64, f64), (w, h, d): (f64, f64, f64)) -> Self {
            self.walls(&[(x, z), (x + w, z), (x + w, z + d), (x, z + d)], [y, y + h], true)
        }

        /// The model in two rotations in plan, upright or with +Z up.
        fn scenes(&self, is_turned: bool) -> [Scene; 2] {
            [false, true].map(|is_round| {
                let place = |p: &DVec3| {
                    let p = if is_round { DVec3::new(p.z, p.y, -p.x) } else { *p };
                    if is_turned { DVec3::new(p.x, -p.z, p.y) } else { p }
                };
                let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
                for (i, quad) in self.0.iter().enumerate() {
                    let (node, role, triangles) = (format!("quad {i}"), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
                    let positions = quad.iter().map(place).collect();
                    builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
                }
                builder.finish("model").unwrap()
            })
        }
    }

    /// Stacked storeys of equal size, without furniture.
    fn storeys((w, h, d): (f64, f64, f64), count: usize) -> Model {
        (0..count).fold(Model::default(), |model, i| model.block((0.0, h * i as f64, 0.0), (w, h, d)))
    }

    /// A house of two storeys under a roof of two slopes.
    fn house() -> Model {
        let mut house = storeys((12.0, 2.7, 9.0), 2);
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        for z in [0.0, 9.0] {
            house.0.push([at(0.0, 5.4, z), at(12.0, 5.4, z), at(12.0, 9.0, 4.5), at(0.0, 9.0, 4.5)]);
        }
        house
    }

    /// Rooms of 4 x 5 m on both sides of a corridor, each a closed box.
    fn rooms() -> Model {
        let row = |model, z| (0..8).fold(model, |m: Model, i| m.block((4.1 * f64::from(i), 0.0, z), (4.0, 2.8, 5.0)));
        row(row(Model::default().block((0.0, 0.0, 0.0), (32.8, 2.8, 2.0)), 2.1), -5.1)
    }

    /// Four towers with `corners` corners, curtain walls between them and a keep: much wall, and no floor except the tops of the walls.
    fn castle(corners: usize) -> Model {
        let mut castle = Model::default().walls(&[(12.0, 8.0), (20.0, 8.0), (20.0, 14.0), (12.0, 14.0)], [0.0, 14.0], false);
        for (x, z) in [(0.0, 0.0), (32.0, 0.0), (0.0, 22.0), (32.0, 22.0)] {
            for radius in [3.0, 2.5] {
                let corner = |i: usize| {
                    let (sin, cos) = (TAU * (i as f64 + 0.5) / corners as f64).sin_cos();
                    (x + radius * cos, z + radius * sin)
                };
                castle = castle.walls(&(0..corners).map(corner).collect::<Vec<_>>(), [0.0, 12.0], false);
            }
        }
        for z in [-0.75, 21.25] {
            castle = castle.block((3.0, 0.0, z), (26.0, 8.0, 1.5));
        }
        for x in [-0.75, 31.25] {
            castle = castle.block((x, 0.0, 3.0), (1.5, 8.0, 16.0));
        }
        castle
    }

    /// Hills, as a grid of quads.
    fn terrain() -> Model {
        let at = |i: i32, k: i32| {
            let (x, z) = (f64::from(i) * 5.0, f64::from(k) * 5.0);
            DVec3::new(x, 8.0 * (x / 17.0).sin() * (z / 23.0).cos(), z)
        };
        let quad = |i: i32, k: i32| [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
        Model((0..400).map(|i| quad(i % 20, i / 20)).collect())
    }

    /// Walls of 3 m on a ground, as a winding passage.
    fn maze() -> Model {
        let ground = Model::default().walls(&[(0.0, 0.0), (24.0, 0.0), (24.0, 18.0), (0.0, 18.0)], [0.0, 3.0], false);
        let rows = (1..9).fold(ground, |m, i| m.block((f64::from(i % 2) * 2.0, 0.0, 2.0 * f64::from(i)), (22.0, 3.0, 0.3)));
        (0..9).fold(rows, |m, i| m.block((3.0 + 2.0 * f64::from(i), 0.0, 2.0 * f64::from(i) + 0.5), (0.3, 3.0, 1.0)))
    }

    /// Steps of 0.3 x 0.17 m up a shaft.
    fn stairs() -> Model {
        let shaft = Model::default().walls(&[(0.0, 0.0), (6.0, 0.0), (6.0, 1.2), (0.0, 1.2)], [0.0, 6.0], false);
        (0..18).fold(shaft, |m, i| m.block((0.3 * f64::from(i), 0.0, 0.0), (0.3, 0.17 * f64::from(i + 1), 1.2)))
    }

    #[test]
    fn what_stands_is_not_noted() {
        let slab = |size, count| storeys(size, count);
        for (what, model) in [
            ("a house", house()),
            ("rooms", rooms()),
            ("a hall", slab((80.0, 4.0, 30.0), 1)),
            ("a slab of flats", slab((60.0, 3.0, 14.0), 8)),
            ("a tower", slab((20.0, 3.0, 20.0), 12)),
            ("a high corridor", slab((40.0, 4.0, 3.0), 1)),
            ("a castle with round towers", castle(12)),
            ("a castle with square towers", castle(4)),
            ("hills", terrain()),
            ("a maze", maze()),
            ("stairs", stairs()),
        ] {
            assert_eq!(model.scenes(false).map(|scene| note(&scene)), [None, None], "{what}");
        }
    }

    #[test]
    fn what_lies_on_its_side_is_noted() {
        for (what, model) in [
            ("a house", house()),
            ("two storeys", storeys((12.0, 2.7, 9.0), 2)),
            ("rooms", rooms()),
            ("a hall", storeys((80.0, 4.0, 30.0), 1)),
        ] {
            assert!(model.scenes(true).iter().all(|scene| note(scene).is_some()), "{what}");
        }
    }

    /// Without the evidence against it, these would get a wrong note.
    #[test]
    fn castles_and_corridors_have_their_largest_planes_upright() {
        for model in [castle(4), castle(12), storeys((40.0, 4.0, 3.0), 1)] {
            let [x, y, z] = Faces::of(&model.scenes(false)[0]).largest;
            assert!(z >= MORE * x.max(y), "{x} {y} {z}");
        }
    }
}
