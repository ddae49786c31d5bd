//! Common types of the plan's steps: the input, the regions, and the labels.

use crate::cells::authored::Claims;
use crate::cells::complex::assemble::Complex;
use crate::cells::complex::faces::Face;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::options::PlanOptions;
use crate::cells::scale::HumanScale;
use std::collections::BTreeMap;

/// The input of all steps.
pub(in crate::cells) struct Input<'i> {
    /// Pieces, and the faces between them.
    pub complex: &'i Complex<'i>,
    /// The claims of the author's rooms.
    pub claims: &'i Claims,
    /// Whether levels always separate cells: they are the author's storeys.
    pub storeys_part: bool,
    /// The thresholds.
    pub options: &'i PlanOptions,
    /// The human scale.
    pub human: HumanScale,
    /// [`crate::math::tolerance::Tolerance::seal`].
    pub seal: f64,
}

/// Measures of each piece.
pub(in crate::cells) struct Pieces {
    /// Whether it touches the rim of the domain, so that it is outside.
    pub rim: Vec<bool>,
    /// Width of the space around its centre, metres.
    pub widths: Vec<f64>,
    /// Cubic metres.
    pub volumes: Vec<f64>,
}

/// The fixed label of a piece or a region, independent of bottlenecks.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(in crate::cells) enum Claim {
    /// The outside.
    Outside,
    /// A plenum over several rooms, identified by one of its pieces.
    Plenum(u32),
    /// An author's room, index into [`crate::scene::Hints::rooms`].
    Room(u32),
}

impl Claim {
    /// The author's room, if it is one.
    pub fn room(self) -> Option<u32> {
        match self {
            Claim::Room(room) => Some(room),
            Claim::Outside | Claim::Plenum(_) => None,
        }
    }
}

/// Regions, with measures at the index of their first piece.
pub(in crate::cells) struct Space {
    /// The pieces of each region.
    pub regions: DisjointSets,
    /// Width, metres.
    pub width: Vec<f64>,
    /// Height, metres.
    pub height: Vec<f64>,
    /// Cubic metres.
    pub volume: Vec<f64>,
    /// Its claim.
    pub claim: Vec<Option<Claim>>,
    /// Largest volume of each authored room with unclaimed pieces, cubic metres.
    pub most: BTreeMap<u32, f64>,
}

impl Space {
    /// Pieces with equal claims form one region; every other piece is a region. `heights` are those of the pieces' runs.
    pub fn new(pieces: &Pieces, heights: &[f64], claim: Vec<Option<Claim>>, most: BTreeMap<u32, f64>) -> Self {
        let n = claim.len();
        let mut regions = DisjointSets::new(n);
        let mut first_of: BTreeMap<Claim, u32> = BTreeMap::new();
        for (p, claim) in claim.iter().enumerate() {
            if let Some(claim) = *claim {
                let first = *first_of.entry(claim).or_insert(p as u32);
                regions.join(first, p as u32);
            }
        }
        let (width, height, volume) = (pieces.widths.clone(), heights.to_vec(), pieces.volumes.clone());
        let mut space = Self { regions, width, height, volume, claim, most };
        for p in 0..n as u32 {
            let r = space.regions.find(p) as usize;
            if r != p as usize {
                space.take(r, p as usize);
            }
        }
        // The outside is unbounded.
        for r in (0..n as u32).filter(|&r| space.is_outside(r)).collect::<Vec<_>>() {
            (space.width[r as usize], space.height[r as usize]) = (f64::INFINITY, f64::INFINITY);
        }
        space
    }

    /// True if the region is claimed.
    pub fn is_claimed(&self, region: u32) -> bool {
        self.claim[region as usize].is_some()
    }

    /// True if the region is the outside.
    pub fn is_outside(&self, region: u32) -> bool {
        self.claim[region as usize] == Some(Claim::Outside)
    }

    /// Whether two regions must not merge: both are claimed, or an author's room would exceed its largest volume.
    pub fn must_part(&self, a: u32, b: u32) -> bool {
        self.is_claimed(a) && self.is_claimed(b) || self.is_outgrown(a, b)
    }

    /// True if an author's room would exceed its largest volume.
    fn is_outgrown(&self, a: u32, b: u32) -> bool {
        let (a, b) = (a as usize, b as usize);
        let claim = self.claim[a].xor(self.claim[b]);
        let most = claim.and_then(Claim::room).and_then(|room| self.most.get(&room));
        most.is_some_and(|most| self.volume[a] + self.volume[b] > *most)
    }

    /// The width of the narrower of two regions, metres.
    pub fn narrower(&self, a: u32, b: u32) -> f64 {
        self.width[a as usize].min(self.width[b as usize])
    }

    /// The height of the lower of two regions, metres.
    pub fn lower(&self, a: u32, b: u32) -> f64 {
        self.height[a as usize].min(self.height[b as usize])
    }

    /// The regions on both sides of a face.
    pub fn sides(&mut self, face: &Face) -> (u32, u32) {
        (self.regions.find(face.a), self.regions.find(face.b))
    }

    /// Adds the measures of `other` to region `r`.
    fn take(&mut self, r: usize, other: usize) {
        self.width[r] = self.width[r].max(self.width[other]);
        self.height[r] = self.height[r].max(self.height[other]);
        self.volume[r] += self.volume[other];
        self.claim[r] = self.claim[r].or(self.claim[other]);
    }

    /// Merges two regions.
    pub fn unite(&mut self, a: u32, b: u32) {
        let r = self.regions.join(a, b) as usize;
        self.take(r, a as usize + b as usize - r);
    }
}

/// True if a face is open between two pieces of free space.
pub(in crate::cells) fn is_passage(face: &Face, free: &[bool]) -> bool {
    face.open_area > 0.0 && free[face.a as usize] && free[face.b as usize]
}

/// The kind of a region.
#[derive(Clone, PartialEq, Debug)]
pub(in crate::cells) struct Region {
    /// Index into [`crate::scene::Hints::rooms`].
    pub room: Option<u32>,
    /// The outside.
    pub outside: bool,
    /// A courtyard: a part of the outside between wings.
    pub courtyard: bool,
}

/// A region for every piece of free space.
#[derive(Debug)]
pub(in crate::cells) struct Labels {
    /// Region of each piece; `None` in solid matter.
    pub of_piece: Vec<Option<u32>>,
    /// The regions, in the order of their first piece.
    pub regions: Vec<Region>,
    /// The least volume, cubic metres, if there were too many regions: smaller ones were joined.
    pub least_volume: Option<f64>,
    /// Whether there were too many faces to join regions in pairs.
    pub were_many: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of 2 m by 3 m and 10 cubic metres with these claims; room 0 has a limit of 25.
    fn space(claims: &[Option<Claim>]) -> Space {
        let n = claims.len();
        let pieces = Pieces { rim: vec![false; n], widths: vec![2.0; n], volumes: vec![10.0; n] };
        Space::new(&pieces, &vec![3.0; n], claims.to_vec(), BTreeMap::from([(0, 25.0)]))
    }

    #[test]
    fn pieces_of_one_claim_are_one_region() {
        let mut space = space(&[None, Some(Claim::Room(0)), Some(Claim::Plenum(2)), Some(Claim::Room(0))]);
        let roots: Vec<u32> = (0..4).map(|p| space.regions.find(p)).collect();
        assert_eq!(roots, [0, 1, 2, 1]);
        assert_eq!(space.volume[1], 20.0);
    }

    #[test]
    fn claims_never_join_each_other_and_rooms_grow_no_more_than_they_may() {
        let mut space = space(&[Some(Claim::Room(0)), None, None, Some(Claim::Room(1)), Some(Claim::Outside)]);
        assert!(space.must_part(0, 3) && space.must_part(3, 4));
        assert!(!space.must_part(0, 1) && !space.must_part(1, 2) && !space.must_part(2, 4));
        space.unite(0, 1);
        assert_eq!((space.claim[0], space.volume[0]), (Some(Claim::Room(0)), 20.0));
        // 30 cubic metres are more than 25; room 1 and the outside have no limit.
        assert!(space.must_part(0, 2) && !space.must_part(2, 3));
    }

    #[test]
    fn the_outside_has_no_end() {
        let space = space(&[None, Some(Claim::Outside)]);
        assert_eq!((space.width[0], space.height[0]), (2.0, 3.0));
        assert_eq!((space.width[1], space.height[1]), (f64::INFINITY, f64::INFINITY));
        assert!(space.is_outside(1) && !space.is_outside(0));
    }
}
