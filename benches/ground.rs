//! Ground: what is drawn of rasters, how wrong it is, and what choosing it costs (`cargo bench --bench ground -- A.tif B.tif`; without files, a
//! made raster of 1,025 x 1,025).
//!
//! First the answers: every sample of the raster on the screen against where it is drawn, and the mesh edge by edge. Then triangles over those
//! of all finest tiles in the view, microseconds of the selection, what nearer ground leaves of it, and microseconds until that is known. Of the
//! judged frames at 1 px, tiles are drawn, too, to see how many show a pixel: no test of tiles could leave less. `--frames N` says how many frames of each flight are judged.

use enfilade::runtime::{Camera, Rect};
use enfilade_scenes::ground;
use enfilade_terrain::raster::{Raster as File, RasterOptions};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Horizon, Limit, MakeOptions, Patch, flight, make};
use std::path::{Path, PathBuf};
use std::time::Duration;
use testing::ground::{Raster, judge};
use testing::ground_picture::Picture;
use testing::times::{least, names, us};

const SIZE: [u32; 2] = [1920, 1080];
const LIMITS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];
const BUDGETS: [u32; 3] = [10_000, 50_000, 200_000];
const ABOVE: [f64; 3] = [2.0, 200.0, 1500.0];
/// Frames of a flight that are timed, and of them judged sample by sample.
const FRAMES: usize = 600;
const JUDGED: usize = 12;
/// A raster with more samples is not judged.
const MOST: u64 = 2_000_000;
const SIDES: [u32; 2] = [33, 65];
const TIMES: usize = 3;
/// Of the viewer's near plane, metres.
const NEAR: f64 = 1e-3;

fn main() {
    let named: Vec<PathBuf> = names().into_iter().map(PathBuf::from).collect();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let files = if named.is_empty() {
        let made = folder.join("ground-1025.tif");
        ground(1025, 30.0, 1, &made).expect("a ground");
        vec![made]
    } else {
        named
    };
    println!(
        "| raster | tile | metres above | limit | samples judged | worst, px | open edges | levels apart | triangles | of the frustum's | us, median | 99 % | not hidden | us, median | 99 % | with a pixel |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for file in files {
        for side in SIDES {
            measure(&file, side, &folder);
        }
    }
}

fn measure(file: &Path, side: u32, folder: &Path) {
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let mut raster = File::open(&[file.to_owned()], &RasterOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let at = folder.join(format!("{name}-{side}.ground"));
    let mut out = std::fs::File::create(&at).expect("a folder to write to");
    make(&mut raster, &MakeOptions { side, ..MakeOptions::default() }, &mut out).expect("a ground");
    let ground = Ground::open(&at, u64::MAX).expect("what was made");
    let [columns, rows] = raster.size();
    let truth = (u64::from(columns) * u64::from(rows) <= MOST).then(|| Raster::read(&mut raster));
    for above in ABOVE {
        let cameras = flight(&ground, above, FRAMES);
        let limits =
            LIMITS.map(Limit::Pixels).into_iter().chain([Limit::Distance(1.0)]).chain(BUDGETS.map(Limit::Triangles));
        for limit in limits {
            let what = format!("{name}, {above} m, {limit:?}");
            let flown = fly(&ground, truth.as_ref(), &cameras, limit, &what);
            flown.print(&format!("{name} | {side} | {above} | {limit:?}"));
        }
    }
}

/// What was found on a flight.
#[derive(Default)]
struct Flown {
    /// Triangles: drawn, left by nearer ground, and of all finest tiles in the view.
    drawn: u64,
    shown: u64,
    whole: u64,
    /// Of judged frames.
    worst: f64,
    samples: u64,
    open: u64,
    steps: u32,
    /// Tiles with a pixel, and all.
    looked: [usize; 2],
    /// Of the selection, and with what is hidden.
    times: Vec<Duration>,
    both: Vec<Duration>,
}

/// Flies with a limit; `what` is told where a judged frame is wrong.
fn fly(ground: &Ground, truth: Option<&Raster>, cameras: &[Camera], limit: Limit, what: &str) -> Flown {
    let mut flown = Flown::default();
    let (mut scratch, mut horizon) = (GroundScratch::default(), Horizon::new(ground));
    for (k, &camera) in cameras.iter().enumerate() {
        let view = GroundView { camera, size: SIZE, windows: &[Rect::FULL] };
        if let Some(truth) = truth.filter(|_| k % (FRAMES / JUDGED) == 0) {
            let patches = ground.select(&view, limit, &mut scratch).to_vec();
            flown.judge(ground, truth, (&view, limit), &patches, &format!("{what}, frame {k}"));
        }
        flown.times.push(least(TIMES, || _ = ground.select(&view, limit, &mut scratch)));
        flown.drawn += scratch.triangles();
        let both = || _ = horizon.hide(ground, &view, NEAR, ground.select(&view, limit, &mut scratch));
        flown.both.push(least(TIMES, both));
        flown.shown += horizon.triangles();
        ground.select(&view, Limit::Pixels(-1.0), &mut scratch);
        flown.whole += scratch.triangles();
    }
    flown.times.sort_unstable();
    flown.both.sort_unstable();
    flown
}

impl Flown {
    /// Judges a frame sample by sample.
    fn judge(
        &mut self,
        ground: &Ground,
        truth: &Raster,
        (view, limit): (&GroundView<'_>, Limit),
        patches: &[Patch],
        what: &str,
    ) {
        let allowed = match limit {
            Limit::Pixels(pixels) => pixels + ROUNDING,
            _ => f64::INFINITY,
        };
        let verdict = judge(ground, truth, view, patches, allowed, false);
        assert!(verdict.beyond == 0, "{what}: {verdict:?}");
        if limit == Limit::Pixels(1.0) {
            let picture = Picture::new(ground, &view.camera, SIZE.map(|s| s as usize), NEAR, patches);
            self.looked = [self.looked[0] + picture.shown().len(), self.looked[1] + patches.len()];
        }
        assert!(verdict.torn == 0 && verdict.steps <= 1, "{what}: {verdict:?}");
        self.worst = self.worst.max(verdict.worst);
        self.samples += verdict.samples;
        self.open += verdict.open_edges;
        self.steps = self.steps.max(verdict.steps);
    }

    /// A line of the table, after `what`.
    fn print(&self, what: &str) {
        let Self { drawn, shown, whole, worst, samples, open, steps, looked, times, both } = self;
        println!(
            "| {what} | {samples} | {worst:.3} | {open} | {steps} | {} | {:.3} | {:.0} | {:.0} | {:.3} | {:.0} | {:.0} | {:.3} |",
            drawn / FRAMES as u64,
            *drawn as f64 / *whole as f64,
            us(times, 50),
            us(times, 99),
            *shown as f64 / *drawn as f64,
            us(both, 50),
            us(both, 99),
            looked[0] as f64 / looked[1] as f64
        );
    }
}

/// Pixels that single precision adds: cameras are `f32`, and so is the eye.
const ROUNDING: f64 = 1e-3;
