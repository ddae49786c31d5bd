//! Whose pieces are before the watershed: the outside at the rim, the author's rooms with what lies over them, and plenums.

use crate::cells::complex::bands::Cut;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::space::{Claim, Input, Pieces};
use std::collections::{BTreeMap, BTreeSet};

/// Whose each piece is, and how much each of the author's rooms may measure, cubic metres.
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
    // What the author drew, and some more.
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

/// What lies over (or under) an author's room up to the next slab or level is the room's where no other room reaches it. Where
/// several do, as over walls that end below the slab, it is a plenum: one more region, that rooms don't merge with.
///
/// A room gets no part that is larger than what is left of its `more`, cubic metres: of a hall he drew the lower storey.
fn fill_up(input: &Input<'_>, pieces: &Pieces, free: &[bool], mut more: BTreeMap<u32, f64>, claims: &mut [Option<Claim>]) {
    let (faces, options) = (input.complex.faces, input.options);
    let reached = reach(input, claims);
    // 1. What of it hangs together, over the tops of walls too.
    let least_width = input.human.metres(options.least_width);
    let narrow = |p: usize| free[p] && pieces.widths[p] < least_width;
    let over: Vec<bool> = (0..claims.len()).map(|p| claims[p].is_none() && (reached[p].is_some() || narrow(p))).collect();
    let mut parts = DisjointSets::new(claims.len());
    let on_level = |f: &Face| matches!(f.surface, Surface::Cut(Cut::Level(_)));
    for f in faces.iter().filter(|f| f.open_area > options.open_face * f.area && !on_level(f)) {
        if over[f.a as usize] && over[f.b as usize] {
            parts.join(f.a, f.b);
        }
    }
    // 2. Whose it is.
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
        // What is narrow and no room reaches stays nobody's.
        claims[p] = if matches!(whole, Some(Claim::Room(_))) { reached[p] } else { whole };
    }
}

/// What rooms reach through open sheets: the claims, and the first room that comes to each piece that has none.
fn reach(input: &Input<'_>, claims: &[Option<Claim>]) -> Vec<Option<Claim>> {
    let open = |f: &Face| f.open_area > input.options.open_ceiling * f.area;
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
