//! The result of a bake in a few lines of prose.

use super::report::BakeReport;

/// Most lines; `--json` and `info` have the rest.
pub const LINES: usize = 8;

impl BakeReport {
    /// The lines that `bake` prints after it has written the file `output`: at most [`LINES`].
    pub fn prose(&self, output: &str) -> String {
        let mut lines = self.head();
        // The last line is about the file.
        let room = LINES.saturating_sub(lines.len() + 1);
        lines.extend(self.most_important(output, room));
        lines.push(format!("{output}: {} bytes, in {:.1} s", self.file_bytes, self.seconds.total));
        lines.join("\n")
    }

    /// The most important notes, in at most `room` lines; the last line counts the others.
    fn most_important(&self, output: &str, room: usize) -> Vec<String> {
        let findings = self.findings.as_deref().unwrap_or_default();
        let finding = findings.first().map(|first| {
            let count = findings.len();
            format!(
                "{count} mismatches of the model's rooms and doors with its walls (--json lists them), such as: {}",
                first.text
            )
        });
        let notes: Vec<&String> = finding.iter().chain(&self.notes).collect();
        let shown = if notes.len() > room { room.saturating_sub(1) } else { notes.len() };
        let mut lines: Vec<String> = notes[..shown].iter().map(|note| one_line("note", note)).collect();
        lines.extend(
            (shown < notes.len())
                .then(|| format!("and {} more notes: `enfilade info {output}` shows them", notes.len() - shown)),
        );
        lines
    }

    /// The model, its cells, and what they save.
    fn head(&self) -> Vec<String> {
        let Self { triangles, objects, cells, open_cells, portals, strategy, .. } = self;
        let by = format!("{:?}", strategy.cells).to_lowercase();
        let mut lines = vec![
            format!("{triangles} triangles in {objects} objects"),
            format!("{cells} cells ({open_cells} open), {portals} portals, by {by}: {}", strategy.reason),
        ];
        lines.extend(self.since.map(|since| since.to_string()));
        if let Some(expected) = &self.expected_draw {
            lines.push(format!("{}, on a walk through every cell", expected.brief()));
            lines.extend(expected.saves_nothing().then(|| self.advice()));
        }
        lines
    }

    /// Advice if portals and rows save nothing.
    fn advice(&self) -> String {
        let why = if self.cells == self.open_cells {
            format!("no cell is closed: {}", self.why_open.as_deref().unwrap_or_default())
        } else {
            format!("{} of {} cells are closed", self.cells - self.open_cells, self.cells)
        };
        format!("portals and rows save nothing here ({why}); cull by occlusion queries: `walk --mode auto`, `Mode::Auto`")
    }
}

/// One line, even if a name in the model has line breaks.
fn one_line(what: &str, text: &str) -> String {
    format!("{what}: {}", text.split_whitespace().collect::<Vec<_>>().join(" "))
}
