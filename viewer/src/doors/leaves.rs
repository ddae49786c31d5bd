//! Which pieces of a door are its leaves, which its frame.

use super::hinge::{Motion, Slab, of_hatch, of_made};
use super::opening::Opening;
use super::pieces::{Facet, Piece, facing, range};
use glam::DVec3;

/// A leaf is wider and higher than these shares of its opening. Smaller: jambs and lintels swing. Larger: one of four leaves doesn't.
const WIDE: f64 = 0.2;
/// See [`WIDE`].
const HIGH: f64 = 0.5;
/// A leaf's triangles cover more than this share of the rectangle around them; a frame covers 0.1 to 0.2, the rim of a glazed leaf 0.4.
const FILLED: f64 = 0.25;
/// A part that reaches beyond a leaf on both sides by this, metres, is its frame.
const BEYOND: f64 = 0.005;
/// A handle's middle is within this of its leaf's faces, metres.
const HANDLE_AWAY: f64 = 0.15;
/// Parts of a leaf, such as its rim and its pane, share more than this part of the narrower one's width.
const SHARED: f64 = 0.5;
/// Parts of a leaf face one way, by the cosine between them, and are this near to each other, metres.
const ONE_WAY: f64 = 0.95;
/// See [`ONE_WAY`].
const TOGETHER: f64 = 0.2;
/// Wider openings get two leaves, and still wider ones a leaf that slides up, metres.
const TWO_LEAVES: f64 = 1.4;
/// See [`TWO_LEAVES`].
const GATE: f64 = 3.2;

/// A leaf.
#[derive(Clone, Debug)]
pub struct Leaf {
    /// Its triangles.
    pub facets: Vec<Facet>,
    /// How it moves.
    pub motion: Motion,
}

/// A leaf, or a part of a leaf.
struct Part<'p> {
    pieces: Vec<&'p Piece>,
    facing: DVec3,
    /// Along it, across it and up.
    reach: [[f64; 2]; 3],
}

impl<'p> Part<'p> {
    fn new(pieces: Vec<&'p Piece>, facing: DVec3) -> Self {
        let reach =
            [DVec3::Y.cross(facing), facing, DVec3::Y].map(|axis| range(pieces.iter().flat_map(|p| &p.facets), axis));
        Self { pieces, facing, reach }
    }

    fn of(piece: &'p Piece) -> Option<Self> {
        Some(Self::new(vec![piece], facing(&piece.facets)?))
    }

    fn size(&self, axis: usize) -> f64 {
        self.reach[axis][1] - self.reach[axis][0]
    }

    fn is_leaf(&self, opening: &Opening) -> bool {
        let facets = self.pieces.iter().flat_map(|p| &p.facets);
        let area = |f: &Facet| 0.5 * (f.corners[1] - f.corners[0]).cross(f.corners[2] - f.corners[0]).dot(self.facing).abs();
        // Both sides are seen.
        let covered = 0.5 * facets.map(area).sum::<f64>();
        self.size(0) > WIDE * 2.0 * opening.half.x
            && self.size(2) > HIGH * 2.0 * opening.half.y
            && covered > FILLED * self.size(0) * self.size(2)
    }

    /// Whether two are one leaf.
    fn is_one_with(&self, other: &Self) -> bool {
        if self.facing.dot(other.facing).abs() < ONE_WAY {
            return false;
        }
        let other = Self::new(other.pieces.clone(), self.facing);
        let shared =
            |axis: usize| self.reach[axis][1].min(other.reach[axis][1]) - self.reach[axis][0].max(other.reach[axis][0]);
        shared(0) > SHARED * self.size(0).min(other.size(0)) && shared(1) > -TOGETHER
    }

    /// Whether a piece goes where this goes: a handle, a pane, a panel.
    fn carries(&self, piece: &Piece) -> bool {
        let part = Part::new(vec![piece], self.facing);
        let middle = |axis: usize| 0.5 * (part.reach[axis][0] + part.reach[axis][1]);
        let is_in = |axis: usize, slack: f64| {
            middle(axis) > self.reach[axis][0] - slack && middle(axis) < self.reach[axis][1] + slack
        };
        let is_frame = part.reach[0][0] < self.reach[0][0] - BEYOND && part.reach[0][1] > self.reach[0][1] + BEYOND;
        is_in(0, BEYOND) && is_in(1, HANDLE_AWAY) && is_in(2, BEYOND) && !is_frame
    }
}

/// The leaves of a door, of the pieces that lie near it. Pieces that are in none stay where they are. `may_be_planks`: the model says that
/// something shuts it. Where nothing in the model does, leaves are made.
pub fn leaves(opening: &Opening, pieces: &[&Piece], may_be_planks: bool) -> Vec<Leaf> {
    let found = if opening.is_upright { upright(opening, pieces, may_be_planks) } else { hatch(opening, pieces) };
    if found.is_empty() { made(opening) } else { found }
}

fn upright(opening: &Opening, pieces: &[&Piece], may_be_planks: bool) -> Vec<Leaf> {
    let mut parts: Vec<Part<'_>> = Vec::new();
    let (mut rest, mut slabs) = (Vec::new(), Vec::new());
    for &piece in pieces {
        match Part::of(piece).filter(|part| part.is_leaf(opening)) {
            Some(part) => slabs.push(part),
            None => rest.push(piece),
        }
    }
    for mut slab in slabs {
        while let Some(i) = parts.iter().position(|part| part.is_one_with(&slab)) {
            let mut pieces = parts.swap_remove(i).pieces;
            pieces.append(&mut slab.pieces);
            slab = Part::new(pieces, slab.facing);
        }
        parts.push(slab);
    }
    let is_within = |piece: &&&Piece| {
        let off = piece.bounds.centre() - opening.middle;
        off.dot(opening.along).abs() < opening.half.x && off.dot(opening.up).abs() < opening.half.y
    };
    if parts.is_empty() && may_be_planks {
        let planks: Vec<&Piece> = rest.iter().filter(is_within).copied().collect();
        let all: Vec<Facet> = planks.iter().flat_map(|p| p.facets.clone()).collect();
        return of_part(opening, &all, opening.n, None).into_iter().collect();
    }
    let of = |part: &Part<'_>| {
        let handles: Vec<&Piece> = rest.iter().filter(|p| part.carries(p)).copied().collect();
        let at = |p: &&Piece| p.bounds.centre().dot(opening.along);
        let handle = (!handles.is_empty()).then(|| handles.iter().map(at).sum::<f64>() / handles.len() as f64);
        let slab: Vec<Facet> = part.pieces.iter().flat_map(|p| p.facets.clone()).collect();
        let mut leaf = of_part(opening, &slab, part.facing, handle)?;
        leaf.facets.extend(handles.iter().flat_map(|p| p.facets.clone()));
        Some(leaf)
    };
    parts.iter().filter_map(of).collect()
}

fn of_part(opening: &Opening, slab: &[Facet], facing: DVec3, handle: Option<f64>) -> Option<Leaf> {
    if slab.is_empty() {
        return None;
    }
    let motion = Slab { facets: slab, facing }.motion(opening, handle)?;
    Some(Leaf { facets: slab.to_vec(), motion })
}

/// Whatever lies over a hatch slides off it.
fn hatch(opening: &Opening, pieces: &[&Piece]) -> Vec<Leaf> {
    let is_over = |piece: &&&Piece| {
        let off = piece.bounds.centre() - opening.middle;
        off.dot(opening.along).abs() < opening.half.x && off.dot(opening.up).abs() < opening.half.y
    };
    let facets: Vec<Facet> = pieces.iter().filter(is_over).flat_map(|p| p.facets.clone()).collect();
    if facets.is_empty() { Vec::new() } else { vec![Leaf { facets, motion: of_hatch(opening) }] }
}

fn made(opening: &Opening) -> Vec<Leaf> {
    let width = 2.0 * opening.half.x;
    let (parts, slides): (&[[f64; 2]], bool) = match width {
        _ if !opening.is_upright || width > GATE => (&[[-1.0, 1.0]], true),
        _ if width > TWO_LEAVES => (&[[-1.0, 0.0], [0.0, 1.0]], false),
        _ => (&[[-1.0, 1.0]], false),
    };
    let motion = |part: [f64; 2]| if opening.is_upright { of_made(opening, part, slides) } else { of_hatch(opening) };
    parts.iter().map(|&part| Leaf { facets: opening.made_leaf(part), motion: motion(part) }).collect()
}
