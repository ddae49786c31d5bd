//! Rooms: the watershed of clearance, from pieces to labels.
//!
//! Bottlenecks are processed from the widest down. Two regions merge if the bottleneck is nearly as wide as the narrower of them; regions
//! that remain are separated by doors, windows and passages. An author's rooms are claims that never merge with each other; everything else
//! follows the same rule.

use crate::cells::complex::assemble::{Complex, has_portal};
use crate::cells::plan::adjacency::Adjacency;
use crate::cells::plan::bottlenecks::{Bottleneck, Runs, bottlenecks, least_width};
use crate::cells::plan::boundaries::smooth;
use crate::cells::plan::claims::claims;
use crate::cells::plan::clearance::{Clearance, widths};
use crate::cells::plan::free_space::free_space;
use crate::cells::plan::space::{Claim, Input, Labels, Pieces, Region, Space, is_passage};
use crate::cells::plan::voids::Voids;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Labels every piece.
pub(in crate::cells) fn label(input: &Input<'_>) -> Labels {
    // 1. Measures of pieces, free space, and claims.
    let clearance = Clearance::new(input);
    let pieces = measure(input, &clearance);
    let free = free_space(input, &pieces);
    let (claims, most) = claims(input, &pieces, &free);
    let fixed: Vec<bool> = claims.iter().map(Option::is_some).collect();
    let runs = Runs::new(input);
    let mut space = Space::new(&pieces, &runs.heights, claims, most);
    // 2. Bottlenecks, widest first.
    let bottlenecks = bottlenecks(input, &clearance, &runs);
    flood(input, &free, &bottlenecks, &mut space);
    // 3. Regions with a large open boundary between them, or openings nearly as wide as they are.
    let were_many = Adjacency { input, bottlenecks: &bottlenecks, free: &free }.join(&mut space);
    // 4. Forecourts join the outside; regions too small for a room join a neighbour; voids too low to stand in are no rooms.
    let voids = Voids { input, runs: &runs, free: &free };
    voids.give_to_outside(&mut space);
    let least_volume = absorb(input, &free, &mut space);
    voids.gather(&mut space);
    // 5. Numbers, and smooth boundaries.
    let mut labels = number(input, &free, &mut space);
    smooth(input.complex.faces, &pieces.volumes, &fixed, input.options, &mut labels);
    (labels.least_volume, labels.were_many) = (least_volume, were_many);
    labels
}

/// Measures of each piece. Pieces that touch the rim of the domain are outside.
fn measure(input: &Input<'_>, clearance: &Clearance) -> Pieces {
    let Complex { plan, columns, .. } = input.complex;
    let volume = |piece: u32| {
        let (floor, ceiling) = columns.heights(piece);
        let (column, _) = columns.of_piece(piece);
        plan.area(column) * (0..3).map(|i| ceiling[i] - floor[i]).sum::<f64>() / 3.0
    };
    let volumes = (0..columns.pieces() as u32).map(volume).collect();
    Pieces { rim: input.complex.at_rim(), widths: widths(input, clearance), volumes }
}

/// The watershed: bottlenecks, from the widest down, join regions if they are nearly as wide and as high as those.
fn flood(input: &Input<'_>, free: &[bool], bottlenecks: &[Bottleneck], space: &mut Space) {
    let (faces, options) = (input.complex.faces, input.options);
    let usable = |i: &usize| is_passage(&faces[*i], free) && bottlenecks[*i].width > 0.0;
    let mut order: Vec<usize> = (0..faces.len()).filter(usable).collect();
    order.sort_by(|&i, &j| bottlenecks[j].width.total_cmp(&bottlenecks[i].width).then(i.cmp(&j)));
    for i in order {
        let (a, b) = space.sides(&faces[i]);
        let Bottleneck { width, height, framed, leaf, ledge } = bottlenecks[i];
        if a == b || leaf || ledge || space.must_part(a, b) {
            continue;
        }
        let narrower = space.narrower(a, b);
        let least = if framed { options.wide_framed_opening * narrower } else { least_width(width, narrower, input) };
        if width >= least && height >= options.high_opening * space.lower(a, b) {
            space.unite(a, b);
        }
    }
}

/// Joins regions too small for a room to the neighbour with the largest opening. With too many cells, larger ones are joined, too, and the
/// result is the least volume in cubic metres.
fn absorb(input: &Input<'_>, free: &[bool], space: &mut Space) -> Option<f64> {
    let options = input.options;
    let whole: f64 = space.volume.iter().sum();
    let authored = input.claims.rooms.iter().any(Option::is_some);
    let least_volume = if authored { options.least_unnamed_volume } else { options.least_volume };
    let of_rooms = input.human.cubic_metres(least_volume);
    let mut least_volume = of_rooms;
    loop {
        let open = open_between(input, free, space);
        if join_small(input, least_volume, &open, space) {
            continue;
        }
        if open.is_empty() || least_volume > whole || is_few(input, free, space) {
            return (least_volume > of_rooms).then_some(least_volume);
        }
        least_volume *= options.coarser;
    }
}

/// Open area between each pair of regions, square metres.
fn open_between(input: &Input<'_>, free: &[bool], space: &mut Space) -> BTreeMap<(u32, u32), f64> {
    let mut open: BTreeMap<(u32, u32), f64> = BTreeMap::new();
    for f in input.complex.faces.iter().filter(|f| is_passage(f, free)) {
        let (a, b) = space.sides(f);
        if a != b {
            *open.entry((a, b)).or_default() += f.open_area;
            *open.entry((b, a)).or_default() += f.open_area;
        }
    }
    open
}

/// Joins regions that are below this volume or too narrow to the neighbour with the largest opening, the smallest first; false if there are
/// none.
fn join_small(input: &Input<'_>, least_volume: f64, open: &BTreeMap<(u32, u32), f64>, space: &mut Space) -> bool {
    let small = |r: u32| !space.is_claimed(r) && space.volume[r as usize] < least_volume || is_narrow(input, space, r);
    let mut wish: BTreeMap<u32, (u32, f64)> = BTreeMap::new();
    for (&(a, b), &open) in open {
        if small(a) && wish.get(&a).is_none_or(|w| open > w.1) {
            wish.insert(a, (b, open));
        }
    }
    let mut wishes: Vec<(u32, u32)> = wish.into_iter().map(|(a, (b, _))| (a, b)).collect();
    wishes.sort_by(|x, y| space.volume[x.0 as usize].total_cmp(&space.volume[y.0 as usize]).then(x.0.cmp(&y.0)));
    let mut joined = false;
    for (a, b) in wishes {
        // A region that grew in this round waits for the next.
        if space.regions.find(a) == a && space.regions.find(b) == b {
            space.unite(a, b);
            joined = true;
        }
    }
    joined
}

/// True for an unclaimed region too narrow for a person.
fn is_narrow(input: &Input<'_>, space: &Space, r: u32) -> bool {
    !space.is_claimed(r) && space.width[r as usize] < input.human.metres(input.options.least_width)
}

/// True if the numbers of cells and of planes with portals are within their limits.
fn is_few(input: &Input<'_>, free: &[bool], space: &mut Space) -> bool {
    let (Complex { plan, facets, faces, .. }, options) = (input.complex, input.options);
    let cells = (0..free.len() as u32).filter(|&p| free[p as usize] && space.regions.find(p) == p).count();
    let mut planes: BTreeSet<(u32, u32, [u32; 3])> = BTreeSet::new();
    for f in faces.iter().filter(|f| is_passage(f, free)) {
        let (a, b) = space.sides(f);
        if a != b {
            planes.insert((a.min(b), a.max(b), f.surface.key()));
        }
    }
    let bands = plan.bands.len();
    let most_portals = (options.most_portals * bands).max(options.most_portals_a_cell * cells);
    let triangles = facets.wall_facets.len() + facets.sheet_facets.len();
    let most_cells = (options.most_cells * bands).max(triangles / options.triangles_a_cell);
    cells <= most_cells && planes.len() <= most_portals
}

/// Numbers regions in the order of their first piece; an unconnected chink, as between a slab and a wall that ends in it, has none.
fn number(input: &Input<'_>, free: &[bool], space: &mut Space) -> Labels {
    let mut reached = vec![false; free.len()];
    for f in input.complex.faces.iter().filter(|f| is_passage(f, free)) {
        let (a, b) = space.sides(f);
        if a != b && (is_narrow(input, space, a) || is_narrow(input, space, b)) && has_portal(f, input.seal) {
            (reached[a as usize], reached[b as usize]) = (true, true);
        }
    }
    let mut number: HashMap<u32, u32> = HashMap::new();
    let mut labels = Labels { of_piece: vec![None; free.len()], regions: Vec::new(), least_volume: None, were_many: false };
    for p in 0..free.len() as u32 {
        let r = space.regions.find(p);
        if free[p as usize] && (reached[r as usize] || !is_narrow(input, space, r)) {
            let next = labels.regions.len() as u32;
            let id = *number.entry(r).or_insert(next);
            if id == next {
                let room = space.claim[r as usize].and_then(Claim::room);
                labels.regions.push(Region { room, outside: space.is_outside(r), courtyard: false });
            }
            labels.of_piece[p as usize] = Some(id);
        }
    }
    labels
}
