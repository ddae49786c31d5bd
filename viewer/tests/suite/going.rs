//! Ways that take somebody somewhere at once: points of a plan, storeys. What is free is measured here on every triangle; which cell is
//! where, the library's own locator says.

use crate::common::body::{EYE, FREE, HEAD, KNEE, nearest_beside};
use crate::common::{self, building, needs_device, shipped, villa};
use enfilade::cells::{Locator, PortalKind};
use enfilade::runtime::Culler;
use enfilade_measure::pages::plans::Plans;
use enfilade_measure::pages::storeys::storeys;
use enfilade_viewer::building::Building;
use enfilade_viewer::collision::Solid;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::doors::swings::swings;
use enfilade_viewer::go::Guide;
use enfilade_viewer::looks::Looks;
use enfilade_viewer::plan_file;
use enfilade_viewer::plan_picture;
use enfilade_viewer::session::Session;
use enfilade_viewer::start::rooms::rooms;
use enfilade_viewer::ui::plan::Plan;
use glam::{DVec2, DVec3, Vec3Swizzles};
use testing::boxes::{self, block, p};

/// Three storeys, 3 m from floor to floor, of two rooms each: 4 by 5 m and 6 by 5 m, the larger with a closet (1 by 2 m) cut out.
fn house() -> Building {
    let mut house = boxes::Building::default();
    let mut names = Vec::new();
    for storey in 0..3 {
        let y = 3.0 * f64::from(storey);
        house.wall("slab", p(0.0, y, 0.0), p(10.2, y, 5.0), &[]);
        let small = house.cell("Study", vec![block(p(0.0, y, 0.0), p(4.0, y + 2.7, 5.0))]);
        let large = house
            .cell("Hall", vec![block(p(4.2, y, 0.0), p(9.2, y + 2.7, 5.0)), block(p(9.2, y, 2.0), p(10.2, y + 2.7, 5.0))]);
        house.wall("wall", p(4.1, y, 0.0), p(4.1, y + 2.7, 5.0), &[(p(4.1, y, 1.0), p(4.1, y + 2.1, 2.0))]);
        house.portal(small, large, p(4.1, y, 1.0), p(4.1, y + 2.1, 2.0), PortalKind::Door);
        house.thing("table", p(1.0, y, 2.0), p(3.0, y + 0.75, 3.0));
        names.extend([small, large]);
    }
    let (scene, mut file) = house.finish();
    names.iter().for_each(|cell| file.cells[cell.index()].source = Some("room".into()));
    Building::new(scene, file, Looks::default())
}

#[test]
fn a_click_on_the_plan_stands_in_the_cell_that_is_there() {
    for (building, least) in [(villa(), 40), (&house(), 40)] {
        let (scene, file) = (&building.scene, &building.file);
        let (solid, rooms, culler) = (Solid::new(scene), rooms(file, scene), Culler::new(file));
        let guide = Guide { building, solid: &solid, rooms: &rooms, culler: &culler };
        let graph = file.graph();
        let locator = Locator::new(&graph);
        let (mut stood, bounds) = (0, scene.bounds());
        for storey in storeys(file) {
            for i in 0..14 * 14 {
                let share = DVec2::new(f64::from(i % 14), f64::from(i / 14)) / 14.0 + 0.5 / 14.0;
                let at = bounds.min.xz() + bounds.size().xz() * share;
                let here = |x: f64, z: f64| locator.locate(DVec3::new(at.x + x, storey.floor + storey.cut, at.y + z));
                let Some((cell, _)) = here(0.0, 0.0).filter(|(cell, _)| !graph.cells[cell.index()].open) else { continue };
                // On a border, either is right.
                if [(0.01, 0.0), (-0.01, 0.0), (0.0, 0.01), (0.0, -0.01)]
                    .iter()
                    .any(|&(x, z)| here(x, z).map(|h| h.0) != Some(cell))
                {
                    continue;
                }
                let walker = guide.to_plan(&storey, at);
                assert_eq!(locator.locate(walker.eye).map(|home| home.0), Some(cell), "{at}: another cell");
                if !walker.flies {
                    let (eye, feet) = (walker.eye + scene.origin, walker.eye.y + scene.origin.y - EYE);
                    let beside = nearest_beside(scene, eye, feet + KNEE, feet + HEAD);
                    assert!(beside >= FREE - 1e-3, "{at}: {} with something {beside} m beside", walker.eye);
                    stood += 1;
                }
            }
        }
        assert!(stood >= least, "{stood} clicks stood in {}", scene.name);
    }
}

#[test]
fn storeys_are_those_of_the_file() {
    for name in ["villa_rotonda", "office"] {
        let building = if name == "office" { &building(name) } else { villa() };
        let told = std::fs::read_to_string(shipped(name, "rooms.json")).unwrap();
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        let told: Vec<f64> = told["storeys"].as_array().unwrap().iter().map(|s| s["elevation"].as_f64().unwrap()).collect();
        let plan = Plan::new(&building.file);
        let floors: Vec<f64> = plan.storeys.iter().map(|s| s.floor + building.file.origin.y).collect();
        // The generator tells no cellars and no attics: the villa has one of the former, and two of the latter.
        assert_eq!(floors.len(), told.len() + if name == "office" { 0 } else { 3 }, "{name}: {floors:?}");
        let is_told = |a: &f64| floors.iter().any(|b| (a - b).abs() < 1e-3);
        assert!(told.iter().all(is_told), "{name}: {floors:?}, without {told:?}");
        assert!(floors.is_sorted());
    }
}

#[test]
fn rooms_have_their_names_and_areas() {
    let house = house();
    let rooms = rooms(&house.file, &house.scene);
    let mut plan = Plan::new(&house.file);
    for storey in 0..3 {
        let mut names = plan.names(&house.file, &rooms, storey);
        names.sort();
        assert_eq!(names, ["Hall\n28.0 m²", "Study\n20.0 m²"]);
    }
}

#[test]
fn a_storey_is_shown_first_and_then_gone_to() {
    let house = house();
    let mut plan = Plan::new(&house.file);
    let eye = |storey: usize| plan.storeys[storey].floor + EYE;
    let [low, middle] = [eye(0), eye(1)];
    assert_eq!((plan.turn(true, low), plan.shown(low)), (None, 1));
    assert_eq!((plan.turn(false, low), plan.shown(low)), (None, 0), "back again");
    assert_eq!((plan.turn(false, low), plan.shown(low)), (None, 0), "nothing is below");
    assert_eq!((plan.turn(true, low), plan.shown(low)), (None, 1));
    assert_eq!((plan.turn(true, low), plan.shown(middle)), (Some(1), 1));
    // From the list, two storeys up: a click, and one on the plan.
    plan.choose(2, middle);
    assert_eq!((plan.turn(true, middle), plan.shown(middle)), (Some(2), 1));
}

#[test]
fn a_plan_is_a_whole_svg_file() {
    let house = house();
    let plan = Plan::new(&house.file);
    let text = plan_file::svg(&house, &plan.storeys, &plan.swings, 1);
    assert!(text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\"") && text.ends_with("</svg>\n"), "{text}");
    assert!(text.find("<style>").unwrap() < text.find("<path").unwrap() && text.contains(">Study</text>"), "{text}");
    assert_eq!(text.matches("class=\"cell ").count(), 2);
}

#[test]
fn a_plan_as_a_picture_has_the_colours_of_the_svg_where_it_has_them() {
    let house = house();
    let plan = Plan::new(&house.file);
    let svg = plan_file::svg(&house, &plan.storeys, &plan.swings, 0);
    let picture = plan_picture::picture(&svg).unwrap();
    let plans = Plans::new(&house.file, &house.scene, &plan.storeys);
    let height: f64 = svg.split("viewBox=\"0 0 860 ").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let scale = 2000.0 / 860.0;
    assert_eq!((picture.width(), picture.height()), (2000, (height * scale).round() as usize));
    let at = |x: f64, z: f64| {
        let p = plans.at(DVec2::new(x, z) - house.file.origin.xz()) * scale;
        picture.pixels()[p.y as usize * picture.width() + p.x as usize]
    };
    // The study and the hall are the first two cells; the hall has a closet cut out of it, where the paper shows.
    let tint = |cell: &str| {
        let before = svg.split(&format!("<title>{cell}</title>")).next().unwrap();
        let class = before.rsplit("class=\"cell ").next().unwrap().split('"').next().unwrap();
        let fill = svg.split(&format!(".{class}{{fill:#")).nth(1).unwrap();
        [0, 2, 4].map(|at| u8::from_str_radix(&fill[at..at + 2], 16).unwrap())
    };
    let is = |pixel: [u8; 3], colour: [u8; 3]| pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(b) <= 2);
    for (p, colour) in
        [((0.4, 0.4), tint("Study")), ((3.6, 4.6), tint("Study")), ((8.8, 0.4), tint("Hall")), ((9.8, 2.6), tint("Hall"))]
    {
        assert!(is(at(p.0, p.1), colour), "{p:?}: {:?}, {colour:?} wanted", at(p.0, p.1));
    }
    assert!(is(at(9.8, 0.6), [255; 3]), "{:?}", at(9.8, 0.6));
    // The door is an orange line where the wall has its hole, the wall a dark one beside it.
    assert!(is(at(4.1, 1.5), [0xc2, 0x46, 0x0b]), "{:?}", at(4.1, 1.5));
    assert!(at(4.1, 3.5).iter().all(|part| *part < 120), "{:?}", at(4.1, 3.5));
}

#[test]
fn doors_swing_by_a_quarter_about_a_jamb() {
    needs_device!();
    let (_, session) = common::visit(villa(), Oracle::Software, [64, 64]);
    let swings = swings(&session.renderer.doors);
    assert!(swings.len() >= 4, "{}", swings.len());
    for swing in &swings {
        let [hinge, open, .., shut] = swing.line[..] else { panic!("{swing:?}") };
        let [radius, width] = [open, shut].map(|p| p.distance(hinge));
        assert!((radius - width).abs() < 1e-6 && (0.3..2.5).contains(&width), "{swing:?}");
        assert!((open - hinge).dot(shut - hinge).abs() < 1e-6 * width, "{swing:?}");
        // The hinge is at a jamb of some door's portal; of a pair, the other end is in the middle.
        let jambs = |p: &enfilade::file::FilePortal| p.winding.iter().map(|c| c.as_dvec3().xz()).collect::<Vec<_>>();
        let is_at = |p: DVec2, jambs: &[DVec2]| jambs.iter().any(|jamb| jamb.distance(p) < 0.4);
        let doors = villa().file.portals.iter().filter(|p| p.kind == PortalKind::Door).map(jambs);
        assert!(doors.into_iter().any(|jambs| is_at(hinge, &jambs)), "{swing:?}");
    }
    let mut plan = Plan::new(&villa().file);
    plan.swings = swings;
    let drawn = |storey| plan_file::svg(villa(), &plan.storeys, &plan.swings, storey).contains("class=\"swing\"");
    assert!((0..plan.storeys.len()).any(drawn));
}

#[test]
fn a_click_a_wheel_and_a_key_reach_the_plan() {
    needs_device!();
    let (house, size) = (house(), [640, 480]);
    let (canvas, mut session) = common::visit(&house, Oracle::Software, size);
    session.begin(None);
    session.view.layers.plan = true;
    let mut draw = |session: &mut Session<'_>, events: Vec<egui::Event>| {
        session.draw(&canvas.view, egui::RawInput { events, ..Default::default() }, 0.02).unwrap();
    };
    let button = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: Default::default(),
    };
    let click = |session: &mut Session<'_>, draw: &mut dyn FnMut(&mut Session<'_>, Vec<egui::Event>), pos| {
        draw(session, vec![egui::Event::PointerMoved(pos)]);
        draw(session, vec![button(pos, true)]);
        draw(session, vec![button(pos, false)]);
    };
    (0..3).for_each(|_| draw(&mut session, Vec::new()));
    // 1. Each room of each storey: a key and a click.
    for storey in [0, 1, 2] {
        if storey > 0 {
            session.act(Action::Storey(true));
            draw(&mut session, Vec::new());
        }
        for (x, z) in [(7.0, 1.0), (0.8, 4.2)] {
            let at = DVec2::new(x, z) - house.scene.origin.xz();
            let pos = session.panels.plan.view.to_screen(session.panels.plan.rect, at);
            click(&mut session, &mut draw, pos);
            let eye = session.motion.walker.eye + house.scene.origin;
            let wanted = DVec3::new(x, 3.0 * f64::from(storey) + EYE, z);
            // A click is as exact as a point of the screen.
            assert!(eye.distance(wanted) < 0.1 && !session.motion.walker.flies, "{eye}, not {wanted}");
        }
    }
    // 2. Two storeys down by keys alone.
    (0..4).for_each(|_| session.act(Action::Storey(false)));
    assert!((session.motion.walker.eye.y + house.scene.origin.y - EYE).abs() < 1e-3);
    // 3. The wheel looks closer.
    let (scale, pos) = (session.panels.plan.view.scale, session.panels.plan.rect.center());
    let wheel = egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 80.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Default::default(),
    };
    draw(&mut session, vec![egui::Event::PointerMoved(pos), wheel]);
    (0..5).for_each(|_| draw(&mut session, Vec::new()));
    assert!(session.panels.plan.view.scale > 1.2 * scale, "{} of {scale}", session.panels.plan.view.scale);
}
