//! Two cities of one size, dense and sparse: buildings and trees at random on a plane, in a scene graph of four levels.
//!
//! Based on: V. Cunha, M. Leitão, *Exploração da Remoção Hierárquica por Oclusão em Simulações em Tempo Real*, ISEP, undated (its
//! latest reference is of 2008). From it: the levels (root, groups, areas, objects; 1,024 square areas, 4 x 4 of them per group),
//! the numbers of objects (table 1), the share of the plane (2 % and 22 %), and the random places, sizes and rotations of
//! buildings.
//!
//! Differences:
//! * Objects don't overlap, and a street runs along every area's border, so that a camera can walk.
//! * Buildings alone cover this share of the plane, within a ten-thousandth of it; the study counts all objects, roughly.
//! * A building is one to three boxes on each other, not a model of thousands of vertices.
//! * The plane's size, the heights and the camera path aren't published. Here the camera moves at a steady speed from a
//!   place with buildings all around to the rim, where half of the view is empty.

use super::building::Building;
use super::facts::Facts;
use super::model::{Material, Model};
use super::path::CameraPath;
use super::solid::{Solid, cuboid, lathe, loft, turn};
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// Random streams.
const SIZES: u64 = 1;
const PLACES: u64 = 2;
/// Areas along the city's edge and along a group's edge.
const AREAS: usize = 32;
const GROUPED: usize = 4;
/// Edge of an area, metres: with it a building of the dense city is 15 m square on average.
const AREA: f64 = 160.0;
/// Width of the streets between areas, metres.
const STREET: f64 = 8.0;
/// Narrowest passage between two objects, metres. Less: nobody can walk through. At 6 m some buildings of the dense city find no
/// place, and the search doesn't end.
const PASSAGE: f64 = 2.0;
/// Range of a building's edges before they are scaled to their share of the plane, metres.
const EDGES: [f64; 2] = [8.0, 22.0];
/// Height of a storey, metres.
const STOREY: f64 = 3.0;
/// Metres from one frame to the next.
const STEP: f64 = 1.0;
/// Street crossings where the camera turns, in areas.
const WAY: [(u32, u32); 6] = [(24, 16), (27, 16), (27, 13), (30, 13), (30, 11), (32, 11)];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Rounds to millimetres, to keep the file short.
fn round_mm(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// The dense city or the sparse one.
pub(super) fn city(dense: bool, seed: u64) -> Building {
    let (name, buildings, trees, share) =
        if dense { ("city-dense", 25_426, 10_862, 0.22) } else { ("city-sparse", 2_028, 4_056, 0.02) };
    let areas = AREAS * AREAS;
    let edge = AREAS as f64 * AREA;
    let rng = &mut Prng::new(seed, SIZES);
    let mut sizes = footprints(buildings, share * edge * edge, rng).into_iter();
    let (buildings_in, trees_in) = (deal(buildings, areas, rng), deal(trees, areas, rng));

    let rng = &mut Prng::new(seed, PLACES);
    let mut model = Model::default();
    model.enter("city");
    model.add("ground", Role::Structure, Material::Ground, cuboid(v(0.0, -0.5, 0.0), v(edge, 0.0, edge)));
    let groups = AREAS / GROUPED;
    for group in 0..groups * groups {
        model.enter(format!("g{group:02}"));
        for member in 0..GROUPED * GROUPED {
            let column = group % groups * GROUPED + member % GROUPED;
            let row = group / groups * GROUPED + member / GROUPED;
            let area = row * AREAS + column;
            let name = format!("g{group:02}/a{area:04}");
            model.enter(name.clone());
            let low = DVec2::new(column as f64, row as f64) * AREA;
            let sizes = sizes.by_ref().take(buildings_in[area]).collect();
            let mut filled = Area { model: &mut model, name, low, plots: Vec::new() };
            filled.build(sizes, rng);
            filled.plant(trees_in[area], rng);
            model.leave();
        }
        model.leave();
    }
    model.leave();

    let waypoints = WAY.map(|(x, z)| v(f64::from(x) * AREA, 0.0, f64::from(z) * AREA));
    let counted = vec![("buildings", buildings), ("trees", trees), ("areas", areas), ("groups", groups * groups)];
    let path = CameraPath::along(&waypoints, STEP);
    Building { name: name.into(), seed, counted, model, facts: Facts::default(), path }
}

/// Random footprints with a total area of `total` square metres.
fn footprints(count: usize, total: f64, rng: &mut Prng) -> Vec<DVec2> {
    let [least, most] = EDGES;
    let mut sizes: Vec<DVec2> = (0..count).map(|_| DVec2::new(rng.range(least, most), rng.range(least, most))).collect();
    let fit = (total / sizes.iter().map(|s| s.x * s.y).sum::<f64>()).sqrt();
    for size in &mut sizes {
        *size = (*size * fit).map(round_mm);
    }
    sizes
}

/// Distributes `count` things over `areas` as evenly as possible; the remainder goes to random areas.
fn deal(count: usize, areas: usize, rng: &mut Prng) -> Vec<usize> {
    let mut dealt: Vec<usize> = (0..areas).map(|i| count / areas + usize::from(i < count % areas)).collect();
    rng.shuffle(&mut dealt);
    dealt
}

/// A rectangle on the ground.
struct Plot {
    middle: DVec2,
    half: DVec2,
    /// Cosine and sine of its rotation.
    turn: (f64, f64),
}

impl Plot {
    /// Unit vectors along its edges, in (x, z).
    fn axes(&self) -> [DVec2; 2] {
        let (c, s) = self.turn;
        [DVec2::new(c, -s), DVec2::new(s, c)]
    }

    /// Half its extent along a direction.
    fn reach(&self, direction: DVec2) -> f64 {
        let [u, w] = self.axes();
        self.half.x * u.dot(direction).abs() + self.half.y * w.dot(direction).abs()
    }

    /// True if a line along an edge of either separates them by [`PASSAGE`].
    fn is_clear_of(&self, other: &Self) -> bool {
        let way = other.middle - self.middle;
        let parts = |axis: &DVec2| way.dot(*axis).abs() >= self.reach(*axis) + other.reach(*axis) + PASSAGE;
        self.axes().iter().chain(&other.axes()).any(parts)
    }
}

struct Area<'m> {
    model: &'m mut Model,
    name: String,
    /// Its lowest corner, in (x, z).
    low: DVec2,
    /// Occupied plots.
    plots: Vec<Plot>,
}

impl Area<'_> {
    /// Finds a random free place for a rectangle, off the streets and clear of other plots. In three dense cities the longest
    /// search took 82 tries, the mean 4.
    fn take(&mut self, size: DVec2, rng: &mut Prng) -> &Plot {
        let mut plot = Plot { middle: DVec2::ZERO, half: size / 2.0, turn: turn(rng.unit()) };
        loop {
            let margin = DVec2::new(plot.reach(DVec2::X), plot.reach(DVec2::Y)) + STREET / 2.0;
            let at = margin + (DVec2::splat(AREA) - 2.0 * margin) * DVec2::new(rng.unit(), rng.unit());
            plot.middle = (self.low + at).map(round_mm);
            if self.plots.iter().all(|other| plot.is_clear_of(other)) {
                self.plots.push(plot);
                return &self.plots[self.plots.len() - 1];
            }
        }
    }

    /// Adds buildings with these footprints, the largest first, while there is most room.
    fn build(&mut self, mut sizes: Vec<DVec2>, rng: &mut Prng) {
        sizes.sort_by(|a, b| (b.x * b.y).total_cmp(&(a.x * a.y)));
        for (i, size) in sizes.into_iter().enumerate() {
            let (kind, material, storeys, make): (_, _, _, fn() -> Solid) = match rng.below(10) {
                0 => ("tower", Material::Concrete, rng.steps(12, 30, 1), || stack(&[(1.0, 0.2), (0.6, 1.0)])),
                1..=2 => {
                    ("terraces", Material::Stone, rng.steps(5, 12, 1), || stack(&[(1.0, 0.5), (0.8, 0.75), (0.6, 1.0)]))
                }
                _ => ("block", Material::Plaster, rng.steps(2, 6, 1), || stack(&[(1.0, 1.0)])),
            };
            let placement = placement(self.take(size, rng), STOREY * f64::from(storeys));
            self.model.place(format!("{}/b{i:02}", self.name), Role::Structure, placement, kind, material, make);
        }
    }

    /// Adds trees 3 to 5 m wide.
    fn plant(&mut self, count: usize, rng: &mut Prng) {
        for i in 0..count {
            let across = round_mm(rng.range(3.0, 5.0));
            let placement = placement(self.take(DVec2::splat(across), rng), 1.8 * across);
            self.model.place(format!("{}/t{i:02}", self.name), Role::Furnishing, placement, "tree", Material::Leaf, tree);
        }
    }
}

/// Scales a solid of 1 x 1 x 1 m, with its origin in the middle of its base, to a plot and a height.
fn placement(plot: &Plot, height: f64) -> DAffine3 {
    let [u, w] = plot.axes().map(|axis| v(axis.x, 0.0, axis.y));
    let linear = DMat3::from_cols(u * (2.0 * plot.half.x), DVec3::Y * height, w * (2.0 * plot.half.y));
    DAffine3::from_mat3_translation(linear, v(plot.middle.x, 0.0, plot.middle.y))
}

/// Square boxes on top of each other as one closed solid: edge and upper end of each.
fn stack(boxes: &[(f64, f64)]) -> Solid {
    let ring = |edge: f64, y: f64| {
        [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, z)| v(x * edge, 2.0 * y, z * edge) / 2.0)
    };
    let mut rings = vec![vec![DVec3::ZERO]];
    let mut low = 0.0;
    for &(edge, top) in boxes {
        rings.extend([ring(edge, low).to_vec(), ring(edge, top).to_vec()]);
        low = top;
    }
    rings.push(vec![DVec3::Y * low]);
    loft(&rings)
}

/// A trunk and a crown.
fn tree() -> Solid {
    lathe(&[(0.0, 0.0), (0.06, 0.0), (0.06, 0.25), (0.5, 0.3), (0.0, 1.0)], 5)
}

#[cfg(test)]
mod tests {
    use super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn stacks_and_trees_are_closed_and_of_the_right_volume() {
        let tower = stack(&[(1.0, 0.2), (0.6, 1.0)]);
        assert_closed(&tower, "tower");
        assert!((tower.volume() - (0.2 + 0.36 * 0.8)).abs() < 1e-12);
        assert_closed(&tree(), "tree");
    }

    #[test]
    fn everything_is_dealt_as_evenly_as_can_be() {
        let dealt = deal(2_028, 1_024, &mut Prng::new(1, SIZES));
        assert_eq!(dealt.iter().sum::<usize>(), 2_028);
        assert_eq!(dealt.iter().filter(|&&n| n == 2).count(), 1_004);
        assert_eq!(dealt.iter().filter(|&&n| n == 1).count(), 20);
    }
}
