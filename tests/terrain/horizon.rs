//! Tiles that nearer ground hides: pictures with and without them are the same, and where nothing is known nothing is hidden.

use crate::cli::folder;
use enfilade::runtime::{Camera, Motion, Rect};
use enfilade_terrain::raster::{Raster as File, RasterOptions};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Horizon, Limit, Patch, Things, flight};
use glam::{DVec2, DVec3};
use testing::data::data;
use testing::ground::{Raster, Scripted, ground, written};
use testing::ground_picture::Picture;
use testing::random::Random;

const SIZE: [usize; 2] = [320, 180];
const WHOLE: [Rect; 1] = [Rect::FULL];
/// Of the near plane, metres.
const NEAR: f64 = 1e-3;

fn view(camera: Camera) -> GroundView<'static> {
    GroundView { camera, size: SIZE.map(|s| s as u32), windows: &WHOLE }
}

fn look(eye: DVec3, target: DVec3, degrees: f64) -> Camera {
    Camera::look_at(eye, target, degrees.to_radians(), SIZE[0] as f64 / SIZE[1] as f64)
}

/// All patches of a view, and those that are kept. Both look the same, to the bit.
fn judged(of: &Ground, camera: Camera, limit: Limit, told: &str) -> (Vec<Patch>, Vec<Patch>) {
    let mut scratch = GroundScratch::default();
    let all = of.select(&view(camera), limit, &mut scratch).to_vec();
    let kept = Horizon::new(of).hide(of, &view(camera), NEAR, &all).to_vec();
    assert!(kept.iter().all(|patch| all.contains(patch)), "{told}: a patch that wasn't selected");
    let [before, after] = [&all, &kept].map(|patches| Picture::new(of, &camera, SIZE, NEAR, patches));
    let lost = before.pixels.iter().zip(&after.pixels).filter(|(a, b)| a.0 != b.0).count();
    let shown = before.shown();
    let hidden: Vec<_> = shown.iter().map(|&k| all[k]).filter(|patch| !kept.contains(patch)).collect();
    assert_eq!(lost, 0, "{told}, from {}: {hidden:?} are hidden and show", camera.eye);
    (all, kept)
}

/// Ridges, one behind another, and roughness; `voids`: holes, a bay at the rim, single samples.
fn ridges(voids: bool) -> Raster {
    Raster::of([385, 321], |c, r| {
        let (x, z) = (f64::from(c), f64::from(r));
        let is_void =
            (c.abs_diff(170) < 9 && r.abs_diff(150) < 25) || (c < 6 && r.abs_diff(100) < 11) || (c * 7 + r * 13) % 2997 == 0;
        if voids && is_void {
            return f64::NAN;
        }
        let rough = f64::from(c.wrapping_mul(2_654_435_761) ^ r.wrapping_mul(40_503) >> 16 & 0xff) / f64::from(u32::MAX);
        150.0 * (0.07 * x + 0.02 * z).sin() + 90.0 * (0.09 * z - 0.03 * x).cos() + 8.0 * rough
    })
}

/// An eye over a place, by chance.
fn eye(of: &Ground, above: f64, random: &mut Random) -> DVec3 {
    let header = of.header();
    let [columns, rows] = header.grid.size();
    let [low, high] = [header.plan(0, 0), header.plan(columns - 1, rows - 1)].map(DVec2::from);
    let at = low + (high - low) * DVec2::new(random.real(0.0, 1.0), random.real(0.0, 1.0));
    DVec3::new(at.x, of.height_at(at.x, at.y).unwrap_or(0.0) + above, at.y)
}

#[test]
fn nothing_that_shows_is_hidden() {
    let spike = |c: u32, r: u32| if [c, r] == [130, 140] { 9000.0 } else { f64::from(c * 7 % 11) };
    let mut random = Random::new(5);
    for (name, mut raster) in [
        ("ridges", ridges(false)),
        ("holes", ridges(true)),
        ("cliff", Raster::of([300, 200], |c, _| if c < 150 { 0.0 } else { 400.0 })),
        ("spike", Raster::of([300, 200], spike)),
        ("comb", Raster::of([385, 321], |c, r| if c.abs_diff(190) < 3 && r % 4 > 0 { 300.0 } else { f64::from(c % 5) })),
        ("uneven", Raster { spacing: [30.0, 7.0], ..ridges(false) }),
        ("small", Raster::of([100, 80], |c, r| 20.0 * (f64::from(c) * 0.2).sin() + f64::from(r % 5))),
    ] {
        let of = ground(&mut raster);
        let (mut all, mut kept) = (0, 0);
        for k in 0..60 {
            let eye = eye(&of, [2.0, 0.3, 20.0, 200.0, -1.0][k % 5], &mut random);
            let towards = DVec3::new(random.real(-1.0, 1.0), random.real(-0.4, 0.2), random.real(-1.0, 1.0));
            let degrees = [60.0, 60.0, 60.0, 100.0, 5.0, 1e-5, 179.9][k % 7];
            let limit = [Limit::Pixels(1.0), Limit::Pixels(8.0), Limit::Triangles(40_000)][k % 3];
            let told = format!("{name}, view {k}");
            let (before, after) = judged(&of, look(eye, eye + towards, degrees), limit, &told);
            (all, kept) = (all + before.len(), kept + after.len());
        }
        let is_rough = ["ridges", "holes", "uneven"].contains(&name);
        assert!(!is_rough || kept * 10 < all * 9, "{name}: {kept} of {all} patches are kept: a test of nothing");
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn nothing_that_shows_of_real_rasters_is_hidden() {
    let data = data();
    // Of patches 2 m above the ground, at most so many in a hundred are kept.
    for (name, most) in [("bigtujunga", 45), ("exploradores_aster_30m", 100), ("srtm_ref", 60), ("dtm_2m", 100)] {
        let mut file = File::open(&[data.join("terrain").join(format!("{name}.tif"))], &RasterOptions::default()).unwrap();
        let of = ground(&mut Raster::read(&mut file));
        for (above, most) in [(2.0, most), (200.0, 100)] {
            let (mut all, mut kept) = (0, 0);
            for camera in flight(&of, above, 8) {
                let (before, after) = judged(&of, camera, Limit::Pixels(1.0), &format!("{name}, {above} m"));
                (all, kept) = (all + before.len(), kept + after.len());
            }
            assert!(kept * 100 <= all * most, "{name}, {above} m: {kept} of {all} patches");
        }
    }
}

#[test]
fn nothing_that_shows_is_hidden_while_tiles_are_late() {
    let whole = ground(&mut ridges(true));
    let path = folder("late").join("X.ground");
    written(&mut ridges(true), &path);
    let disk = Scripted::new(&path, &whole, 2, 1);
    let mut late = Ground::from_disk(&whole, Box::new(disk), whole.cache_bytes() / 3);
    let (mut scratch, mut motion, mut levels) = (GroundScratch::default(), Motion::default(), [0; 8]);
    for (k, camera) in flight(&whole, 2.0, 60).into_iter().enumerate() {
        let (all, _) = judged(&late, camera, Limit::Pixels(1.0), &format!("frame {k}"));
        all.iter().for_each(|patch| levels[patch.key.level as usize] += 1);
        motion.see(&camera, k as f64 / 60.0);
        late.select(&view(camera), Limit::Pixels(1.0), &mut scratch);
        late.load(&view(camera), Limit::Pixels(1.0), &motion, 0.0, scratch.patches());
    }
    assert!(levels.iter().filter(|&&patches| patches > 0).count() > 2, "{levels:?}");
}

/// A wall across a plain, from one side to the other: all behind it is hidden, and nothing before it.
#[test]
fn a_wall_hides_what_is_behind_it() {
    let of = ground(&mut Raster::of([257, 257], |c, r| if c.abs_diff(140) < 8 { 300.0 } else { f64::from(r % 3) }));
    let eye = DVec3::new(-800.0, 20.0, 165.0);
    let (all, kept) = judged(&of, look(eye, eye + DVec3::X, 30.0), Limit::Pixels(0.0), "wall");
    let header = of.header();
    let first = |patch: &Patch| header.grid.column(patch.key, 0);
    let behind = |patches: &[Patch]| patches.iter().filter(|p| first(p) >= 160).count();
    let before = |patches: &[Patch]| patches.iter().filter(|p| first(p) < 128).count();
    assert!(behind(&all) >= 12 && behind(&kept) == 0, "{} of {} tiles behind the wall", behind(&kept), behind(&all));
    assert!(before(&all) > 6 && before(&kept) == before(&all));
    // From above the wall, its top hides nothing of what is far enough behind it.
    let over = DVec3::new(0.0, 2000.0, 5.0);
    let (all, kept) = judged(&of, look(over, over + DVec3::new(1.0, -1.0, 0.0), 60.0), Limit::Pixels(0.0), "over the wall");
    assert_eq!(kept.len(), all.len());
}

/// A valley behind a plain is hidden, unless one looks down into it through a hole of the plain.
#[test]
fn what_shows_through_a_hole_is_not_hidden() {
    let valley = |hole: bool| {
        Raster::of([257, 129], move |c, r| {
            let is_void = hole && (100..124).contains(&c) && r.abs_diff(64) < 20;
            if is_void { f64::NAN } else { 390.0 - 3.0 * f64::from(c.clamp(130, 170)) }
        })
    };
    let hidden = [false, true].map(|hole| {
        let of = ground(&mut valley(hole));
        let height = of.height_at(-500.0, 0.0).unwrap();
        let eye = DVec3::new(-500.0, height + 60.0, 0.0);
        let (all, kept) = judged(&of, look(eye, eye + DVec3::new(1.0, -0.2, 0.0), 40.0), Limit::Pixels(0.0), "a hole");
        all.len() - kept.len()
    });
    assert!(hidden[0] > 2 && hidden[1] < hidden[0], "{hidden:?} tiles are hidden without a hole and with one");
}

/// A hole behind a wall is no reason to hide a hill that one sees over both, below the eye's own height.
#[test]
fn a_hidden_hole_hides_nothing() {
    let of = ground(&mut Raster::of([257, 129], |c, _| match c {
        58..62 => 50.0,
        70..90 => f64::NAN,
        92.. => 80.0,
        _ => 0.0,
    }));
    let eye = DVec3::new(-1080.0, 100.0, 0.0);
    judged(&of, look(eye, eye + DVec3::X, 40.0), Limit::Pixels(0.0), "a hidden hole");
}

#[test]
fn an_eye_that_is_not_above_the_ground_sees_all_of_it() {
    let of = ground(&mut ridges(true));
    let header = of.header();
    let [west, north] = header.plan(0, 0);
    let void = header.plan(170, 150);
    let below = DVec3::new(300.0, of.height_at(300.0, 400.0).unwrap() - 0.01, 400.0);
    let mut scratch = GroundScratch::default();
    for (what, eye) in [
        ("below", below),
        ("deep below", below - DVec3::Y * 500.0),
        ("beside", DVec3::new(west - 1.0, 50.0, 0.0)),
        ("beside", DVec3::new(0.0, 50.0, north - 100.0)),
        ("in a hole", DVec3::new(void[0] + 85.0, -400.0, void[1])),
    ] {
        for towards in [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::new(1.0, -0.5, 1.0), DVec3::new(0.1, 1.0, 0.0)] {
            let camera = look(eye, eye + towards, 60.0);
            let all = of.select(&view(camera), Limit::Pixels(1.0), &mut scratch).to_vec();
            judged(&of, camera, Limit::Pixels(1.0), what);
            if what != "in a hole" {
                assert_eq!(Horizon::new(&of).hide(&of, &view(camera), NEAR, &all), all, "{what}");
            }
        }
    }
    // What the near plane cuts off doesn't hide.
    let eye = below + DVec3::Y * 1.01;
    let camera = look(eye, eye + DVec3::X, 60.0);
    let all = of.select(&view(camera), Limit::Pixels(1.0), &mut scratch).to_vec();
    let kept = [NEAR, 2.0].map(|near| Horizon::new(&of).hide(&of, &view(camera), near, &all).len());
    assert!(kept[0] < all.len() && kept[1] == all.len(), "{kept:?} of {}", all.len());
}

/// From the eye on, each ray meets patches in their order.
#[test]
fn near_patches_come_first() {
    let of = ground(&mut Raster::of([700, 500], |c, r| f64::from((c * 31 + r * 17) % 7)));
    let header = of.header();
    let mut random = Random::new(9);
    for k in 0..12 {
        let eye = eye(&of, 1500.0, &mut random);
        let camera = look(eye, eye + DVec3::new(0.01, -1.0, 0.0), 150.0);
        let (_, kept) = judged(&of, camera, Limit::Pixels([0.0, 0.1][k % 2]), "order");
        assert!(kept.len() > 10);
        for turn in 0..90 {
            let angle = f64::from(turn) * 0.07;
            let mut last = 0;
            for step in 0..800 {
                let p = DVec2::new(eye.x, eye.z) + DVec2::from_angle(angle) * 10.0 * f64::from(step);
                let inside = |patch: &Patch| {
                    let [low, high] = [0, header.grid.side() - 1]
                        .map(|k| DVec2::from(header.plan(header.grid.column(patch.key, k), header.grid.row(patch.key, k))));
                    p.cmpgt(low).all() && p.cmplt(high).all()
                };
                if let Some(at) = kept.iter().position(inside) {
                    assert!(at >= last, "from {eye}, {angle}: {at} after {last}");
                    last = at;
                }
            }
        }
    }
}

/// Boxes that are said to be hidden have no pixel: the ground that is drawn is nearer everywhere.
#[test]
fn boxes_that_ground_is_said_to_hide_have_no_pixel() {
    let mut random = Random::new(11);
    for (name, mut raster) in [("boxes", ridges(false)), ("boxes-holes", ridges(true))] {
        let of = ground(&mut raster);
        let (mut horizon, mut scratch) = (Horizon::new(&of), GroundScratch::default());
        let (mut hidden, mut shown) = (0, 0);
        for k in 0..200 {
            // A town, here and there on the corner of the raster's quarters, in which boxes stand on the ground, and in it.
            let most = [300.0, 20.0, 900.0][k % 3];
            let town =
                DVec2::new(random.real(-1500.0, 1200.0), random.real(-1200.0, 900.0)) * f64::from(u8::from(k % 4 > 0));
            let mut side = || random.real(-most, most);
            let boxes: Vec<_> = (0..20)
                .map(|_| {
                    let [a, b] = [0, 1].map(|_| town + DVec2::new(side(), side()));
                    let (from, to) = (a.min(b), a.max(b));
                    let foot = of.height_at(from.x, from.y).unwrap_or(0.0) + side() / most * 3.0;
                    [DVec3::new(from.x, foot, from.y), DVec3::new(to.x, foot + 20.0 + side() / most * 19.0, to.y)]
                })
                .collect();
            let things = Things::new(&of, boxes.iter().copied());
            let eye = eye(&of, [2.0, 20.0, 100.0][k % 3], &mut random);
            let middle = DVec3::new(town.x, of.height_at(town.x, town.y).unwrap_or(0.0), town.y);
            let camera = look(eye, middle, [60.0, 20.0][k % 2]);
            let patches = of.select(&view(camera), Limit::Pixels([1.0, 8.0][k / 2 % 2]), &mut scratch).to_vec();
            let kept = horizon.hide_with(&of, &view(camera), NEAR, &patches, &things, 0..boxes.len()).to_vec();
            let is_hidden: Vec<bool> = (0..boxes.len()).map(|thing| horizon.hides(thing)).collect();
            assert_eq!(horizon.hide(&of, &view(camera), NEAR, &patches), kept, "things change what is kept of the ground");
            assert!((0..boxes.len()).all(|thing| !horizon.hides(thing)), "nobody has asked");
            let picture = Picture::new(&of, &camera, SIZE, NEAR, &patches);
            for (&[low, high], is_hidden) in boxes.iter().zip(is_hidden) {
                let [_, pixels] = picture.pixels_of_box(&camera, NEAR, [low, high]);
                if is_hidden {
                    assert_eq!(pixels, 0, "{name}, view {k}: {low} to {high} from {eye}");
                    hidden += 1;
                } else {
                    shown += usize::from(pixels > 0);
                }
            }
        }
        assert!(hidden > 500 && shown > 200, "{name}: {hidden} hidden, {shown} shown: a test of little");
    }
}

/// A ridge around a plain, 200 m wide above. From its foot, anywhere around it, it hides what stands inside and on no tile of the ridge, also on
/// the corner of the raster's quarters, and nothing that stands before it or on it.
#[test]
fn a_ring_hides_what_is_inside_from_everywhere() {
    let ring = |c: u32, r: u32| {
        let from_middle = (10.0 * f64::from(c) - 1280.0).hypot(10.0 * f64::from(r) - 1280.0);
        (230.0 - 1.5 * (from_middle - 700.0).abs()).clamp(0.0, 80.0)
    };
    let of = ground(&mut Raster::of([257, 257], ring));
    let boxed = |middle: DVec2, half: f64, [low, high]: [f64; 2]| {
        let half = DVec3::new(half, 0.0, half);
        [DVec3::new(middle.x, low, middle.y) - half, DVec3::new(middle.x, high, middle.y) + half]
    };
    let (mut horizon, mut scratch) = (Horizon::new(&of), GroundScratch::default());
    for turn in 0..48 {
        let out = DVec2::from_angle(f64::from(turn) * std::f64::consts::TAU / 48.0);
        let inside = (0..9).map(|k| DVec2::new(f64::from(k % 3), f64::from(k / 3)) * 90.0 - 90.0);
        let inside = inside.flat_map(|p| [40.0, 100.0, 200.0].map(|half| boxed(p, half, [-2.0, 20.0])));
        let before = [boxed(out * 900.0, 8.0, [0.0, 10.0]), boxed(out * 800.0, 8.0, [75.0, 95.0])];
        let boxes: Vec<_> = inside.chain(before).collect();
        let things = Things::new(&of, boxes.iter().copied());
        let mut hidden = |height: f64, towards: f64| -> Vec<bool> {
            let eye = DVec3::new(1000.0 * out.x, height, 1000.0 * out.y);
            let camera = look(eye, eye - DVec3::new(towards * out.x, 0.1, towards * out.y), 60.0);
            let patches = of.select(&view(camera), Limit::Pixels(1.0), &mut scratch);
            horizon.hide_with(&of, &view(camera), NEAR, patches, &things, 0..boxes.len());
            (0..boxes.len()).map(|thing| horizon.hides(thing)).collect()
        };
        let foot = hidden(2.0, 1.0);
        assert!(foot[..27].iter().all(|&is_hidden| is_hidden), "turn {turn}: {foot:?}");
        assert_eq!(foot[27..], [false; 2], "turn {turn}: before the ring, and on it");
        assert_eq!(hidden(300.0, 1.0), [false; 29], "turn {turn}: from above");
        // Who looks away from it sees nothing of it. That isn't the ground's doing.
        assert_eq!(hidden(2.0, -1.0), [false; 29], "turn {turn}: behind one's back");
    }
}

/// What is not all on the raster is never said to be hidden, nor what is over very many tiles, nor what has no size.
#[test]
fn boxes_beside_the_raster_are_not_hidden() {
    let of = ground(&mut Raster::of([1025, 257], |c, _| if (300..330).contains(&c) { 300.0 } else { 0.0 }));
    let [[west, north], [east, south]] = [of.header().plan(0, 0), of.header().plan(1024, 256)];
    let eye = DVec3::new(of.header().plan(240, 0)[0], 2.0, 0.0);
    let boxes = [
        ([0.0, 0.0], [10.0, 10.0], true),
        ([east - 10.0, 0.0], [east, 10.0], true),
        ([east - 10.0, 0.0], [east + 0.1, 10.0], false),
        ([0.0, north - 0.1], [10.0, 10.0], false),
        ([0.0, 0.0], [10.0, south + 0.1], false),
        ([west - 50.0, 0.0], [west - 40.0, 10.0], false),
        ([-4000.0, north], [east, south], false),
        ([10.0, 0.0], [0.0, 10.0], false),
        ([f64::NAN, 0.0], [10.0, 10.0], false),
    ];
    let things =
        Things::new(&of, boxes.map(|([x, z], [to_x, to_z], _)| [DVec3::new(x, 0.0, z), DVec3::new(to_x, 5.0, to_z)]));
    let view = view(look(eye, eye + DVec3::X, 60.0));
    let (mut horizon, mut scratch) = (Horizon::new(&of), GroundScratch::default());
    let patches = of.select(&view, Limit::Pixels(1.0), &mut scratch);
    // Numbers beyond the last thing are no thing's.
    horizon.hide_with(&of, &view, NEAR, patches, &things, 0..2 * boxes.len());
    assert_eq!(things.len(), boxes.len());
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7, 8].map(|thing| horizon.hides(thing)), boxes.map(|(_, _, is_hidden)| is_hidden));
    assert!(!horizon.hides(2 * boxes.len() - 1));
}
