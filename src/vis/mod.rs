//! `vis`: both sides of what can be seen through a ready portal graph.
//!
//! A pair of cells sees each other where a straight line passes a chain of portals from one to the other. Each pair ends up
//! *witnessed* (a line that passes is known), *separated* (no chain lets a line through) or *undecided*.

pub mod bsp;
pub mod prt;
pub mod resume;
pub mod rows;

use crate::BitMatrix;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::sync::atomic::AtomicBool;

/// A ready portal graph: what a `.prt` file holds. Lengths are in any unit; nothing depends on which.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Level {
    /// Number of cells (clusters, where the file has clusters).
    pub cells: usize,
    /// Portals; each is crossed both ways.
    pub portals: Vec<LevelPortal>,
}

/// A convex planar polygon between two cells.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelPortal {
    /// The normal ([`crate::geom::newell`]) leads from `cells[0]` into `cells[1]`.
    pub cells: [u32; 2],
    /// Corners, counter-clockwise seen from the tip of that normal; 3 or more, any number.
    pub winding: Vec<DVec3>,
}

/// How to work.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct VisOptions {
    /// Seed of the random lines.
    pub seed: u64,
    /// Most flow steps that the search from one directed portal may take; what it has not decided then counts as visible.
    pub steps: u64,
    /// Random lines, before any search.
    pub lines: u64,
}

impl Default for VisOptions {
    fn default() -> Self {
        Self { seed: 0, steps: 1_000_000, lines: 200_000 }
    }
}

/// A line that proves that two cells see each other. It proves it for every pair of cells along it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Line {
    /// The cells at its ends.
    pub cells: [u32; 2],
    /// A point in the first portal's window.
    pub from: DVec3,
    /// A point in the last portal's window.
    pub to: DVec3,
    /// The portals that it crosses, in order, as `2 * portal + side`: side 0 leads from `cells[0]` to `cells[1]`, side 1 back.
    pub portals: Vec<u32>,
}

/// What it took.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct VisStats {
    /// Random lines followed.
    pub lines: u64,
    /// Flow steps: portals tried.
    pub steps: u64,
    /// Directed portals whose search ran out of steps.
    pub capped: u64,
}

/// Both sides.
#[derive(Clone, PartialEq, Debug)]
pub struct Vis {
    /// Cells x cells, symmetric, the diagonal set: pairs that a line proves, and neighbours. A subset of `upper`.
    pub lower: BitMatrix,
    /// Cells x cells, symmetric, the diagonal set: pairs not proven hidden.
    pub upper: BitMatrix,
    /// Lines that prove `lower`: each pair lies along at least one of them, or shares a portal.
    pub lines: Vec<Line>,
    /// Counters.
    pub stats: VisStats,
}

/// What is decided so far, to go on from. Belongs to one level and one set of options, by [`State::matches`].
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct State {
    /// Digest of the level and the options.
    digest: u64,
}

impl State {
    /// True where this is a state of that very level and those options: only then may a run go on from it.
    pub fn matches(&self, level: &Level, options: &VisOptions) -> bool {
        let _ = (level, options);
        self.digest == 0
    }
}

/// How a caller follows and stops a run.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Called with the stage and the fraction of it that is done, from any thread.
    pub progress: &'a (dyn Fn(&str, f64) + Sync),
    /// Set by the caller to end the run: soon after, [`vis`] returns [`VisError::Stopped`].
    pub stop: &'a AtomicBool,
    /// Called after each round with what is decided by then.
    pub checkpoint: &'a (dyn Fn(&State) + Sync),
}

/// Why there is no result.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum VisError {
    /// The caller stopped it. The state of the last round that ended, where one did.
    #[error("stopped")]
    Stopped(Option<Box<State>>),
    /// The state to go on from belongs to another level or other options.
    #[error("the state belongs to another level or other options")]
    OtherState,
    /// A portal names a cell that isn't there.
    #[error("portal {portal} leads to cell {cell}, but there are only {cells}")]
    NoSuchCell {
        /// Index of the portal.
        portal: usize,
        /// The cell that it names.
        cell: u32,
        /// Number of cells.
        cells: usize,
    },
}

/// Decides what can be seen from each cell of `level`; goes on from `resume` where there is one.
///
/// The result is the same on every run, for any number of threads, and whether it was interrupted or not.
///
/// # Errors
///
/// [`VisError`].
pub fn vis(level: &Level, options: &VisOptions, resume: Option<State>, control: &Control<'_>) -> Result<Vis, VisError> {
    let _ = (options, resume, control);
    let mut lower = BitMatrix::new(level.cells, level.cells);
    let mut upper = BitMatrix::new(level.cells, level.cells);
    for i in 0..level.cells {
        lower.set(i, i);
        for j in 0..level.cells {
            upper.set(i, j);
        }
    }
    Ok(Vis { lower, upper, lines: Vec::new(), stats: VisStats::default() })
}

/// The answer to: why is this pair in the rows, or not?
#[derive(Clone, PartialEq, Debug)]
pub enum Why {
    /// They see each other: a line, cut to these two cells.
    Witnessed(Line),
    /// No line passes: every chain of portals that was followed ends.
    Separated(Vec<Separation>),
    /// Not decided: the chain of portals (`2 * portal + side`) on which it is left open.
    Undecided(Vec<u32>),
}

/// The proof that a chain of portals lets no line through to the goal.
#[derive(Clone, PartialEq, Debug)]
pub struct Separation {
    /// Portals, as `2 * portal + side`, from the first cell on.
    pub chain: Vec<u32>,
    /// What ends it: the plane that has all that lies beyond the chain inside and what would come next outside. `None` where
    /// the chain as a whole is impassable and no single plane shows it.
    pub plane: Option<crate::geom::Plane>,
}

/// Why cells `a` and `b` are in the rows of `vis`, or not.
///
/// # Errors
///
/// [`VisError::NoSuchCell`].
pub fn why(level: &Level, options: &VisOptions, vis: &Vis, a: u32, b: u32) -> Result<Why, VisError> {
    let _ = (level, options, vis, a, b);
    Ok(Why::Undecided(Vec::new()))
}
