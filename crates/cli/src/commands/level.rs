//! Level inputs of commands: a `.prt`, or a `.bsp` with its portals.

use super::{CliError, at, portal_file};
use enfilade::BitMatrix;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::prt::{Dialect, Prt, read_prt};
use enfilade_levels::{Level, VisOptions};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// Flags of commands that compute the visibility of a level.
#[derive(clap::Args)]
pub struct SearchFlags {
    /// Limit of flow steps per search; undecided pairs count as visible
    #[arg(long, value_name = "N", default_value_t = VisOptions::default().steps)]
    pub steps: u64,
    /// Random lines from each side of a portal before any search
    #[arg(long, value_name = "N", default_value_t = VisOptions::default().lines)]
    pub lines: u64,
    /// Compare with rows of another tool: text in the form of `vis --rows`, or a .bsp with rows
    #[arg(long, value_name = "ROWS")]
    pub against: Option<PathBuf>,
}

impl SearchFlags {
    /// The library's options.
    pub fn options(&self, seed: u64) -> VisOptions {
        VisOptions { seed, steps: self.steps, lines: self.lines, fast: false }
    }
}

/// A level and the clusters of its leaves.
pub struct Input {
    /// Clusters and portals.
    pub level: Level,
    /// Cluster of each leaf.
    pub clusters: Vec<u32>,
    /// The level's file, if the input is one.
    pub bsp: Option<Bsp>,
    /// Source of the portals: the dialect of a portal file, or `tree`.
    pub portals_from: String,
    /// Portals of the tree that were too narrow and left out.
    pub slivers: usize,
    /// Notes for the user.
    pub notes: Vec<String>,
}

impl Input {
    /// Reads a `.prt` or a `.bsp`. The portals of a `.bsp` come from the `.prt` beside it, if that fits, else from its own tree.
    pub fn read(path: &Path) -> Result<Self, CliError> {
        match path.extension().map(|e| e.to_ascii_lowercase()) {
            Some(e) if e == "prt" => Ok(Self::of_prt(prt_file(path)?, None)),
            Some(e) if e == "bsp" => Self::of_bsp(path),
            Some(e) if e == "map" => {
                Err(at(path, "a level's source: compile it (qbsp) and give the .bsp or the .prt, or `bake` it as it is"))
            }
            _ if path.is_dir() => Err(at(path, "is a folder; give a .prt or .bsp in it")),
            _ => Err(at(path, "is neither a .prt nor a .bsp")),
        }
    }

    /// The level's own rows, by cluster: a cluster sees what any of its leaves sees.
    pub fn rows(&self) -> Result<BitMatrix, String> {
        let bsp = self.bsp.as_ref().ok_or("has no rows; give a file with --rows")?;
        if !bsp.has_rows() {
            return Err("has no rows; give a file with --rows".into());
        }
        self.rows_of(bsp)
    }

    /// The rows of a file of this level, by this level's clusters.
    pub fn rows_of(&self, bsp: &Bsp) -> Result<BitMatrix, String> {
        let (theirs, ours) = (bsp.cells(), self.clusters.len());
        if theirs != ours {
            let what = if bsp.is_by_leaf() { "leaves" } else { "clusters" };
            return Err(format!("has {theirs} {what}, the level {ours}; the rows belong to another level"));
        }
        let of_leaves = bsp.rows().map_err(|e| e.to_string())?.ok_or("has no rows")?;
        let mut rows = BitMatrix::new(self.level.cells, self.level.cells);
        for (leaf, &cluster) in self.clusters.iter().enumerate() {
            of_leaves.ones(leaf).for_each(|other| _ = rows.set(cluster as usize, self.clusters[other] as usize));
        }
        Ok(rows)
    }

    /// The cluster of a word: a number, or a point `X,Y,Z` in the level's own units.
    pub fn cluster(&self, word: &str) -> Result<u32, String> {
        let last = self.level.cells.saturating_sub(1);
        if let Ok(cluster) = word.parse::<u32>() {
            let is_there = (cluster as usize) < self.level.cells;
            return is_there.then_some(cluster).ok_or_else(|| format!("{word}: the level has clusters 0 to {last}"));
        }
        let words = word.trim_matches(['(', ')', ' ']).split([',', ' ']).filter(|word| !word.is_empty());
        let numbers: Vec<f64> =
            words.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite()).unwrap_or(f64::NAN)).collect();
        let [x, y, z] = numbers[..] else {
            return Err(format!("{word}: takes a cluster's number, 0 to {last}, or a point, as 480,-352,88"));
        };
        self.cluster_at(DVec3::new(x, y, z)).map_err(|e| format!("{word}: {e}"))
    }

    fn cluster_at(&self, point: DVec3) -> Result<u32, String> {
        if point.is_nan() {
            return Err("a point has three numbers, as 480,-352,88".into());
        }
        let bsp = self.bsp.as_ref().ok_or("a .prt has no positions of its clusters; give the .bsp, or a number")?;
        let leaf = bsp.cell_at(point).ok_or("lies in a wall or outside the level")?;
        Ok(self.clusters[leaf])
    }

    fn of_prt(prt: Prt, bsp: Option<Bsp>) -> Self {
        let portals_from = prt.dialect.to_string();
        Self { level: prt.level, clusters: prt.leaves, bsp, portals_from, slivers: 0, notes: Vec::new() }
    }

    fn of_bsp(path: &Path) -> Result<Self, CliError> {
        let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
        let bsp = Bsp::read(bytes).map_err(|e| at(path, e))?;
        let beside = path.with_extension("prt");
        // A level with rows had its portals once.
        let note = portal_file::note(path, &beside).filter(|_| !bsp.has_rows());
        let mut input = if beside.exists() { Self::of_both(bsp, &beside)? } else { Self::of_tree(path, bsp)? };
        input.notes.extend(note);
        Ok(input)
    }

    /// A level whose portals come from its tree.
    fn of_tree(path: &Path, bsp: Bsp) -> Result<Self, CliError> {
        let derived = bsp.level().map_err(|e| at(path, e))?;
        let clusters = (0..bsp.cells() as u32).collect();
        let (level, slivers) = (derived.level, derived.slivers);
        Ok(Self { level, clusters, bsp: Some(bsp), portals_from: "tree".into(), slivers, notes: Vec::new() })
    }

    /// A level and the portal file beside it, which has to be this level's.
    fn of_both(bsp: Bsp, beside: &Path) -> Result<Self, CliError> {
        let mut prt = prt_file(beside)?;
        let mut notes = Vec::new();
        if prt.dialect == Dialect::HalfLifeBare && prt.level.cells != bsp.cells() {
            let by_offset =
                bsp.clusters_by_offset().filter(|c| c.last().is_some_and(|&c| c as usize + 1 == prt.level.cells));
            prt.leaves = by_offset.ok_or_else(|| {
                let what = format!(
                    "has {} clusters without their leaves, the level {} leaves, and its rows don't tell which belong together; \
                     compile with -nofixprt to keep them, or remove the file: then portals come from the tree",
                    prt.level.cells,
                    bsp.cells()
                );
                at(beside, what)
            })?;
            notes.push(format!(
                "{}: the leaves of each cluster come from the rows that they share in the level",
                beside.display()
            ));
        }
        let fit = bsp.fit(&prt);
        if !fit.is_taken() {
            return Err(at(
                beside,
                format!("{fit}: it belongs to another level; remove it, and portals come from the tree"),
            ));
        }
        if !fit.elsewhere.is_empty() {
            notes.push(format!("{} {fit}; it is used anyway", beside.display()));
        }
        Ok(Self { notes, ..Self::of_prt(prt, Some(bsp)) })
    }
}

fn prt_file(path: &Path) -> Result<Prt, CliError> {
    let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
    read_prt(&bytes).map_err(|e| at(path, e))
}
