//! Every threshold of the plan strategy: its unit, its value, and the effect of other values.
//!
//! Lengths, areas and volumes are in human metres; [`HumanScale`](crate::cells::scale::HumanScale) converts them to the model's unit.
//! Shares have no unit; seals are those of [`crate::math::tolerance`]. Values avoid the round numbers of real buildings, where rounding would
//! decide.
//!
//! No threshold affects soundness. A poor value gives cells that cull less.
//!
//! Numbers and buildings in comments were measured. All other effects of larger and smaller values are reasoned.

/// Declares each threshold once: meaning, type, value.
macro_rules! thresholds {
    ($($(#[$doc:meta])* $name:ident: $kind:ty = $value:expr;)*) => {
        /// The thresholds of the plan strategy.
        #[derive(Clone, PartialEq, Debug)]
        pub(in crate::cells) struct PlanOptions {
            $($(#[$doc])* pub(in crate::cells) $name: $kind,)*
        }

        impl Default for PlanOptions {
            fn default() -> Self {
                Self { $($name: $value,)* }
            }
        }
    };
}

thresholds! {
    // The size of a person.

    /// Metres. A lower void is no room, because nobody can stand in it. Larger: low attics and cellars become plenums. Smaller: plenums
    /// become rooms, each with a row of its own.
    standing: f64 = 1.87;
    /// Metres. The highest step that a person can take. Larger: the top of a low wall joins the plenum over it to the room. Smaller: a
    /// stage or a landing is separated from its hall.
    ledge: f64 = 0.93;
    /// Metres. Narrower regions join a neighbour: a door's reveal, a niche. Larger: passages join their rooms. Smaller: reveals become
    /// cells.
    least_width: f64 = crate::cells::scale::LEAST_WIDTH;
    /// Metres. The widest door: a wider opening is a bottleneck only if it is much narrower than its regions (`wide_passage`). Larger:
    /// connected halls are separated at every pier. Smaller: a wide door does not separate rooms.
    widest_door: f64 = 1.65;

    // Shares that decide by themselves.

    /// Share. Most of something: a face with this share open is an opening, otherwise a wall with a hole; an opening with this share covered
    /// by leaves or panes is filled; adjacent openings with this share of their heights in common are one; a forecourt has this share of its
    /// ceiling open to the sky; a building with this share of its ceilings closed has roofs. Larger: leaves that are ajar make walls vanish,
    /// rooms join through glazed doors. Smaller: walls with wide windows do not stop the clearance, a sidelight shuts the passage beside it.
    most: f64 = 0.5;
    /// Share. Nearly all of something: an author's room goes on above (or below) a sheet with this share open; stacked regions with this
    /// share of ceiling and floor open are one shaft; under a building's roofs, a region with this share open to the sky is a yard; solid
    /// matter shows its front over less. Larger: lamps separate a room from the space above, brackets divide a shaft, yards with a tree are
    /// rooms. Smaller: rooms join through broken ceilings and stairwells, rooms under torn roofs are outside.
    nearly_all: f64 = 0.9;
    /// Share. All of something, but for rounding and holes: a face that is less open has a frame; solid matter shows its back over this share
    /// of its boundary. Larger: rounding counts as a frame, a hole in a solid's hull makes a cell of it. Smaller: a lintel is no frame, rooms
    /// with some walls turned inside out are solid.
    all: f64 = 0.98;
    /// Share of a cut's area. A hole in a floor is a bottleneck that may join regions if it is more open than this. Larger: halls of two
    /// storeys fall apart where a beam crosses them. Smaller: rooms join through a stair's well.
    open_floor: f64 = 0.8;

    // Clearance.

    /// Metres. Walls farther than this do not count. Larger: time, and wide halls differ in width. Smaller: halls count as narrow as the
    /// reach, and wide passages do not separate them.
    clearance_reach: f64 = 8.0;
    /// Share of a height. Walls that are only this near to the floor or the ceiling do not narrow the space. Larger: only walls at half the
    /// height count. Smaller: a kerb narrows a room.
    grazed: f64 = 0.25;
    /// Multiple of a piece's height. The largest width of a piece. Larger: halls are so wide that their doors seem narrow, and they fall to
    /// pieces. Smaller: low corridors count as narrow as their doors.
    widest_for_height: f64 = 2.0;

    // Bottlenecks.

    /// Seals. Openings within this distance of each other are one. Larger: a mullion is lost. Smaller: rounding divides one opening.
    touching: f64 = 3.0;
    /// Shares of a face's length. The clearance of a bottleneck is measured at these places along its face. The ends (0 and 1) touch walls,
    /// so they are useless.
    measured_at: [f64; 3] = [0.25, 0.5, 0.75];

    // The watershed: the bottlenecks that join two regions.

    /// Share of the narrower region's width. An opening at least this wide is no bottleneck. From 0.9 on levels with ragged walls fall
    /// to pieces. At 0.75 the Villa Rotonda's outer doors (1.6 m in passages of 2.14 m) join its hall to the outside.
    wide_opening: f64 = 0.79;
    /// The same for a face with a wall or lintel on part of it, because those are built where rooms end. Larger: a thin pilaster divides a
    /// room. Smaller: doors as wide as their passage join it to the room.
    wide_framed_opening: f64 = 0.97;
    /// The same for openings wider than any door (`widest_door`). Larger: piers divide a hall. Smaller: the garage joins the house.
    wide_passage: f64 = 0.64;
    /// Share of the lower region's height. An opening at least this high is no bottleneck: a door of 2.1 m in a room of 2.4 m is 0.875, a
    /// beam of 0.2 m under a ceiling of 2.5 m leaves 0.92. Larger: beams separate rooms. Smaller: doors do not.
    high_opening: f64 = 0.89;

    // The size of a cell.

    /// Cubic metres. Smaller regions join a neighbour. Larger: closets and lavatories are lost. Smaller: niches are cells.
    least_volume: f64 = 1.5;
    /// Cubic metres. The same for unnamed regions in models with authored rooms: plenums, shafts, cavities of walls. Larger: rooms that the
    /// author forgot join neighbours. Smaller: each shaft is a cell.
    least_unnamed_volume: f64 = 25.0;
    /// Most cells of each band of the plan, or one per `triangles_a_cell` triangles, whichever is more. With more cells, the least volume
    /// grows until they fit. Larger: rows take memory with its square. Smaller: a hospital's rooms are joined.
    most_cells: usize = 4_000;
    /// Triangles of walls and sheets; see `most_cells`. Rooms have 80 and more. Larger: rooms of the largest buildings are joined. Smaller:
    /// soups of many triangles have a cell for every few of them.
    triangles_a_cell: usize = 64;
    /// Most planes with portals in each band of the plan, or `most_portals_a_cell` per cell, whichever is more; beyond it, the least volume
    /// grows likewise. Larger: time. Smaller: open plans become one cell.
    most_portals: usize = 4_000;
    /// Count for each cell; see `most_portals`.
    most_portals_a_cell: usize = 4;
    /// Factor. The least volume grows by this until the cells fit. Larger: more rooms are joined than necessary. Smaller: more rounds.
    coarser: f64 = 2.0;

    // Rooms that an author drew.

    /// Share of the drawn volume. An authored room may grow by this (above a ceiling, into a bay), plus `least_growth`. Larger: through a
    /// glass wall it takes in the outside. Smaller: bays and ceilings are cells.
    growth: f64 = 0.5;
    /// Cubic metres; see `growth`. Larger: a closet takes in its corridor. Smaller: a closet loses the space over its ceiling.
    least_growth: f64 = 5.0;

    // Adjacency: openness of whole regions.

    /// Count of face visits. Below it, a region joins one other per round; above it, all regions open to a larger one join it at once.
    /// Larger: time, with the square of a hall's niches. Smaller: towers with open storeys are one cell.
    faces_in_pairs: usize = 100_000_000;
    /// Share of the smaller region's whole boundary. Two regions are one if this share is open between them: a room's door is 2 % of it, a
    /// wide window 6 %, half a hall 20 % and more. Larger: halls fall apart. Smaller: rooms join through their windows.
    open_share: f64 = 0.2;
    /// The same if the smaller region is a hall (`hall_volume`): otherwise a level with connected halls would become one cell. Larger:
    /// courts fall to pieces. Smaller: the level is one cell.
    open_share_of_halls: f64 = 0.35;
    /// Cubic metres. A region of this size is a hall. Larger: halls join. Smaller: rooms fall to pieces.
    hall_volume: f64 = 150.0;
    /// Share of the smaller cross-section. Two indoor regions are one if this much is open between them under a slope: halves of an attic
    /// 1.8, a garage door under its lintel 0.6, a door 0.2. Larger: an attic falls apart. Smaller: rooms under it join.
    open_section: f64 = 1.2;
    /// Cubic metres. A region smaller than this may be a stall. Larger: rooms join their corridors. Smaller: stalls are cells.
    stall_volume: f64 = 10.0;
    /// Share of a stall's whole boundary. A stall joins a neighbour if at least this is open: over and under toilet partitions 0.16 and
    /// more; a cupboard with an open door 0.13. Larger: stalls are cells. Smaller: cupboards are not.
    open_share_of_stalls: f64 = 0.14;
    /// The same if the level is not an authored storey: a gallery over a third of a hall leaves 0.67. Larger: a hall with a gallery is
    /// divided at the level. Smaller: two storeys around a well are one.
    open_share_of_galleries: f64 = 0.6;
    /// Rise over length. A ceiling slopes if it rises by this; drainage slopes are smaller. Larger: attics are measured as rooms. Smaller:
    /// rooms under flat roofs are measured as attics.
    slope: f64 = 0.1;
    /// Seals. Faces meet if their ends are in one square of this size. Larger: rows of narrow openings are one. Smaller: rounding divides
    /// one opening.
    meeting: f64 = 8.0;
    /// Count of directions in which a row of faces is measured; 16 are good to 2 %. More: time. Fewer: slanted rows seem narrow.
    directions: usize = 16;

    // Free space and solid matter.

    /// Fronts over backs, by area. A sealed part above this faces inward: it is free if people could pass in it. Larger: rooms of mixed
    /// winding must be wide. Smaller: cavities of walls are cells.
    inward: f64 = 1.5;
    /// Fronts over backs, by area. A sealed part above this has mixed winding: it is free if it is as wide as a room (`mixed_width`).
    /// Larger: rooms of mixed winding are solid. Smaller: thick walls are cells.
    mixed: f64 = 0.67;
    /// Metres. Sealed parts of mixed winding that are this wide are rooms. Larger: such closets are solid. Smaller: thick walls are cells.
    mixed_width: f64 = 1.0;

    // Voids and the open sky.

    /// Share of a region's sides. A region is outside if it is open to the sky (`most`) and this share of its sides is open to the
    /// outside: a forecourt in a U of buildings has 0.25, the open doors of a hall without a roof 0.05. Larger: forecourts are rooms.
    /// Smaller: roofless halls are outside.
    open_sides: f64 = 0.15;
    /// Square metres. A crawl space has more than this open to a room at its side, without a ledge. Larger: crawl spaces are plenums.
    /// Smaller: a chink makes a cell of a plenum.
    crawl: f64 = 0.2;

    // Courtyards.

    /// Count. A courtyard has openings from at least this many cells; with fewer it is a niche. Larger: small courtyards stay part of the
    /// outside. Smaller: balconies and bays become useless cells.
    courtyard_rooms: usize = 4;
    /// Shares of the rooms with windows, as candidates for the top of courtyards; tried in this order. Under low roofs beside a tower,
    /// courtyards as high as the tower's rooms would be connected.
    courtyard_tops: [f64; 5] = [1.0, 0.95, 0.9, 0.75, 0.5];

    // Smoothing of boundaries.

    /// Share of its volume that a region keeps. Larger: the zigzag of small rooms stays. Smaller: a small room behind a wide opening
    /// vanishes.
    kept: f64 = 0.7;
    /// Factor. Cost of a square metre of boundary off walls, sheets and levels. Well above 1: boundaries keep the zigzag of the reveal's
    /// corners. At 1: they leave the walls to save a tiny area.
    off_wall: f64 = 1.25;

    // Rounding.

    /// Share of a number. Differences below this are rounding. Larger: real steps are lost. Smaller: equal choices oscillate.
    rounding: f64 = 1e-9;
}
