//! Sections: caps whose pixels are known, what is cut away, and that nobody misses it.

use crate::common::{self, made, needs_device, path, villa};
use enfilade::cells::PortalKind;
use enfilade::runtime::Mode;
use enfilade::scene::ImportOptions;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::slice::Section;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::looks::{Detail, Looks};
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::Walker;
use glam::{DVec2, DVec3};
use std::path::Path;
use testing::boxes::{self, block, p};

const SIZE: [u32; 2] = [640, 480];
const MODES: [Mode; 5] = [Mode::None, Mode::Frustum, Mode::Pvs, Mode::PortalsAndPvs, Mode::Chc];
/// Of caps.
const CAP: [u8; 3] = [69, 74, 84];

/// A room of 6 by 4 m under a ceiling, with a pillar of 1 by 1 m and a shelf of 0.5 by 2 m that runs into it by half a metre; an open screen.
fn room() -> Building {
    let mut room = boxes::Building::default();
    room.wall("slab", p(0.0, 0.0, 0.0), p(6.0, 0.0, 4.0), &[]);
    room.wall("ceiling", p(0.0, 2.7, 0.0), p(6.0, 2.7, 4.0), &[]);
    room.cell("Room", vec![block(p(0.0, 0.0, 0.0), p(6.0, 2.7, 4.0))]);
    room.thing("pillar", p(2.0, 0.0, 1.0), p(3.0, 2.7, 2.0));
    room.thing("shelf", p(2.5, 0.5, 1.5), p(3.0, 1.6, 3.5));
    room.wall("screen", p(5.0, 0.0, 1.0), p(5.0, 2.0, 3.0), &[]);
    let (scene, file) = room.finish();
    let looks = Looks::read(&scene, Path::new(""), &ImportOptions::default(), &|_| {});
    Building::new(scene, file, looks)
}

struct Visit<'b> {
    canvas: Canvas,
    session: Session<'b>,
}

impl<'b> Visit<'b> {
    fn new(building: &'b Building, oracle: Oracle) -> Self {
        let (canvas, mut session) = common::visit(building, oracle, SIZE);
        (session.view.hud, session.view.layers.alarm) = (false, true);
        Self { canvas, session }
    }

    /// Draws; returns the pixels without panels, and how many are missed.
    fn draw(&mut self) -> (Vec<[u8; 3]>, u32) {
        let session = &mut self.session;
        session.draw(&self.canvas.view, egui::RawInput::default(), 0.02).unwrap();
        session.renderer.settle().unwrap();
        let missed = session.renderer.readback.missed.as_ref().expect("counted").pixels;
        (session.screenshot().unwrap().pixels().to_vec(), missed)
    }
}

fn caps(pixels: &[[u8; 3]]) -> usize {
    pixels.iter().filter(|pixel| pixel.iter().zip(CAP).all(|(a, b)| a.abs_diff(b) <= 1)).count()
}

#[test]
fn caps_are_as_large_as_what_is_cut() {
    needs_device!();
    let room = room();
    let mut visit = Visit::new(&room, Oracle::Software);
    // 5 m above the floor, above the ceiling: 3.8 m above a section at 1.2 m.
    let eye = p(3.0, 5.0, 2.0) - room.file.origin;
    visit.session.motion.walker = Walker::new(eye, DVec3::new(0.0, -1.0, -1e-9), true);
    visit.session.act(Action::Section);
    let floor = -room.file.origin.y;
    let set = |visit: &mut Visit<'_>, height: f64| {
        let is_at = visit.session.section().expect("one").d;
        let notches = (-(floor + height) - is_at) / -0.1;
        assert!(visit.session.move_section(notches));
        let section = visit.session.section().unwrap();
        assert!((section.d + floor + height).abs() < 1e-9 && section.n == DVec3::NEG_Y);
    };
    // Pixels a metre, and square metres; looking down by 89 degrees stretches it by less than half of a percent.
    let pixels = |height: f64, area: f64| {
        let a_metre = f64::from(SIZE[1]) / (2.0 * (5.0 - height) * (0.5 * visit.session.view.fov_y).tan());
        area * a_metre * a_metre
    };
    // The pillar and what of the shelf stands before it; above the shelf; above all.
    let wanted = [(1.2, pixels(1.2, 1.75)), (2.0, pixels(2.0, 1.0)), (2.8, 0.0)];
    for detail in [Detail::Plain, Detail::Full] {
        for mode in MODES {
            (visit.session.view.detail, visit.session.view.mode) = (detail, mode.into());
            for (height, wanted) in wanted {
                set(&mut visit, height);
                let (picture, missed) = visit.draw();
                let found = caps(&picture) as f64;
                // Edges and shade darken some of them in full detail.
                let slack = if detail == Detail::Full { 0.3 } else { 0.02 };
                assert!(
                    (found - wanted).abs() <= slack * wanted,
                    "{mode}, {height} m: {found} pixels of caps, {wanted} wanted"
                );
                assert_eq!(missed, 0, "{mode}, {height} m");
            }
        }
    }
    // From below no cap is seen, and the ceiling is gone.
    set(&mut visit, 1.2);
    (visit.session.view.detail, visit.session.view.mode) = (Detail::Plain, Mode::Auto.into());
    visit.session.motion.walker = Walker::new(p(1.0, 1.0, 3.0) - room.file.origin, DVec3::new(1.0, 0.2, -1.0), true);
    let (picture, missed) = visit.draw();
    assert_eq!((caps(&picture), missed), (0, 0));
    // Without it, all is as it was.
    visit.session.act(Action::Section);
    let (whole, missed) = visit.draw();
    assert!(visit.session.section().is_none() && whole != picture && missed == 0);
}

#[test]
fn what_is_cut_away_is_neither_picked_nor_missed() {
    needs_device!();
    let villa = villa();
    let walk = path("villa_rotonda");
    for oracle in [Oracle::Software, Oracle::Device] {
        let mut visit = Visit::new(villa, oracle);
        let mut capped = 0;
        for (frame, is_upright) in [(0, false), (40, true), (90, false), (120, true)] {
            visit.session.stand(&walk, frame);
            let Section { n, d } = {
                visit.session.set_section(is_upright);
                visit.session.section().unwrap()
            };
            // From the side that is cut away, the whole cut is seen.
            if !is_upright {
                visit.session.motion.walker.eye.y += 15.0;
                visit.session.motion.walker.pitch = -1.2;
            }
            for mode in [Mode::Pvs.into(), Mode::Chc.into(), ViewMode::Hiz] {
                for detail in [Detail::Plain, Detail::Full] {
                    (visit.session.view.mode, visit.session.view.detail) = (mode, detail);
                    let (picture, missed) = visit.draw();
                    capped += caps(&picture);
                    assert_eq!(missed, 0, "frame {frame}, {mode}, {oracle:?}");
                }
            }
            assert_eq!(visit.session.renderer.culling.last.as_ref().unwrap().method, Mode::Frustum);
            visit.session.act(Action::Pick);
            for object in visit.session.selection.objects.clone() {
                let bounds = &villa.scene.objects[object.index()].bounds;
                let most = (n * bounds.min).max(n * bounds.max).element_sum();
                assert!(most >= d, "{object} is cut away");
            }
        }
        assert!(capped > 10_000, "{capped} pixels of caps");
    }
}

#[test]
fn a_section_faces_who_sets_it() {
    needs_device!();
    let room = room();
    let mut visit = Visit::new(&room, Oracle::Software);
    let session = &mut visit.session;
    let eye = p(1.0, 1.6, 2.0) - room.file.origin;
    // Nearly along x: along x. Between two axes: as one looks.
    for (along, n) in
        [(DVec3::new(1.0, -0.4, 0.2), DVec3::X), (DVec3::new(1.0, 0.3, 1.0), DVec3::new(1.0, 0.0, 1.0).normalize())]
    {
        session.motion.walker = Walker::new(eye, along, true);
        session.set_section(true);
        let section = session.section().unwrap();
        assert!(section.n.distance(n) < 1e-6 && (section.before(eye) + 1.0).abs() < 1e-9, "{section:?}");
        // The wheel moves it away.
        session.move_section(5.0);
        assert!((session.section().unwrap().before(eye) + 1.5).abs() < 1e-9);
    }
    // Level, a little above the eye; for who is above the building, where the plan is cut.
    session.set_section(false);
    assert!((session.section().unwrap().before(eye) - 0.3).abs() < 1e-9);
    session.motion.walker.eye.y += 20.0;
    session.set_section(false);
    let height = -session.section().unwrap().d + room.file.origin.y;
    assert!((height - 1.2).abs() < 1e-6, "{height}");
    // Shift+Z: the other one.
    session.act(Action::TurnSection);
    assert_eq!(session.section().unwrap().n.y, 0.0);
    session.act(Action::Section);
    assert!(session.section().is_none() && !session.move_section(1.0));
}

#[test]
fn lengths_snap_and_are_kept_until_escape() {
    needs_device!();
    let mut house = boxes::Building::default();
    house.wall("slab", p(0.0, 0.0, 0.0), p(8.0, 0.0, 5.0), &[]);
    let study = house.cell("Study", vec![block(p(0.0, 0.0, 0.0), p(4.0, 2.7, 5.0))]);
    let hall = house.cell("Hall", vec![block(p(4.0, 0.0, 0.0), p(8.0, 2.7, 5.0))]);
    house.wall("wall", p(4.0, 0.0, 0.0), p(4.0, 2.7, 5.0), &[(p(4.0, 0.0, 1.0), p(4.0, 2.1, 1.9))]);
    house.wall("back", p(0.5, 0.0, 0.0), p(0.5, 2.7, 5.0), &[]);
    house.portal(study, hall, p(4.0, 0.0, 1.0), p(4.0, 2.1, 1.9), PortalKind::Door);
    let house = made(house);
    let origin = house.file.origin;
    let mut visit = Visit::new(&house, Oracle::Software);
    let session = &mut visit.session;
    session.motion.walker = Walker::new(p(1.0, 1.5, 2.0) - origin, DVec3::X, true);
    session.act(Action::Measure);
    let click = |session: &mut Session<'_>, at: DVec3, off: DVec2| {
        let pixel = enfilade_viewer::measure::on_screen(&session.camera(), SIZE, at - origin).unwrap() + off;
        let [w, h] = SIZE.map(f64::from);
        session.click(DVec2::new(2.0 * pixel.x / w - 1.0, 1.0 - 2.0 * pixel.y / h));
    };
    // The door's head, some pixels beside its corners, on the wall.
    click(session, p(4.0, 2.1, 1.0), DVec2::new(-4.0, -5.0));
    assert_eq!(session.measure.done.len(), 0);
    click(session, p(4.0, 2.1, 1.9), DVec2::new(5.0, -3.0));
    assert!((session.measure.done[0].length() - 0.9).abs() < 1e-6, "{:?}", session.measure.done);
    assert_eq!(session.measure.done[0].text().lines().nth(1), Some("dx 0.000, dy 0.000, dz 0.900"));
    // A point of this wall and one of the wall behind: 3.5 m between them, however they are aimed at.
    click(session, p(4.0, 1.2, 3.6), DVec2::ZERO);
    session.motion.walker = Walker::new(p(1.5, 1.5, 2.0) - origin, DVec3::NEG_X, true);
    click(session, p(0.5, 1.9, 2.2), DVec2::ZERO);
    let measured = session.measure.done[1];
    assert!((measured.between_faces().unwrap() - 3.5).abs() < 1e-6 && measured.length() > 3.6, "{measured:?}");
    // Both are written at their middles where those are before the eye; nobody was picked.
    session.motion.walker = Walker::new(p(1.0, 1.5, 2.0) - origin, DVec3::X, true);
    let marks = session.labels(&[]);
    assert_eq!(marks.iter().filter(|mark| mark.text.contains(" m\ndx")).count(), 2);
    assert!(session.selection.objects.is_empty());
    // Escape forgets them, and only then quits.
    session.escape(false);
    assert!(!session.measure.is_on && session.measure.done.is_empty() && !session.window.quit);
}

#[test]
fn names_are_those_of_rooms_that_are_reached() {
    needs_device!();
    let mut house = boxes::Building::default();
    house.wall("slab", p(0.0, 0.0, 0.0), p(8.0, 0.0, 4.0), &[]);
    let study = house.cell("Study", vec![block(p(0.0, 0.0, 0.0), p(4.0, 2.7, 4.0))]);
    let hall = house.cell("Hall", vec![block(p(4.2, 0.0, 0.0), p(8.0, 2.7, 4.0))]);
    house.wall("wall", p(4.1, 0.0, 0.0), p(4.1, 2.7, 4.0), &[(p(4.1, 0.0, 1.0), p(4.1, 2.1, 2.0))]);
    house.portal(study, hall, p(4.1, 0.0, 1.0), p(4.1, 2.1, 2.0), PortalKind::Door);
    let mut house = made(house);
    house.file.cells.iter_mut().for_each(|cell| cell.source = Some("room".into()));
    let mut visit = Visit::new(&house, Oracle::Software);
    visit.session.view.mode = Mode::Portals.into();
    visit.session.motion.walker = Walker::new(p(0.5, 1.6, 1.8) - house.file.origin, DVec3::X, true);
    let names = |visit: &mut Visit<'_>| -> Vec<String> {
        visit.draw();
        let cells = visit.session.renderer.culling.last.as_ref().unwrap().cells.clone();
        visit.session.labels(&cells).into_iter().map(|mark| mark.text).collect()
    };
    assert_eq!(names(&mut visit), [""; 0]);
    visit.session.view.layers.names = true;
    visit.session.renderer.doors.set_all(false);
    visit.session.renderer.doors_changed();
    assert_eq!(names(&mut visit), ["Study\n16.0 m²"]);
    visit.session.renderer.doors.set_all(true);
    visit.session.renderer.doors_changed();
    let mut both = names(&mut visit);
    both.sort();
    assert_eq!(both, ["Hall\n15.2 m²", "Study\n16.0 m²"]);
}
