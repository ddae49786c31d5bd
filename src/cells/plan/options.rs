//! Every threshold of the plan strategy: its unit, its value, its range, and the effect of other values.
//!
//! Lengths, areas and volumes are in human metres; [`HumanScale`](crate::cells::scale::HumanScale) converts them to the model's unit.
//! Shares have no unit; seals are those of [`crate::tolerance`]. Values avoid the round numbers of real buildings, where rounding would
//! decide.
//!
//! No threshold affects soundness. A poor value gives cells that cull less.
//!
//! Numbers and buildings in comments were measured. All other effects of larger and smaller values, and the ranges, are reasoned.

/// A threshold, or a group of them.
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
#[error("{name} is {value}; it must be from {least} to {most}")]
pub(in crate::cells) struct OutOfRange {
    /// Name of the field.
    name: &'static str,
    /// Its value.
    value: f64,
    /// The range, ends included.
    least: f64,
    most: f64,
}

/// Declares each threshold once: meaning, type, value, range with both ends.
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
    // The size of a person.

    /// Metres. A lower void is no room, because nobody can stand in it. Larger: low attics and cellars become plenums. Smaller: plenums
    /// become rooms, each with a row of its own.
    standing: f64 = 1.87, in 1.2 to 2.2;
    /// Metres. The highest step that a person can take. Larger: the top of a low wall joins the plenum over it to the room. Smaller: a
    /// stage or a landing is separated from its hall.
    ledge: f64 = 0.93, in 0.3 to 1.5;
    /// Metres. Narrower regions join a neighbour: a door's reveal, a niche. Larger: passages join their rooms. Smaller: reveals become
    /// cells.
    least_width: f64 = crate::cells::scale::LEAST_WIDTH, in 0.1 to 1.0;
    /// Metres. The widest door: a wider opening is a bottleneck only if it is much narrower than its regions (`wide_passage`). Larger:
    /// connected halls are separated at every pier. Smaller: a wide door does not separate rooms.
    widest_door: f64 = 1.65, in 0.9 to 4.0;

    // The open share of a face.

    /// Share of a face's area. A face that is more open than this is an opening; else it is a wall with a hole. Larger: a wall with a
    /// wide window stops the clearance. Smaller: a door leaf that is ajar makes its wall vanish.
    open_face: f64 = 0.5, in 0.1 to 0.9;
    /// Share of the open part of a face. An opening is filled if door leaves or panes cover more than this. Larger: glazed doors count as
    /// holes, and rooms join. Smaller: a sidelight shuts the passage beside it.
    filled_face: f64 = 0.5, in 0.1 to 0.9;
    /// Share of a face's area. A face that is less open than this has a frame. Larger: rounding counts as a frame. Smaller: a lintel does
    /// not.
    frameless: f64 = 0.98, in 0.8 to 1.0;
    /// Share of a cut's area. A hole in a floor is a bottleneck that may join regions if it is more open than this. Larger: halls of two
    /// storeys fall apart where a beam crosses them. Smaller: rooms join through a stair's well.
    open_floor: f64 = 0.8, in 0.5 to 1.0;
    /// Share of a cut's area. An author's room goes on above (or below) a sheet that is more open than this. Larger: objects that hang from
    /// a ceiling separate the room from the space above. Smaller: a room takes in the space above its broken ceiling.
    open_ceiling: f64 = 0.9, in 0.5 to 1.0;

    // Clearance.

    /// Metres. Walls farther than this do not count. Larger: time, and wide halls differ in width. Smaller: halls count as narrow as the
    /// reach, and wide passages do not separate them.
    clearance_reach: f64 = 8.0, in 2.0 to 64.0;
    /// Share of a height. Walls that are only this near to the floor or the ceiling do not narrow the space. Larger: only walls at half the
    /// height count. Smaller: a kerb narrows a room.
    grazed: f64 = 0.25, in 0.0 to 0.45;
    /// Multiple of a piece's height. The largest width of a piece. Larger: halls are so wide that their doors seem narrow, and they fall to
    /// pieces. Smaller: low corridors count as narrow as their doors.
    widest_for_height: f64 = 2.0, in 1.0 to 10.0;

    // Bottlenecks.

    /// Seals. Openings within this distance of each other are one. Larger: a mullion is lost. Smaller: rounding divides one opening.
    touching: f64 = 3.0, in 1.0 to 10.0;
    /// Share of the higher one's height. Adjacent openings are one if their heights overlap by more than this. Larger: a stepped lintel
    /// divides an opening. Smaller: a door and the window beside it are one.
    same_height: f64 = 0.5, in 0.1 to 1.0;
    /// Shares of a face's length. The clearance of a bottleneck is measured at these places along its face. The ends (0 and 1) touch walls,
    /// so they are useless.
    measured_at: [f64; 3] = [0.25, 0.5, 0.75], in 0.01 to 0.99;

    // The watershed: the bottlenecks that join two regions.

    /// Share of the narrower region's width. An opening at least this wide is no bottleneck. From 0.9 on levels with ragged walls fall
    /// to pieces. At 0.75 the Villa Rotonda's outer doors (1.6 m in passages of 2.14 m) join its hall to the outside.
    wide_opening: f64 = 0.79, in 0.5 to 1.0;
    /// The same for a face with a wall or lintel on part of it, because those are built where rooms end. Larger: a thin pilaster divides a
    /// room. Smaller: doors as wide as their passage join it to the room.
    wide_framed_opening: f64 = 0.97, in 0.5 to 1.0;
    /// The same for openings wider than any door (`widest_door`). Larger: piers divide a hall. Smaller: the garage joins the house.
    wide_passage: f64 = 0.64, in 0.3 to 1.0;
    /// Share of the lower region's height. An opening at least this high is no bottleneck: a door of 2.1 m in a room of 2.4 m is 0.875, a
    /// beam of 0.2 m under a ceiling of 2.5 m leaves 0.92. Larger: beams separate rooms. Smaller: doors do not.
    high_opening: f64 = 0.89, in 0.5 to 1.0;

    // The size of a cell.

    /// Cubic metres. Smaller regions join a neighbour. Larger: closets and lavatories are lost. Smaller: niches are cells.
    least_volume: f64 = 1.5, in 0.0 to 30.0;
    /// Cubic metres. The same for unnamed regions in models with authored rooms: plenums, shafts, cavities of walls. Larger: rooms that the
    /// author forgot join neighbours. Smaller: each shaft is a cell.
    least_unnamed_volume: f64 = 25.0, in 0.0 to 200.0;
    /// Most cells of each band of the plan, or one per `triangles_a_cell` triangles, whichever is more. With more cells, the least volume
    /// grows until they fit. Larger: rows take memory with its square. Smaller: a hospital's rooms are joined.
    most_cells: usize = 4_000, in 10 to 1_000_000;
    /// Triangles of walls and sheets; see `most_cells`. Rooms have 80 and more. Larger: rooms of the largest buildings are joined. Smaller:
    /// soups of many triangles have a cell for every few of them.
    triangles_a_cell: usize = 64, in 1 to 10_000;
    /// Most planes with portals in each band of the plan, or `most_portals_a_cell` per cell, whichever is more; beyond it, the least volume
    /// grows likewise. Larger: time. Smaller: open plans become one cell.
    most_portals: usize = 4_000, in 10 to 1_000_000;
    /// Count for each cell; see `most_portals`.
    most_portals_a_cell: usize = 4, in 1 to 100;
    /// Factor. The least volume grows by this until the cells fit. Larger: more rooms are joined than necessary. Smaller: more rounds.
    coarser: f64 = 2.0, in 1.1 to 10.0;

    // Rooms that an author drew.

    /// Share of the drawn volume. An authored room may grow by this (above a ceiling, into a bay), plus `least_growth`. Larger: through a
    /// glass wall it takes in the outside. Smaller: bays and ceilings are cells.
    growth: f64 = 0.5, in 0.0 to 2.0;
    /// Cubic metres; see `growth`. Larger: a closet takes in its corridor. Smaller: a closet loses the space over its ceiling.
    least_growth: f64 = 5.0, in 0.0 to 50.0;

    // Adjacency: openness of whole regions.

    /// Count of face visits. Below it, a region joins one other per round; above it, all regions open to a larger one join it at once.
    /// Larger: time, with the square of a hall's niches. Smaller: towers with open storeys are one cell.
    faces_in_pairs: usize = 100_000_000, in 0 to 1_000_000_000;
    /// Share of the smaller region's whole boundary. Two regions are one if this share is open between them: a room's door is 2 % of it, a
    /// wide window 6 %, half a hall 20 % and more. Larger: halls fall apart. Smaller: rooms join through their windows.
    open_share: f64 = 0.2, in 0.07 to 0.5;
    /// The same if the smaller region is a hall (`hall_volume`): otherwise a level with connected halls would become one cell. Larger:
    /// courts fall to pieces. Smaller: the level is one cell.
    open_share_of_halls: f64 = 0.35, in 0.07 to 0.9;
    /// Cubic metres. A region of this size is a hall. Larger: halls join. Smaller: rooms fall to pieces.
    hall_volume: f64 = 150.0, in 30.0 to 5e3;
    /// Share of the smaller cross-section. Two indoor regions are one if this much is open between them under a slope: halves of an attic
    /// 1.8, a garage door under its lintel 0.6, a door 0.2. Larger: an attic falls apart. Smaller: rooms under it join.
    open_section: f64 = 1.2, in 0.6 to 1.8;
    /// Cubic metres. A region smaller than this may be a stall. Larger: rooms join their corridors. Smaller: stalls are cells.
    stall_volume: f64 = 10.0, in 0.0 to 50.0;
    /// Share of a stall's whole boundary. A stall joins a neighbour if at least this is open: over and under toilet partitions 0.16 and
    /// more; a cupboard with an open door 0.13. Larger: stalls are cells. Smaller: cupboards are not.
    open_share_of_stalls: f64 = 0.14, in 0.05 to 0.5;
    /// Share of the lower one's ceiling and of the upper one's floor. Stacked regions with this share open are one shaft. Larger: brackets
    /// divide a shaft. Smaller: rooms join through a stairwell.
    open_share_of_shafts: f64 = 0.9, in 0.5 to 1.0;
    /// The same if the level is not an authored storey: a gallery over a third of a hall leaves 0.67. Larger: a hall with a gallery is
    /// divided at the level. Smaller: two storeys around a well are one.
    open_share_of_galleries: f64 = 0.6, in 0.3 to 1.0;
    /// Rise over length. A ceiling slopes if it rises by this; drainage slopes are smaller. Larger: attics are measured as rooms. Smaller:
    /// rooms under flat roofs are measured as attics.
    slope: f64 = 0.1, in 0.02 to 0.5;
    /// Seals. Faces meet if their ends are in one square of this size. Larger: rows of narrow openings are one. Smaller: rounding divides
    /// one opening.
    meeting: f64 = 8.0, in 2.0 to 64.0;
    /// Count of directions in which a row of faces is measured; 16 are good to 2 %. More: time. Fewer: slanted rows seem narrow.
    directions: usize = 16, in 4 to 360;

    // Free space and solid matter.

    /// Share of the boundary. Solid matter shows its back over at least this. Larger: a hole in a solid's hull makes a cell of it.
    /// Smaller: rooms with some walls turned inside out are solid.
    backs: f64 = 0.98, in 0.5 to 1.0;
    /// Share of the boundary. Solid matter shows its front over less than this. Larger: rooms whose walls have two sides are solid.
    /// Smaller: a pier between two slabs is free.
    fronts: f64 = 0.9, in 0.1 to 1.0;
    /// Fronts over backs, by area. A sealed part above this faces inward: it is free if people could pass in it. Larger: rooms of mixed
    /// winding must be wide. Smaller: cavities of walls are cells.
    inward: f64 = 1.5, in 1.0 to 10.0;
    /// Fronts over backs, by area. A sealed part above this has mixed winding: it is free if it is as wide as a room (`mixed_width`).
    /// Larger: rooms of mixed winding are solid. Smaller: thick walls are cells.
    mixed: f64 = 0.67, in 0.1 to 1.0;
    /// Metres. Sealed parts of mixed winding that are this wide are rooms. Larger: such closets are solid. Smaller: thick walls are cells.
    mixed_width: f64 = 1.0, in 0.3 to 5.0;

    // Voids and the open sky.

    /// Share of a region's sides. A region is outside if it is open to the sky (`half_sky`) and this share of its sides is open to the
    /// outside: a forecourt in a U of buildings has 0.25, the open doors of a hall without a roof 0.05. Larger: forecourts are rooms.
    /// Smaller: roofless halls are outside.
    open_sides: f64 = 0.15, in 0.05 to 0.25;
    /// Share of a region's ceiling. A forecourt is open to the sky over at least this. Larger: a canopy makes a room of it. Smaller:
    /// halls with a skylight and a wide door are outside.
    half_sky: f64 = 0.5, in 0.1 to 0.9;
    /// Share of a region's ceiling. If a building has roofs (`roofed`), a region with this share open to the sky is a yard, and outside.
    /// Larger: yards with a tree are rooms. Smaller: rooms under torn roofs are outside.
    open_sky: f64 = 0.9, in 0.5 to 1.0;
    /// Share of all ceilings that is closed. A building has roofs from this on: a model without slabs is not a courtyard. Larger: yards are
    /// rooms. Smaller: all rooms of a model without slabs are outside.
    roofed: f64 = 0.5, in 0.1 to 0.9;
    /// Square metres. A crawl space has more than this open to a room at its side, without a ledge. Larger: crawl spaces are plenums.
    /// Smaller: a chink makes a cell of a plenum.
    crawl: f64 = 0.2, in 0.02 to 1.0;

    // Courtyards.

    /// Count. A courtyard has openings from at least this many cells; with fewer it is a niche. Larger: small courtyards stay part of the
    /// outside. Smaller: balconies and bays become useless cells.
    courtyard_rooms: usize = 4, in 2 to 100;
    /// Shares of the rooms with windows, as candidates for the top of courtyards; tried in this order. Under low roofs beside a tower,
    /// courtyards as high as the tower's rooms would be connected.
    courtyard_tops: [f64; 5] = [1.0, 0.95, 0.9, 0.75, 0.5], in 0.0 to 1.0;

    // Smoothing of boundaries.

    /// Share of its volume that a region keeps. Larger: the zigzag of small rooms stays. Smaller: a small room behind a wide opening
    /// vanishes.
    kept: f64 = 0.7, in 0.0 to 1.0;
    /// Factor. Cost of a square metre of boundary off walls, sheets and levels. Well above 1: boundaries keep the zigzag of the reveal's
    /// corners. At 1: they leave the walls to save a tiny area.
    off_wall: f64 = 1.25, in 1.0 to 2.0;

    // Rounding.

    /// Share of a number. Differences below this are rounding. Larger: real steps are lost. Smaller: equal choices oscillate.
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
        assert_eq!(refused(narrow), "least_width is 0; it must be from 0.1 to 1");
        let few = PlanOptions { courtyard_rooms: 1, ..PlanOptions::default() };
        assert_eq!(refused(few), "courtyard_rooms is 1; it must be from 2 to 100");
        let mut tops = PlanOptions::default();
        tops.courtyard_tops[4] = 1.5;
        assert_eq!(refused(tops), "courtyard_tops is 1.5; it must be from 0 to 1");
        let unknown = PlanOptions { high_opening: f64::NAN, ..PlanOptions::default() };
        assert!(refused(unknown).starts_with("high_opening is NaN"));
    }
}
