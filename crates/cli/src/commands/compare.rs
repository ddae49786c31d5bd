//! Compares rows of another tool with a level's, for `vis --against` and `report --against`.

use super::level::Input;
use super::{CliError, at};
use enfilade::BitMatrix;
use enfilade_levels::Line;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::compare::Against;
use enfilade_levels::rows::read_rows;
use serde_json::{Value, json};
use std::path::Path;

/// Most lines in prose.
const MOST_LINES: usize = 20;

/// Reads rows for the clusters of a level: text as `vis --rows` writes it, or the rows of a .bsp.
pub fn other_rows(path: &Path, input: &Input) -> Result<BitMatrix, CliError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bsp")) {
        let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
        let other = Bsp::read(bytes).map_err(|e| at(path, e))?;
        return input.rows_of(&other).map_err(|e| at(path, e));
    }
    let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
    read_rows(&bytes, input.level.cells).map_err(|e| at(path, e))
}

/// The JSON key `against`, see docs/cli.md.
pub fn told(a: &Against) -> Value {
    let line = |line: &Line| {
        json!({
            "pair": line.cells,
            "from": line.from.to_array(),
            "to": line.to.to_array(),
            "chain": super::vis::chain(&line.portals),
        })
    };
    json!({
        "their_pairs": a.theirs,
        "our_pairs": a.ours,
        "both_pairs": a.both,
        "refuted_pairs": a.refuted,
        "lost_pairs": a.lost.len(),
        "undecided_pairs": a.undecided,
        "one_way_pairs": a.one_way,
        "one_way_refuted_pairs": a.one_way_refuted,
        "lost": a.lost.iter().map(line).collect::<Vec<_>>(),
    })
}

/// Counts with their names.
pub fn counts(a: &Against) -> Vec<(String, u64)> {
    let lost = a.lost.len() as u64;
    [
        ("in their rows", a.theirs),
        ("in both", a.both),
        ("theirs only: proven hidden", a.refuted),
        ("ours only: proven visible by a line", lost),
        ("ours only: undecided", a.undecided),
        ("theirs in one direction only (a sees b, b doesn't see a)", a.one_way),
        ("of those, proven hidden", a.one_way_refuted),
    ]
    .map(|(what, pairs)| (what.to_owned(), pairs))
    .into()
}

/// The comparison in prose, with the first lines.
pub fn prose(a: &Against, path: &Path) -> String {
    let mut lines = vec![
        format!(
            "{} has {} pairs: {} are in both, {} are proven hidden; it lacks {} proven visible and {} undecided pairs",
            path.display(),
            a.theirs,
            a.both,
            a.refuted,
            a.lost.len(),
            a.undecided
        ),
        format!("{} of its pairs are in one direction only, {} of those proven hidden", a.one_way, a.one_way_refuted),
    ];
    for line in a.lost.iter().take(MOST_LINES) {
        let [x, y] = line.cells;
        let portals: Vec<String> = line.portals.iter().map(|p| (p / 2).to_string()).collect();
        let [from, to] = [line.from, line.to].map(|p| format!("{:.1} {:.1} {:.1}", p.x, p.y, p.z));
        lines.push(format!("  it lacks {x} {y}: setpos {from}, and look at {to}, through portals {}", portals.join(" ")));
    }
    if a.lost.len() > MOST_LINES {
        lines.push(format!("  and {} more; --json lists them all", a.lost.len() - MOST_LINES));
    }
    lines.join("\n")
}
