//! `enfilade info`.

use super::{CliError, Outcome, at};
use enfilade::cells::{PortalKind, PortalState};
use enfilade::file::{Container, Gap, PvsFile, SectionId, VERSION, entropy_bits_per_pair, load_bytes};
use enfilade::types::bounds::CONFIDENCE;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::io::{self, Write as _};
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

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let bytes = load_bytes(&args.file).map_err(|e| at(&args.file, e))?;
    let container = Container::parse(&bytes).map_err(|e| at(&args.file, e))?;
    let file = PvsFile::read(&bytes).map_err(|e| at(&args.file, e))?;
    let facts = facts(&container, &file);
    let text = if args.json { format!("{facts:#}\n") } else { prose(&facts) };
    match io::stdout().write_all(text.as_bytes()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(CliError(format!("stdout: {e}"))),
        _ => Ok(Outcome::Done),
    }
}

/// Everything that the command says; the prose is made of this, too.
fn facts(container: &Container<'_>, file: &PvsFile) -> Value {
    let (cells, objects) = (file.cells.len() as u64, file.objects.len() as u64);
    let sections: Vec<Value> = container
        .sections()
        .iter()
        .map(|s| json!({ "id": s.number, "name": s.name(), "bytes": s.bytes, "decoded_bytes": s.decoded }))
        .collect();
    json!({
        "version": VERSION,
        "file_bytes": container.file_bytes(),
        "model_hash": format!("{:032x}", file.model_hash),
        "guarantee": file.guarantee,
        "strategy": file.strategy,
        "reason": file.reason,
        "smallest_hole": file.smallest_hole,
        "origin": file.origin.to_array(),
        "import": file.import,
        "cells": cells,
        "open_cells": file.cells.iter().filter(|c| c.open).count(),
        "portals": file.portals.len(),
        "doors": states(file, PortalKind::Door),
        "windows": states(file, PortalKind::Window),
        "objects": objects,
        "triangles": file.objects.iter().map(|o| u64::from(o.triangles)).sum::<u64>(),
        "pvs": pvs(container, file),
        "stats": file.stats,
        "sections": sections,
        "left_out": file.left_out,
        "notes": file.notes,
        "repairs": file.repairs.len(),
        "view_cells": view_cells(container, file),
    })
}

/// View cells, and what their rows take.
fn view_cells(container: &Container<'_>, file: &PvsFile) -> Value {
    let total = (file.views.cells.len() * file.objects.len()) as u64;
    let set = file.views.rows.as_ref().map_or(total, |rows| rows.count_ones());
    let bytes = container.section(SectionId::ViewRows).map_or(0, |s| s.bytes);
    json!({ "count": file.views.cells.len(), "pairs": set, "total_pairs": total, "row_bytes": bytes })
}

/// How many portals of a kind there are, and how they stand.
fn states(file: &PvsFile, kind: PortalKind) -> Value {
    let of = file.portals.iter().filter(|p| p.kind == kind).map(|p| p.state);
    let count = |wanted: fn(&PortalState) -> bool| of.clone().filter(wanted).count();
    json!({
        "count": of.clone().count(),
        "open": count(|s| !s.shut),
        "shut": count(|s| s.shut),
        "see_through": count(|s| s.see_through),
        "closable": count(|s| s.closable),
        "ajar": count(|s| s.ajar),
    })
}

/// What is undecided from closed cells, by kind, and apart from that what is from open ones.
fn gap(file: &PvsFile) -> Value {
    let known = (file.pairs.upper == file.pairs.lower).then(Gap::default);
    let Some(gap) = file.gap.or(known) else { return Value::Null };
    let (undecided, upper) = (gap.closed(), gap.closed_upper);
    json!({
        "closed": undecided as f64 / upper.max(1) as f64,
        "closed_upper_pairs": file.gap.map(|_| upper),
        "tolerance_pairs": gap.tolerance,
        "inside_pairs": gap.inside,
        "budget_pairs": gap.budget,
        "open_cells_pairs": gap.open,
    })
}

/// The `pvs.*` keys, the same as those of `bake --json`.
pub(super) fn pvs(container: &Container<'_>, file: &PvsFile) -> Value {
    let (cells, objects) = (file.cells.len() as u64, file.objects.len() as u64);
    let (pairs, total, cell_total) = (&file.pairs, cells * objects, cells * cells);
    let row_bytes = |id| container.section(id).map_or(0, |s| s.bytes);
    let (object_bytes, cell_bytes) = (row_bytes(SectionId::ObjectRows), row_bytes(SectionId::CellRows));
    let bits = |bytes: u64, pairs: u64| if pairs == 0 { 0.0 } else { bytes as f64 * 8.0 / pairs as f64 };
    let set = |rows: &Option<enfilade::BitMatrix>, all| rows.as_ref().map_or(all, |m| m.count_ones());
    json!({
        "guarantee": file.guarantee,
        "unseen": file.unseen.as_ref().map(|unseen| {
            let closed = unseen.cells.iter().zip(&file.cells).filter(|(_, cell)| !cell.open).map(|(&bound, _)| bound);
            json!({ "mean": unseen.mean, "max_closed": closed.reduce(f32::max), "confidence": CONFIDENCE })
        }),
        "gap": gap(file),
        "lower_pairs": pairs.lower,
        "upper_pairs": pairs.upper,
        "undecided_pairs": pairs.upper - pairs.lower,
        "total_pairs": total,
        "cell_lower_pairs": pairs.cell_lower,
        "cell_upper_pairs": pairs.cell_upper,
        "cell_undecided_pairs": pairs.cell_upper - pairs.cell_lower,
        "cell_total_pairs": cell_total,
        "row_bytes": object_bytes,
        "bits_per_pair": bits(object_bytes, total),
        "entropy_bits_per_pair": entropy_bits_per_pair(set(&file.object_rows, total), total),
        "cell_row_bytes": cell_bytes,
        "cell_bits_per_pair": bits(cell_bytes, cell_total),
        "cell_entropy_bits_per_pair": entropy_bits_per_pair(set(&file.cell_rows, cell_total), cell_total),
    })
}

fn prose(f: &Value) -> String {
    let text = |v: &Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    let p = &f["pvs"];
    let number = |key: &str| p[key].as_f64().unwrap_or_default();
    let percent = |key: &str, all: &str| 100.0 * number(key) / number(all).max(1.0);
    let mut out = String::new();
    let mut line = |name: &str, what: String| {
        // One line, whatever a name in the file holds. Writing into a String cannot fail.
        let what = what.split_whitespace().collect::<Vec<_>>().join(" ");
        let _ = writeln!(out, "{name:<10} {what}");
    };
    line("file", format!("version {}, {} bytes, for model {}", f["version"], f["file_bytes"], text(&f["model_hash"])));
    let promise = match text(&f["guarantee"]).as_str() {
        "conservative" => "conservative: nothing visible is missing from the rows",
        _ => "sampled: what is in the rows is visible, something visible may be missing",
    };
    line("guarantee", promise.to_owned());
    line(
        "cells",
        format!(
            "{} ({} open), {} portals, strategy {}: {}",
            f["cells"],
            f["open_cells"],
            f["portals"],
            text(&f["strategy"]),
            text(&f["reason"])
        ),
    );
    line(
        "",
        format!("openings narrower than {:.3} mm may be sealed", f["smallest_hole"].as_f64().unwrap_or_default() * 1e3),
    );
    for kind in ["doors", "windows"] {
        let s = &f[kind];
        if s["count"] != 0 {
            let how = format!(
                "{}: {} open, {} shut ({} of them ajar), {} see-through",
                s["count"], s["open"], s["shut"], s["ajar"], s["see_through"]
            );
            line(kind, how);
        }
    }
    line("objects", format!("{} of {} triangles", f["objects"], f["triangles"]));
    for (name, key, all) in [("cell", "cell_", "cell_total_pairs"), ("object", "", "total_pairs")] {
        let [lower, upper, undecided] = ["lower", "upper", "undecided"].map(|side| format!("{key}{side}_pairs"));
        line(
            if key.is_empty() { "" } else { "pairs" },
            format!(
                "cell-{name}: {:.2} % proven visible, {:.2} % not proven hidden; {} of {} undecided",
                percent(&lower, all),
                percent(&upper, all),
                p[&undecided],
                p[all],
            ),
        );
    }
    for (name, key) in [("cell", "cell_"), ("object", "")] {
        let of = |what: &str| number(&format!("{key}{what}"));
        line(
            if key.is_empty() { "" } else { "rows" },
            format!(
                "cell-{name}: {} bytes, {:.4} bits a pair (zero-order entropy {:.4})",
                of("row_bytes"),
                of("bits_per_pair"),
                of("entropy_bits_per_pair")
            ),
        );
    }
    let views = &f["view_cells"];
    if views["count"] != 0 {
        let [count, pairs, total, bytes] = ["count", "pairs", "total_pairs", "row_bytes"].map(|key| text(&views[key]));
        line("view cells", format!("{count}: rows hold {pairs} of {total} pairs with objects, {bytes} bytes"));
    }
    let entries = |key: &str| f[key].as_array().cloned().unwrap_or_default();
    line(
        "sections",
        entries("sections").iter().map(|s| format!("{} {}", text(&s["name"]), s["bytes"])).collect::<Vec<_>>().join(", "),
    );
    for (name, key) in [("left out", "left_out"), ("notes", "notes")] {
        let lines = entries(key);
        for (i, one) in lines.iter().take(SHOWN).enumerate() {
            line(if i == 0 { name } else { "" }, text(one));
        }
        if lines.len() > SHOWN {
            line("", format!("and {} more (--json)", lines.len() - SHOWN));
        }
    }
    line("repairs", f["repairs"].to_string());
    out
}

/// Lines of a kind that fit on the one screen.
const SHOWN: usize = 6;
