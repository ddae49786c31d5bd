//! Rows of another tool beside a level's, as `vis --against` and `report --rows` tell it.

use super::level::Input;
use super::{CliError, at};
use enfilade::BitMatrix;
use enfilade_levels::Line;
use enfilade_levels::compare::Against;
use enfilade_levels::rows::read_rows;
use serde_json::{Value, json};
use std::path::Path;

/// Lines that prose tells.
const TOLD: usize = 20;

/// Rows for the clusters of a level: text as `vis --rows` writes it, or what a .bsp holds.
pub fn other_rows(path: &Path, input: &Input) -> Result<BitMatrix, CliError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bsp")) {
        let other = Input::read(path)?;
        let (theirs, ours) = (other.level.cells, input.level.cells);
        if theirs != ours {
            return Err(at(path, format!("has {theirs} clusters, the level {ours}; the rows belong to another level")));
        }
        return other.rows().map_err(|e| at(path, e));
    }
    let bytes = std::fs::read(path).map_err(|e| at(path, e))?;
    read_rows(&bytes, input.level.cells).map_err(|e| at(path, e))
}

/// The key `against`; docs/cli.md says what each means.
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

/// What each count is.
pub fn counts(a: &Against) -> Vec<(String, u64)> {
    let lost = a.lost.len() as u64;
    [
        ("in their rows", a.theirs),
        ("in both", a.both),
        ("theirs only: proven hidden", a.refuted),
        ("ours only: on a line, which they lack", lost),
        ("ours only: undecided", a.undecided),
        ("theirs one way only (a sees b, b doesn't see a)", a.one_way),
        ("of those, proven hidden", a.one_way_refuted),
    ]
    .map(|(what, pairs)| (what.to_owned(), pairs))
    .into()
}

/// The same in prose, with the first of the lines.
pub fn prose(a: &Against, path: &Path) -> String {
    let mut lines = vec![
        format!(
            "{} has {} pairs: {} are in both, {} are proven hidden; it lacks {} that lie on a line and {} undecided ones",
            path.display(),
            a.theirs,
            a.both,
            a.refuted,
            a.lost.len(),
            a.undecided
        ),
        format!("{} of its pairs are there one way only, {} of those proven hidden", a.one_way, a.one_way_refuted),
    ];
    for line in a.lost.iter().take(TOLD) {
        let [x, y] = line.cells;
        let portals: Vec<String> = line.portals.iter().map(|p| (p / 2).to_string()).collect();
        let (from, to) = (line.from.to_array(), line.to.to_array());
        lines.push(format!("  it lacks {x} {y}: the line from {from:?} to {to:?} through portals {}", portals.join(" ")));
    }
    if a.lost.len() > TOLD {
        lines.push(format!("  and {} more; --json lists them all", a.lost.len() - TOLD));
    }
    lines.join("\n")
}
