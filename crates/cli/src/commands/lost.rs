//! Files of the pairs that another tool's rows lack, for `vis --lost`: a page, or a point file that map editors draw as a path.

use super::compare::{Audit, portals};
use super::kinds::Kind;
use super::{CliError, at};
use enfilade::file::replace_file;
use enfilade_levels::Line;
use enfilade_measure::pages::lost::{LostPage, LostPair};
use glam::DVec3;
use std::collections::HashSet;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Distance of points along a line, in the level's units.
const SPACING: f64 = 8.0;
/// Most points in a file: old editors read no more.
const MOST_POINTS: usize = 8192;

/// The kind of a file.
pub fn kind(path: &Path) -> Kind {
    if is(path, "html") { Kind::Page } else { Kind::Points }
}

fn is(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// The level's point files as compilers name them.
pub fn of_compilers(level: &Path) -> [PathBuf; 2] {
    ["pts", "lin"].map(|extension| level.with_extension(extension))
}

/// Refuses a file of no known kind.
pub fn check(paths: &[PathBuf]) -> Result<(), CliError> {
    let is_known = |path: &PathBuf| ["html", "pts", "lin"].iter().any(|extension| is(path, extension));
    let unknown = paths.iter().find(|path| !is_known(path));
    unknown.map_or(Ok(()), |path| Err(at(path, "--lost writes a page, .html, or a point file, .pts or .lin")))
}

/// Writes a file. `files`: the level and the rows that were compared.
pub fn write(path: &Path, audit: &Audit<'_>, files: [&Path; 2]) -> Result<(), CliError> {
    if kind(path) == Kind::Page {
        let html = page(audit, files);
        return replace_file(path, |out| out.write_all(html.as_bytes())).map_err(|e| at(path, e));
    }
    let (points, rest) = if is(path, "pts") { points(audit, dotted) } else { points(audit, Vec::from) };
    if rest > 0 {
        eprintln!(
            "note: {} has the worst clusters' lines; {rest} more don't fit, as old editors read {MOST_POINTS} points",
            path.display()
        );
    }
    let line = |out: &mut dyn Write, p: &DVec3| writeln!(out, "{:.3} {:.3} {:.3}", p.x, p.y, p.z);
    replace_file(path, |out| points.iter().try_for_each(|p| line(out, p))).map_err(|e| at(path, e))
}

/// All lost pairs, those of the cluster that lacks most first, but behind all others those that hang on the file's last digits.
fn in_order<'a>(audit: &'a Audit<'_>) -> Vec<&'a Line> {
    let found = &audit.found;
    let mut all: Vec<&Line> = found.by_cell().iter().flat_map(|faults| found.lost_from(faults.cell)).collect();
    all.sort_by_key(|line| audit.is_on_digits(line));
    all
}

/// Points of the lines, one way of each, as far as whole lines fit; and the number of lines that don't.
fn points(audit: &Audit<'_>, of: impl Fn([DVec3; 2]) -> Vec<DVec3>) -> (Vec<DVec3>, usize) {
    let mut known = HashSet::new();
    let (mut all, mut rest) = (Vec::new(), 0);
    for line in in_order(audit) {
        let [a, b] = line.cells;
        let along = line.direction(audit.level);
        // A point of a portal becomes a path through it.
        let ends = if line.from == line.to {
            [line.from - along * SPACING, line.to + along * SPACING]
        } else {
            [line.from, line.to]
        };
        if known.insert([a.min(b), a.max(b)]) {
            let more = of(ends);
            if rest > 0 || all.len() + more.len() > MOST_POINTS {
                rest += 1;
            } else {
                all.extend(more);
            }
        }
    }
    (all, rest)
}

/// Points of a line, at most `SPACING` apart.
fn dotted([from, to]: [DVec3; 2]) -> Vec<DVec3> {
    let steps = (from.distance(to) / SPACING).ceil().max(1.0);
    (0..=steps as usize).map(|k| from.lerp(to, k as f64 / steps)).collect()
}

fn page(audit: &Audit<'_>, files: [&Path; 2]) -> String {
    let [level, rows] = files.map(|path| path.file_name().unwrap_or_default().to_string_lossy());
    let found = &audit.found;
    let point = |p: DVec3| format!("{:.1} {:.1} {:.1}", p.x, p.y, p.z);
    let pair = |line: &Line| LostPair {
        cells: line.cells,
        ends: [line.from, line.to].map(point),
        portals: portals(line),
        setpos: audit.setpos(line),
        is_on_digits: audit.is_on_digits(line),
    };
    let clusters: Vec<_> =
        found.by_cell().iter().map(|of| [u64::from(of.cell), of.lost as u64, of.refuted as u64]).collect();
    let pairs: Vec<LostPair> = in_order(audit).into_iter().map(pair).collect();
    LostPage { level: &level, rows: &rows, counts: &audit.counts(), clusters: &clusters, pairs: &pairs }.html()
}
