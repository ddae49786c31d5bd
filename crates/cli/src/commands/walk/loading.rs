//! `enfilade walk --budget`.

use super::super::bake::size;
use super::{Args, Doors, Views, at, print_json};
use crate::commands::{CliError, Outcome};
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors as DoorStates};
use enfilade_measure::walkthrough::loading::{
    LoadingOptions, LoadingSummary, Method, RATE, WALK, object_bytes, walk_loading,
};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::stroll::Stroll;
use serde_json::json;

/// Aspect ratio of a frame.
const ASPECT: f64 = 16.0 / 9.0;
/// Larger budgets would hold all objects anyway.
const MOST_PERCENT: f64 = 1e6;

/// Flags.
#[derive(clap::Args)]
pub struct Flags {
    /// Measure loading instead of culling: memory for objects, bytes (K, M or G) or a share of all. The camera walks at 1.4 m/s,
    /// 60 frames a second; prints the objects missing if loaded by rows, and if loaded on demand
    #[arg(
        long,
        value_name = "SIZE|PERCENT%",
        value_parser = budget,
        conflicts_with_all = ["modes", "frames", "size", "verify_pixels", "min_pixels", "movers", "every"]
    )]
    budget: Option<Budget>,
    /// The disk: bytes per second, and extra seconds per load
    #[arg(long, value_name = "SIZE,SECONDS", value_parser = disk, default_value = "20M,0.05", requires = "budget")]
    disk: Disk,
}

/// Memory for objects.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Budget {
    Bytes(u64),
    /// Percent of all objects' bytes.
    Percent(f64),
}

fn budget(text: &str) -> Result<Budget, String> {
    let Some(number) = text.strip_suffix('%') else { return size(text).map(Budget::Bytes) };
    let percent = number.parse().ok().filter(|p| (0.0..=MOST_PERCENT).contains(p));
    percent.map(Budget::Percent).ok_or_else(|| "takes bytes, as in 512M, or percent, as in 20%".into())
}

/// The source of objects.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Disk {
    /// Bytes a second.
    bandwidth: u64,
    /// Extra seconds per load.
    latency: f64,
}

fn disk(text: &str) -> Result<Disk, String> {
    let wrong = || "takes bytes per second and seconds per load, as in 20M,0.05".to_owned();
    let (bandwidth, latency) = text.split_once(',').ok_or_else(wrong)?;
    let latency = latency.parse().ok().filter(|s: &f64| *s >= 0.0 && s.is_finite()).ok_or_else(wrong)?;
    Ok(Disk { bandwidth: size(bandwidth).map_err(|_| wrong())?, latency })
}

impl Flags {
    pub fn is_asked(&self) -> bool {
        self.budget.is_some()
    }
}

/// Walks, and prints a line per method.
pub fn run(args: &Args, file: &PvsFile) -> Result<Outcome, CliError> {
    let stroll = match &args.path {
        Some(Views::Random(_)) => return Err(CliError("--budget walks along a path, not through random views".into())),
        Some(Views::Path(path)) => Stroll::along(&CameraPath::load(path).map_err(|e| at(path, e))?, WALK / RATE),
        None => Stroll::through(file, args.seed, WALK / RATE),
    };
    if stroll.frames() == 0 {
        return Err(at(&args.file, "has no two cells to walk between; give a path with --path"));
    }
    let bytes = object_bytes(file);
    let all: u64 = bytes.iter().sum();
    let budget = match args.loading.budget {
        Some(Budget::Bytes(bytes)) => bytes,
        Some(Budget::Percent(percent)) => (all as f64 * percent / 1e2) as u64,
        None => all,
    };
    let culler = Culler::new(file);
    let doors = match args.doors {
        Doors::AsFound => DoorStates::as_found(&culler),
        Doors::Open => DoorStates::open(&culler),
    };
    let Disk { bandwidth, latency } = args.loading.disk;
    let options = LoadingOptions { budget, bandwidth: bandwidth as f64, latency, aspect: ASPECT };
    for method in [Method::Rows, Method::OnDemand] {
        let summary = walk_loading(file, (&culler, &doors), &bytes, &stroll, (method, &options), &mut |_| ());
        if args.json {
            print_json(&json!({ "loading": summary, "budget": budget, "bytes_all": all }))?;
        } else {
            crate::commands::answer(&prose(&summary, budget, all))?;
        }
    }
    Ok(Outcome::Done)
}

fn prose(s: &LoadingSummary, budget: u64, all: u64) -> String {
    let percent = |part: u64, of: u64| part as f64 * 1e2 / of.max(1) as f64;
    let megabytes = |bytes: u64| bytes as f64 / 1e6;
    format!(
        "{:9} {} frames, {} with missing objects ({:.3} %), {} objects; {} more after {} jumps; {:.1} MB loaded; at most {:.1} MB in memory, \
         budget {:.1} of {:.1} MB; {} frames need more than that; {:.1} us (p99 {:.1})",
        s.method,
        s.frames,
        s.frames_missing,
        percent(s.frames_missing, s.frames),
        s.objects_missing,
        s.after_jumps,
        s.jumps,
        megabytes(s.bytes_loaded),
        megabytes(s.bytes_most),
        megabytes(budget),
        megabytes(all),
        s.frames_over_budget,
        s.us[0],
        s.us[1]
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_are_bytes_or_percent() {
        assert_eq!(
            [budget("64K"), budget("20%"), budget("0%")],
            [Ok(Budget::Bytes(65536)), Ok(Budget::Percent(20.0)), Ok(Budget::Percent(0.0))]
        );
        for bad in ["", "%", "-1%", "nan%", "inf%", "1e9%", "0", "20 %", "5T"] {
            assert!(budget(bad).is_err(), "{bad}");
        }
        assert_eq!(disk("1M,0.5"), Ok(Disk { bandwidth: 1 << 20, latency: 0.5 }));
        for bad in ["", "1M", "1M,-0.1", "1M,nan", "1M,inf", "0,1", "x,1"] {
            assert!(disk(bad).is_err(), "{bad}");
        }
    }
}
