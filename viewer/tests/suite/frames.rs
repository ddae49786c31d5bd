//! Frames on a device: no mode misses a pixel, the alarm sees what is broken on purpose, pictures are as they were.

use crate::common::{self, differ, drawn, needs_device, path, villa};
use enfilade::runtime::Mode;
use enfilade_viewer::args::Shown;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::headless::Walk;
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::session::Session;

const SIZE: [u32; 2] = [320, 180];

/// Somebody in a building whose frames are culled by both, and what they are drawn on.
fn visit(building: &Building) -> (Canvas, Session<'_>) {
    let (canvas, mut session) = common::visit(building, Oracle::Software, SIZE);
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
        let (mut least, mut sum) = (u64::MAX, 0);
        for frame in 0..path.frames.len() {
            let missed = walk.missed(walk.camera(frame), mode).unwrap().expect("counted");
            assert_eq!(missed.pixels, 0, "{mode} by {oracle:?}, frame {frame}: {missed:?}");
            least = least.min(walk.renderer.triangles());
            sum += walk.renderer.triangles();
        }
        // That something was culled at all is what makes it a test.
        let all = villa.scene.triangles.len() as u64;
        assert!(mode.name() == "none" || least < all / 2, "{mode} by {oracle:?} drew {least} of {all} at least");
        let most = all * path.frames.len() as u64 / 4;
        assert!(mode != Mode::Chc.into() || (1..most).contains(&sum), "{oracle:?} hides less than three quarters: {sum}");
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
        common::compare(name, &picture);
    }
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
fn a_mirror_shows_something_else_and_the_fifth_takes_all_down() {
    needs_device!();
    let villa = villa();
    let (canvas, mut session) = visit(villa);
    session.view.hud = false;
    let mut most = 0;
    for _ in 0..8 {
        session.motion.walker.turn(std::f64::consts::FRAC_PI_4, 0.0);
        let mut with = |hang: usize| {
            (0..hang).for_each(|_| session.act(Action::Mirror));
            drawn(&canvas, &mut session)
        };
        let [bare, hung, cleared] = [with(0), with(1), with(4)];
        most = most.max(differ(&bare, &hung));
        assert!(bare == cleared, "a mirror is left");
    }
    // Of 57,600 pixels.
    assert!(most > 1000, "no mirror shows: {most} pixels changed");
}
