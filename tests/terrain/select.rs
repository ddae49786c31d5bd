//! Ground: every sample of a raster against where it is drawn, meshes edge by edge, tiles that are late, and grounds with known answers.

use crate::cli::folder;
use enfilade::runtime::{Camera, Motion, Rect};
use enfilade_terrain::raster::{Raster as File, RasterOptions};
use enfilade_terrain::{Ground, GroundError, GroundScratch, GroundView, Limit, MakeOptions, Patch, flight, make};
use glam::{DVec2, DVec3};
use std::io::Cursor;
use std::path::PathBuf;
use testing::bakes;
use testing::data::data;
use testing::ground::{Raster, Scripted, bytes, ground, ground_with, judge, written};

const SIZE: [u32; 2] = [1920, 1080];
const WHOLE: [Rect; 1] = [Rect::FULL];
/// Pixels that the camera's single precision adds.
const ROUNDING: f64 = 1e-3;

/// A raster as a ground, all of it in memory, and in a file.
fn on_disk(name: &str, raster: &mut Raster) -> (PathBuf, Ground) {
    let path = folder(name).join("X.ground");
    written(raster, &path);
    (path, ground(raster))
}

fn view(camera: Camera) -> GroundView<'static> {
    GroundView { camera, size: SIZE, windows: &WHOLE }
}

fn look(eye: DVec3, target: DVec3) -> Camera {
    Camera::look_at(eye, target, 60f64.to_radians(), 16.0 / 9.0)
}

/// Hills, a plain, a cliff, and a few voids: a hole, a bay at the rim, single samples.
fn hills(size: [u32; 2], voids: bool) -> Raster {
    Raster::of(size, |c, r| {
        let (x, y) = (f64::from(c), f64::from(r));
        let is_void =
            (c.abs_diff(70) < 9 && r.abs_diff(50) < 5) || (c < 6 && r.abs_diff(100) < 11) || (c * 7 + r * 13) % 997 == 0;
        if voids && is_void {
            return f64::NAN;
        }
        let rough = (c.wrapping_mul(2_654_435_761u32.wrapping_mul(r + 1)) >> 20) as f64 / 4096.0;
        let hill = 60.0 * (x / 21.0).sin() * (y / 17.0).cos() + 6.0 * rough;
        let plain = if c > 200 { 0.1 * hill } else { hill };
        if r > 150 { plain + 80.0 } else { plain }
    })
}

#[test]
fn no_sample_is_farther_from_its_place_than_was_asked_and_no_edge_is_open() {
    for (name, voids, width) in [("hills", false, 260), ("voids", true, 259)] {
        let mut raster = hills([width, 230], voids);
        let ground = ground(&mut raster);
        let mut scratch = GroundScratch::default();
        let mut mixed = 0;
        for above in [2.0, 200.0, 1500.0] {
            for camera in flight(&ground, above, 5) {
                for pixels in [0.5, 1.0, 2.0, 4.0, 40.0] {
                    let patches = ground.select(&view(camera), Limit::Pixels(pixels), &mut scratch).to_vec();
                    let verdict = judge(&ground, &raster, &view(camera), &patches, pixels + ROUNDING, true);
                    assert_eq!(
                        (verdict.beyond, verdict.open_edges, verdict.torn),
                        (0, 0, 0),
                        "{name} {above} m {pixels} px: {verdict:?}"
                    );
                    assert!(verdict.steps <= 1 && verdict.worst <= f64::from(scratch.worst()) + ROUNDING, "{verdict:?}");
                    mixed += u32::from(verdict.steps == 1);
                }
            }
        }
        assert!(mixed > 10, "{name}: hardly any frame has two levels");
    }
}

/// Real rasters: nothing beyond the limit, from near and from far.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_rasters_are_drawn_within_the_limit() {
    let data = data();
    for name in ["bigtujunga", "exploradores_aster_30m", "srtm_ref", "ky4_elevation", "dtm_2m", "dsm_2m", "../dem-gpl/dem"] {
        let file = data.join("terrain").join(format!("{name}.tif"));
        let mut file = File::open(&[file], &RasterOptions::default()).unwrap();
        let mut raster = Raster::read(&mut file);
        let ground = ground(&mut raster);
        let mut scratch = GroundScratch::default();
        for above in [2.0, 200.0, 1500.0] {
            for camera in flight(&ground, above, 2) {
                for pixels in [1.0, 4.0] {
                    let patches = ground.select(&view(camera), Limit::Pixels(pixels), &mut scratch).to_vec();
                    let verdict = judge(&ground, &raster, &view(camera), &patches, pixels + ROUNDING, false);
                    assert_eq!((verdict.beyond, verdict.torn), (0, 0), "{name} {above} m {pixels} px: {verdict:?}");
                    assert!(verdict.steps <= 1, "{name}: {verdict:?}");
                }
            }
        }
    }
}

#[test]
fn a_plain_is_one_tile_and_a_spike_is_all_of_its_error() {
    let plain = ground(&mut Raster::of([257, 257], |c, r| f64::from(c) + 2.0 * f64::from(r)));
    assert!(plain.tiles().iter().all(|t| t.error < 1e-3), "a slope is flat at every level, to rounding");
    let mut scratch = GroundScratch::default();
    let above = view(look(DVec3::new(0.0, 4000.0, 0.0), DVec3::new(1.0, 0.0, 0.0)));
    assert_eq!(plain.select(&above, Limit::Pixels(1.0), &mut scratch).len(), 1);

    // At (129, 129) only level 0 has the sample: all others miss it by its height. At (128, 128) the coarsest has it, and draws a pyramid of
    // its slope over flat ground: one sample beside the top, it is too high by the height less one part in 8. A tile of level 1 is too high by
    // three quarters: the top is on its border, where a neighbour's samples may be four apart.
    let spike = |at: u32| Raster::of([257, 257], move |c, r| if [c, r] == [at, at] { 1000.0 } else { 0.0 });
    let errors = |ground: &Ground| {
        let worst =
            |level| ground.header().grid.tiles_of(level).map(|t| ground.tiles()[t as usize].error).fold(0.0, f32::max);
        [worst(0), worst(1), worst(3)]
    };
    let odd = ground(&mut spike(129));
    let near = |found: f32, want: f32| (found - want).abs() < 0.1;
    let [zero, one, three] = errors(&odd);
    assert!(zero < 0.1 && near(one, 1000.0) && near(three, 1000.0), "{:?}", errors(&odd));
    let even = ground(&mut spike(128));
    let [zero, one, three] = errors(&even);
    assert!(zero < 0.1 && near(one, 750.0) && near(three, 875.0), "{:?}", errors(&even));
}

#[test]
fn budgets_are_never_passed_and_a_larger_one_is_never_worse() {
    let mut raster = hills([700, 500], false);
    let ground = ground(&mut raster);
    let mut scratch = GroundScratch::default();
    for above in [2.0, 200.0, 1500.0] {
        for camera in flight(&ground, above, 10) {
            let mut before = f32::INFINITY;
            for budget in [2_048, 10_000, 30_000, 50_000, 100_000, 200_000, 500_000] {
                let patches = ground.select(&view(camera), Limit::Triangles(budget), &mut scratch).to_vec();
                assert!(scratch.triangles() <= u64::from(budget), "{} of {budget}", scratch.triangles());
                assert!(scratch.worst() <= before, "{budget}: {} after {before}", scratch.worst());
                before = scratch.worst();
                if budget == 50_000 {
                    let verdict = judge(&ground, &raster, &view(camera), &patches, f64::INFINITY, false);
                    assert!(verdict.worst <= f64::from(before) + ROUNDING, "{verdict:?} with {before} told");
                }
            }
        }
    }
}

#[test]
fn tiles_that_are_late_leave_no_hole_and_nothing_waits_for_them() {
    let mut raster = hills([700, 500], true);
    let (path, all) = on_disk("late", &mut raster);
    let mut scratch = GroundScratch::default();
    let cameras = flight(&all, 200.0, 160);
    for (late, a_frame, cache) in [(4, 8, 1 << 19), (20, 1, 1 << 17)] {
        let mut late = Ground::from_disk(&all, Box::new(Scripted::new(&path, &all, late, a_frame)), cache);
        let mut motion = Motion::default();
        let (mut short, mut mixed) = (0, 0);
        for (k, &camera) in cameras.iter().enumerate() {
            let limit = Limit::Pixels(2.0);
            let patches = late.select(&view(camera), limit, &mut scratch).to_vec();
            if !patches.is_empty() && k % 8 == 0 {
                let verdict = judge(&late, &raster, &view(camera), &patches, f64::from(scratch.worst()) + ROUNDING, true);
                assert_eq!((verdict.beyond, verdict.open_edges, verdict.torn), (0, 0, 0), "frame {k}: {verdict:?}");
                assert!(verdict.steps <= 1, "frame {k}: {verdict:?}");
                mixed += verdict.steps;
            }
            motion.see(&camera, k as f64 / 60.0);
            let loading = late.load(&view(camera), limit, &motion, 0.2, &patches);
            assert!(!patches.is_empty() || k < 30, "frame {k}: no ground");
            short += loading.wanted - loading.present;
        }
        assert!(short > 0 && mixed > 0, "the disk was never late: the test shows nothing");
    }
}

#[test]
fn the_same_tiles_give_the_same_patches_and_threads_the_same_bytes() {
    let make_on = |threads| bakes::on(threads, || bytes(&mut hills([700, 300], true), &MakeOptions::default()));
    assert!(make_on(1) == make_on(2), "threads matter");
    let ground = ground(&mut hills([700, 300], true));
    let camera = flight(&ground, 200.0, 3)[1];
    let (mut a, mut b) = (GroundScratch::default(), GroundScratch::default());
    for other in flight(&ground, 2.0, 4) {
        ground.select(&view(other), Limit::Pixels(1.0), &mut a);
    }
    let limit = Limit::Pixels(1.0);
    assert_eq!(ground.select(&view(camera), limit, &mut a), ground.select(&view(camera), limit, &mut b));
    assert!(!a.patches().is_empty());
}

#[test]
fn what_no_window_shows_is_neither_drawn_nor_asked_for() {
    let mut raster = hills([700, 500], false);
    let (path, all) = on_disk("windows", &mut raster);
    let mut scratch = GroundScratch::default();
    let camera = look(DVec3::new(0.0, 200.0, 0.0), DVec3::new(100.0, 150.0, 0.0));
    let limit = Limit::Pixels(1.0);
    let mut whole: Vec<u32> = all.select(&view(camera), limit, &mut scratch).iter().map(|p| p.tile).collect();
    let narrow = [Rect { min: glam::vec2(0.2, -0.5), max: glam::vec2(0.3, 0.1) }];
    let through = GroundView { windows: &narrow, ..view(camera) };
    let part = all.select(&through, limit, &mut scratch).to_vec();
    whole.sort_unstable();
    assert!(!part.is_empty() && part.len() * 4 < whole.len(), "{} of {}", part.len(), whole.len());

    let none = GroundView { windows: &[], ..view(camera) };
    assert!(all.select(&none, limit, &mut scratch).is_empty());
    let mut idle = Ground::from_disk(&all, Box::new(Scripted::new(&path, &all, 1, 8)), 1 << 20);
    let mut motion = Motion::default();
    for k in 0..10 {
        motion.see(&camera, f64::from(k));
        let loading = idle.load(&none, limit, &motion, 1.0, &[]);
        assert_eq!((loading.wanted, loading.under_way), (0, 0));
    }
    // And once a window shows it, it comes.
    for _ in 0..20 {
        idle.load(&through, limit, &motion, 0.0, &[]);
    }
    assert_eq!(idle.select(&through, limit, &mut scratch), &part[..]);
}

/// All samples that windows show are drawn, and of the tiles only the parts that may show.
#[test]
fn parts_of_a_tile_that_no_window_shows_are_not_drawn() {
    let mut raster = hills([700, 500], true);
    let ground = ground(&mut raster);
    let mut scratch = GroundScratch::default();
    let window = |x: f32, y: f32| Rect { min: glam::vec2(x, y), max: glam::vec2(x + 0.15, y + 0.3) };
    let windows = [window(-0.9, -0.5), window(0.1, -0.3), window(0.6, -0.9)];
    let (mut samples, mut drawn, mut whole) = (0, 0, 0);
    for above in [2.0, 200.0, 1500.0] {
        for camera in flight(&ground, above, 4) {
            for pixels in [1.0, 8.0, 64.0] {
                let through = GroundView { windows: &windows, ..view(camera) };
                let patches = ground.select(&through, Limit::Pixels(pixels), &mut scratch).to_vec();
                let verdict = judge(&ground, &raster, &through, &patches, pixels + ROUNDING, false);
                assert_eq!(verdict.beyond, 0, "{above} m {pixels} px: {verdict:?}");
                let cells: usize = patches.iter().map(|patch| patch.drawn_cells(33).count()).sum();
                assert_eq!(scratch.triangles(), 2 * cells as u64);
                samples += verdict.samples;
                drawn += cells;
                whole += 32 * 32 * patches.len();
            }
        }
    }
    assert!(samples > 10_000 && 2 * drawn < whole, "{samples} samples; {drawn} of {whole} cells");
}

#[test]
fn a_small_raster_has_one_level_and_is_drawn_whole() {
    let mut raster = hills([200, 150], false);
    let ground = ground(&mut raster);
    assert_eq!(ground.header().grid.top(), 0);
    let camera = look(DVec3::new(0.0, 5000.0, 0.0), DVec3::new(1.0, 0.0, 0.0));
    let mut scratch = GroundScratch::default();
    let patches = ground.select(&view(camera), Limit::Pixels(1000.0), &mut scratch).to_vec();
    assert!(patches.iter().all(|p| p.key.level == 0 && p.coarser == 0));
    let verdict = judge(&ground, &raster, &view(camera), &patches, 0.01, true);
    assert_eq!((verdict.samples, verdict.beyond, verdict.open_edges), (200 * 150, 0, 0));
}

#[test]
fn no_ground_is_made_under_a_building() {
    let mut raster = Raster::of([300, 300], |c, _| f64::from(c));
    // A house of 100 x 60 m, 20 m east and 30 m south of the middle, as two triangles and one that stands upright.
    let [a, b, c, d] = [(-30.0, 0.0), (70.0, 0.0), (70.0, 60.0), (-30.0, 60.0)].map(|(x, z)| DVec2::new(x, z));
    let options = MakeOptions { keep_out: vec![[a, b, c], [c, d, a], [a, a, b]], ..MakeOptions::default() };
    let ground = ground_with(&mut raster, &options);
    // Samples stand at odd multiples of 5 m: 10 across and 6 down are inside.
    assert_eq!(ground.header().voids, 60);
    for (x, z, there) in [(20.0, 30.0, false), (69.0, 59.0, false), (20.0, 80.0, true), (-60.0, 30.0, true)] {
        assert_eq!(ground.height_at(x, z).is_some(), there, "{x} {z}");
    }
    let want = (20.0 / 10.0 + 149.5) - 0.0;
    assert!((ground.height_at(20.0, 80.0).unwrap() - want).abs() < 1e-2);
}

/// Grounds and views that break carelessness: nothing panics, nothing is beyond the limit.
#[test]
fn extreme_grounds_and_views() {
    let flat = |_: u32, _: u32| 0.0;
    let mut all: Vec<(&str, Raster)> = vec![
        ("step", Raster::of([300, 200], |c, _| if c < 150 { 0.0 } else { 4000.0 })),
        ("level", Raster::of([300, 200], flat)),
        ("spike", Raster::of([300, 200], |c, r| if [c, r] == [137, 77] { 9000.0 } else { 0.0 })),
        ("tiny", Raster::of([300, 200], |c, r| 1e-3 * f64::from((c * 31 + r * 17) % 100) / 100.0)),
        ("huge", Raster::of([300, 200], |c, r| 1e5 * f64::from((c * 31 + r * 17) % 100) / 100.0)),
        ("three", Raster::of([3, 3], |c, r| f64::from(c * r))),
        ("two", Raster::of([2, 2], |c, r| f64::from(c + r))),
        ("strip", Raster::of([5000, 2], |c, _| f64::from(c % 7))),
        ("far", Raster { first: [1e7, -1e7], ..hills([300, 200], true) }),
        ("one triangle", Raster::of([300, 200], |c, r| if c.abs_diff(150) + r.abs_diff(100) < 2 { 5.0 } else { f64::NAN })),
        ("lonely samples", Raster::of([300, 200], |c, r| if c % 2 == 0 && r % 2 == 0 { 5.0 } else { f64::NAN })),
    ];
    for (name, raster) in &mut all {
        let ground = ground(raster);
        let top = ground.tiles().iter().map(|t| t.high).fold(0.0, f32::max);
        let middle = DVec3::new(0.0, ground.height_at(0.0, 0.0).unwrap_or(0.0), 0.0);
        let eyes = [2.0, 0.0, -3.0, 50.0, 1e5].map(|up| middle + DVec3::Y * up);
        let mut scratch = GroundScratch::default();
        for eye in eyes {
            for (fov, target) in [
                (60.0, eye + DVec3::new(1.0, -0.2, 0.3)),
                (1e-5, eye + DVec3::new(1.0, -0.2, 0.3)),
                (179.9, eye + DVec3::X),
                (90.0, eye - DVec3::Y),
                (90.0, eye + DVec3::Y),
            ] {
                let camera = Camera::look_at(eye, target, f64::to_radians(fov), 1.5);
                for limit in [Limit::Pixels(1.0), Limit::Distance(1.0), Limit::Triangles(20_000)] {
                    let patches: Vec<Patch> = ground.select(&view(camera), limit, &mut scratch).to_vec();
                    let ordinary = fov == 60.0 && limit == Limit::Pixels(1.0);
                    if ordinary {
                        let allowed = f64::from(scratch.worst()).max(1.0) + ROUNDING;
                        let verdict = judge(&ground, raster, &view(camera), &patches, allowed, true);
                        let found = (verdict.beyond, verdict.open_edges, verdict.torn);
                        assert_eq!(found, (0, 0, 0), "{name} at {eye} under {top}: {verdict:?}");
                    }
                }
            }
        }
        // A camera that jumps each frame.
        let mut motion = Motion::default();
        for k in 0..20u32 {
            let eye = DVec3::new(f64::from(k * 7919 % 3000) - 1500.0, 100.0, f64::from(k * 104_729 % 2000) - 1000.0);
            motion.see(&look(eye, DVec3::ZERO), f64::from(k) * 1e-9);
            assert!(motion.ahead(1.0).is_some_and(|c| c.eye.is_finite()));
        }
    }
    let mut void = Raster::of([300, 200], |_, _| f64::NAN);
    let refused = make(&mut void, &MakeOptions::default(), &mut Cursor::new(Vec::new())).unwrap_err();
    assert!(matches!(refused, GroundError::Heights(line) if line.starts_with("no sample has a height")));
}

/// The study's measure is beaten: where it asks for 1 px, samples are farther off.
#[test]
fn error_over_distance_is_no_bound() {
    let mut raster = hills([700, 500], false);
    let ground = ground(&mut raster);
    let mut scratch = GroundScratch::default();
    let mut worst = 0f64;
    for camera in flight(&ground, 200.0, 12) {
        let patches = ground.select(&view(camera), Limit::Distance(1.0), &mut scratch).to_vec();
        worst = worst.max(judge(&ground, &raster, &view(camera), &patches, f64::INFINITY, false).worst);
    }
    assert!(worst > 1.05, "{worst}");
}
