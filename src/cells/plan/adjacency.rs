//! Adjacency of whole regions. Two regions are one space if much of their boundary is open between them, or if openings together are nearly
//! as wide as the narrower region, even if no single bottleneck joins them.

use crate::cells::complex::assemble::Complex;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::bottlenecks::{Bottleneck, ends, least_width};
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::{Input, Space, is_passage};
use glam::DVec2;
use std::collections::{BTreeMap, HashMap};

/// True if a vertical face is higher at one end than at the other.
fn is_under_slope(f: &Face, options: &PlanOptions) -> bool {
    let at = |end: f64| {
        let near = options.rounding * end.abs().max(1.0);
        let heights = f.polygon.iter().filter(move |p| (p.x - end).abs() <= near).map(|p| p.y);
        heights.fold(f64::NEG_INFINITY, f64::max)
    };
    let low = f.polygon.iter().fold(f64::INFINITY, |low, p| low.min(p.x));
    let high = f.polygon.iter().fold(f64::NEG_INFINITY, |high, p| high.max(p.x));
    (at(high) - at(low)).abs() > options.slope * (high - low)
}

/// The inputs of the adjacency step.
pub(in crate::cells) struct Adjacency<'a> {
    /// The input of all steps.
    pub input: &'a Input<'a>,
    /// The bottleneck of each face.
    pub bottlenecks: &'a [Bottleneck],
    /// Whether each piece is free space.
    pub free: &'a [bool],
}

/// The contact of two regions.
#[derive(Default)]
struct Contact {
    /// Open area without door leaves and panes, square metres.
    open: f64,
    /// Open faces as high as the lower region.
    high: Vec<usize>,
    /// Open area of vertical frameless faces under a sloping ceiling, square metres: none of these is as high as the regions.
    sloping: f64,
    /// Open area of levels between them, with the lower number below, and above; square metres.
    level: [f64; 2],
}

/// The boundaries of all regions, by number; square metres.
struct Boundaries {
    /// Contacts between two regions, the lower number first.
    contacts: BTreeMap<(u32, u32), Contact>,
    /// Area of the boundary.
    whole: Vec<f64>,
    /// Area of its open part.
    open: Vec<f64>,
    /// Areas of floor and ceiling.
    ends: Vec<[f64; 2]>,
}

/// Unites the pairs in order, and returns whether any were united. A changed region waits for the next round, with one exception, unless
/// `in_pairs`: the region with more boundary (`whole`) may absorb any number of others, because its contacts only grow.
fn unite(space: &mut Space, wishes: &[(f64, (u32, u32))], whole: &[f64], in_pairs: bool) -> bool {
    let (mut grown, mut gone) = (vec![false; whole.len()], vec![false; whole.len()]);
    let mut is_any = false;
    for &(_, (a, b)) in wishes {
        let (less, more) =
            if whole[b as usize] < whole[a as usize] { (b as usize, a as usize) } else { (a as usize, b as usize) };
        if grown[less] || gone[less] || gone[more] || in_pairs && grown[more] {
            continue;
        }
        let into = space.regions.find(more as u32);
        if !space.must_part(less as u32, into) {
            space.unite(less as u32, into);
            (gone[less], grown[more], is_any) = (true, true, true);
        }
    }
    is_any
}

impl Adjacency<'_> {
    /// Joins regions, the most open pairs first, until no pair is open enough. In each round a region joins one other, so that the next
    /// round sees updated contacts; with many faces (`faces_in_pairs`) it absorbs any number with less boundary, and the result is true.
    pub(in crate::cells) fn join(&self, space: &mut Space) -> bool {
        let (mut looked_at, mut were_many) = (0, false);
        loop {
            let in_pairs = looked_at < self.input.options.faces_in_pairs;
            looked_at = looked_at.saturating_add(self.bottlenecks.len());
            let boundaries = self.boundaries(space);
            let mut wishes = self.wishes(space, &boundaries);
            wishes.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            if !unite(space, &wishes, &boundaries.whole, in_pairs) {
                return were_many;
            }
            were_many |= !in_pairs;
        }
    }

    /// The contacts of regions. Torn columns do not count, because their open faces may not be open.
    fn boundaries(&self, space: &mut Space) -> Boundaries {
        let (Complex { columns, faces, .. }, n) = (self.input.complex, self.free.len());
        let torn = |piece: u32| columns.torn[columns.of_piece(piece).0];
        let (contacts, whole, open, ends) = (BTreeMap::new(), vec![0.0; n], vec![0.0; n], vec![[0.0; 2]; n]);
        let mut all = Boundaries { contacts, whole, open, ends };
        for (i, (f, bottleneck)) in faces.iter().zip(self.bottlenecks).enumerate() {
            let (a, b) = space.sides(f);
            if a == b || torn(f.a) || torn(f.b) {
                continue;
            }
            all.whole[a as usize] += f.area;
            all.whole[b as usize] += f.area;
            if matches!(f.surface, Surface::Cut(_)) {
                all.ends[a as usize][1] += f.area;
                all.ends[b as usize][0] += f.area;
            }
            if !is_passage(f, self.free) || bottleneck.leaf || space.must_part(a, b) {
                continue;
            }
            let contact = all.contacts.entry((a.min(b), a.max(b))).or_default();
            let level = matches!(f.surface, Surface::Cut(Cut::Level(_)));
            if level {
                contact.level[usize::from(a > b)] += f.open_area;
            }
            if self.input.storeys_part && level && !self.is_eaves(space, a, b) {
                continue;
            }
            contact.open += f.open_area;
            all.open[a as usize] += f.open_area;
            all.open[b as usize] += f.open_area;
            self.add_upright(contact, i, space.lower(a, b));
        }
        all
    }

    /// Adds face `i` to a contact if it is frameless; `lower` is the height of the lower region, metres.
    fn add_upright(&self, contact: &mut Contact, i: usize, lower: f64) {
        let (f, bottleneck, options) = (&self.input.complex.faces[i], &self.bottlenecks[i], self.input.options);
        if bottleneck.height.is_finite() && !bottleneck.framed && !bottleneck.ledge {
            if is_under_slope(f, options) {
                contact.sloping += f.open_area;
            }
            if bottleneck.height >= options.high_opening * lower {
                contact.high.push(i);
            }
        }
    }

    /// True if the lower of two regions is outside and the upper is too low to stand in: eaves have no floor, so they are no storey.
    fn is_eaves(&self, space: &Space, below: u32, above: u32) -> bool {
        let standing = self.input.human.metres(self.input.options.standing);
        space.is_outside(below) && space.height[above as usize] < standing
    }

    /// The pairs of regions that are one space, each with its openness.
    fn wishes(&self, space: &Space, boundaries: &Boundaries) -> Vec<(f64, (u32, u32))> {
        let Boundaries { contacts, whole, .. } = boundaries;
        let mut most_open: BTreeMap<u32, f64> = BTreeMap::new();
        for (&(a, b), contact) in contacts {
            for r in [a, b] {
                let best = most_open.entry(r).or_default();
                *best = best.max(contact.open);
            }
        }
        let mut wishes: Vec<(f64, (u32, u32))> = Vec::new();
        for (&(a, b), contact) in contacts {
            let share = contact.open / whole[a as usize].min(whole[b as usize]);
            let stall = |r: u32| contact.open >= most_open[&r] && contact.open > 0.0 && self.is_stall(space, boundaries, r);
            let joins = share >= self.least_share(space, a, b)
                || self.is_one_attic(space, contact, a, b)
                || stall(a)
                || stall(b)
                || self.is_shaft(boundaries, a, b, contact.level[0])
                || self.is_shaft(boundaries, b, a, contact.level[1])
                || self.is_wide(space, contact, a, b);
            if joins {
                wishes.push((share, (a, b)));
            }
        }
        wishes
    }

    /// The least open share of the smaller boundary that joins two regions.
    fn least_share(&self, space: &Space, a: u32, b: u32) -> f64 {
        let (human, options) = (self.input.human, self.input.options);
        let hall = space.volume[a as usize].min(space.volume[b as usize]) >= human.cubic_metres(options.hall_volume);
        if hall { options.open_share_of_halls } else { options.open_share }
    }

    /// True if two indoor regions share a large open area under a slope, compared with the smaller cross-section.
    fn is_one_attic(&self, space: &Space, contact: &Contact, a: u32, b: u32) -> bool {
        let section = space.narrower(a, b) * space.lower(a, b);
        let indoors = !space.is_outside(a) && !space.is_outside(b);
        section.is_finite() && indoors && contact.sloping >= self.input.options.open_section * section
    }

    /// True for a small, open, unclaimed region.
    fn is_stall(&self, space: &Space, boundaries: &Boundaries, r: u32) -> bool {
        let (human, options) = (self.input.human, self.input.options);
        let small = space.volume[r as usize] < human.cubic_metres(options.stall_volume) && !space.is_claimed(r);
        small && boundaries.open[r as usize] >= options.open_share_of_stalls * boundaries.whole[r as usize]
    }

    /// True if both are one shaft: much of the ceiling below and of the floor above is open.
    fn is_shaft(&self, boundaries: &Boundaries, below: u32, above: u32, open: f64) -> bool {
        let options = self.input.options;
        let least = boundaries.ends[below as usize][1].max(boundaries.ends[above as usize][0]);
        let share = if self.input.storeys_part { options.nearly_all } else { options.open_share_of_galleries };
        open > 0.0 && open >= share * least
    }

    /// True if adjacent openings together are as wide as the regions. The threshold is that of one bottleneck, because a row of narrow
    /// openings may sum up to a wide one.
    fn is_wide(&self, space: &Space, contact: &Contact, a: u32, b: u32) -> bool {
        let width = self.width(&contact.high);
        width >= least_width(width, space.narrower(a, b), self.input)
    }

    /// The extent in plan of the longest run of faces that meet at their ends, metres.
    fn width(&self, faces: &[usize]) -> f64 {
        let Complex { plan, facets, faces: all, .. } = self.input.complex;
        let (square, directions) = (self.input.options.meeting * self.input.seal, self.input.options.directions);
        let ends: Vec<(DVec2, DVec2)> = faces.iter().filter_map(|&i| ends(&all[i], plan, facets)).collect();
        let key = |p: DVec2| ((p.x / square).round() as i64, (p.y / square).round() as i64);
        let mut at: HashMap<(i64, i64), u32> = HashMap::new();
        let mut runs = DisjointSets::new(ends.len());
        for (i, &(a, b)) in ends.iter().enumerate() {
            for end in [a, b] {
                let first = *at.entry(key(end)).or_insert(i as u32);
                runs.join(first, i as u32);
            }
        }
        let mut reach: BTreeMap<u32, Vec<DVec2>> = BTreeMap::new();
        for (i, &(a, b)) in ends.iter().enumerate() {
            reach.entry(runs.find(i as u32)).or_default().extend([a, b]);
        }
        let longest = |points: &Vec<DVec2>| {
            let directions = (0..directions).map(|k| DVec2::from_angle(k as f64 * std::f64::consts::PI / directions as f64));
            directions
                .map(|d| {
                    let along = points.iter().map(|p| d.dot(*p));
                    along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
                })
                .fold(0.0, f64::max)
        };
        reach.values().map(longest).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::plan::space::{Claim, Pieces};

    /// The regions after one round: for each of `n` pieces of 10 cubic metres, the first piece of its region. Piece 0 is the author's room,
    /// with a limit of 35.
    fn round(wishes: &[(u32, u32)], whole: &[f64], in_pairs: bool) -> Vec<u32> {
        let n = whole.len();
        let pieces = Pieces { rim: vec![false; n], widths: vec![2.0; n], volumes: vec![10.0; n] };
        let mut claims = vec![None; n];
        claims[0] = Some(Claim::Room(0));
        let mut space = Space::new(&pieces, &vec![3.0; n], claims, BTreeMap::from([(0, 35.0)]));
        let wishes: Vec<(f64, (u32, u32))> = wishes.iter().map(|&pair| (0.5, pair)).collect();
        assert_eq!(unite(&mut space, &wishes, whole, in_pairs), !wishes.is_empty());
        let roots: Vec<u32> = (0..n as u32).map(|p| space.regions.find(p)).collect();
        roots.iter().map(|root| roots.iter().position(|r| r == root).unwrap_or(n) as u32).collect()
    }

    #[test]
    fn a_hall_takes_in_one_niche_a_round_or_all() {
        let (wishes, whole) = ([(1, 2), (1, 3), (1, 4)], [50.0, 100.0, 4.0, 3.0, 5.0]);
        assert_eq!(round(&wishes, &whole, true), [0, 1, 1, 3, 4]);
        assert_eq!(round(&wishes, &whole, false), [0, 1, 1, 1, 1]);
        assert_eq!(round(&[], &whole, false), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn what_has_changed_is_taken_in_by_nobody() {
        // 3 has absorbed 4, so its boundary has changed since it wished for 2; 4 is gone.
        let (wishes, whole) = ([(3, 4), (2, 3), (1, 4)], [50.0, 60.0, 100.0, 5.0, 4.0]);
        assert_eq!(round(&wishes, &whole, false), [0, 1, 2, 3, 3]);
    }

    #[test]
    fn a_room_takes_in_no_more_than_it_may() {
        let (wishes, whole) = ([(0, 1), (0, 2), (0, 3)], [50.0, 3.0, 3.0, 3.0]);
        assert_eq!(round(&wishes, &whole, false), [0, 0, 0, 3]);
    }
}
