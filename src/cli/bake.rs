//! `enfilade bake`.

use super::resume::{Kept, catch_interrupts};
use super::scene::SceneFlags;
use super::{CliError, Outcome, at};
use clap::ValueEnum;
use enfilade::bake::{BakeError, BakeOptions, Baked, bake, digest};
use enfilade::cells::{ViewCell, read_view_cells};
use enfilade::file::{Container, load_bytes};
use enfilade::pvs::cubes::Choice;
use enfilade::pvs::{Guarantee, PvsOptions};
use enfilade::scene::{Scene, import};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Most findings that prose lists.
const FINDINGS: usize = 12;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The scene: .glb, .gltf, .obj, .ifc, or .gml (IndoorGML), whose cell spaces are the cells
    input: PathBuf,
    /// The file to write [default: INPUT with the extension .pvs]
    #[arg(short, long, value_name = "OUT.pvs")]
    output: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneFlags,
    /// Regions to work out rows for on top of the cells, as camera volumes
    #[arg(long, value_name = "V.json")]
    view_cells: Option<PathBuf>,
    /// Which side of the truth the rows take
    #[arg(long, value_enum, default_value = "conservative")]
    ship: Ship,
    /// Keep both sides and the witnesses in the file
    #[arg(long)]
    keep_bounds: bool,
    /// What draws visibility cubes; with gpu the bytes may depend on the driver
    #[arg(long, value_enum, default_value = "raster")]
    cubes: Cubes,
    /// What rows and proofs may take while they are worked out: bytes, or with K, M or G; with less, cells are joined and rows coarser
    #[arg(long, value_name = "SIZE", value_parser = size, default_value = "8G")]
    memory: u64,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// What an interrupted bake leaves, and the next goes on from [default: the output's name with .bake-state]
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Print JSON to stdout
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Ship {
    Conservative,
    Sampled,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Cubes {
    Raster,
    Gpu,
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    args.scene.check()?;
    catch_interrupts()?;
    super::pool(args.threads)?.install(|| bake_file(&args))
}

fn bake_file(args: &Args) -> Result<Outcome, CliError> {
    let begin = Instant::now();
    let bar = progress_bar();
    bar.set_message("import");
    let import_options = args.scene.import();
    let scene = import(&args.input, &import_options).map_err(|e| at(&args.input, e))?;
    let cubes = choice(args.cubes, &scene)?;
    let import_seconds = begin.elapsed().as_secs_f64();
    let given = args.scene.given(&args.input, &scene)?;
    let view_cells = args.view_cells.as_deref().map(|path| view_cells(path, &scene)).transpose()?.unwrap_or_default();
    let options = BakeOptions {
        split: args.scene.split(),
        pvs: PvsOptions {
            ship: match args.ship {
                Ship::Conservative => Guarantee::Conservative,
                Ship::Sampled => Guarantee::Sampled,
            },
            seed: args.seed,
            ray_budget: args.scene.ray_budget(),
            cubes,
            ..PvsOptions::default()
        },
        keep_bounds: args.keep_bounds,
        given,
        view_cells,
        import: import_options,
        memory: args.memory,
    };
    let progress = |stage: &str, done: f64| {
        bar.set_message(stage.to_owned());
        bar.set_position((done * 1000.0) as u64);
    };
    let output = args.output.clone().unwrap_or_else(|| args.input.with_extension("pvs"));
    let kept = Kept::open(args.state.as_deref(), &output, digest(&scene, &options), "bake-state")?;
    let baked = bake(&scene, options, &kept.work(&progress));
    bar.finish_and_clear();
    let baked = match baked {
        Ok(baked) => baked,
        Err(BakeError::Stopped(_)) => return kept.stopped(),
        Err(e) => {
            kept.done()?;
            return Err(at(&args.input, e));
        }
    };
    baked.file.save(&output).map_err(|e| at(&output, e))?;
    kept.done()?;
    let bytes = load_bytes(&output).map_err(|e| at(&output, e))?;
    let container = Container::parse(&bytes).map_err(|e| at(&output, e))?;
    let report = report(&scene, &baked, &container, import_seconds, begin.elapsed().as_secs_f64(), bytes.len());
    if args.json {
        println!("{report:#}");
    } else {
        eprintln!("{}", prose(&report, &output));
    }
    Ok(Outcome::Done)
}

/// Bytes, as `512M`; powers of 1024.
fn size(text: &str) -> Result<u64, String> {
    let (digits, power) = match text.char_indices().next_back() {
        Some((at, 'K' | 'k')) => (&text[..at], 10),
        Some((at, 'M' | 'm')) => (&text[..at], 20),
        Some((at, 'G' | 'g')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let bytes = digits.parse::<u64>().ok().and_then(|n| n.checked_mul(1 << power)).filter(|&n| n > 0);
    bytes.ok_or_else(|| "takes bytes, above 0, as in 512M".into())
}

/// The engine that is asked for; an error where there is none.
fn choice(cubes: Cubes, scene: &Scene) -> Result<Choice, CliError> {
    Ok(match cubes {
        Cubes::Raster => Choice::Raster,
        Cubes::Gpu => on_gpu(scene)?,
    })
}

#[cfg(feature = "gpu")]
fn on_gpu(scene: &Scene) -> Result<Choice, CliError> {
    let checked = enfilade::pvs::cubes::gpu::GpuScene::check(scene);
    checked.map(|_| Choice::Gpu).map_err(|e| CliError(format!("--cubes gpu: {e}")))
}

#[cfg(not(feature = "gpu"))]
fn on_gpu(_: &Scene) -> Result<Choice, CliError> {
    Err(CliError("--cubes gpu: this binary draws no cubes on a graphics processor; build it with `--features gpu`".into()))
}

fn view_cells(path: &Path, scene: &Scene) -> Result<Vec<ViewCell>, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| at(path, e))?;
    read_view_cells(&text, scene).map_err(|e| at(path, e))
}

/// A bar with the time still to go, where that can be said, on a terminal; nothing elsewhere.
pub(super) fn progress_bar() -> indicatif::ProgressBar {
    let style = indicatif::ProgressStyle::with_template("{msg:12} [{bar:40}] {percent:>3} %  {elapsed} (still {left})");
    let bar = indicatif::ProgressBar::new(1000);
    if let Ok(style) = style {
        let left = |state: &indicatif::ProgressState, out: &mut dyn std::fmt::Write| {
            // A stage that has told nothing yet, or never does.
            let _ = match state.pos() {
                0 => out.write_str("?"),
                _ => write!(out, "{:#}", indicatif::HumanDuration(state.eta())),
            };
        };
        bar.set_style(style.progress_chars("=> ").with_key("left", left));
    }
    // Long searches say little; the clock goes on.
    bar.enable_steady_tick(std::time::Duration::from_millis(500));
    bar
}

/// The keys of `bake --json`; docs/cli.md says what each means.
pub(super) fn report(
    scene: &Scene,
    baked: &Baked,
    container: &Container<'_>,
    import: f64,
    total: f64,
    bytes: usize,
) -> Value {
    let file = &baked.file;
    let (cells, objects) = (file.cells.len(), file.objects.len());
    let mut pvs = super::info::pvs(container, file);
    for (key, value) in [
        ("rays", file.stats.rays),
        ("cubes", file.stats.cubes),
        ("flow_steps", file.stats.flow_steps),
        ("flow_capped", file.stats.flow_capped),
        ("cracks", file.stats.cracks),
        ("contradictions", file.stats.contradictions),
    ] {
        pvs[key] = value.into();
    }
    let mut report = json!({
        "triangles": scene.triangles.len(),
        "objects": objects,
        "cells": cells,
        "open_cells": file.cells.iter().filter(|c| c.open).count(),
        "portals": file.portals.len(),
        "strategy": { "cells": file.strategy, "reason": file.reason },
        "left_out": file.left_out,
        "notes": file.notes,
        "pvs": pvs,
        "smallest_hole": file.smallest_hole,
        "repairs": file.repairs,
        "cells_found": baked.cells_found.unwrap_or(cells),
        "seconds": {
            "import": import,
            "cells": baked.seconds.cells,
            "pvs": baked.seconds.pvs,
            "total": total,
        },
        "peak_rss_mb": peak_rss_mb(),
        "file_bytes": bytes,
    });
    if let Some(views) = &baked.views {
        let (lower, upper) = (views.lower.count_ones(), views.upper.count_ones());
        report["view_cells"] = json!({
            "count": views.upper.rows(),
            "lower_pairs": lower,
            "upper_pairs": upper,
            "undecided_pairs": upper - lower,
            "total_pairs": views.upper.rows() * views.upper.columns(),
            "in_no_cell": views.in_no_cell.len(),
            "unseen": views.unseen,
            "rays": views.rays,
            "flow_capped": views.capped,
            "contradictions": views.contradictions,
        });
    }
    if let Some(audit) = &baked.audit {
        report["authored"] = json!({ "rooms": audit.rooms, "sound_rooms": audit.sound_rooms, "claimed": audit.claimed });
        report["findings"] = json!(audit.findings);
    }
    report
}

fn prose(report: &Value, output: &Path) -> String {
    let n = |p: &str| report.pointer(p).map(ToString::to_string).unwrap_or_default();
    let s = |p: &str| report.pointer(p).and_then(Value::as_f64).unwrap_or_default();
    let mut lines = vec![
        format!("{} triangles in {} objects", n("/triangles"), n("/objects")),
        format!(
            "{} cells ({} open), {} portals, by {}: {}",
            n("/cells"),
            n("/open_cells"),
            n("/portals"),
            n("/strategy/cells"),
            n("/strategy/reason"),
        ),
        format!(
            "of {} cell-object pairs {} are witnessed visible, {} proven hidden, {} undecided",
            n("/pvs/total_pairs"),
            n("/pvs/lower_pairs"),
            s("/pvs/total_pairs") - s("/pvs/upper_pairs"),
            n("/pvs/undecided_pairs"),
        ),
        format!(
            "import {:.1} s, cells {:.1} s, visibility {:.1} s, {:.1} s in all",
            s("/seconds/import"),
            s("/seconds/cells"),
            s("/seconds/pvs"),
            s("/seconds/total"),
        ),
    ];
    if report.get("view_cells").is_some() {
        let (count, total, lower) = (n("/view_cells/count"), n("/view_cells/total_pairs"), n("/view_cells/lower_pairs"));
        let hidden = s("/view_cells/total_pairs") - s("/view_cells/upper_pairs");
        let undecided = n("/view_cells/undecided_pairs");
        lines.push(format!(
            "{count} view cells: of {total} pairs {lower} are witnessed visible, {hidden} proven hidden, {undecided} undecided"
        ));
    }
    let list = |p: &str| report.pointer(p).and_then(Value::as_array).cloned().unwrap_or_default();
    lines.extend(list("/left_out").iter().filter_map(Value::as_str).map(|x| format!("left out: {x}")));
    let findings = list("/findings");
    if !findings.is_empty() {
        let (rooms, sound) = (n("/authored/rooms"), n("/authored/sound_rooms"));
        lines.push(format!("of {rooms} rooms that the author drew {sound} are sound; what is wrong:"));
        let text = findings.iter().filter_map(|f| f["text"].as_str());
        lines.extend(text.take(FINDINGS).map(|text| format!("  {text}")));
        if findings.len() > FINDINGS {
            lines.push(format!("  and {} more (--json)", findings.len() - FINDINGS));
        }
    }
    if !list("/repairs").is_empty() {
        lines.push(format!("{} holes in the cell graph were found and mended", list("/repairs").len()));
    }
    lines.push(format!("{}: {} bytes", output.display(), n("/file_bytes")));
    lines.join("\n")
}

/// The most memory that this process has held, MiB, where the system says so.
pub(super) fn peak_rss_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some((kib / 1024.0 * 10.0).round() / 10.0)
}
