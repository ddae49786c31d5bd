//! What explains the culling: kinds of triangles, two modes side by side, frozen frames, profiles, the flight along a line of sight.

use crate::common::{self, needs_device, path, sampled, shipped, villa};
use enfilade::runtime::Mode;
use enfilade::scene::ImportOptions;
use enfilade_formats::import;
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_viewer::args::Shown;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::marks::Marking;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::headless::Walk;
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::output_files::OutputFiles;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::{MoveInput, Walker};
use glam::DVec3;
use testing::boxes::p;

const SIZE: [u32; 2] = [320, 180];

fn visit(building: &Building, oracle: Oracle) -> (Canvas, Session<'_>) {
    let (canvas, mut session) = common::visit(building, oracle, SIZE);
    session.view.hud = false;
    session.view.mode = Mode::PortalsAndPvs.into();
    (canvas, session)
}

/// The frame of the villa's walk that the fewest objects are drawn in.
fn innermost(session: &mut Session<'_>, canvas: &Canvas, path: &CameraPath) -> usize {
    let mut objects = |frame: usize| {
        session.stand(path, frame);
        draw(canvas, session);
        session.renderer.culling.last.as_ref().unwrap().objects.len()
    };
    (0..path.frames.len()).step_by(5).min_by_key(|&frame| objects(frame)).unwrap()
}

/// A frame; returns its pixels.
fn draw(canvas: &Canvas, session: &mut Session<'_>) -> Vec<[u8; 3]> {
    let pixels = common::drawn(canvas, session);
    session.renderer.settle().unwrap();
    pixels
}

#[test]
fn triangles_of_boxes_are_of_the_kinds_that_one_counts_by_hand() {
    needs_device!();
    // Twelve triangles each: a box before the eye, of which the front shows; one hidden by it; one behind the eye.
    let things = [
        ("before", p(-1.0, -1.0, -4.0), p(1.0, 1.0, -3.0)),
        ("hidden", p(-0.2, -0.2, -6.0), p(0.2, 0.2, -5.0)),
        ("behind", p(-1.0, -1.0, 3.0), p(1.0, 1.0, 4.0)),
    ];
    let hall = common::hall(10.0, &things);
    let (canvas, mut session) = visit(&hall, Oracle::Software);
    session.motion.walker = Walker::new(p(0.0, 0.0, 0.0) - hall.file.origin, DVec3::NEG_Z, true);
    session.act(Action::Waste);
    let of_library = [(Mode::Frustum, [2, 22, 12]), (Mode::None, [2, 34, 0]), (Mode::Chc, [2, 10, 24])];
    let of_device = [(ViewMode::Hiz, [2, 10, 24])];
    for (mode, kinds) in of_library.map(|(mode, kinds)| (mode.into(), kinds)).into_iter().chain(of_device) {
        session.view.mode = mode;
        // Queries need a frame to know what hides, and a pyramid another one.
        (0..3).for_each(|_| drop(draw(&canvas, &mut session)));
        assert_eq!(session.renderer.kinds(), Some(kinds), "{mode}");
        // The front is as large as 2 m at 3 m: at 65 degrees 94 pixels a side. Its two faces fill it once.
        let side = (2.0 / 3.0 / (2.0 * 32.5f64.to_radians().tan()) * f64::from(SIZE[1])).round();
        let filled = session.renderer.readback.marked.as_ref().unwrap().pixels;
        assert!((filled[0] as f64 - side * side).abs() < 2.0 * side, "{mode}: {filled:?}");
        let picture = session.screenshot().unwrap();
        let green = picture.pixels().iter().filter(|[r, g, b]| g > r && g > b).count();
        assert_eq!(green as u64, filled[0], "{mode}: what is seen is green");
    }
}

#[test]
fn every_mode_draws_all_that_is_seen() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    for frame in (0..path.frames.len()).step_by(12) {
        let mut seen = Vec::new();
        let ways = [Mode::None, Mode::Portals, Mode::PortalsAndPvs, Mode::Chc].map(|mode| (mode.into(), Oracle::Software));
        let of_device = [(Mode::Chc.into(), Oracle::Device), (ViewMode::Hiz, Oracle::Device)];
        for (mode, oracle) in ways.into_iter().chain(of_device) {
            let mut walk = Walk::new(villa, &path, Some(oracle), SIZE).unwrap();
            walk.renderer.set_marking(Marking::Counted).unwrap();
            let camera = walk.camera(frame);
            for _ in 0..3 {
                let request = FrameRequest::new(camera, mode);
                walk.draw(request).unwrap();
                walk.renderer.settle().unwrap();
            }
            let kinds = walk.renderer.kinds().expect("told apart");
            let all: u64 = walk.renderer.mesh.ranges.iter().map(|range| u64::from(range.end - range.start) / 3).sum();
            assert_eq!(kinds.iter().sum::<u64>(), all, "frame {frame}, {mode} by {oracle:?}");
            seen.push(kinds[0]);
        }
        assert!(seen[0] > 0 && seen.iter().all(|n| *n == seen[0]), "frame {frame}: {seen:?}");
    }
}

#[test]
fn halves_are_what_either_mode_draws_alone() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let (canvas, mut session) = visit(villa, Oracle::Software);
    session.view.culled = false;
    let frame = innermost(&mut session, &canvas, &path);
    session.stand(&path, frame);
    draw(&canvas, &mut session);
    // From where what both modes draw differs.
    session.freeze();
    session.motion.walker = Walker::new(DVec3::new(-30.0, 25.0, 30.0), DVec3::new(1.0, -0.8, -1.0), true);
    // Lines are of what the frame before decided.
    let twice = |session: &mut Session<'_>| {
        draw(&canvas, session);
        draw(&canvas, session)
    };
    session.act(Action::Mode(1));
    let frustum = twice(&mut session);
    session.act(Action::Mode(4));
    let both = twice(&mut session);
    let differ = |a: &[[u8; 3]], b: &[[u8; 3]], left: bool| {
        let is_in = |i: usize| if left { i % 320 < 160 } else { i % 320 >= 162 };
        (0..a.len()).filter(|&i| is_in(i) && a[i] != b[i]).count()
    };
    assert!(differ(&frustum, &both, false) > 500, "the modes are as good as the same here");
    session.act(Action::Split);
    let split = twice(&mut session);
    assert_eq!([differ(&split, &both, true), differ(&split, &frustum, false)], [0, 0]);
    // The right half by another mode, chosen by Shift and its number.
    session.act(Action::OtherMode(4));
    assert_eq!(differ(&twice(&mut session), &both, false), 0);
    session.act(Action::Split);
    assert!(twice(&mut session) == both && !session.is_on(Action::Split));
}

#[test]
fn glass_shows_what_a_frozen_frame_left_out() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let (canvas, mut session) = visit(villa, Oracle::Software);
    let frame = innermost(&mut session, &canvas, &path);
    session.stand(&path, frame);
    let live = draw(&canvas, &mut session);
    session.act(Action::Culled);
    assert!(live == draw(&canvas, &mut session), "it shows in frozen frames only");
    session.freeze();
    session.motion.walker = Walker::new(DVec3::new(-30.0, 25.0, 30.0), DVec3::new(1.0, -0.8, -1.0), true);
    let bare = draw(&canvas, &mut session);
    session.act(Action::Culled);
    let with = draw(&canvas, &mut session);
    // All of the villa is drawn or is glass: whatever has a pixel of it in the frame of everything differs from the sky.
    session.act(Action::Freeze);
    session.motion.walker = Walker::new(DVec3::new(-30.0, 25.0, 30.0), DVec3::new(1.0, -0.8, -1.0), true);
    session.act(Action::Mode(0));
    let all = draw(&canvas, &mut session);
    let sky = all[0];
    let covered = |pixels: &[[u8; 3]]| pixels.iter().filter(|pixel| **pixel != sky).count();
    assert!(covered(&bare) < covered(&all) / 2, "{} of {}", covered(&bare), covered(&all));
    // The frozen frustum's lines may lie on the sky.
    let missing = (0..all.len()).filter(|&i| all[i] != sky && with[i] == sky).count();
    assert_eq!(missing, 0);
}

#[test]
fn a_profile_has_every_frame_and_leads_to_it() {
    needs_device!();
    let villa = villa();
    let mut short = path("villa_rotonda");
    short.frames = short.frames.into_iter().step_by(20).collect();
    let folder = common::folder("insight");
    let (canvas, mut session) = visit(villa, Oracle::Software);
    session.document.output = OutputFiles::beside(&folder.join("villa.glb"));
    session.act(Action::Heat);
    assert!(!session.is_on(Action::Heat), "there is nothing to colour by yet");
    session.play_path(short.clone());
    session.act(Action::Play);
    session.begin(None);
    let home = session.motion.walker.eye;
    session.act(Action::Profile);
    let mut drawn = 0;
    while !session.insight.profile.as_ref().unwrap().is_done() {
        draw(&canvas, &mut session);
        drawn += 1;
        assert!(drawn <= short.frames.len() + 4, "it doesn't end");
    }
    assert_eq!(session.motion.walker.eye, home, "who was led along is back");
    // The same frames, one by one.
    let costs = session.insight.profile.as_ref().unwrap().costs.clone();
    assert_eq!(costs.len(), short.frames.len());
    session.view.layers.alarm = true;
    for (frame, cost) in costs.iter().enumerate() {
        session.stand(&short, frame);
        draw(&canvas, &mut session);
        let missed = session.renderer.readback.missed.as_ref().map(|missed| missed.pixels);
        assert_eq!((cost.triangles, Some(cost.missed_pixels)), (session.renderer.triangles(), missed), "frame {frame}");
        assert!(cost.seen > 0 && cost.seen <= cost.triangles && cost.ms >= cost.cull_ms, "frame {frame}: {cost:?}");
    }
    session.view.layers.alarm = false;
    let profile = session.insight.profile.as_ref().unwrap();
    let frames = profile.costs.len() as u32;
    assert!(profile.seen.iter().all(|n| *n <= frames) && profile.seen.iter().any(|n| *n > 0));
    assert!(profile.seen.contains(&0), "the path sees all of the villa");
    // Colours of both kinds, then none.
    let mut pictures = vec![draw(&canvas, &mut session)];
    for _ in 0..2 {
        session.act(Action::Heat);
        assert!(session.is_on(Action::Heat));
        pictures.push(draw(&canvas, &mut session));
    }
    session.act(Action::Heat);
    assert!(!session.is_on(Action::Heat) && pictures[0] == draw(&canvas, &mut session));
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    // Escape closes it.
    assert!(session.is_on(Action::Profile));
    session.escape(false);
    assert!(!session.is_on(Action::Profile) && session.insight.profile.is_some());
}

#[test]
fn one_flies_along_the_line_of_sight_and_escape_ends_it() {
    needs_device!();
    // With witnesses.
    let model = shipped("villa_rotonda", "glb");
    let villa = sampled(import(&model, &ImportOptions::default()).unwrap(), &model, 20_000);
    let (canvas, mut session) = visit(&villa, Oracle::Software);
    // What a place sees is witnessed from somewhere in its cell.
    let path = path("villa_rotonda");
    let frame = (0..path.frames.len()).find(|&frame| {
        session.stand(&path, frame);
        session.show_this(Shown::Why);
        session.selection.sight().is_some()
    });
    assert!(frame.is_some(), "nothing on the path has a witness");
    let [from, to] = session.selection.sight().unwrap();
    session.fly_along_sight();
    session.go(0.0, &MoveInput::default());
    assert!(session.motion.walker.eye.distance(from) < 1e-9);
    let mut before = session.motion.walker.eye.distance(to);
    for _ in 0..200 {
        session.go(0.1, &MoveInput::default());
        let now = session.motion.walker.eye.distance(to);
        assert!(now <= before + 1e-9 && session.motion.walker.forward().dot((to - from).normalize()) > 0.999);
        before = now;
    }
    assert!(before < 0.5 && before > 0.0, "{before} m before the end");
    session.fly_along_sight();
    session.go(0.1, &MoveInput::default());
    session.escape(false);
    let there = session.motion.walker.eye;
    session.go(0.5, &MoveInput::default());
    assert!(session.motion.walker.eye.distance(there) < 1.0 && session.selection.sight().is_none());
    draw(&canvas, &mut session);
}

#[test]
fn a_path_of_one_frame_has_a_profile() {
    needs_device!();
    let (_, mut session) = visit(villa(), Oracle::Software);
    let eye = DVec3::new(0.0, 1.7, 30.0);
    let frames = vec![PathFrame { eye, target: eye + DVec3::NEG_Z }];
    let path = CameraPath { name: "one".into(), fov_y_degrees: 65.0, near: 0.01, frames };
    session.profile(path).unwrap();
    assert_eq!(session.insight.profile.as_ref().unwrap().costs.len(), 1);
}
