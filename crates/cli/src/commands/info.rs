//! `enfilade info`.

use super::files::Files;
use super::{CliError, Outcome, at};
use enfilade::file::{Container, FileSummary, PvsFile, load_bytes};
use enfilade::types::guarantee::Guarantee;
use enfilade_measure::walkthrough::expected::{ExpectedDraw, expected_draw};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The .pvs file.
    file: PathBuf,
    /// JSON on stdout, keys as in docs/cli.md.
    #[arg(long)]
    json: bool,
}

/// The command's JSON.
#[derive(serde::Serialize)]
struct InfoReport {
    #[serde(flatten)]
    file: FileSummary,
    expected_draw: Option<ExpectedDraw>,
}

impl Args {
    /// Input files.
    pub fn files(&self) -> Files {
        Files::new().reads(&self.file, &["pvs"])
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let bytes = load_bytes(&args.file)?;
    let container = Container::parse(&bytes).map_err(|e| at(&args.file, e))?;
    let file = PvsFile::read(&bytes).map_err(|e| at(&args.file, e))?;
    let report = InfoReport { file: FileSummary::of(&container, &file), expected_draw: expected_draw(&file) };
    super::answer(&if args.json { super::json(&report)? } else { prose(&report) })?;
    Ok(Outcome::Done)
}

/// Lines with a label each.
#[derive(Default)]
struct Lines(String);

impl Lines {
    /// Adds one line, whatever the text holds.
    fn add(&mut self, name: &str, what: &str) {
        // Writing into a String cannot fail.
        let _ = writeln!(self.0, "{name:<10} {}", what.split_whitespace().collect::<Vec<_>>().join(" "));
    }
}

fn percent(part: u64, all: u64) -> f64 {
    100.0 * part as f64 / (all as f64).max(1.0)
}

/// The contents of the file, in words.
fn prose(InfoReport { file: f, expected_draw }: &InfoReport) -> String {
    let mut out = Lines::default();
    out.add("file", &format!("version {}, {} bytes, for model {}", f.version, f.file_bytes, f.model_hash));
    out.add("guarantee", f.guarantee.in_words());
    out.add("", &format!("clearance {}: {}", length(f.clearance), Guarantee::STATEMENT));
    out.add("", &format!("openings narrower than {} may be sealed", length(f.smallest_hole)));
    let by = format!("{:?}", f.strategy).to_lowercase();
    out.add("cells", &format!("{} ({} open), {} portals, by {by}: {}", f.cells, f.open_cells, f.portals, f.reason));
    for (kind, s) in [("doors", &f.doors), ("windows", &f.windows)].into_iter().filter(|(_, s)| s.count != 0) {
        let [open, shut, ajar] = [s.open, s.shut, s.ajar];
        out.add(
            kind,
            &format!("{}: {open} open, {shut} shut ({ajar} of them ajar), {} see-through", s.count, s.see_through),
        );
    }
    out.add("objects", &format!("{} of {} triangles", f.objects, f.triangles));
    let p = &f.pvs;
    let kept = match f.guarantee {
        Guarantee::Conservative => p.upper_pairs,
        Guarantee::Sampled => p.lower_pairs,
    };
    out.add("rows", &format!("{:.0} % of the cell-object pairs are kept", percent(kept, p.total_pairs)));
    if let Some(expected) = expected_draw {
        out.add("expected", &format!("{expected}, on a path through every cell"));
    }
    let views = &f.view_cells;
    if views.count != 0 {
        let held = format!("rows hold {} of {} pairs with objects", views.pairs, views.total_pairs);
        out.add("view cells", &format!("{}: {held}, {} bytes", views.count, views.row_bytes));
    }
    figures(f, &mut out);
    for (i, note) in f.notes.iter().enumerate() {
        out.add(if i == 0 { "notes" } else { "" }, note);
    }
    out.0
}

/// Bounds of the visible pairs, bytes, and parts left out of the file.
fn figures(f: &FileSummary, out: &mut Lines) {
    let p = &f.pvs;
    for (label, name, [lower, upper, undecided, all]) in [
        ("pairs", "cell", [p.cell_lower_pairs, p.cell_upper_pairs, p.cell_undecided_pairs, p.cell_total_pairs]),
        ("", "object", [p.lower_pairs, p.upper_pairs, p.undecided_pairs, p.total_pairs]),
    ] {
        let [seen, not_hidden] = [lower, upper].map(|part| percent(part, all));
        let what =
            format!("{seen:.2} % proven visible, {not_hidden:.2} % not proven hidden; {undecided} of {all} undecided");
        out.add(label, &format!("cell-{name}: {what}"));
    }
    for (label, name, bytes, bits, entropy) in [
        ("bytes", "cell", p.cell_row_bytes, p.cell_bits_per_pair, p.cell_entropy_bits_per_pair),
        ("", "object", p.row_bytes, p.bits_per_pair, p.entropy_bits_per_pair),
    ] {
        out.add(label, &format!("cell-{name}: {bytes} bytes, {bits:.4} bits a pair (zero-order entropy {entropy:.4})"));
    }
    let sections: Vec<String> = f.sections.iter().map(|s| format!("{} {}", s.name, s.bytes)).collect();
    out.add("sections", &sections.join(", "));
    for (i, line) in f.left_out.iter().enumerate() {
        out.add(if i == 0 { "left out" } else { "" }, line);
    }
    out.add("repairs", &f.repairs.to_string());
}

/// Units of length: least metres, name, factor.
const UNITS: [(f64, &str, f64); 4] =
    [(1e3, "km", 1e-3), (0.1, "m", 1.0), (1e-5, "mm", 1e3), (f64::MIN_POSITIVE, "\u{b5}m", 1e6)];

/// A length in a readable unit, to three significant digits.
fn length(metres: f64) -> String {
    let (_, name, scale) = UNITS.into_iter().find(|&(from, ..)| metres >= from).unwrap_or(UNITS[1]);
    let number = metres * scale;
    let whole_digits = if number >= 1.0 { number.log10() as usize + 1 } else { 0 };
    // Zeros after the point don't count as digits: `0.0125` has three.
    let zeros = if number > 0.0 && number < 1.0 { (-number.log10()) as usize } else { 0 };
    let decimals = if number == 0.0 { 0 } else { 3usize.saturating_sub(whole_digits) + zeros };
    format!("{number:.decimals$} {name}")
}

#[cfg(test)]
mod tests {
    use super::length;

    #[test]
    fn lengths_are_in_the_unit_that_reads_best() {
        for (metres, text) in [
            (0.0, "0 m"),
            (2.5e-7, "0.250 \u{b5}m"),
            (5e-6, "5.00 \u{b5}m"),
            (1.25e-5, "0.0125 mm"),
            (0.00029, "0.290 mm"),
            (0.0125, "12.5 mm"),
            (0.29074, "0.291 m"),
            (1.0, "1.00 m"),
            (290.74, "291 m"),
            (29_074.0, "29.1 km"),
        ] {
            assert_eq!(length(metres), text, "{metres}");
        }
    }
}
