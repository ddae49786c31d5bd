//! Ground around a building: it shows outside and through windows, and nowhere else; nothing of it is missed; it has no cracks.

use crate::common::{self, differ, drawn, made as by_hand, needs_device, path, villa};
use enfilade::CellId;
use enfilade::cells::PortalKind;
use enfilade::runtime::{Camera, Mode, Rect};
use enfilade_terrain::{Ground, GroundView, Limit, Loading, Patch, Placement, drawn as triangles_of};
use enfilade_viewer::body::EYE;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::{Culling, Oracle};
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::renderer::Renderer;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::ground::{Land, Shown};
use enfilade_viewer::headless::Walk;
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::{MoveInput, Walker};
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use testing::boxes::{self, block, p};
use testing::ground::{Raster, Screen, Scripted, written};

const SIZE: [u32; 2] = [320, 180];
const SKY: [u8; 3] = [204, 222, 240];
/// Of all tiles here, bytes.
const ALL: u64 = 32 << 20;

/// Level under the villa, hills beyond: 257 x 257 samples, 2 m apart.
pub fn hills() -> Raster {
    let raster = Raster::of([257, 257], |c, r| {
        let (x, z) = (2.0 * f64::from(c) - 256.0, 2.0 * f64::from(r) - 256.0);
        let far = ((x.hypot(z) - 60.0) / 60.0).clamp(0.0, 1.0);
        30.0 + far * 6.0 * ((x / 25.0).sin() + (z / 31.0).cos())
    });
    Raster { spacing: [2.0; 2], ..raster }
}

/// Mountains with some roughness: 513 x 513 samples, 10 m apart.
fn mountains() -> Raster {
    Raster::of([513, 513], |c, r| {
        let (x, z) = (f64::from(c), f64::from(r));
        let rough = f64::from((c.wrapping_mul(2_654_435_761) ^ r.wrapping_mul(40_503)) >> 16 & 0xff) / 255.0;
        120.0 * (x * 0.021).sin() * (z * 0.017).cos() + 25.0 * (x * 0.17 + z * 0.11).sin() + 4.0 * rough
    })
}

/// Writes a ground.
pub fn made(name: &str, mut raster: Raster) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name).with_extension("ground");
    written(&mut raster, &path);
    path
}

fn hills_around(name: &str) -> Land {
    Land::new(Ground::open(&made(name, hills()), ALL).unwrap(), None)
}

/// Somebody in the villa on a ground, in flat colours without panels.
fn visit(land: Option<Land>) -> (Canvas, Session<'static>) {
    let (canvas, mut session) = common::visit(villa(), Oracle::Software, SIZE);
    land.into_iter().for_each(|land| session.renderer.set_ground(land).unwrap());
    (session.view.mode, session.view.hud) = (Mode::PortalsAndPvs.into(), false);
    (canvas, session)
}

fn patches(renderer: &Renderer<'_>) -> usize {
    renderer.terrain.as_ref().unwrap().shown.patches().len()
}

#[test]
fn ground_shows_where_sky_was_outside_and_through_windows() {
    needs_device!();
    let path = path("villa_rotonda");
    let ((bare, mut without), (canvas, mut with)) = (visit(None), visit(Some(hills_around("shows"))));
    let mut through = 0;
    for frame in (0..path.frames.len()).step_by(3) {
        let [before, after] = [(&bare, &mut without), (&canvas, &mut with)].map(|(canvas, session)| {
            session.stand(&path, frame);
            drawn(canvas, session)
        });
        for (a, b) in before.iter().zip(&after) {
            // The villa stands above the ground: it is as it was.
            assert!(a == b || *a == SKY, "frame {frame}: {a:?} has become {b:?}");
            through += usize::from(a != b);
        }
    }
    assert!(through > 500, "{through} pixels of ground through windows and doors");
    // From outside, looking down at the villa: below the horizon nothing is sky.
    with.motion.walker = Walker::new(DVec3::new(60.0, 40.0, 60.0), DVec3::new(-1.0, -1.3, -1.0), true);
    let picture = drawn(&canvas, &mut with);
    assert!(picture.iter().all(|p| *p != SKY), "{} pixels of sky", picture.iter().filter(|p| **p == SKY).count());
}

#[test]
fn portals_windows_miss_no_pixel_and_save_most_of_the_ground() {
    needs_device!();
    let path = path("villa_rotonda");
    let mut walk = Walk::new(villa(), &path, Some(Oracle::Software), SIZE).unwrap();
    walk.renderer.set_ground(hills_around("windows")).unwrap();
    let mut tiles = [0; 2];
    for frame in 0..path.frames.len() {
        let camera = walk.camera(frame);
        let mut sums = Vec::new();
        for mode in [ViewMode::Hiz, Mode::Frustum.into(), Mode::PortalsAndPvs.into()] {
            let missed = walk.missed(camera, mode).unwrap().expect("counted");
            assert_eq!(missed.pixels, 0, "{mode}, frame {frame}: {missed:?}");
            sums.push(patches(&walk.renderer));
        }
        let home = walk.renderer.culling.last.as_ref().and_then(|last| last.home).expect("in a cell");
        if !villa().file.cells[home.index()].open {
            assert_eq!(sums[0], sums[1], "the device leaves ground alone");
            tiles = [tiles[0] + sums[1], tiles[1] + sums[2]];
        }
    }
    let [frustum, both] = tiles;
    assert!(both > 0 && both * 2 < frustum, "{both} tiles through portals, {frustum} in the frustum");
}

#[test]
fn who_sees_no_window_has_no_ground() {
    needs_device!();
    let path = path("villa_rotonda");
    let mut walk = Walk::new(villa(), &path, Some(Oracle::Software), SIZE).unwrap();
    walk.renderer.set_ground(hills_around("blind")).unwrap();
    let (mut none, mut some) = (0, 0);
    for (frame, turn) in (0..path.frames.len()).step_by(6).flat_map(|frame| (0..8).map(move |turn| (frame, turn))) {
        let eye = path.frames[frame].eye - villa().file.origin;
        let angle = f64::from(turn) * std::f64::consts::FRAC_PI_4;
        let target = eye + DVec3::new(angle.sin(), -0.2, angle.cos());
        let camera = Camera::look_at(eye, target, 0.8, 16.0 / 9.0);
        let missed = walk.missed(camera, Mode::PortalsAndPvs).unwrap().expect("counted");
        assert_eq!(missed.pixels, 0, "frame {frame}, turn {turn}: {missed:?}");
        let terrain = walk.renderer.terrain.as_ref().unwrap();
        if terrain.shown.windows.is_empty() {
            assert_eq!(patches(&walk.renderer), 0, "frame {frame}, turn {turn}");
            none += 1;
        } else {
            some += 1;
        }
    }
    assert!(none > 10 && some > 10, "{none} views without a window, {some} with one");
}

#[test]
fn the_alarm_sees_ground_that_was_left_out() {
    needs_device!();
    let path = path("villa_rotonda");
    let mut walk = Walk::new(villa(), &path, Some(Oracle::Software), SIZE).unwrap();
    walk.renderer.set_ground(hills_around("alarm")).unwrap();
    let outside = Camera::look_at(DVec3::new(60.0, 30.0, 60.0), DVec3::new(120.0, 0.0, 120.0), 1.0, 16.0 / 9.0);
    let mut seen = |camera, culled_by| {
        walk.draw(FrameRequest {
            culled_by: Some(culled_by),
            alarm: true,
            ..FrameRequest::new(camera, Mode::PortalsAndPvs)
        })
        .unwrap();
        walk.renderer.settle().unwrap();
        walk.renderer.readback.missed.clone().expect("counted")
    };
    assert_eq!(seen(outside, outside).pixels, 0);
    // Tiles for who looks up into the sky.
    let up = Camera::look_at(DVec3::new(60.0, 30.0, 60.0), DVec3::new(60.5, 60.0, 60.0), 1.0, 16.0 / 9.0);
    let missed = seen(outside, up);
    let ground = villa().scene.objects.len() + 1;
    assert!(missed.pixels > 10_000 && missed.objects[0].0.index() == ground, "{missed:?}");
}

#[test]
fn no_sky_shows_through_ground_while_tiles_are_missing_or_all_there() {
    needs_device!();
    let path = made("cracks", mountains());
    let whole = Ground::open(&path, ALL).unwrap();
    let slow = Scripted::new(&path, &whole, 0, 1);
    // As many slots as hold a part of the tiles.
    let late = Ground::from_disk(&whole, Box::new(slow), whole.cache_bytes() / 4);
    // The villa is out of sight, 200 m up; the top of the picture looks down by 15 degrees.
    let place = Placement { at: DVec3::new(0.0, 400.0, 0.0), degrees: 30.0 };
    for (name, ground, frames) in [("all there", whole, 1), ("one a frame", late, 60)] {
        let mut land = Land::new(ground, Some(place));
        land.limit = Limit::Pixels(4.0);
        let (canvas, mut session) = visit(Some(land));
        session.view.fov_y = 40f64.to_radians();
        session.view.mode = Mode::Frustum.into();
        let mut levels = BTreeSet::new();
        for frame in 0..frames {
            let (angle, down) = (0.05 * f64::from(frame), 35f64.to_radians());
            let along = DVec3::new(angle.sin() * down.cos(), -down.sin(), angle.cos() * down.cos());
            session.motion.walker = Walker::new(DVec3::new(90.0, 0.0, 90.0), along, true);
            let picture = drawn(&canvas, &mut session);
            let terrain = session.renderer.terrain.as_ref().unwrap();
            levels.extend(terrain.shown.patches().iter().map(|patch| patch.key.level));
            let sky = picture.iter().filter(|p| **p == SKY).count();
            // Until the coarsest tile has come there is nothing.
            assert!(sky == 0 || frame < 3, "{name}: frame {frame}: {sky} pixels of sky");
        }
        assert!(levels.len() > 1, "{name}: all tiles are of one level: {levels:?}");
    }
}

/// Columns and rows of peaks: one sample inside the corners of 2 x 2 tiles, all of them odd. Only the finest level has them, and all around
/// those four tiles nothing is that fine. So each of the four has two coarser neighbours, and its peak beside the corner between them.
const PEAKS: [u32; 2] = [65, 127];
/// Height of a peak, metres; of the eye; and how far away it is.
const PEAK: f64 = 40.0;
const LOW: f64 = 6.0;
const AWAY: f64 = 120.0;
/// Pixels that the picture may be from what it is held against.
const NEAR: f64 = 1.0;

/// What the library's mesh covers of a picture, by pixel: whether a triangle surely does, and whether one may. Triangles behind the eye are left
/// out.
fn covered(ground: &Ground, view: &GroundView<'_>, patches: &[Patch]) -> Vec<[bool; 2]> {
    let (screen, header) = (Screen::new(view), ground.header());
    let (grid, cells) = (&header.grid, header.grid.side() - 1);
    let [width, height] = view.size.map(f64::from);
    let mut covered = vec![[false; 2]; (view.size[0] * view.size[1]) as usize];
    for (patch, cell) in patches.iter().flat_map(|patch| (0..cells * cells).map(move |cell| (patch, cell))) {
        let place = |[i, j]: [u32; 2]| {
            let [x, z] = header.plan(grid.column(patch.key, i), grid.row(patch.key, j));
            let at = screen.at(DVec3::new(x, f64::from(ground.sample(patch.tile, [i, j])?), z))?;
            Some(DVec2::new(width / 2.0 + at.x, height / 2.0 - at.y))
        };
        for triangle in triangles_of(cell % cells, cell / cells, grid.side(), patch.coarser) {
            let [Some(a), Some(b), Some(c)] = triangle.map(place) else { continue };
            let turn = (b - a).perp_dot(c - a).signum();
            let low = (a.min(b).min(c) - NEAR).clamp(DVec2::ZERO, DVec2::new(width, height)).as_uvec2();
            let high = (a.max(b).max(c) + NEAR).clamp(DVec2::ZERO, DVec2::new(width, height)).as_uvec2();
            for (y, x) in (low.y..high.y).flat_map(|y| (low.x..high.x).map(move |x| (y, x))) {
                let p = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
                let within = |from: DVec2, to: DVec2| turn * (to - from).normalize_or_zero().perp_dot(p - from);
                let depth = within(a, b).min(within(b, c)).min(within(c, a));
                let [surely, maybe] = &mut covered[(y * view.size[0] + x) as usize];
                (*surely, *maybe) = (*surely || depth > NEAR, *maybe || depth > -NEAR);
            }
        }
    }
    covered
}

#[test]
fn a_peak_beside_the_corner_of_two_coarser_tiles_looks_as_the_library_has_it() {
    needs_device!();
    let is_peak = |c, r| PEAKS.contains(&c) && PEAKS.contains(&r);
    let raster = Raster::of([257, 257], |c, r| if is_peak(c, r) { PEAK } else { 0.0 });
    let ground = Ground::open(&made("corners", raster), ALL).unwrap();
    let tops = PEAKS.map(|r| PEAKS.map(|c| DVec2::from(ground.header().plan(c, r)))).concat();
    // The villa is out of sight, far above.
    let place = Placement { at: DVec3::new(0.0, 400.0, 0.0), degrees: 0.0 };
    let (canvas, mut session) = visit(Some(Land::new(ground, Some(place))));
    session.view.fov_y = 40f64.to_radians();
    session.view.mode = Mode::Frustum.into();
    let (mut between_two, mut compared, mut wrong) = (BTreeSet::new(), 0, Vec::new());
    for (top, turn) in tops.iter().flat_map(|top| (0..8).map(move |turn| (*top, turn))) {
        let away = AWAY * DVec2::from_angle(f64::from(turn) * std::f64::consts::FRAC_PI_4);
        let eye = DVec3::new(top.x + away.x, LOW, top.y + away.y);
        let land = &session.renderer.terrain.as_ref().unwrap().land;
        let eye = land.to_building(eye, villa().file.origin).as_dvec3();
        session.motion.walker = Walker::new(eye, DVec3::new(-away.x, 0.0, -away.y), true);
        let picture = drawn(&canvas, &mut session);
        let terrain = session.renderer.terrain.as_ref().unwrap();
        let view = GroundView { camera: terrain.shown.camera.unwrap(), size: SIZE, windows: &[Rect::FULL] };
        let covered = covered(&terrain.land.ground, &view, terrain.shown.patches());
        // Above the eye there are only peaks, all in front of it.
        let above = || picture.iter().zip(&covered).take((SIZE[0] * (SIZE[1] / 2 - 2)) as usize);
        let holes = above().filter(|(pixel, [surely, _])| **pixel == SKY && *surely).count();
        let more = above().filter(|(pixel, [_, maybe])| **pixel != SKY && !maybe).count();
        if holes + more > 0 {
            wrong.push(format!(
                "peak {top}, eye {away:.0} from it: {holes} pixels of sky in ground, {more} of ground in the sky"
            ));
        }
        compared += above().filter(|(_, [surely, _])| *surely).count();
        between_two
            .extend(terrain.shown.patches().iter().map(|patch| patch.coarser).filter(|sides| sides.count_ones() == 2));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(between_two, BTreeSet::from([0b0011, 0b0110, 0b1001, 0b1100]), "sides of tiles with two coarser neighbours");
    assert!(compared > 10_000, "{compared} pixels of peaks");
}

/// Six rooms in a row to the east, 4 x 4 m each, with doors in the middle of the walls between them. The last one has a window, at its side: who
/// goes east along the middle sees it from the doorway of that room, no sooner than from the room before.
fn row_of_rooms() -> Building {
    let mut row = boxes::Building::default();
    for x in (0..6).map(|k| 4.0 * f64::from(k)) {
        row.cell("room", vec![block(p(x, 0.0, 0.0), p(x + 4.0, 3.0, 4.0))]);
    }
    let outside = row.outside(p(0.0, 0.0, 0.0), p(24.0, 3.0, 4.0));
    let window = (p(22.0, 1.0, 4.0), p(23.0, 2.0, 4.0));
    row.portal(CellId(5), outside, window.0, window.1, PortalKind::Window);
    row.wall("side", p(0.0, 0.0, 4.0), p(24.0, 3.0, 4.0), &[window]);
    row.wall("other side", p(0.0, 0.0, 0.0), p(24.0, 3.0, 0.0), &[]);
    for room in 1..6 {
        let x = 4.0 * f64::from(room);
        let door = (p(x, 0.0, 1.5), p(x, 2.1, 2.5));
        row.portal(CellId(room - 1), CellId(room), door.0, door.1, PortalKind::Door);
        row.wall("between", p(x, 0.0, 0.0), p(x, 3.0, 4.0), &[door]);
    }
    by_hand(row)
}

/// The villa stands behind a ridge of 80 m, which is 200 m wide above: from the foot of the ridge nothing of it is drawn, from above and from
/// between all that the mode draws.
#[test]
fn objects_behind_a_ridge_are_not_drawn_and_none_is_missed() {
    needs_device!();
    let path = path("villa_rotonda");
    let ridge = Raster::of([513, 513], |c, _| (280.0 - 2.0 * (10.0 * f64::from(c) - 3210.0).abs()).clamp(0.0, 80.0));
    let at = made("ridge", ridge);
    let origin = villa().file.origin;
    let mut walk = Walk::new(villa(), &path, Some(Oracle::Software), SIZE).unwrap();
    let place = Placement { at: DVec3::ZERO, degrees: 30.0 };
    let land = Land::new(Ground::open(&at, ALL).unwrap(), Some(place));
    // To the east of the ridge, 2 m above the ground and 300 m; and between the ridge and the villa.
    let eyes = [(1000.0, 2.0), (1000.0, 300.0), (500.0, 2.0)].map(|(x, y)| land.to_building(DVec3::new(x, y, 0.0), origin));
    walk.renderer.set_ground(land).unwrap();
    for mode in [Mode::None, Mode::Frustum, Mode::PortalsAndPvs, Mode::Chc] {
        for (eye, is_hidden) in eyes.into_iter().zip([true, false, false]) {
            let camera = Camera::look_at(eye.as_dvec3(), DVec3::ZERO, 0.5, 16.0 / 9.0);
            let missed = walk.missed(camera, mode).unwrap().expect("counted");
            assert_eq!(missed.pixels, 0, "{mode} from {eye}: {missed:?}");
            let shown = walk.renderer.terrain.as_ref().unwrap().shown.objects;
            let last = walk.renderer.culling.last.as_ref().unwrap();
            let (drawn, counted) = (last.objects.len(), (last.stats.objects as usize, last.stats.triangles > 0));
            assert_eq!(counted, (drawn, drawn > 0), "{mode} from {eye}");
            let told = format!("{mode} from {eye}: {drawn} drawn, {shown} not");
            assert_eq!((drawn == 0, shown > 0), (is_hidden, is_hidden), "{told}");
            assert!(mode != Mode::None || drawn + shown == villa().scene.objects.len(), "{told}");
        }
    }
}

/// What a walk along the row asks of a disk that takes a tile a frame and answers four frames later.
#[derive(Default)]
struct Asked {
    /// Tiles in rooms from which three portals or more lead to a window, and in the others before a window is in view.
    far: u32,
    near: u32,
    /// Of the first frame that has a window in view.
    first: Loading,
}

/// Walks at 3 m/s until a window is in view. `enters`: the ground is told of the building.
fn walk_the_row(row: &Building, enters: bool) -> Asked {
    let path = made(if enters { "row-told" } else { "row" }, mountains());
    let whole = Ground::open(&path, ALL).unwrap();
    let late = Ground::from_disk(&whole, Box::new(Scripted::new(&path, &whole, 4, 1)), ALL);
    let mut land = Land::new(late, Some(Placement { at: DVec3::new(0.0, 300.0, 0.0), degrees: 0.0 }));
    if enters {
        land.enter(&row.file);
    }
    let mut culling = Culling::new(row, Oracle::Software, SIZE);
    let (mut shown, mut asked, mut loaded) = (Shown::default(), Asked::default(), 0);
    for frame in 0..440u32 {
        let eye = p(1.0 + 0.05 * f64::from(frame), 1.6, 2.0) - row.file.origin;
        let camera = Camera::look_at(eye, eye + DVec3::X, 1.0, 16.0 / 9.0);
        culling.decide(frame.into(), &camera, 0.01, Mode::PortalsAndPvs);
        let decision = culling.last.as_mut().unwrap();
        let home = decision.home.expect("in a room");
        land.select(decision, &row.file, SIZE, &mut shown);
        land.load_at(f64::from(frame) / 60.0, SIZE, &mut shown);
        if !shown.windows.is_empty() {
            asked.first = shown.loading;
            return asked;
        }
        assert!(shown.patches().is_empty(), "frame {frame}: ground without a window");
        loaded += shown.loading.loaded;
        let so_far = loaded + shown.loading.under_way;
        if home < CellId(4) {
            asked.far = so_far;
        } else {
            asked.near = so_far - asked.far;
        }
    }
    panic!("no window was seen");
}

#[test]
fn tiles_are_asked_for_two_portals_from_a_window_and_no_sooner() {
    let row = row_of_rooms();
    let [told, untold] = [true, false].map(|enters| walk_the_row(&row, enters));
    assert_eq!((told.far, untold.far, untold.near), (0, 0, 0), "asked for far from windows");
    assert!(told.near > 0, "nothing was asked for before a window was in view");
    let missing = |asked: &Asked| asked.first.wanted - asked.first.present;
    assert_eq!(told.first.wanted, untold.first.wanted);
    assert!(untold.first.present == 0 && untold.first.wanted > 3, "{:?}", untold.first);
    assert!(
        missing(&told) * 4 < missing(&untold),
        "{:?} after {} tiles, {:?} after none",
        told.first,
        told.near,
        untold.first
    );
}

#[test]
fn somebody_outside_stands_on_the_ground() {
    needs_device!();
    let (_, mut session) = visit(Some(hills_around("stands")));
    let origin = villa().file.origin;
    session.motion.walker = Walker::new(DVec3::new(150.0, 60.0, 80.0), DVec3::X, false);
    for _ in 0..100 {
        session.go(0.1, &MoveInput { to: DVec3::Z, hurry: false });
    }
    let terrain = session.renderer.terrain.as_ref().unwrap();
    let height = terrain.land.height(session.motion.walker.eye, origin).unwrap();
    assert!(session.motion.walker.eye.x > 160.0, "{}", session.motion.walker.eye);
    let above = session.motion.walker.eye.y - height;
    assert!((above - EYE).abs() < 0.3, "the eye is {above} m above the ground");
}

#[test]
fn tiles_are_shown_and_a_frozen_view_keeps_them() {
    needs_device!();
    let (canvas, mut session) = visit(Some(hills_around("tiles")));
    session.motion.walker = Walker::new(DVec3::new(60.0, 20.0, 60.0), DVec3::new(1.0, -0.3, 1.0), true);
    let plain = drawn(&canvas, &mut session);
    session.act(Action::Ground);
    let coloured = drawn(&canvas, &mut session);
    assert!(differ(&plain, &coloured) > 10_000, "{} pixels have other colours", differ(&plain, &coloured));
    let before = session.renderer.terrain.as_ref().unwrap().shown.patches().to_vec();
    session.freeze();
    session.motion.walker.turn(2.0, 0.0);
    drawn(&canvas, &mut session);
    assert_eq!(session.renderer.terrain.as_ref().unwrap().shown.patches(), before);
    assert!(!before.is_empty());
}

#[test]
fn the_golden_picture_of_ground() {
    needs_device!();
    let (canvas, mut session) = visit(Some(hills_around("golden")));
    session.motion.walker = Walker::new(DVec3::new(45.0, 18.0, 60.0), DVec3::new(-0.6, -0.2, -0.9), true);
    drawn(&canvas, &mut session);
    let picture = canvas.read(&session.renderer.gpu).unwrap();
    common::compare("ground", &picture);
}
