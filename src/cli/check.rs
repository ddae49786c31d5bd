//! `enfilade check`.

use super::{CliError, Outcome, at};
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::pvs::Guarantee;
use enfilade::report::check::{CheckError, CheckOptions, CheckReport, Violation, check};
use enfilade::scene::{Scene, import};
use std::path::PathBuf;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The file that `bake` wrote.
    #[arg(value_name = "OUT.pvs")]
    file: PathBuf,
    /// The model that it was baked for.
    #[arg(long, value_name = "INPUT")]
    model: PathBuf,
    /// Rays; each is tested against the rows and followed through the portals.
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().rays)]
    rays: u64,
    /// Views of 96 x 54 rays.
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().views)]
    views: u32,
    /// Seed of every random choice.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print JSON to stdout.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let file = PvsFile::load(&args.file).map_err(|e| at(&args.file, e))?;
    let scene = import(&args.model, &file.import.options()).map_err(|e| at(&args.model, e))?;
    let options = CheckOptions { rays: args.rays, views: args.views, seed: args.seed };
    let report = check(&file, &scene, &options).map_err(|e| match e {
        CheckError::OtherModel { .. } => at(&args.model, e),
        _ => at(&args.file, e),
    })?;
    if args.json {
        let text = serde_json::to_string(&report).map_err(|e| CliError(e.to_string()))?;
        println!("{text}");
    }
    tell(&report, &file, &scene);
    Ok(if report.passed { Outcome::Done } else { Outcome::Failed })
}

fn tell(r: &CheckReport, file: &PvsFile, scene: &Scene) {
    let promise = match r.guarantee {
        Guarantee::Conservative => "conservative",
        Guarantee::Sampled => "sampled",
    };
    eprintln!(
        "{} rays ({promise} rows): {} missed, {} cell-object pairs, {} cell-cell pairs",
        r.rays, r.missed_rays, r.missed_pairs, r.missed_cell_pairs
    );
    eprintln!("{} segments: {} left a cell other than through a portal", r.segments, r.missed_segments);
    eprintln!(
        "{} violations through cracks narrower than {:.4} m, which are promised nothing",
        r.crack_rays, file.smallest_hole
    );
    let percent = |x: f64| x * 100.0;
    let f = &r.false_pixels;
    eprintln!(
        "{} views: false pixels {:.4} % mean, {:.4} % p95, {:.4} % max",
        r.views,
        percent(f.mean),
        percent(f.p95),
        percent(f.max)
    );
    if r.empty_cells > 0 {
        eprintln!("{} cells have no volume; nothing was cast from them", r.empty_cells);
    }
    for e in &r.examples {
        let name =
            |cell: Option<CellId>| cell.map_or("no cell".into(), |c| format!("cell {c} ({})", file.cells[c.index()].name));
        let object = e.object.map_or(String::new(), |o| format!("object {o} ({})", scene.objects[o.index()].node));
        let [a, b] = e.cells.map(name);
        match e.violation {
            Violation::Object => eprintln!("  {a} doesn't list {object}, seen from {:.3} at {:.3}", e.from, e.at),
            Violation::Cell => eprintln!("  {a} doesn't list {b}, seen from {:.3} at {:.3}", e.from, e.at),
            Violation::Segment => eprintln!("  from {a} into {b} without a portal at {:.3}, seen from {:.3}", e.at, e.from),
        }
    }
    eprintln!("{} in {:.1} s", if r.passed { "passed" } else { "failed" }, r.seconds);
}
