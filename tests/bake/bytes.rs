//! Whole bakes of generated buildings: the same bytes on any number of threads, both sides in order, nothing missed.

use crate::cli::building;
use enfilade::bake::{BakeOptions, Baked, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::runtime::Mode;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::verify::{CheckOptions, check};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::walk::walk;
use enfilade_scenes::Kind;
use std::path::Path;
use testing::bakes;

fn options() -> BakeOptions {
    BakeOptions { keep_bounds: true, ..bakes::with_rays(2_000_000) }
}

/// Import and bake on a number of threads.
fn baked(model: &Path, threads: usize) -> (Scene, Baked) {
    bakes::on(threads, || {
        let scene = import(model, &ImportOptions::default()).unwrap();
        let baked = bake(&scene, options(), &Job::quiet()).unwrap();
        (scene, baked)
    })
}

fn check_bake(name: &str) -> (Scene, PvsFile) {
    let model = building(&format!("{name}.glb"));
    let (scene, one) = baked(&model, 1);
    let (_, two) = baked(&model, 2);
    assert!(one.file.write() == two.file.write(), "{name}: one and two threads give different bytes");

    let file = one.file;
    let bounds = file.bounds.as_ref().expect("both sides are kept");
    assert_eq!(bounds.cells_lower.first_outside(&bounds.cells_upper), None, "{name}: cells");
    assert_eq!(bounds.objects_lower.first_outside(&bounds.objects_upper), None, "{name}: objects");
    assert!(bounds.objects_lower.count_ones() > 0, "{name}: nothing is seen");
    assert_eq!(file.stats.contradictions, 0, "{name}: {:?}", file.stats);

    let report = check(&file, &scene, &CheckOptions { rays: 300_000, ..CheckOptions::default() }).unwrap();
    assert!(report.passed, "{name}: {:?}", report.examples);
    assert_eq!((report.missed_pairs, report.missed_cell_pairs, report.missed_segments), (0, 0, 0), "{name}");
    (scene, file)
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn the_villa_is_baked_the_same_everywhere_and_passes_its_check() {
    check_bake("villa_rotonda");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn the_gallery_draws_a_tenth_of_the_frustum_and_misses_no_pixel() {
    let (scene, file) = check_bake("gallery100");
    let path = CameraPath::load(&building("gallery100.path.json")).unwrap();
    let options = bakes::walk([Mode::Frustum, Mode::PortalsAndPvs], [160, 90]);
    let summaries = walk(&scene, &file, &path, &options, &mut |_| ()).unwrap();
    for summary in &summaries {
        assert_eq!((summary.frames, summary.missed_pixels), (path.frames.len(), Some(0)), "{}", summary.mode);
    }
    let [frustum, both] = [0, 1].map(|m: usize| summaries[m].triangles_mean);
    assert!(both > 0.0 && both <= frustum / 10.0, "{both} triangles of the frustum's {frustum}");
}

/// One closed room: nothing to part, so no portals; nothing hidden in it from itself, so no rows.
#[test]
fn a_hall_is_one_cell_and_its_file_has_no_rows() {
    let (_, scene) = bakes::generated(Kind::Hall, 1);
    let file = PvsFile::read(&bakes::baked(&scene, options()).write()).unwrap();
    assert_eq!(file.cells.iter().map(|cell| cell.open).collect::<Vec<_>>(), [true, false], "outside and the hall");
    assert!(file.portals.is_empty() && file.cell_rows.is_none() && file.object_rows.is_none());
    assert!(file.left_out.iter().any(|line| line.starts_with("rows: one closed cell")), "{:?}", file.left_out);
    let report = check(&file, &scene, &CheckOptions { rays: 100_000, ..CheckOptions::default() }).unwrap();
    assert!(report.passed && report.segments == 100_000, "{:?}", report.examples);
}
