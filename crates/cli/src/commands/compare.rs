//! Compares rows of another tool with a level's, for `vis --against` and `report --against`.

use super::level::Input;
use super::{CliError, at};
use enfilade::BitMatrix;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::compare::{Against, CellFaults};
use enfilade_levels::rows::read_rows;
use enfilade_levels::{Level, Line};
use serde_json::{Value, json};
use std::path::Path;

/// Most clusters in prose.
const MOST_CLUSTERS: usize = 20;
/// Most pairs that are proven hidden and listed in JSON.
const MOST_REFUTED: u64 = 100_000;
/// How far before the first portal of a line an eye stands, in the level's units.
const STEP_BACK: f64 = 1.0;

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

/// A comparison, and what tells of it.
pub struct Audit<'a> {
    /// The level.
    pub level: &'a Level,
    /// Pairs that see each other only if the last digits of the level's file are right, ascending.
    pub on_digits: &'a [[u32; 2]],
    /// The comparison.
    pub found: Against,
}

impl Audit<'_> {
    /// Whether a line joins cells that see each other only if the last digits of the level's file are right.
    pub fn is_on_digits(&self, line: &Line) -> bool {
        let [a, b] = line.cells;
        self.on_digits.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// What puts a player's eye before a line's first portal, looking along the line: a command for the consoles of Source and
    /// its kin.
    pub fn setpos(&self, line: &Line) -> String {
        let direction = line.direction(self.level);
        let eye = line.from - direction * STEP_BACK;
        // Down is positive.
        let pitch = -direction.z.clamp(-1.0, 1.0).asin().to_degrees();
        let yaw = (direction.y + 0.0).atan2(direction.x).to_degrees();
        // Adding zero leaves no -0.0.
        let [x, y, z, pitch, yaw] = [eye.x, eye.y, eye.z, pitch, yaw].map(|v| (v * 10.0).round() / 10.0 + 0.0);
        format!("setpos {x:.1} {y:.1} {z:.1};setang {pitch:.1} {yaw:.1} 0")
    }

    /// The JSON key `against`, see docs/cli.md.
    pub fn told(&self) -> Value {
        let a = &self.found;
        let line = |line: &Line| {
            json!({
                "pair": line.cells,
                "from": line.from.to_array(),
                "to": line.to.to_array(),
                "chain": super::vis::chain(&line.portals),
                "setpos": self.setpos(line),
                "on_last_digit": self.is_on_digits(line),
            })
        };
        let cluster = |faults: &CellFaults| {
            let mut told = json!({ "cluster": faults.cell, "lost_pairs": faults.lost, "refuted_pairs": faults.refuted });
            if a.refuted <= MOST_REFUTED {
                told["refuted"] = a.refuted_rows.ones(faults.cell as usize).collect();
            }
            told
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
            "by_cluster": a.by_cell().iter().map(cluster).collect::<Vec<_>>(),
        })
    }

    /// Counts with their names.
    pub fn counts(&self) -> Vec<(String, u64)> {
        let a = &self.found;
        [
            ("in their rows", a.theirs),
            ("in both", a.both),
            ("theirs only: proven hidden", a.refuted),
            ("ours only: proven visible by a line", a.lost.len() as u64),
            ("ours only: undecided", a.undecided),
            ("theirs in one direction only (a sees b, b doesn't see a)", a.one_way),
            ("of those, proven hidden", a.one_way_refuted),
        ]
        .map(|(what, pairs)| (what.to_owned(), pairs))
        .into()
    }

    /// The comparison in prose: counts, and a table of the clusters that lack most.
    pub fn prose(&self, path: &Path) -> String {
        let a = &self.found;
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
        let on_digits = a.lost.iter().filter(|line| self.is_on_digits(line)).count();
        if on_digits > 0 {
            lines.push(format!(
                "{on_digits} of the pairs that it lacks are visible only if the last digits of the file are right"
            ));
        }
        let mut faults = a.by_cell();
        faults.retain(|faults| faults.lost > 0);
        if !faults.is_empty() {
            lines.push("cluster  lacks  shows hidden  the first that it lacks, and where to look".to_owned());
        }
        for of in faults.iter().take(MOST_CLUSTERS) {
            let lost = a.lost_from(of.cell);
            // One that is certain, if there is one.
            let first = lost.iter().find(|line| !self.is_on_digits(line)).unwrap_or(&lost[0]);
            let CellFaults { cell, lost, refuted } = of;
            let [seen, portals, setpos] = [first.cells[1].to_string(), portals(first), self.setpos(first)];
            lines.push(format!("{cell:>7}  {lost:>5}  {refuted:>12}  {seen} through portals {portals}: {setpos}"));
        }
        if faults.len() > MOST_CLUSTERS {
            lines.push(format!("and {} more: --json has all", faults.len() - MOST_CLUSTERS));
        }
        lines.join("\n")
    }
}

/// Numbers of the portals along a line.
pub fn portals(line: &Line) -> String {
    line.portals.iter().map(|p| (p / 2).to_string()).collect::<Vec<_>>().join(" ")
}
