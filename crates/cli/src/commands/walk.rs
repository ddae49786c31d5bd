//! `enfilade walk`.

mod loading;

use super::files::Files;
use super::kinds::Kind;
use super::{CliError, Outcome, at};
use enfilade::file::PvsFile;
use enfilade::pvs::Guarantee;
use enfilade::runtime::Mode;
use enfilade::scene::{ImportOptions, Picture, Scene};
use enfilade_formats::import;
use enfilade_measure::verify::random_path;
use enfilade_measure::walkthrough::crowd::CrowdSeen;
use enfilade_measure::walkthrough::mode::WalkMode;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::tour::tour;
use enfilade_measure::walkthrough::walk::{FrameLine, Summary, WalkOptions, picture_path, walk};
use enfilade_tubes::usual_sides;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The .pvs file
    file: PathBuf,
    /// The file's model
    #[arg(long)]
    model: PathBuf,
    #[command(flatten)]
    files: super::FilesFlag,
    /// A camera path, or N random views [default: a path through every cell]
    #[arg(long, value_name = "P.json|random:N", value_parser = views)]
    path: Option<Views>,
    #[arg(
        long = "mode",
        value_name = "MODE",
        default_value = "both",
        help = format!(
            "Culling mode: {}, or all of these; or exact: visible triangles only, in milliseconds per frame. May be repeated",
            Mode::ALL.map(Mode::name).join(", ")
        )
    )]
    modes: Vec<String>,
    /// Write a picture of every frame into this folder; frames are compared as with --verify-pixels
    #[arg(long, value_name = "DIR")]
    frames: Option<PathBuf>,
    /// Size of the pictures, pixels
    #[arg(long, default_value = "640x360", value_name = "WxH")]
    size: String,
    /// Leave out objects whose boxes cover fewer than N pixels; 1 leaves out those that cover none, 0 is no limit. Each value is a separate walk
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', default_value = "0")]
    min_pixels: Vec<u32>,
    /// Boxes that walk about through doors, 0 to 100,000; their pixels are compared, too, and a missed one fails
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=100_000), value_name = "N")]
    movers: u32,
    /// Compare every frame with a picture of everything; exit 1 if a conservative file misses a pixel, or --min-pixels pixels of
    /// one object
    #[arg(long)]
    verify_pixels: bool,
    /// Take every n-th frame of the path
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), value_name = "N")]
    every: u32,
    /// Doors: all open, or shut where the model has a shut solid leaf
    #[arg(long, value_enum, default_value_t)]
    doors: Doors,
    /// Seed of the path through every cell, or of the random views
    #[arg(long, default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    loading: loading::Flags,
    /// JSON on stdout: a line per frame, then a summary per mode; with --budget, a line per method
    #[arg(long)]
    json: bool,
}

/// Positions of the cameras.
#[derive(Clone)]
pub enum Views {
    Path(PathBuf),
    Random(u32),
}

impl Views {
    fn path(&self) -> Option<&PathBuf> {
        if let Self::Path(path) = self { Some(path) } else { None }
    }
}

/// Most random views.
const MOST_VIEWS: u32 = 100_000;

fn views(text: &str) -> Result<Views, String> {
    let Some(count) = text.strip_prefix("random:") else { return Ok(Views::Path(text.into())) };
    let count = count.parse().ok().filter(|n| (1..=MOST_VIEWS).contains(n)).map(Views::Random);
    count.ok_or_else(|| format!("takes 1 to {MOST_VIEWS} random views, as in random:100"))
}

/// State of the doors.
#[derive(Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
enum Doors {
    /// All open.
    #[default]
    Open,
    /// As the model has them.
    AsFound,
}

impl Args {
    /// Input and output files.
    pub fn files(&self) -> Files {
        let files = Files::new().reads(&self.file, &["pvs"]).model(&self.model).reads_too(self.files.paths());
        files.reads_too(self.path.as_ref().and_then(Views::path)).fills(&self.frames)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let (width, height) = size(&args.size)?;
    let modes = modes(&args.modes)?;
    let (file, scene) = read(&args)?;
    if args.loading.is_asked() {
        return loading::run(&args, &file);
    }
    let files = args.files();
    let scene = scene.meshed(usual_sides);
    let path = match &args.path {
        Some(Views::Path(path)) => CameraPath::load(path).map_err(|e| at(path, e))?,
        Some(Views::Random(count)) => random_path(&scene, &file, *count, args.seed),
        None => tour(&file, args.seed),
    };
    if path.frames.is_empty() {
        return Err(at(&args.file, "has no cell to walk through; give a path with --path"));
    }
    let min_pixels = args.min_pixels;
    if args.frames.is_some() && min_pixels.len() > 1 {
        return Err(CliError("--frames takes pictures of one walk; give one --min-pixels".into()));
    }
    let every = args.every as usize;
    if let Some(folder) = &args.frames {
        let named = named_pictures(&scene, &args.model);
        let frames = (0..path.frames.len()).step_by(every);
        let pictures = frames.flat_map(|frame| modes.iter().map(move |mode| picture_path(folder, frame, *mode)));
        make_folder(folder, files.reads_too(&named), pictures)?;
    }
    let (verify_pixels, pictures, movers) = (args.verify_pixels, args.frames, args.movers as usize);
    let doors_as_found = args.doors == Doors::AsFound;
    let options = WalkOptions { modes, width, height, verify_pixels, pictures, every, doors_as_found, min_pixels, movers };
    let mut printed = Ok(());
    let mut print = |line: &FrameLine| {
        if printed.is_ok() && args.json {
            printed = print_json(&json!(line));
        }
    };
    let folder = options.pictures.clone().unwrap_or_default();
    let summaries = walk(&scene, &file, &path, &options, &mut print).map_err(|e| at(&folder, e))?;
    printed?;
    for summary in &summaries {
        if args.json {
            print_json(&json!({ "summary": summary }))?;
        } else {
            super::answer(&prose(summary, file.objects.iter().map(|o| u64::from(o.triangles)).sum()))?;
        }
    }
    // A sampled file doesn't promise every pixel, so its misses are no failure; nor are misses below `min_pixels`.
    let fails = |s: &Summary| {
        let misses = s.most_missed_pixels.is_some_and(|most| most >= u64::from(s.min_pixels.max(1)));
        let missed_movers = s.movers.is_some_and(|seen| seen.missed_mover_pixels > 0);
        args.verify_pixels && misses || missed_movers || s.lost_objects.is_some_and(|lost| lost > 0)
    };
    let failed = file.guarantee == Guarantee::Conservative && summaries.iter().any(fails);
    Ok(if failed { Outcome::Failed } else { Outcome::Done })
}

/// The file and its model.
fn read(args: &Args) -> Result<(PvsFile, Scene), CliError> {
    let file = PvsFile::load(&args.file)?;
    // Pictures must not overwrite the model's own.
    let options = ImportOptions { trace: args.frames.is_some(), ..args.files.again(&file.import) };
    let scene = import(&args.model, &options).map_err(|e| at(&args.model, e))?;
    if scene.hash() != file.model_hash {
        let what = format!("is not the model of {}; bake the file again, or give its model", args.file.display());
        return Err(at(&args.model, what));
    }
    Ok((file, scene))
}

/// Makes the folder of pictures, unless one of them would replace a file that is read.
fn make_folder(folder: &Path, files: Files, pictures: impl Iterator<Item = PathBuf>) -> Result<(), CliError> {
    let replaced = pictures.filter(|path| path.exists());
    replaced.fold(files, |files, path| files.writes(&path, Kind::Png)).check()?;
    std::fs::create_dir_all(folder).map_err(|e| at(folder, e))
}

/// Picture files that a model names.
fn named_pictures(scene: &Scene, model: &Path) -> Vec<PathBuf> {
    let folder = model.parent().unwrap_or(Path::new(""));
    let all = scene.trace.iter().flat_map(|trace| &trace.materials).flat_map(|material| material.pictures()).flatten();
    let named = all.filter_map(|picture| if let Picture::Named(name) = picture { Some(name) } else { None });
    named.filter(|name| !name.starts_with("data:")).map(|name| folder.join(name)).collect()
}

fn print_json(value: &serde_json::Value) -> Result<(), CliError> {
    super::answer(&value.to_string())
}

fn prose(s: &Summary, all_triangles: u64) -> String {
    let mut line = format!(
        "{:8} {} frames, {:.0} of {all_triangles} triangles, {:.0} objects, {:.1} us (p99 {:.1})",
        s.mode, s.frames, s.triangles_mean, s.objects_mean, s.us_median, s.us_p99
    );
    if let Some(small) = s.small_mean {
        line += &format!(", {small:.0} objects below {} pixels", s.min_pixels);
    }
    if let Some(frame) = s.frame_us_median {
        line += &format!(", {frame:.0} us with drawing, {:.0} queries", s.queries_mean);
    }
    if let (Some(visible), Some(undecided)) = (s.visible_triangles_mean, s.undecided_triangles_mean) {
        line += &format!(", {visible:.0} visible triangles, {undecided:.1} undecided");
    }
    if let Some(lost) = s.lost_objects {
        line += &format!(", {lost} visible objects left out");
    }
    if let (Some(missed), Some(cracks), Some(exact)) = (s.missed_pixels, s.crack_pixels, s.exact_triangles_mean) {
        let closed = s.closed_pixels.map_or(String::new(), |closed| format!(", {closed} behind closed holes"));
        line += &format!(", {missed} missed pixels, {cracks} at cracks{closed}, {exact:.0} exactly visible triangles");
    }
    if let Some(seen) = s.movers {
        let CrowdSeen { movers, movers_shown, missed_mover_pixels, crack_mover_pixels } = seen;
        let mean = |sum: u64| sum as f64 / s.frames.max(1) as f64;
        line += &format!(
            ", {:.1} movers for {:.1} that show, {missed_mover_pixels} missed pixels of movers, {crack_mover_pixels} at cracks",
            mean(movers),
            mean(movers_shown)
        );
    }
    line
}

/// Modes by name, each once, in the given order; `all` means all but `exact`.
fn modes(names: &[String]) -> Result<Vec<WalkMode>, CliError> {
    let mut modes = Vec::new();
    for name in names {
        let named = match name.as_str() {
            "all" => Mode::ALL.map(WalkMode::from).to_vec(),
            name => vec![name.parse().map_err(|e| CliError(format!("--mode: {e}")))?],
        };
        for mode in named {
            if !modes.contains(&mode) {
                modes.push(mode);
            }
        }
    }
    Ok(modes)
}

fn size(text: &str) -> Result<(usize, usize), CliError> {
    let parse = |s: &str| s.parse::<usize>().ok().filter(|n| (1..=16384).contains(n));
    text.split_once('x')
        .and_then(|(w, h)| Some((parse(w)?, parse(h)?)))
        .ok_or_else(|| CliError(format!("--size: \"{text}\" is not WIDTHxHEIGHT in pixels, each 1 to 16384")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_and_modes_are_read_strictly() {
        assert_eq!(size("640x360").unwrap(), (640, 360));
        for bad in ["640", "0x3", "3x0", "-1x5", "16385x1", "1x1x1", "ax1"] {
            assert!(size(bad).is_err(), "{bad}");
        }
        let names = |names: &[&str]| modes(&names.iter().map(|s| s.to_string()).collect::<Vec<_>>());
        let read: Vec<&str> = names(&["both", "all", "exact", "pvs"]).unwrap().into_iter().map(WalkMode::name).collect();
        assert_eq!(read, ["both", "none", "frustum", "portals", "pvs", "chc", "chc++", "auto", "exact"]);
        assert!(names(&["CHC"]).unwrap_err().to_string().contains("no mode"));
    }
}
