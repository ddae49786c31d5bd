//! What a person does who keeps the viewer open: pictures and paths as files, the wheel, and Escape.

use crate::common::{self, differ, drawn, has_device, villa};
use enfilade::runtime::Mode;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_viewer::args::Shown;
use enfilade_viewer::commands::{Action, TABLE};
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::output_files::OutputFiles;
use enfilade_viewer::session::Session;
use enfilade_viewer::settings::Settings;
use enfilade_viewer::walker::MoveInput;
use glam::{DVec2, DVec3};
use std::path::PathBuf;

const SIZE: [u32; 2] = [320, 180];

/// Somebody where a visit begins, and an empty folder that their files go to.
fn visit(test: &str) -> Option<(Canvas, Session<'static>, PathBuf)> {
    if !has_device() {
        return None;
    }
    let folder = common::folder(&format!("habits/{test}"));
    let (canvas, mut session) = common::visit(villa(), Oracle::Software, SIZE);
    session.view.mode = Mode::PortalsAndPvs.into();
    session.document.output = OutputFiles::beside(&folder.join("villa.glb"));
    session.begin(None);
    Some((canvas, session, folder))
}

#[test]
fn a_screenshot_is_what_is_drawn_without_the_panels() {
    let Some((canvas, mut session, folder)) = visit("a_screenshot_is_what_is_drawn_without_the_panels") else { return };
    session.view.hud = false;
    session.act(Action::Layer(Shown::Portals));
    drawn(&canvas, &mut session);
    let bare = drawn(&canvas, &mut session);
    for action in [Action::Hud, Action::Menu, Action::Preferences, Action::Layer(Shown::Plan)] {
        session.act(action);
    }
    session.view.crosshair = true;
    drawn(&canvas, &mut session);
    let panels = drawn(&canvas, &mut session);
    assert!(differ(&panels, &bare) > 5000, "no panels show");
    session.act(Action::Screenshot);
    session.act(Action::Screenshot);
    for name in ["villa-1.png", "villa-2.png"] {
        assert_eq!(differ(&common::read(&folder.join(name)), &bare), 0, "{name} of {} pixels", bare.len());
    }
    // And it is told, once the line has its size.
    drawn(&canvas, &mut session);
    assert!(drawn(&canvas, &mut session) != panels);
}

#[test]
fn a_recorded_path_is_where_the_walker_was_and_is_played_there() {
    let Some((_, mut session, folder)) = visit("a_recorded_path_is_where_the_walker_was_and_is_played_there") else {
        return;
    };
    session.motion.walker.flies = true;
    let origin = villa().file.origin;
    let mut places = vec![session.motion.walker.eye + origin];
    session.act(Action::Record);
    for step in 0..20 {
        session.look(DVec2::new(f64::from(step), 0.0));
        session.go(0.1, &MoveInput { to: DVec3::new(0.2, 0.1, 1.0), hurry: false });
        places.push(session.motion.walker.eye + origin);
    }
    let forward = session.motion.walker.forward();
    // Somebody stands still for less than a frame: whatever is rounded, the last place is in.
    session.go(0.05, &MoveInput::default());
    session.act(Action::Record);
    let path = CameraPath::load(&folder.join("villa-1.path.json")).unwrap();
    assert_eq!(path.frames.len(), places.len());
    for (frame, place) in path.frames.iter().zip(&places) {
        assert!(frame.eye.distance(*place) < 1e-6, "{} is not {place}", frame.eye);
    }
    let last = path.frames[places.len() - 1];
    assert!((last.target - last.eye).distance(forward) < 1e-6);
    assert!(places[0].distance(places[20]) > 5.0, "nobody went anywhere");

    // Elsewhere, and back along the path: who walked before walks after.
    session.motion.walker.eye += DVec3::splat(30.0);
    session.motion.walker.flies = false;
    session.act(Action::Play);
    session.go(1.0, &MoveInput { to: DVec3::X, hurry: true });
    let mut kept = Settings::default();
    session.remember(&mut kept);
    assert!(!kept.flies, "a path makes nobody fly the next time");
    assert!((session.motion.walker.eye + origin).distance(places[10]) < 1e-6 && session.motion.walker.flies);
    session.go(1.5, &MoveInput::default());
    assert!((session.motion.walker.eye + origin).distance(places[20]) < 1e-6 && !session.motion.walker.flies);
    assert!(!session.is_on(Action::Play));
    // A path from a file, and on along it when more is known of the building.
    session.play_path(CameraPath { frames: path.frames[5..].to_vec(), ..path });
    assert!((session.motion.walker.eye + origin).distance(places[5]) < 1e-6 && session.is_on(Action::Play));
    session.act(Action::Record);
    session.act(Action::Layer(Shown::Keys));
    let ongoing = session.ongoing();
    let Some((_, mut next, _)) = visit("a_recorded_path_is_where_the_walker_was_and_is_played_there") else { return };
    next.go_on(ongoing);
    assert!(next.is_on(Action::Play) && next.is_on(Action::Record) && next.is_on(Action::Layer(Shown::Keys)));
    next.go(0.5, &MoveInput::default());
    assert!((next.motion.walker.eye + origin).distance(places[10]) < 1e-6);
    assert!(next.save_recording() && folder.join("villa-1.path.json").exists());
}

#[test]
fn the_wheel_and_the_settings_change_how_somebody_goes_and_looks() {
    let Some((_, mut session, _)) = visit("the_wheel_and_the_settings_change_how_somebody_goes_and_looks") else { return };
    session.motion.walker.flies = true;
    let far = |session: &mut Session<'_>| {
        let from = session.motion.walker.eye;
        session.go(0.1, &MoveInput { to: DVec3::X, hurry: false });
        from.distance(session.motion.walker.eye)
    };
    let usual = far(&mut session);
    session.wheel(1e6, false);
    assert!((far(&mut session) / usual - 10.0).abs() < 1e-6);
    session.wheel(-1e6, false);
    assert!((far(&mut session) / usual - 0.1).abs() < 1e-6);
    for (notches, degrees) in [(1e6, 20.0), (-1e6, 110.0)] {
        session.wheel(notches, true);
        assert!((session.view.fov_y.to_degrees() - degrees).abs() < 1e-9);
    }
    session.motion.walker.yaw = 1.0;
    let mut looked = |sensitivity, inverted| {
        (session.user.preferences.sensitivity, session.user.preferences.inverted) = (sensitivity, inverted);
        let from = (session.motion.walker.yaw, session.motion.walker.pitch);
        session.look(DVec2::new(10.0, 10.0));
        let by = (session.motion.walker.yaw - from.0, session.motion.walker.pitch - from.1);
        session.look(DVec2::new(-10.0, -10.0));
        by
    };
    let (right, up) = looked(1.0, false);
    assert!(right > 0.0 && up < 0.0, "the mouse went right and down");
    let (double, inverted) = looked(2.0, true);
    assert!((double - 2.0 * right).abs() < 1e-9 && (inverted + 2.0 * up).abs() < 1e-9);
}

#[test]
fn escape_closes_and_asks_before_a_recording_is_lost() {
    let Some((_, mut session, folder)) = visit("escape_closes_and_asks_before_a_recording_is_lost") else { return };
    [Action::Layer(Shown::Keys), Action::Preferences, Action::Record].into_iter().for_each(|action| session.act(action));
    assert!(session.escape(true), "the mouse is let go first");
    assert!(session.view.keys && session.view.preferences);
    assert!(!session.escape(false) && !session.view.keys && session.view.preferences);
    assert!(!session.escape(false) && !session.view.preferences && !session.view.question);
    assert!(!session.escape(false) && session.view.question && !session.window.quit);
    // No; then the recording is saved, and there is nothing to ask.
    session.escape(false);
    assert!(!session.view.question && !session.window.quit);
    session.act(Action::Record);
    assert!(folder.join("villa-1.path.json").exists());
    session.close();
    assert!(session.window.quit && !session.view.question);
}

#[test]
fn what_a_button_toggles_is_on_or_off() {
    let Some((_, mut session, _)) = visit("what_a_button_toggles_is_on_or_off") else { return };
    for entry in &TABLE {
        let (name, action) = (entry.label, entry.action);
        match action {
            Action::Door | Action::Mirror | Action::Pick | Action::Screenshot | Action::Play => {}
            // What was picked, the storey that the plan shows, and files have no state of their own.
            Action::Hide | Action::Isolate | Action::ShowAll | Action::Storey(_) | Action::SavePlan => {}
            Action::TurnSection => {}
            // Of a profile, of a ground and of tubes: see tests/insight.rs, tests/ground.rs and tests/tubes.rs.
            Action::Heat | Action::Ground | Action::Tubes => {}
            Action::Open => {
                session.act(action);
                assert!(session.window.open);
            }
            Action::FullScreen => {
                session.act(action);
                assert!(session.window.full_screen);
            }
            Action::Mode(_) => {
                session.act(action);
                let on = TABLE.iter().filter(|e| matches!(e.action, Action::Mode(_)) && session.is_on(e.action));
                assert!(on.map(|e| e.action).eq([action]), "{name}");
            }
            toggled => {
                let before = session.is_on(toggled);
                session.act(toggled);
                assert_ne!(session.is_on(toggled), before, "{name}");
                session.act(toggled);
                assert_eq!(session.is_on(toggled), before, "{name}");
            }
        }
    }
}

/// A window may be as small as one pixel.
#[test]
fn all_panels_fit_into_a_window_of_one_pixel() {
    let Some((_, mut session, _)) = visit("all_panels_fit_into_a_window_of_one_pixel") else { return };
    let panels = [Shown::Plan, Shown::Matrix, Shown::Graphs, Shown::Keys, Shown::Names].map(Action::Layer);
    let others =
        [Action::Menu, Action::Preferences, Action::Find, Action::Section, Action::Pick, Action::Split, Action::Waste];
    panels.into_iter().chain(others).for_each(|action| session.act(action));
    for size in [[1, 1], [1, 200], [300, 1], [2, 2], SIZE] {
        session.resize(size);
        let canvas = Canvas::new(&session.renderer.gpu, size);
        for _ in 0..3 {
            session.draw(&canvas.view, Default::default(), 0.1).unwrap();
        }
    }
    session.renderer.settle().unwrap();
}
