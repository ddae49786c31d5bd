//! What a bake found, in words: a few lines for the person whose model it is, or all that there is to say.

use super::report::{AuthoredReport, BakeReport};

/// Most lines that are printed where nobody asks for more.
pub const LINES: usize = 8;

impl BakeReport {
    /// What `bake` prints when it has written a file of this name: at most [`LINES`] lines, or everything.
    pub fn prose(&self, output: &str, is_verbose: bool) -> String {
        let mut lines = self.head(is_verbose);
        let last = format!("{output}: {} bytes, in {:.1} s", self.file_bytes, self.seconds.total);
        if is_verbose {
            lines.extend(self.figures());
            lines.extend(self.wrong());
            lines.extend(self.notes.iter().map(|note| one_line("note", note)));
            lines.extend(self.details.iter().map(|detail| one_line("detail", detail)));
        } else {
            // The last line is the file's.
            let room = LINES.saturating_sub(lines.len() + 1);
            lines.extend(self.most_important(room));
        }
        lines.push(last);
        lines.join("\n")
    }

    /// The notes that matter most, in so many lines; the last says how many more there are.
    fn most_important(&self, room: usize) -> Vec<String> {
        let findings = self.findings.as_deref().unwrap_or_default();
        let finding = findings.first().map(|first| {
            let count = findings.len();
            format!(
                "{count} things that the model says of rooms and doors don't fit its walls (-v lists them), as: {}",
                first.text
            )
        });
        let notes: Vec<&String> = finding.iter().chain(&self.notes).collect();
        let shown = if notes.len() > room { room.saturating_sub(1) } else { notes.len() };
        let mut lines: Vec<String> = notes[..shown].iter().map(|note| one_line("note", note)).collect();
        lines.extend((shown < notes.len()).then(|| format!("and {} more notes: -v shows them", notes.len() - shown)));
        lines
    }

    /// The model, its cells, and what they save.
    fn head(&self, is_verbose: bool) -> Vec<String> {
        let Self { triangles, objects, cells, open_cells, portals, strategy, .. } = self;
        let by = format!("{:?}", strategy.cells).to_lowercase();
        let mut lines = vec![
            format!("{triangles} triangles in {objects} objects"),
            format!("{cells} cells ({open_cells} open), {portals} portals, by {by}: {}", strategy.reason),
        ];
        if let Some(expected) = &self.expected_draw {
            let saves = if is_verbose { expected.to_string() } else { expected.brief() };
            lines.push(format!("{saves}, on a walk through every cell"));
            lines.extend(expected.saves_nothing().then(|| self.advice()));
        }
        lines
    }

    /// What to do where portals and rows save nothing.
    fn advice(&self) -> String {
        let why = if self.cells == self.open_cells {
            format!("no cell is closed: {}", self.why_open.as_deref().unwrap_or_default())
        } else {
            format!("{} of {} cells are closed", self.cells - self.open_cells, self.cells)
        };
        format!(
            "portals and rows save nothing here ({why}); cull by occlusion queries: `walk --mode auto`, `FrameMode::Auto`"
        )
    }

    /// Both sides of what is seen, times, and what the file lacks.
    fn figures(&self) -> Vec<String> {
        let sides = |total: u64, lower: u64, upper: u64| {
            let (hidden, undecided) = (total - upper, upper - lower);
            format!("{lower} are witnessed visible, {hidden} proven hidden, {undecided} undecided")
        };
        let (p, stats, seconds) = (&self.pvs.summary, &self.pvs.stats, &self.seconds);
        let mut lines =
            vec![format!("of {} cell-object pairs {}", p.total_pairs, sides(p.total_pairs, p.lower_pairs, p.upper_pairs))];
        if let Some(v) = &self.view_cells {
            let total = v.total_pairs as u64;
            lines.push(format!("{} view cells: of {total} pairs {}", v.count, sides(total, v.lower_pairs, v.upper_pairs)));
        }
        lines.push(format!(
            "import {:.1} s, cells {:.1} s, visibility {:.1} s, {:.1} s in all",
            seconds.import, seconds.cells, seconds.pvs, seconds.total
        ));
        for (count, what) in [
            (self.closed_holes as u64, "holes are closed: what shows only through them is culled"),
            (stats.met_kept, "pairs that rays met only within the clearance of a surface count as visible"),
            (stats.met_left_out, "pairs that rays met only within the clearance of a surface are left out"),
            (self.repairs.len() as u64, "holes in the cell graph were found and mended"),
        ] {
            lines.extend((count > 0).then(|| format!("{count} {what}")));
        }
        lines.extend(self.left_out.iter().map(|line| format!("left out: {line}")));
        lines
    }

    /// What is wrong in what the author wrote.
    fn wrong(&self) -> Vec<String> {
        let (Some(authored), Some(findings)) = (&self.authored, self.findings.as_ref().filter(|all| !all.is_empty())) else {
            return Vec::new();
        };
        let AuthoredReport { rooms, sound_rooms, .. } = authored;
        let head = format!("{sound_rooms} of the {rooms} rooms that the model names can be used; what is wrong:");
        std::iter::once(head).chain(findings.iter().map(|finding| format!("  {}", finding.text))).collect()
    }
}

/// One line, whatever a name in the model holds.
fn one_line(what: &str, text: &str) -> String {
    format!("{what}: {}", text.split_whitespace().collect::<Vec<_>>().join(" "))
}
