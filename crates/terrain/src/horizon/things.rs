//! Boxes on a ground, cut along its finest tiles: each piece has a rank from near to far, as tiles have.

use super::order::{ends, tiles_from_corner};
use super::picture::{Footprint, ROUNDING};
use crate::{Ground, Header, Key};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Maximum finest tiles of a tested box. More: boxes as large as a town are tested, and take long each frame.
const MOST_PIECES: u64 = 256;

/// Boxes on a ground, or in it, for [`Horizon::hide_with`](super::Horizon::hide_with).
#[derive(Clone, Debug, Default)]
pub struct Things {
    pieces: Vec<Piece>,
    /// By box, its pieces; empty if it is never tested.
    of: Vec<Range<usize>>,
}

/// The part of a box on a finest tile.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// The box's number.
    pub(super) thing: usize,
    pub(super) tile: Key,
    low: DVec3,
    high: DVec3,
    /// By axis of the plan, whether the box ends at its low and at its high side.
    ends: [[bool; 2]; 2],
}

impl Things {
    /// From boxes, each by its least and its greatest corner, metres from the ground's origin. A box that is not entirely over
    /// the raster, or is over more than 256 of its finest tiles, never counts as hidden.
    pub fn new(ground: &Ground, boxes: impl IntoIterator<Item = [DVec3; 2]>) -> Self {
        let mut things = Self::default();
        for corners in boxes {
            let first = things.pieces.len();
            things.cut(ground.header(), corners);
            things.of.push(first..things.pieces.len());
        }
        things
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.of.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.of.is_empty()
    }

    fn cut(&mut self, header: &Header, [low, high]: [DVec3; 2]) {
        let grid = &header.grid;
        let [first, last] = [low, high].map(|p| tiles_from_corner(header, p));
        let is_on = first.cmpge(DVec2::ZERO).all() && last.cmple(ends(header)).all() && low.cmple(high).all();
        if !is_on {
            return;
        }
        // A box that ends on the raster's last column or row is on the last tile.
        let [across, down] = grid.across(0).map(|tiles| tiles - 1);
        let tiles = [first, last].map(|p| [(p.x as u32).min(across), (p.y as u32).min(down)]);
        let [[west, north], [east, south]] = tiles;
        if u64::from(east - west + 1) * u64::from(south - north + 1) > MOST_PIECES {
            return;
        }
        for tile in (north..=south).flat_map(|y| (west..=east).map(move |x| Key { level: 0, x, y })) {
            let corner = |k: u32| header.plan(grid.column(tile, k), grid.row(tile, k));
            let ([west, north], [east, south]) = (corner(0), corner(grid.side() - 1));
            let ends = [[low.x >= west, high.x <= east], [low.z >= north, high.z <= south]];
            self.pieces.push(Piece {
                thing: self.of.len(),
                tile,
                low: low.max(DVec3::new(west, f64::NEG_INFINITY, north)),
                high: high.min(DVec3::new(east, f64::INFINITY, south)),
                ends,
            });
        }
    }

    /// The pieces of all boxes.
    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The numbers of a box's pieces.
    pub(super) fn pieces_of(&self, thing: usize) -> Range<usize> {
        self.of.get(thing).cloned().unwrap_or_default()
    }
}

impl Piece {
    /// Its footprint as seen from an eye.
    pub(super) fn footprint(&self, eye: DVec3) -> Footprint {
        let (low, high) = (self.low - eye, self.high - eye);
        let rounding = self.ends.map(|ends| ends.map(|ends| if ends { ROUNDING } else { 0.0 }));
        Footprint { low: [low.x, low.z], high: [high.x, high.z], top: high.y, rounding }
    }
}
