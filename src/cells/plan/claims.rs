//! Claims on pieces before the watershed: the outside at the rim, the author's rooms with the space above them, and plenums.

use crate::cells::complex::bands::Cut;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::space::{Claim, Input, Pieces};
use std::collections::{BTreeMap, BTreeSet};

/// The claim on each piece, and the largest volume of each authored room, cubic metres.
pub(in crate::cells) fn claims(
    input: &Input<'_>,
    pieces: &Pieces,
    free: &[bool],
) -> (Vec<Option<Claim>>, BTreeMap<u32, f64>) {
    let (given, options) = (input.claims, input.options);
    let claim_of = |p: usize| {
        let doorway = || given.doorways[p].filter(|_| free[p]);
        if pieces.rim[p] { Some(Claim::Outside) } else { given.rooms[p].or_else(doorway).map(Claim::Room) }
    };
    let mut claims: Vec<Option<Claim>> = (0..free.len()).map(claim_of).collect();
    // The drawn volume, and some more.
    let mut drawn: BTreeMap<u32, f64> = BTreeMap::new();
    for (room, volume) in given.rooms.iter().zip(&pieces.volumes) {
        if let Some(room) = *room {
            *drawn.entry(room).or_default() += volume;
        }
    }
    let growth = |drawn: f64| options.growth * drawn + input.human.cubic_metres(options.least_growth);
    let most = drawn.iter().map(|(&room, &drawn)| (room, drawn + growth(drawn))).collect();
    let more = drawn.into_iter().map(|(room, drawn)| (room, growth(drawn))).collect();
    fill_up(input, pieces, free, more, &mut claims);
    (claims, most)
}

/// The space above (or below) an author's room, up to the next slab or level, belongs to the room if no other room reaches it. If several
/// do, as over walls that end below the slab, it is a plenum: a region of its own, which does not merge with rooms.
///
/// A room gets no part larger than the rest of its `more`, cubic metres, because authors may draw only the lower storey of a hall.
fn fill_up(input: &Input<'_>, pieces: &Pieces, free: &[bool], mut more: BTreeMap<u32, f64>, claims: &mut [Option<Claim>]) {
    let (faces, options) = (input.complex.faces, input.options);
    let reached = reach(input, claims);
    // 1. Connected components of this space, also over the tops of walls.
    let least_width = input.human.metres(options.least_width);
    let narrow = |p: usize| free[p] && pieces.widths[p] < least_width;
    let over: Vec<bool> = (0..claims.len()).map(|p| claims[p].is_none() && (reached[p].is_some() || narrow(p))).collect();
    let mut parts = DisjointSets::new(claims.len());
    let on_level = |f: &Face| matches!(f.surface, Surface::Cut(Cut::Level(_)));
    for f in faces.iter().filter(|f| f.open_area > options.most * f.area && !on_level(f)) {
        if over[f.a as usize] && over[f.b as usize] {
            parts.join(f.a, f.b);
        }
    }
    // 2. The claim on each component.
    let mut rooms: BTreeMap<u32, (BTreeSet<u32>, f64)> = BTreeMap::new();
    for p in (0..claims.len()).filter(|&p| over[p]) {
        let part = rooms.entry(parts.find(p as u32)).or_default();
        part.0.extend(reached[p].and_then(Claim::room));
        part.1 += if free[p] { pieces.volumes[p] } else { 0.0 };
    }
    let whose: BTreeMap<u32, Option<Claim>> = (rooms.into_iter())
        .map(|(part, (rooms, volume))| match (rooms.len(), rooms.first()) {
            (1, Some(&room)) => {
                let left = more.entry(room).or_default();
                let fits = volume <= *left;
                *left -= if fits { volume } else { 0.0 };
                (part, fits.then_some(Claim::Room(room)))
            }
            (0, _) => (part, None),
            _ => (part, Some(Claim::Plenum(part))),
        })
        .collect();
    for p in (0..claims.len()).filter(|&p| over[p]) {
        let whole = whose[&parts.find(p as u32)];
        // Narrow pieces that no room reaches stay unclaimed.
        claims[p] = if matches!(whole, Some(Claim::Room(_))) { reached[p] } else { whole };
    }
}

/// The claims, extended through open sheets: each unclaimed piece gets the first room that reaches it.
fn reach(input: &Input<'_>, claims: &[Option<Claim>]) -> Vec<Option<Claim>> {
    let open = |f: &Face| f.open_area > input.options.nearly_all * f.area;
    let through = |f: &&Face| matches!(f.surface, Surface::Cut(Cut::Sheet(_))) && open(f);
    let mut reached = claims.to_vec();
    loop {
        let mut grown = false;
        for f in input.complex.faces.iter().filter(through) {
            for (from, to) in [(f.a, f.b), (f.b, f.a)] {
                let claim = reached[from as usize];
                if matches!(claim, Some(Claim::Room(_))) && reached[to as usize].is_none() {
                    reached[to as usize] = claim;
                    grown = true;
                }
            }
        }
        if !grown {
            return reached;
        }
    }
}
