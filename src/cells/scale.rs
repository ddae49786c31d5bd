//! Human scale: the length of a metre in a model. Thresholds about buildings are multiples of it.
//!
//! It follows from the height of the model's rooms, so that a building gives the same rooms in any unit. Vertical rays start at the centres
//! of the largest horizontal triangles; the ceiling height is the median over the crossed volume. Rays from front to front cross rooms, and
//! rays from back to back cross slabs, or the reverse if the model is inside out: the set with more and higher space counts. A large ground
//! counts only near walls.

use crate::math::geom::{Aabb, newell};
use crate::math::random::Prng;
use crate::scene::bulk::bulk;
use crate::scene::floors::within;
use crate::scene::rays::RayScene;
use crate::scene::up;
use crate::types::note::Note;
use crate::types::person::{CEILING_HEIGHT, LEAST_ACROSS, PLAUSIBLE, by_extent, hall, metric};
use glam::DVec3;

/// A triangle is horizontal if its normal's cosine with the vertical is above this (8 degrees).
const LEVEL: f64 = 0.99;

/// Typical lengths of buildings, scaled if a model is evidently not in metres. They choose splitting planes and rooms; soundness does not
/// depend on them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct HumanScale {
    /// Length of a metre in the model's units.
    pub metre: f64,
    /// Ceiling height in the model's units, the median by volume; only for formats without a unit.
    ceiling: Option<f64>,
    /// Whether the model may lie on its side, so that room heights mean nothing.
    is_doubted: bool,
}

/// Units of models: number in a metre, name, flag.
const UNITS: [(f64, &str, &str); 4] =
    [(1e3, "millimetres", "mm"), (100.0, "centimetres", "cm"), (1.0 / 0.0254, "inches", "inch"), (1e-3, "kilometres", "km")];
/// Ceiling heights that identify a unit, metres.
const ROOMS: std::ops::RangeInclusive<f64> = 2.0..=4.6;
/// Plausible heights in a model in metres, metres: rooms, halls, city blocks without storeys.
const IN_METRES: std::ops::RangeInclusive<f64> = 0.7..=40.0;
/// Without rooms, an estimated metre gets the name of a unit within this factor. Game units, 32 to a metre, pass for inches.
const NEAR: f64 = 1.35;
/// Rooms of 2.3 to 3.5 m, in feet. Few buildings in metres have such heights: halls and churches.
const IN_FEET: std::ops::RangeInclusive<f64> = 7.5..=11.5;

/// Narrowest passage for a person, human metres.
pub(super) const LEAST_WIDTH: f64 = 0.6;
/// If spaces too low for rooms in metres fill less than this share of the model's box, they are under tables or in slabs, and there is no
/// ceiling. Larger: small copies of sparse buildings pass for rooms in metres. Smaller: furnished rooms without a ceiling pass for small
/// copies.
const LEAST_FULL: f64 = 0.05;
/// Smallest area of a wall or a sheet that cuts, human square metres.
const LEAST_CUT: f64 = 0.1;
/// Margin around the model, as a share of its diagonal, and its maximum in human metres. Larger: useless cells outside. None: the outside
/// has no pieces.
const MARGIN_SHARE: f64 = 0.05;
const MOST_MARGIN: f64 = 3.0;
/// Most rays.
const LINES: usize = 4096;

impl HumanScale {
    /// The scale of a model in metres.
    pub const METRES: Self = Self { metre: 1.0, ceiling: None, is_doubted: false };

    /// Metres, if ceiling heights are plausible in metres; else kilometres or millimetres, if heights fit and the model is at least as
    /// large as a room; else the unit that gives ceilings the height of game halls. A model without ceilings is in metres if it is 3 to 400
    /// m across, and otherwise counts as 100 m across. IFC states its unit, so game halls are not considered there.
    pub fn of(rays: &RayScene<'_>) -> Self {
        let scene = rays.scene();
        let is_doubted = scene.source.up == "+Y" && up::is_on_its_side(scene);
        let near = bulk(scene);
        let part = near.unwrap_or(scene.bounds());
        let across = part.diagonal();
        let are_rooms = |&(height, volume): &(f64, f64)| {
            let is_low = height < PLAUSIBLE[0] * CEILING_HEIGHT && across >= LEAST_ACROSS;
            !is_low || volume >= LEAST_FULL * part.size().element_product()
        };
        let Some((height, _)) = ceiling(rays, near).filter(are_rooms) else {
            return Self { metre: by_extent(across), ceiling: None, is_doubted };
        };
        let hall = if scene.source.format.starts_with("IFC") { 1.0 } else { hall(height) };
        let metre = metric(height, across).unwrap_or(hall);
        // Formats without a mandatory unit.
        let is_silent = ["glTF", "OBJ", "PLY", "STL"].contains(&scene.source.format.as_str());
        Self { metre, ceiling: is_silent.then_some(height), is_doubted }
    }

    /// Human metres in model units.
    pub fn metres(&self, metres: f64) -> f64 {
        metres * self.metre
    }

    /// Human square metres in model units.
    pub fn square_metres(&self, square_metres: f64) -> f64 {
        square_metres * self.metre * self.metre
    }

    /// Human cubic metres in model units.
    pub fn cubic_metres(&self, cubic_metres: f64) -> f64 {
        cubic_metres * self.metre.powi(3)
    }

    /// The domain of the split: the model with a margin.
    pub fn domain(&self, model: Aabb) -> Aabb {
        model.inflated((MARGIN_SHARE * model.diagonal()).min(self.metres(MOST_MARGIN)))
    }

    /// A note if the model is not in metres or may be in feet; none if the up direction is in doubt.
    pub fn note(&self) -> Option<Note> {
        self.doubt().map(Note::fault)
    }

    fn doubt(&self) -> Option<String> {
        let (metre, height) = (self.metre, self.ceiling.unwrap_or_default());
        if self.is_doubted {
            return None;
        }
        if metre != 1.0 {
            let (units, name, unit) = UNITS.into_iter().min_by(|a, b| {
                let off = |units: f64| match self.ceiling {
                    Some(height) => (height / units / CEILING_HEIGHT).ln().abs(),
                    None => (metre / units).ln().abs(),
                };
                off(a.0).total_cmp(&off(b.0))
            })?;
            let fits = match self.ceiling {
                Some(height) => ROOMS.contains(&(height / units)),
                None => (1.0 / NEAR..=NEAR).contains(&(metre / units)),
            };
            // City blocks and game halls are higher than rooms in any unit.
            let is_odd = !IN_METRES.contains(&height);
            return match (fits, self.ceiling) {
                (true, Some(_)) => {
                    Some(format!("the model seems to be in {name}: its rooms are {height:.0} units high (--unit {unit})"))
                }
                (true, None) => Some(format!("the model seems to be in {name}, by its size (--unit {unit})")),
                (false, Some(_)) if is_odd => Some(format!(
                    "the model seems not to be in metres: its rooms are {height} units high; give its unit with --unit"
                )),
                (false, Some(_)) => None,
                (false, None) => Some("the model seems not to be in metres; give its unit with --unit".to_owned()),
            };
        }
        let feet = || format!("its rooms are {height:.1} m high; if the model is in feet, give --unit ft");
        IN_FEET.contains(&height).then(feet)
    }

    /// A length as text: in model units if those are not metres.
    pub fn told(&self, length: f64) -> String {
        match self.metre == 1.0 {
            true => format!("{length:.3} m"),
            false => format!("{length:.3} units ({:.2} m of a person)", length / self.metre),
        }
    }

    /// Smallest wall area on one line that cuts, square metres: jambs of a window have more, facets of a column or a moulding less.
    pub fn least_wall(&self) -> f64 {
        self.square_metres(LEAST_CUT)
    }

    /// Smallest floor, ceiling or roof area in one plane that cuts, square metres.
    pub fn least_sheet(&self) -> f64 {
        self.square_metres(LEAST_CUT)
    }
}

/// The median height, by volume, of the spaces above horizontal triangles, and their total volume, both in model units; `part` is the
/// [bulk] of the scene.
fn ceiling(rays: &RayScene<'_>, part: Option<Aabb>) -> Option<(f64, f64)> {
    let scene = rays.scene();
    let normal = |t: u32| {
        let c = scene.corners(t as usize);
        newell(&c.map(|p| p - c[0]))
    };
    let mut level: Vec<Level> = Vec::new();
    for t in scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone()) {
        let n = normal(t);
        if n.y.abs() > LEVEL * n.length() {
            let corners = scene.corners(t as usize);
            let near = part.map_or_else(|| vec![corners], |part| within(corners, part));
            let told = |c: [DVec3; 3]| (newell(&c.map(|p| p - c[0])).length(), (c[0] + c[1] + c[2]) / 3.0, n.y > 0.0);
            level.extend(near.into_iter().map(told));
        }
    }
    let level = few(level);
    let above = 4.0 * scene.tolerance().clearance;
    // Between fronts, between backs, and, for sheets without thickness, mixed.
    let mut crossed: [Vec<(f64, f64)>; 3] = Default::default();
    for (area, p, up) in level {
        if let Some(hit) = rays.first_opaque(p + DVec3::Y * above, DVec3::Y, f64::INFINITY) {
            let down = normal(hit.triangle).y < 0.0;
            crossed[if up == down { usize::from(!up) } else { 2 }].push((hit.t + above, area));
        }
    }
    let volume = |heights: &[(f64, f64)]| heights.iter().map(|h| h.0 * h.1).sum::<f64>();
    // High spaces weigh more: a ground slab may have more volume than all rooms.
    let weight = |heights: &[(f64, f64)]| heights.iter().map(|h| h.0 * h.0 * h.1).sum::<f64>();
    let [fronts, backs, mut heights] = crossed;
    heights.extend(if weight(&backs) > weight(&fronts) { backs } else { fronts });
    heights.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole = volume(&heights);
    let half = 0.5 * whole;
    let mut sum = 0.0;
    let middle = heights.into_iter().find(|h| {
        sum += h.0 * h.1;
        sum >= half
    });
    // The areas are doubled.
    middle.map(|h| (h.0, 0.5 * whole))
}

/// A horizontal triangle: its area, its centre, and whether it faces up.
type Level = (f64, DVec3, bool);

/// At most [`LINES`] triangles: half are the largest, half a sample of the others, weighted by area. (The largest alone may all be roof
/// tiles.) The choice does not depend on the order in the file.
fn few(mut level: Vec<Level>) -> Vec<Level> {
    if level.len() <= LINES {
        return level;
    }
    level.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| order(a.1, b.1)).then(a.2.cmp(&b.2)));
    let small = level.split_off(LINES / 2);
    let share = small.iter().map(|l| l.0).sum::<f64>() / (LINES / 2) as f64;
    // One triangle from each equal share of the area.
    let mut random = Prng::new(0, 0);
    let mut at = random.unit() * share;
    let mut sum = 0.0;
    for (area, middle, up) in small {
        sum += area;
        while sum > at && level.len() < LINES {
            level.push((share, middle, up));
            at = ((level.len() - LINES / 2) as f64 + random.unit()) * share;
        }
    }
    level
}

fn order(a: DVec3, b: DVec3) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};

    /// Horizontal sheets of `size` x 0.6 `size` at these heights.
    fn scene(size: f64, heights: &[f64]) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for (i, &y) in heights.iter().enumerate() {
            let positions = [(0., 0.), (size, 0.), (size, 0.6 * size), (0., 0.6 * size)];
            let positions = positions.map(|(x, z)| DVec3::new(x, y, z)).to_vec();
            let (node, triangles) = (format!("sheet {i}"), vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
        }
        builder.finish("sheets").unwrap()
    }

    fn of(scene: &Scene) -> HumanScale {
        HumanScale::of(&RayScene::new(scene))
    }

    /// The estimated metre of a storey with this clear height and slabs of 0.3 m, drawn with `units` to a metre.
    fn metre(height: f64, units: f64) -> f64 {
        of(&scene(20.0 * units, &[-0.3, 0.0, height, height + 0.3].map(|y| y * units))).metre
    }

    /// 3,600 roof tiles are larger than those of ceilings and floors: almost all rays would start on the roof and hit nothing.
    #[test]
    fn storeys_of_many_tiles_are_as_high_as_their_rooms() {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for (height, edge, up) in [(0.0, 2.8, true), (2.6, 2.9, false), (2.9, 3.0, true)] {
            let tile = |k: usize| {
                let (x, z) = (3.0 * (k % 60) as f64, 3.0 * (k / 60) as f64);
                [(x, z), (x, z + edge), (x + edge, z + edge), (x + edge, z)].map(|(x, z)| DVec3::new(x, height, z) * 1e3)
            };
            let positions = (0..3600).flat_map(tile).collect();
            let facing = |t: [u32; 3]| if up { t } else { [t[0], t[2], t[1]] };
            let triangles = (0..3600).flat_map(|k| [[0, 1, 2], [0, 2, 3]].map(|t| facing(t.map(|i| 4 * k + i)))).collect();
            let node = format!("at {height}");
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
        }
        assert_eq!(of(&builder.finish("tiles").unwrap()).metre, 1e3);
    }

    #[test]
    fn rooms_as_people_build_them_are_in_metres() {
        for height in [0.8, 2.2, 2.7, 4.0, 9.0, 15.0] {
            assert_eq!(metre(height, 1.0), 1.0, "{height} m");
        }
    }

    #[test]
    fn millimetres_and_kilometres_are_told() {
        for height in [2.2, 2.7, 4.0] {
            assert_eq!((metre(height, 1e3), metre(height, 1e-3)), (1e3, 1e-3), "{height} m");
        }
    }

    #[test]
    fn feet_pass_for_metres_as_all_thresholds_are_wide_enough_for() {
        assert_eq!(metre(2.7, 1.0 / 0.3048), 1.0);
    }

    #[test]
    fn other_units_are_told_to_within_a_factor_of_two() {
        // Inches, centimetres, units of a game.
        for units in [1.0 / 0.0254, 100.0, 32.0] {
            let found = metre(2.7, units) / units;
            assert!((0.5..=2.0).contains(&found), "{units}: {found}");
        }
    }

    #[test]
    fn a_level_in_units_of_a_game_is_not_a_dolls_house_in_millimetres() {
        // 2,048 units wide, halls of 700: 2 m by 0.7 m in millimetres.
        let found = of(&scene(2048.0, &[-16.0, 0.0, 700.0, 716.0])).metre;
        assert!((30.0..=200.0).contains(&found), "{found}");
        // A room of 6 x 3.6 x 2.4 m in millimetres is still recognized.
        assert_eq!(of(&scene(6000.0, &[-300.0, 0.0, 2400.0, 2700.0])).metre, 1e3);
    }

    #[test]
    fn ifc_is_in_metres_however_low_its_rooms_are() {
        let mut crawl = scene(20.0, &[-0.1, 0.0, 0.3, 0.4]);
        assert!(of(&crawl).metre < 0.1);
        crawl.source.format = "IFC2X3".into();
        assert_eq!(of(&crawl).metre, 1.0);
    }

    /// A floor of 12 slabs of 1.5 x 0.04 x 1.5 m, walls of 3 m around it, and a table 0.5 m above one of the slabs; all scaled.
    fn room_without_a_ceiling(scale: f64) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut quad = |corners: [DVec3; 4]| {
            let (node, triangles) = ("part".into(), vec![[0, 1, 2], [0, 2, 3]]);
            let positions = corners.map(|p| p * scale).to_vec();
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
        };
        let level =
            |at: DVec3, size: f64| [at, at + DVec3::Z * size, at + (DVec3::X + DVec3::Z) * size, at + DVec3::X * size];
        for tile in 0..12 {
            let at = DVec3::new(f64::from(tile % 4) * 1.5, 0.0, f64::from(tile / 4) * 1.5);
            quad(level(at, 1.5));
            let [a, b, c, d] = level(at - 0.04 * DVec3::Y, 1.5);
            quad([d, c, b, a]);
        }
        quad(level(DVec3::Y * 0.5, 1.2));
        for (at, along) in [(DVec3::ZERO, 6.0 * DVec3::X), (DVec3::ZERO, 4.5 * DVec3::Z)] {
            quad([at, at + along, at + along + 3.0 * DVec3::Y, at + 3.0 * DVec3::Y]);
        }
        builder.finish("room").unwrap()
    }

    #[test]
    fn slabs_and_tables_of_a_room_without_a_ceiling_are_no_rooms() {
        let room = of(&room_without_a_ceiling(1.0));
        assert_eq!((room.metre, room.note()), (1.0, None));
        // A model full of ceilings at 0.3 m is a small copy of a building.
        assert!(metre(0.3, 1.0) < 0.2);
    }

    #[test]
    fn a_ground_with_a_thickness_is_no_room() {
        // Slabs of 0.3 m around a room of 20 x 12 x 2.7 m, on a ground slab of 0.2 m: 1,600 m2 have half of the room's volume, 640,000 m2
        // two hundred times as much.
        for reach in [20.0, 400.0] {
            let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
            let mut quad = |corners: [DVec3; 4]| {
                let (node, triangles) = ("part".into(), vec![[0, 1, 2], [0, 2, 3]]);
                builder
                    .add(Mesh { node, role: Role::Structure, opaque: true, positions: corners.to_vec(), triangles })
                    .unwrap();
            };
            let mut slab = |[x, z]: [[f64; 2]; 2], [low, high]: [f64; 2]| {
                let corner = |x: f64, z: f64, y: f64| DVec3::new(x, y, z);
                quad([
                    corner(x[0], z[0], high),
                    corner(x[0], z[1], high),
                    corner(x[1], z[1], high),
                    corner(x[1], z[0], high),
                ]);
                quad([corner(x[0], z[0], low), corner(x[1], z[0], low), corner(x[1], z[1], low), corner(x[0], z[1], low)]);
                for (a, b) in [([0, 0], [1, 0]), ([1, 0], [1, 1]), ([1, 1], [0, 1]), ([0, 1], [0, 0])] {
                    let at = |[i, k]: [usize; 2], y: f64| corner(x[i], z[k], y);
                    quad([at(a, low), at(a, high), at(b, high), at(b, low)]);
                }
            };
            let room = [[0.0, 20.0], [0.0, 12.0]];
            slab(room, [-0.3, 0.0]);
            slab(room, [2.7, 3.0]);
            slab([[-0.3, 0.0], room[1]], [0.0, 2.7]);
            slab([room[0], [-0.3, 0.0]], [0.0, 2.7]);
            slab([[-reach, reach], [-reach, reach]], [-0.51, -0.31]);
            assert_eq!(of(&builder.finish("house").unwrap()).metre, 1.0, "{reach}");
        }
    }

    #[test]
    fn nothing_is_told_of_rooms_that_may_lie_on_their_side() {
        let note = HumanScale { metre: 100.0, ..HumanScale::METRES };
        assert!(note.note().is_some_and(|note| note.starts_with("the model seems ")));
        assert_eq!(HumanScale { is_doubted: true, ..note }.note(), None);
    }

    #[test]
    fn units_are_named_by_the_height_of_rooms() {
        for (height, unit) in [(260.0, "in centimetres: "), (102.4, "in inches: "), (2700.0, "in millimetres: ")] {
            let note = HumanScale { metre: hall(height), ceiling: Some(height), is_doubted: false }.note().unwrap();
            assert!(note.contains(unit), "{height}: {note}");
        }
        let feet = HumanScale { ceiling: Some(9.0), ..HumanScale::METRES }.note().unwrap();
        assert!(feet.ends_with("in feet, give --unit ft"), "{feet}");
        // A city of blocks 18 m high.
        assert_eq!(HumanScale { metre: hall(18.0), ceiling: Some(18.0), is_doubted: false }.note(), None);
    }

    #[test]
    fn nothing_overhead_leaves_the_extent_to_tell() {
        for (size, expected) in [(20.0, 1.0), (300.0, 1.0), (8000.0, 93.295), (1e-3, 1.166e-5)] {
            let found = of(&scene(size, &[0.0])).metre;
            assert!((found / expected - 1.0).abs() < 1e-3, "{size}: {found}");
        }
    }

    #[test]
    fn thresholds_are_multiples_of_it() {
        let (small, large) = (HumanScale::METRES, HumanScale { metre: 1000.0, ..HumanScale::METRES });
        assert_eq!(large.least_wall(), 1e6 * small.least_wall());
        assert_eq!(large.least_sheet(), 1e6 * small.least_sheet());
    }
}
