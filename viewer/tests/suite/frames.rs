//! Frames on a device: no mode misses a pixel, the alarm sees what is broken on purpose, pictures are as they were.

use crate::common::{building, needs_device, path};
use enfilade::runtime::Mode;
use enfilade::types::portal::PortalKind;
use enfilade_viewer::args::Shown;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::headless::Walk;
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::MoveInput;
use std::sync::OnceLock;

const SIZE: [u32; 2] = [320, 180];

/// Baked once for all tests here.
fn villa() -> &'static Building {
    static VILLA: OnceLock<Building> = OnceLock::new();
    VILLA.get_or_init(|| building("villa_rotonda"))
}

/// Somebody in a building whose frames are culled by both, and what they are drawn on.
fn visit(building: &Building) -> (Canvas, Session<'_>) {
    let (canvas, mut session) = crate::common::visit(building, Oracle::Software, SIZE);
    session.view.mode = Mode::PortalsAndPvs.into();
    (canvas, session)
}

/// Modes and oracles, every sensible pair.
fn ways() -> Vec<(ViewMode, Oracle)> {
    let software = ViewMode::ALL.into_iter().map(|mode| (mode, Oracle::Software));
    software.chain([Mode::Chc, Mode::Auto].map(|mode| (mode.into(), Oracle::Device))).collect()
}

#[test]
fn no_mode_misses_a_pixel_on_the_recorded_walk() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    for (mode, oracle) in ways() {
        let mut walk = Walk::new(villa, &path, Some(oracle), SIZE).unwrap();
        let (mut least, mut seen) = (u64::MAX, 0);
        for frame in 0..path.frames.len() {
            let missed = walk.missed(walk.camera(frame), mode).unwrap().expect("counted");
            assert_eq!(missed.pixels, 0, "{mode} by {oracle:?}, frame {frame}: {missed:?}");
            least = least.min(walk.renderer.triangles());
            seen += 1;
        }
        assert!(seen > 30);
        // That something was culled at all is what makes it a test.
        let all = villa.scene.triangles.len() as u64;
        assert!(mode.name() == "none" || least < all / 2, "{mode} by {oracle:?} drew {least} of {all} at least");
    }
}

#[test]
fn the_alarm_sees_a_row_that_was_broken_on_purpose() {
    needs_device!();
    let (sound, path) = (villa(), path("villa_rotonda"));
    let mode = Mode::Pvs;
    // What fills the most pixels of a frame is taken out of the row of the frame's cell.
    let frame = path.frames.len() / 2;
    let mut walk = Walk::new(sound, &path, None, SIZE).unwrap();
    let camera = walk.camera(frame);
    assert_eq!(walk.missed(camera, mode).unwrap().expect("counted").pixels, 0);
    let home = walk.renderer.culling.last.as_ref().and_then(|d| d.home).expect("in a cell");
    let mut worst = (0, enfilade::ObjectId(0));
    for object in sound.file.objects_seen(home).collect::<Vec<_>>() {
        let mut broken = sound.clone();
        broken.file.object_rows.as_mut().expect("rows").clear(home.index(), object.index());
        let area = sound.scene.objects[object.index()].bounds.diagonal();
        if area > sound.scene.objects[worst.1.index()].bounds.diagonal() || worst.0 == 0 {
            let mut walk = Walk::new(&broken, &path, None, SIZE).unwrap();
            let missed = walk.missed(camera, mode).unwrap().expect("counted");
            if missed.pixels > worst.0 {
                worst = (missed.pixels, object);
                assert_eq!(missed.objects[0].0, object, "the alarm names another object: {missed:?}");
                let magenta = walk.picture().unwrap().pixels().iter().filter(|p| **p == [255, 0, 255]).count();
                assert_eq!(magenta, missed.pixels as usize, "as many pixels are magenta as are counted");
            }
        }
        if worst.0 > 200 {
            break;
        }
    }
    assert!(worst.0 > 200, "no object was missed: {worst:?}");
}

#[test]
fn golden_pictures() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let frame = path.frames.len() / 3;
    let shows: [(&str, &[Action]); 5] = [
        ("plain", &[]),
        ("cells", &[Action::Cells]),
        ("portals", &[Action::Layer(Shown::Portals)]),
        ("frozen", &[Action::Freeze]),
        ("full", &[Action::Detail]),
    ];
    for (name, actions) in shows {
        let (canvas, mut session) = visit(villa);
        session.stand(&path, frame);
        session.view.hud = false;
        session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
        actions.iter().for_each(|&action| session.act(action));
        if session.is_frozen() {
            // Out and up, looking back.
            let along = session.motion.walker.forward();
            session.motion.walker.eye -= along * 14.0 - glam::DVec3::Y * 9.0;
            session.motion.walker.turn(0.0, -0.45);
        }
        session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
        let picture = canvas.read(&session.renderer.gpu).unwrap();
        crate::common::compare(name, &picture);
    }
}

#[test]
fn doors_shut_and_open_again() {
    needs_device!();
    let villa = villa();
    let (canvas, mut session) = visit(villa);
    session.motion.walker.flies = true;
    // Before a door, looking at it.
    let doors = villa.file.portals.iter().filter(|p| p.kind == PortalKind::Door && p.plane.y.abs() < 0.1);
    let mut done = 0;
    for door in doors {
        let middle = enfilade_viewer::doors::middle(&door.winding).as_dvec3();
        let n = door.plane.truncate().as_dvec3();
        session.motion.walker = enfilade_viewer::walker::Walker::new(middle - n * 1.5, n, true);
        let mut drawn = || {
            session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
            let objects = session.renderer.culling.last.as_ref().unwrap().objects.len();
            session.act(Action::Door);
            // Until its leaf is at rest.
            session.go(1.0, &MoveInput::default());
            objects
        };
        let [open, shut, again] = [drawn(), drawn(), drawn()];
        session.act(Action::Door);
        session.go(1.0, &MoveInput::default());
        assert_eq!(open, again, "a door that is opened again shows what it showed");
        assert!(shut <= open);
        done += usize::from(shut < open);
    }
    assert!(done >= 4, "{done} doors of the villa hid anything");
}

#[test]
fn a_lost_device_is_one_line() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let mut walk = Walk::new(villa, &path, None, SIZE).unwrap();
    let camera = walk.camera(0);
    let request = || FrameRequest::new(camera, Mode::Auto);
    walk.draw(request()).unwrap();
    walk.renderer.gpu.close();
    let line = walk.draw(request()).unwrap_err();
    assert!(line.contains("failed: ") && line.lines().count() == 1, "{line}");
}

#[test]
fn either_oracle_hides_three_quarters_of_the_villa() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let mode = Mode::Chc;
    let mut device = Walk::new(villa, &path, Some(Oracle::Device), SIZE).unwrap();
    let mut software = Walk::new(villa, &path, Some(Oracle::Software), SIZE).unwrap();
    let mut sums = [0, 0];
    for frame in 0..path.frames.len() {
        for (walk, sum) in [&mut device, &mut software].into_iter().zip(&mut sums) {
            walk.missed(walk.camera(frame), mode).unwrap();
            *sum += walk.renderer.triangles();
        }
    }
    let all = (villa.scene.triangles.len() * path.frames.len()) as u64;
    assert!(sums.iter().all(|&sum| sum > 0 && sum * 4 < all), "{sums:?} of {all}");
}

#[test]
fn a_mirror_shows_something_else_and_the_fifth_takes_all_down() {
    needs_device!();
    let villa = villa();
    let (canvas, mut session) = visit(villa);
    session.view.hud = false;
    let mut most = 0;
    for _ in 0..8 {
        session.motion.walker.turn(std::f64::consts::FRAC_PI_4, 0.0);
        let mut drawn = |hang: usize| {
            (0..hang).for_each(|_| session.act(Action::Mirror));
            session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
            canvas.read(&session.renderer.gpu).unwrap()
        };
        let [bare, hung, cleared] = [drawn(0), drawn(1), drawn(4)];
        let changed = bare.pixels().iter().zip(hung.pixels()).filter(|(a, b)| a != b).count();
        most = most.max(changed);
        assert!(bare.pixels() == cleared.pixels(), "a mirror is left");
    }
    // Of 57,600 pixels.
    assert!(most > 1000, "no mirror shows: {most} pixels changed");
}
