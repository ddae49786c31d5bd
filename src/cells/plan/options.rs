//! Every threshold of the plan strategy: its unit, its value, the range that it may have, and what breaks beyond it.
//!
//! Lengths, areas and volumes are in a person's metres: whoever compares with them asks [`HumanScale`](crate::cells::scale::HumanScale)
//! for what they are in the model. Shares have no unit; seals are those of [`crate::tolerance`]. Values are not round on purpose
//! where people build round ones: rounding would decide.
//!
//! No threshold bears on soundness. A poor value gives cells that cull less.
//!
//! Where a comment gives numbers or a building, they were measured. The rest of what larger and smaller values break, and the ranges, is
//! reasoned from what the threshold does.

/// A threshold, or a few that belong together.
trait Threshold {
    /// The values to compare with a range.
    fn values(&self) -> Vec<f64>;
}

impl Threshold for f64 {
    fn values(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl Threshold for usize {
    fn values(&self) -> Vec<f64> {
        vec![*self as f64]
    }
}

impl<const N: usize> Threshold for [f64; N] {
    fn values(&self) -> Vec<f64> {
        self.to_vec()
    }
}

/// A threshold outside its range.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[error("{name} is {value}, and must be from {least} to {most}")]
pub(in crate::cells) struct OutOfRange {
    /// Name of the field.
    name: &'static str,
    /// Its value.
    value: f64,
    /// The range, ends included.
    least: f64,
    most: f64,
}

/// States each threshold once: what it means, its type, its value, its range with both ends.
macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident: $kind:ty = $value:expr, in $least:literal to $most:literal;)*) => {
        /// The thresholds of the plan strategy.
        #[derive(Clone, PartialEq, Debug)]
        pub(in crate::cells) struct PlanOptions {
            $($(#[$doc])* #[doc = concat!("\n\nFrom ", $least, " to ", $most, ".")] pub(in crate::cells) $name: $kind,)*
        }

        impl Default for PlanOptions {
            fn default() -> Self {
                Self { $($name: $value,)* }
            }
        }

        impl PlanOptions {
            /// The first threshold outside its range, as an error.
            pub(in crate::cells) fn validate(&self) -> Result<(), OutOfRange> {
                let all: Vec<(&'static str, Vec<f64>, f64, f64)> =
                    vec![$((stringify!($name), self.$name.values(), $least as f64, $most as f64),)*];
                for (name, values, least, most) in all {
                    if let Some(&value) = values.iter().find(|v| !(least..=most).contains(*v)) {
                        return Err(OutOfRange { name, value, least, most });
                    }
                }
                Ok(())
            }
        }
    };
}

thresholds! {
    // What a person is like.

    /// Metres. Lower than this nobody stands: a void is no room. Larger: low attics and cellars become plenums. Smaller: plenums become
    /// rooms, each with a row of its own.
    standing: f64 = 1.87, in 1.2 to 2.2;
    /// Metres. Higher than this over a floor nobody steps. Larger: the top of a low wall joins the plenum over it to the room. Smaller:
    /// a stage or a landing is parted from its hall.
    ledge: f64 = 0.93, in 0.3 to 1.5;
    /// Metres. What is narrower is a part of its neighbour: a door's reveal, a niche. Larger: passages go to their rooms. Smaller:
    /// reveals become cells.
    least_width: f64 = crate::cells::scale::LEAST_WIDTH, in 0.1 to 1.0;
    /// Metres. People build no wider door: a wider opening is a bottleneck only where much is missing (`wide_passage`). Larger: halls
    /// that flow into one another are parted at every pier. Smaller: a wide door parts nothing.
    widest_door: f64 = 1.65, in 0.9 to 4.0;

    // How much of a face is open.

    /// Share of a face's area. A face that is more open than this is an opening; else it is a wall with a hole. Larger: a wall with a
    /// wide window stops the clearance. Smaller: a door leaf that is ajar makes its wall vanish.
    open_face: f64 = 0.5, in 0.1 to 0.9;
    /// Share of what is open of a face. Where more than this has a leaf or a pane, the leaf fills it. Larger: glazed doors count as
    /// holes, and rooms join. Smaller: a sidelight shuts the passage beside it.
    filled_face: f64 = 0.5, in 0.1 to 0.9;
    /// Share of a face's area. A face that is less open than this has a frame. Larger: rounding counts as a frame. Smaller: a lintel
    /// doesn't.
    frameless: f64 = 0.98, in 0.8 to 1.0;
    /// Share of a cut's area. A hole in a floor is a bottleneck that may join regions where it is more open than this. Larger: halls
    /// of two storeys fall apart where a beam crosses them. Smaller: rooms join through a stair's well.
    open_floor: f64 = 0.8, in 0.5 to 1.0;
    /// Share of a cut's area. An author's room goes on above (or below) a sheet that is more open than this. Larger: what hangs from
    /// a ceiling parts the room from the space over it. Smaller: a room takes in what lies over its broken ceiling.
    open_ceiling: f64 = 0.9, in 0.5 to 1.0;

    // Clearance.

    /// Metres. Walls farther than this don't count. Larger: time, and halls differ in width where all are wide. Smaller: halls count as narrow
    /// as the reach, and wide passages part nothing.
    clearance_reach: f64 = 8.0, in 2.0 to 64.0;
    /// Share of a height. Walls that stand only this near to the floor or the ceiling don't narrow what is there. Larger: only walls at
    /// half the height count. Smaller: a kerb narrows a room.
    grazed: f64 = 0.25, in 0.0 to 0.45;
    /// Times a piece's height. No piece is wider than this. Larger: halls are so wide that their doors seem narrow, and they fall to
    /// pieces. Smaller: low corridors count as narrow as their doors.
    widest_for_height: f64 = 2.0, in 1.0 to 10.0;

    // Bottlenecks.

    /// Seals. Openings that are nearer to each other than this are one. Larger: a mullion is lost. Smaller: rounding parts one opening.
    touching: f64 = 3.0, in 1.0 to 10.0;
    /// Share of the higher one's height. Openings beside each other are one where they share more of their heights. Larger: a stepped
    /// lintel parts an opening. Smaller: a door and the window beside it are one.
    same_height: f64 = 0.5, in 0.1 to 1.0;
    /// Shares of a face's length. The clearance of a bottleneck is measured at these places along its face. The ends (0 and 1) touch
    /// walls and tell nothing.
    measured_at: [f64; 3] = [0.25, 0.5, 0.75], in 0.01 to 0.99;

    // The watershed: which bottlenecks join two regions.

    /// Share of the narrower region's width. An opening at least this wide is no bottleneck. From 0.9 on levels with ragged walls fall
    /// to pieces. At 0.75 the Villa Rotonda's outer doors (1.6 m in passages of 2.14 m) join its hall to the outside.
    wide_opening: f64 = 0.79, in 0.5 to 1.0;
    /// The same where a wall or lintel lies on part of the face: people build those where rooms end. Larger: a thin pilaster parts a
    /// room. Smaller: doors as wide as their passage join it to the room.
    wide_framed_opening: f64 = 0.97, in 0.5 to 1.0;
    /// The same for openings wider than people build doors (`widest_door`). Larger: piers part a hall. Smaller: the garage joins the
    /// house.
    wide_passage: f64 = 0.64, in 0.3 to 1.0;
    /// Share of the lower region's height. An opening at least this high is no bottleneck: a door of 2.1 m in a room of 2.4 m is 0.875,
    /// a beam of 0.2 m under a ceiling of 2.5 m leaves 0.92. Larger: beams part rooms. Smaller: doors don't.
    high_opening: f64 = 0.89, in 0.5 to 1.0;

    // What is too small for a cell.

    /// Cubic metres. What is smaller is a part of its neighbour. Larger: closets and lavatories are lost. Smaller: niches are cells.
    least_volume: f64 = 1.5, in 0.0 to 30.0;
    /// Cubic metres. The same where the author named rooms: what has no name and is this small is a plenum, a shaft, the inside of a
    /// wall. Larger: rooms that he forgot go to their neighbours. Smaller: each shaft is a cell.
    least_unnamed_volume: f64 = 25.0, in 0.0 to 200.0;
    /// Count for each band of the plan, or one for so many triangles as `triangles_a_cell` says, whichever is more. With more cells than
    /// this, the least volume grows until it fits. More: rows take memory with the square of it. Fewer: a hospital's rooms are joined.
    most_cells: usize = 4_000, in 10 to 1_000_000;
    /// Triangles of walls and sheets; see `most_cells`. Rooms have 80 and more. Larger: rooms of the largest buildings are joined. Smaller:
    /// soups of many triangles have a cell for every few of them.
    triangles_a_cell: usize = 64, in 1 to 10_000;
    /// Count for each band of the plan: most planes with portals, or `most_portals_a_cell` for each cell, whichever is more; beyond it
    /// the least volume grows likewise. More: time. Fewer: open plans become one cell.
    most_portals: usize = 4_000, in 10 to 1_000_000;
    /// Count for each cell; see `most_portals`.
    most_portals_a_cell: usize = 4, in 1 to 100;
    /// Times. The least volume grows by this until what is left fits. Larger: more is joined than must be. Smaller: more rounds.
    coarser: f64 = 2.0, in 1.1 to 10.0;

    // Rooms that an author drew.

    /// Share of what the author drew. His room takes in as much that he didn't draw (over a ceiling, in a bay), and `least_growth`
    /// besides. Larger: through a wall of glass it takes in the outside. Smaller: bays and ceilings are cells.
    growth: f64 = 0.5, in 0.0 to 2.0;
    /// Cubic metres; see `growth`. Larger: a closet takes in its corridor. Smaller: a closet loses the space over its ceiling.
    least_growth: f64 = 5.0, in 0.0 to 50.0;

    // Adjacency: what is open to each other as a whole.

    /// Count of faces, each as often as it is looked at. Until then a region joins one other a round; afterwards all that are open to a
    /// larger one join it at once. More: time, by the square of a hall's niches. Fewer: towers with open storeys are one cell.
    faces_in_pairs: usize = 100_000_000, in 0 to 1_000_000_000;
    /// Share of the smaller region's whole boundary. Two regions that are open to each other over this are one: a room's door is 2 % of
    /// it, a wide window 6 %, half a hall 20 % and more. Larger: halls fall apart. Smaller: rooms join through their windows.
    open_share: f64 = 0.2, in 0.07 to 0.5;
    /// The same where the smaller region is itself a hall (`hall_volume`): a level whose halls flow into one another would end up as
    /// one cell. Larger: courts fall to pieces. Smaller: the level is one cell.
    open_share_of_halls: f64 = 0.35, in 0.07 to 0.9;
    /// Cubic metres. A region of this size is a hall. Larger: halls join. Smaller: rooms fall to pieces.
    hall_volume: f64 = 150.0, in 30.0 to 5e3;
    /// Share of the smaller cross-section. Two regions indoors are one where this much is open between them under a slope: halves of an
    /// attic 1.8, a garage door under its lintel 0.6, a door 0.2. Larger: an attic falls apart. Smaller: rooms under it join.
    open_section: f64 = 1.2, in 0.6 to 1.8;
    /// Cubic metres. A region smaller than this may be a stall. Larger: rooms go to their corridors. Smaller: stalls are cells.
    stall_volume: f64 = 10.0, in 0.0 to 50.0;
    /// Share of a stall's whole boundary. A stall goes to a neighbour where this is open in all: over and under the partitions of a
    /// toilet's stalls 0.16 and more; a cupboard's door that stands open is 0.13. Larger: stalls are cells. Smaller: cupboards aren't.
    open_share_of_stalls: f64 = 0.14, in 0.05 to 0.5;
    /// Share of the lower one's ceiling and of the upper one's floor. What lies over each other and is open over this is one shaft.
    /// Larger: a shaft is parted by its brackets. Smaller: rooms join over a stair's well.
    open_share_of_shafts: f64 = 0.9, in 0.5 to 1.0;
    /// The same where the level is no author's storey: a gallery over a third of a hall leaves 0.67. Larger: a hall with a gallery is
    /// parted at the level. Smaller: two storeys around a well are one.
    open_share_of_galleries: f64 = 0.6, in 0.3 to 1.0;
    /// Rise over length. A ceiling slopes where it rises by this: a roof that drains is flatter. Larger: attics are measured as rooms.
    /// Smaller: flat roofs as attics.
    slope: f64 = 0.1, in 0.02 to 0.5;
    /// Seals. Faces whose ends share a square of this size meet. Larger: rows of narrow openings are one. Smaller: rounding parts one
    /// opening.
    meeting: f64 = 8.0, in 2.0 to 64.0;
    /// Count of directions in which a row of faces is measured; 16 are good to 2 %. More: time. Fewer: slanted rows seem narrow.
    directions: usize = 16, in 4 to 360;

    // Free space against solid matter.

    /// Share of the boundary. Solid matter shows its back over at least this. Larger: a hole in a solid's hull makes a cell of it.
    /// Smaller: rooms with some walls turned inside out are solid.
    backs: f64 = 0.98, in 0.5 to 1.0;
    /// Share of the boundary. Solid matter shows its front over less than this. Larger: rooms whose walls have two sides are solid.
    /// Smaller: a pier between two slabs is free.
    fronts: f64 = 0.9, in 0.1 to 1.0;
    /// Fronts over backs, by area. A sealed part looks inward where it shows more: it is free if people could pass in it. Larger:
    /// rooms of mixed winding must be wide. Smaller: cavities of walls are cells.
    inward: f64 = 1.5, in 1.0 to 10.0;
    /// Fronts over backs, by area. A sealed part that shows more is of mixed winding: it is free if it is as wide as a room
    /// (`mixed_width`). Larger: rooms of mixed winding are solid. Smaller: thick walls are cells.
    mixed: f64 = 0.67, in 0.1 to 1.0;
    /// Metres. Sealed parts of mixed winding that are this wide are rooms. Larger: closets of them are solid. Smaller: thick walls
    /// are cells.
    mixed_width: f64 = 1.0, in 0.3 to 5.0;

    // Voids and the open sky.

    /// Share of a region's sides. What the sky is open to from above (`half_sky`), and the outside over this share of its sides, is
    /// outside: three sides of a forecourt in a U of buildings are 0.25, the open doors of a hall without a roof 0.05. Larger:
    /// forecourts are rooms. Smaller: roofless halls are outside.
    open_sides: f64 = 0.15, in 0.05 to 0.25;
    /// Share of a region's ceiling. A forecourt is open to the sky over at least this. Larger: a canopy makes a room of it. Smaller:
    /// halls with a skylight and a wide door are outside.
    half_sky: f64 = 0.5, in 0.1 to 0.9;
    /// Share of a region's ceiling. Where a building has roofs (`roofed`), what is open to the sky over this is a yard, and outside.
    /// Larger: yards with a tree are rooms. Smaller: rooms under torn roofs are outside.
    open_sky: f64 = 0.9, in 0.5 to 1.0;
    /// Share of all ceilings that is closed. From this on a building has roofs: a model without slabs is not a courtyard. Larger:
    /// yards are rooms. Smaller: all rooms of a model without slabs are outside.
    roofed: f64 = 0.5, in 0.1 to 0.9;
    /// Square metres. A void that people crawl into has more than this open to a room at its side, from whose floor it is no ledge.
    /// Larger: crawl spaces are plenums. Smaller: a chink makes a cell of a plenum.
    crawl: f64 = 0.2, in 0.02 to 1.0;

    // Courtyards.

    /// Count. A courtyard has openings from so many cells, or it is a niche. More: small courtyards stay one with the outside. Fewer:
    /// balconies and bays become cells, for which nobody sees less.
    courtyard_rooms: usize = 4, in 2 to 100;
    /// Shares of the rooms that look out, above which courtyards may end; tried in this order. Under low roofs beside a tower, several
    /// courtyards are one where they reach up to the tower's rooms.
    courtyard_tops: [f64; 5] = [1.0, 0.95, 0.9, 0.75, 0.5], in 0.0 to 1.0;

    // Boundaries drawn tight.

    /// Share of its volume that a region keeps. Larger: the zigzag of small rooms stays. Smaller: a small room behind a wide opening is
    /// eaten up.
    kept: f64 = 0.7, in 0.0 to 1.0;
    /// Times. A square metre of boundary that lies on no wall, sheet or level costs so much more. Well above: boundaries stay in the
    /// zigzag of the reveal's corners. At 1: they wander off the walls where that saves a hair of area.
    off_wall: f64 = 1.25, in 1.0 to 2.0;

    // Rounding.

    /// Share of a number. Differences below this are rounding. Larger: real steps are lost. Smaller: what is equal goes to and fro.
    rounding: f64 = 1e-9, in 1e-14 to 1e-6;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_values_are_in_their_ranges() {
        assert_eq!(PlanOptions::default().validate(), Ok(()));
    }

    #[test]
    fn a_value_beyond_its_range_is_named() {
        let refused = |options: PlanOptions| options.validate().unwrap_err().to_string();
        let narrow = PlanOptions { least_width: 0.0, ..PlanOptions::default() };
        assert_eq!(refused(narrow), "least_width is 0, and must be from 0.1 to 1");
        let few = PlanOptions { courtyard_rooms: 1, ..PlanOptions::default() };
        assert_eq!(refused(few), "courtyard_rooms is 1, and must be from 2 to 100");
        let mut tops = PlanOptions::default();
        tops.courtyard_tops[4] = 1.5;
        assert_eq!(refused(tops), "courtyard_tops is 1.5, and must be from 0 to 1");
        let unknown = PlanOptions { high_opening: f64::NAN, ..PlanOptions::default() };
        assert!(refused(unknown).starts_with("high_opening is NaN"));
    }
}
