//! `vis`: lower and upper bounds of visibility in a finished portal graph.
//!
//! Two cells see each other if a straight line passes a chain of portals between them. Each pair ends up *witnessed* (such a line
//! is known), *separated* (no chain lets a line through) or *undecided*.
//!
//! [`vis`] is the main path: `lines` finds most visible pairs, the portal flow of [`enfilade::pvs`] decides the rest, and each
//! chain that it accepts becomes a line, too. [`why()`] gives the proof of a pair.
//!
//! Proofs hold for the graph: the file guarantees that lines stay inside a cell between two of its portals. This is true for
//! convex cells, such as leaves and clusters of a level's tree.

pub mod bsp;
pub mod compare;
mod digits;
pub mod far;
mod level;
mod lines;
mod parts;
mod proof;
pub mod prt;
pub mod quake;
pub mod rows;

pub use digits::pairs_on_digits;
pub use enfilade::pvs::flow::exact::{Edge, Term};
pub use enfilade::types::level::LevelPortal;
pub use level::{FARTHEST, Level, MOST_CLUSTERS};
pub use proof::{ChainProof, PairProof, why};

use enfilade::BitMatrix;
use enfilade::job::{Digest, Job, Stopped};
use enfilade::math::geom::{Plane, newell};
use enfilade::pvs::flow::cells::{Cells, reached};
use enfilade::pvs::flow::might_see::MightSee;
use enfilade::pvs::flow::net::{Net, NetPortal};
use glam::DVec3;
use lines::Walker;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

/// Options of `vis`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct VisOptions {
    /// Seed of the random lines.
    pub seed: u64,
    /// Maximum flow steps for the search from one directed portal; its undecided pairs then count as visible.
    pub steps: u64,
    /// Random lines from each directed portal, before any search.
    pub lines: u64,
    /// Only the flood: cells that might see each other. Nothing is witnessed but neighbours.
    pub fast: bool,
}

impl Default for VisOptions {
    fn default() -> Self {
        Self { seed: 0, steps: 100_000, lines: 16, fast: false }
    }
}

/// A line that proves that two cells see each other. It proves it for every pair of cells along it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Line {
    /// The cells at its ends.
    pub cells: [u32; 2],
    /// A point in the first portal's window; or before it, for a part of a line so thin that rounding would move it.
    pub from: DVec3,
    /// A point in the last portal's window; or likewise beyond it.
    pub to: DVec3,
    /// The portals that it crosses, in order, as `2 * portal + side`: side 0 leads from `cells[0]` to `cells[1]`, side 1 back.
    pub portals: Vec<u32>,
}

/// Work counters.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct VisStats {
    /// Random lines followed.
    pub lines: u64,
    /// Flow steps: portals tried.
    pub steps: u64,
    /// Directed portals whose search ran out of steps.
    pub capped: u64,
    /// Chains of portals that were tested exactly, because windows left them undecided.
    pub exact_asked: u64,
    /// Chains that no line passes.
    pub exact_refuted: u64,
    /// Chains that a line passes.
    pub exact_lines: u64,
}

/// Both bounds.
#[derive(Clone, PartialEq, Debug)]
pub struct Vis {
    /// Cells x cells, symmetric, with the diagonal: pairs that a line proves, and neighbours. A subset of `upper`.
    pub lower: BitMatrix,
    /// Cells x cells, symmetric, with the diagonal: pairs not proven hidden.
    pub upper: BitMatrix,
    /// Lines that prove `lower`: each pair lies along at least one of them, or shares a portal.
    pub lines: Vec<Line>,
    /// Counters.
    pub stats: VisStats,
}

/// Called with both bounds after the flood, after the random lines and after each round of searches; `lower` never falls and
/// `upper` never rises. The final result adds pairs that a line proves only through gaps made by rounding. Counts are the same on
/// every run; times are the caller's.
pub type Follow<'a> = &'a dyn Fn(&Bounds);

/// Both bounds at some moment of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bounds {
    /// The stage that has ended: `might-see`, `lines`, or a round of `flow`.
    pub stage: &'static str,
    /// Flow steps so far.
    pub steps: u64,
    /// Ordered pairs of cells that are proven to see each other, including each with itself.
    pub lower: u64,
    /// Likewise: pairs not proven hidden.
    pub upper: u64,
}

/// Why there is no result.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum VisError {
    /// The caller stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A portal names a missing cell.
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

/// Digest of all inputs of the result; identifies a [journal](enfilade::job::Journal).
pub fn digest(level: &Level, options: &VisOptions) -> Digest {
    let of_numbers = |numbers: &[u64]| {
        let mut hash = Xxh3::new();
        numbers.iter().for_each(|n| hash.update(&n.to_le_bytes()));
        hash
    };
    let mut hash = of_numbers(&[level.cells as u64, level.portals.len() as u64, level.rounding.to_bits()]);
    for portal in &level.portals {
        hash.update(&(portal.winding.len() as u64).to_le_bytes());
        portal.cells.iter().for_each(|c| hash.update(&c.to_le_bytes()));
        portal.winding.iter().flat_map(|p| p.to_array()).for_each(|x| hash.update(&x.to_bits().to_le_bytes()));
    }
    let options = of_numbers(&[options.seed, options.steps, options.lines, options.fast.into()]).digest128();
    Digest { input: hash.digest128(), options, build: 0 }
}

/// Computes both bounds for each cell of `level`. Without `follow`, nothing is counted on the way, and disconnected parts of the
/// level are processed one after the other.
///
/// The result is the same on every run, for any number of threads, and after an interruption.
///
/// # Errors
///
/// [`VisError`].
pub fn vis(level: &Level, options: &VisOptions, follow: Option<Follow<'_>>, work: &Job<'_>) -> Result<Vis, VisError> {
    check(level)?;
    if follow.is_some() {
        return vis_joined(level, options, follow, work);
    }
    let parts = parts::parts(level);
    if let [part] = &parts[..]
        && part.cells.len() == level.cells
    {
        return vis_joined(&part.level, options, None, work);
    }
    let mut all = Vis::of_none(level.cells);
    for part in parts {
        all.take(&part, vis_joined(&part.level, options, None, work)?);
    }
    Ok(all)
}

/// Result of [`vis_rows`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct VisRows {
    /// By cell, the cells that are not proven hidden from it, including itself, ascending.
    pub rows: Vec<Vec<u32>>,
    /// Ordered pairs that are proven to see each other, including each cell with itself.
    pub lower_pairs: u64,
    /// Likewise: pairs not proven hidden.
    pub upper_pairs: u64,
    /// Number of lines that prove `lower_pairs`.
    pub lines: usize,
    /// See [`pairs_on_digits`].
    pub on_digits: Vec<[u32; 2]>,
    /// Counters.
    pub stats: VisStats,
}

/// As [`vis`], with the same journal, for rows only. Memory depends on the largest connected part and on the visible pairs.
///
/// # Errors
///
/// [`VisError`].
pub fn vis_rows(level: &Level, options: &VisOptions, work: &Job<'_>) -> Result<VisRows, VisError> {
    check(level)?;
    let mut all = VisRows { rows: (0..level.cells as u32).map(|cell| vec![cell]).collect(), ..VisRows::default() };
    (all.lower_pairs, all.upper_pairs) = (level.cells as u64, level.cells as u64);
    for part in parts::parts(level) {
        let vis = vis_joined(&part.level, options, None, work)?;
        let on_digits =
            pairs_on_digits(&part.level, &vis).into_iter().map(|pair| pair.map(|cell| part.cells[cell as usize]));
        all.on_digits.extend(on_digits);
        let Vis { lower, upper, lines, stats } = vis;
        let itself = part.cells.len() as u64;
        all.lower_pairs += lower.count_ones() - itself;
        all.upper_pairs += upper.count_ones() - itself;
        all.lines += lines.len();
        all.stats.add(&stats);
        for (row, &cell) in part.cells.iter().enumerate() {
            all.rows[cell as usize] = upper.ones(row).map(|other| part.cells[other]).collect();
        }
    }
    all.on_digits.sort_unstable();
    Ok(all)
}

/// Computes a level without looking for parts.
fn vis_joined(level: &Level, options: &VisOptions, follow: Option<Follow<'_>>, work: &Job<'_>) -> Result<Vis, VisError> {
    // 1. The portals, and a cheap superset of the cells that each sees.
    work.tell("might-see", 0.0);
    let net = net(level);
    let might_see = MightSee::new(&net);
    let bounds = |stage, steps, lower: &BitMatrix, upper| {
        if let Some(follow) = follow {
            follow(&Bounds { stage, steps, lower: lower.count_ones(), upper });
        }
    };

    // 2. Random lines find most visible pairs.
    work.tell("lines", 0.0);
    let walker = Walker::new(level, &net, options.seed);
    let mut lower = BitMatrix::new(level.cells, level.cells);
    for i in 0..level.cells {
        lower.set(i, i);
        net.out(i).for_each(|p| _ = lower.set(i, net.target[p] as usize));
    }
    if options.fast {
        let mut upper = flooded(&net, &might_see);
        upper.union_with(&lower);
        return Ok(Vis { lower, upper, lines: Vec::new(), stats: VisStats::default() });
    }
    let flooded = follow.map_or(0, |_| flooded(&net, &might_see).count_ones());
    bounds("might-see", 0, &lower, flooded);
    let mut walks = lines::random(&walker, &might_see, options.lines, &mut lower);
    bounds("lines", 0, &lower, flooded);

    // 3. Flow: searches for every remaining pair, in rounds.
    let mut pairs = Cells::new(&net, might_see, &lower, options.steps, |_| true);
    let all = level.cells as u64 * level.cells as u64;
    while let Some(found) = pairs.next(&walker, "flow", work)? {
        for walk in found.iter().flat_map(|f| &f.proofs) {
            if lines::keep(&walker, walk, &mut lower) {
                walks.push(walk.clone());
            }
        }
        pairs.settled.union_with(&lower);
        pairs.merge(&found);
        bounds("flow", pairs.tally.steps, &lower, all - pairs.hidden.count_ones());
    }

    // 4. Pairs that are not hidden may be visible; so are pairs that lines prove only through gaps made by rounding.
    let mut upper = BitMatrix::new(level.cells, level.cells);
    for i in 0..level.cells {
        (0..level.cells).filter(|&j| !pairs.hidden.get(i, j)).for_each(|j| _ = upper.set(i, j));
    }
    upper.union_with(&lower);
    let stats = VisStats {
        lines: options.lines * net.portals() as u64,
        steps: pairs.tally.steps,
        capped: pairs.tally.capped.len() as u64,
        exact_asked: pairs.exact.asked,
        exact_refuted: pairs.exact.refuted,
        exact_lines: pairs.exact.lines,
    };
    Ok(Vis { lower, upper, lines: walks.iter().map(|w| walker.line(w)).collect(), stats })
}

/// Pairs of cells that the flood leaves possible in both directions, and neighbours.
fn flooded(net: &Net, might_see: &MightSee) -> BitMatrix {
    let mut rows = BitMatrix::new(net.cells, net.cells);
    for i in 0..net.cells {
        rows.row_mut(i).copy_from_slice(&reached(net, might_see, net.out(i)));
        rows.set(i, i);
    }
    let mut both = BitMatrix::new(net.cells, net.cells);
    for i in 0..net.cells {
        rows.ones(i).filter(|&j| rows.get(j, i)).for_each(|j| _ = both.set(i, j));
    }
    both
}

/// Checks that every portal leads to existing cells.
fn check(level: &Level) -> Result<(), VisError> {
    let cells = level.cells;
    for (portal, p) in level.portals.iter().enumerate() {
        if let Some(&cell) = p.cells.iter().find(|&&c| c as usize >= cells) {
            return Err(VisError::NoSuchCell { portal, cell, cells });
        }
    }
    Ok(())
}

/// Corners within this fraction of the level's size of their winding's plane count as in the plane.
const COPLANAR: f64 = 1e-8;
/// For rounded coordinates: corners also count as in the plane within this multiple of the largest distance of a corner from its
/// own winding, up to this multiple of the rounding. Larger: slits are lost. Smaller: portals of one wall see each other through
/// gaps made by rounding, and such pairs stay undecided.
const ROUNDED: [f64; 2] = [2.0, 4.0];

/// Greatest distance of corners from their intended plane, as far as rounding explains it.
fn coplanar(level: &Level) -> f64 {
    let off = |winding: &[DVec3]| {
        let plane = plane(winding);
        winding.iter().map(|p| plane.distance(*p).abs()).fold(0.0, f64::max)
    };
    let bounds = enfilade::math::geom::Aabb::of(level.portals.iter().flat_map(|p| p.winding.iter().copied()));
    let farthest = level.portals.iter().map(|p| off(&p.winding)).fold(0.0, f64::max);
    (COPLANAR * bounds.diagonal()).max((ROUNDED[0] * farthest).min(ROUNDED[1] * level.rounding))
}

/// The plane of a winding.
fn plane(winding: &[DVec3]) -> Plane {
    let middle = enfilade::math::geom::middle(winding);
    let relative: Vec<DVec3> = winding.iter().map(|&p| p - middle).collect();
    Plane::through(middle, newell(&relative).normalize_or_zero())
}

/// A level's portals, prepared for flow. All their cells exist.
fn net(level: &Level) -> Net {
    let portals: Vec<NetPortal<'_>> =
        level.portals.iter().map(|p| NetPortal { cells: p.cells, plane: plane(&p.winding), winding: &p.winding }).collect();
    Net::new(level.cells, &portals, coplanar(level))
}
