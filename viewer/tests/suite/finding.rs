//! What is in a building is found, told, gone to and hidden.

use crate::common::{self, needs_device, path, quickly_baked, villa};
use enfilade::cells::{Locator, PortalKind};
use enfilade::runtime::{Culler, Mode};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Material, Role};
use enfilade::types::scene::{Look, Trace};
use enfilade::{CellId, ObjectId};
use enfilade_viewer::building::Building;
use enfilade_viewer::collision::Solid;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::targets::Canvas;
use enfilade_viewer::find::{FindTarget, Found, MOST, facts, find, objects};
use enfilade_viewer::go::Guide;
use enfilade_viewer::looks::{Detail, Looks};
use enfilade_viewer::session::Session;
use enfilade_viewer::start::rooms::rooms;
use enfilade_viewer::units::Units;
use enfilade_viewer::walker::{MoveInput, Walker};
use glam::DVec2;
use std::collections::BTreeSet;
use testing::boxes::{self, block, p};
use testing::data::data;

/// Panels leave most of it free.
const SIZE: [u32; 2] = [960, 720];

/// Two rooms with a door between them; a lamp of brass and, in the other, a desk of oak and 60 books.
fn house() -> Building {
    let mut house = boxes::Building::default();
    house.wall("slab", p(0.0, 0.0, 0.0), p(10.2, 0.0, 5.0), &[]);
    let library = house.cell("Library", vec![block(p(0.0, 0.0, 0.0), p(4.0, 2.7, 5.0))]);
    let parlour = house.cell("Oak parlour", vec![block(p(4.2, 0.0, 0.0), p(10.2, 2.7, 5.0))]);
    house.cell("oak void", vec![block(p(0.0, 3.0, 0.0), p(10.2, 3.4, 5.0))]);
    house.wall("wall", p(4.1, 0.0, 0.0), p(4.1, 2.7, 5.0), &[(p(4.1, 0.0, 1.0), p(4.1, 2.1, 2.0))]);
    house.portal(library, parlour, p(4.1, 0.0, 1.0), p(4.1, 2.1, 2.0), PortalKind::Door);
    house.thing("Lamp", p(8.0, 0.0, 3.0), p(8.3, 1.6, 3.3));
    house.thing("Desk", p(0.2, 0.0, 3.0), p(1.2, 0.75, 4.6));
    for i in 0..60 {
        house.thing(&format!("book {i}"), p(0.02 * f64::from(i), 1.0, 0.0), p(0.02 * f64::from(i + 1), 1.3, 0.2));
    }
    let (mut scene, mut file) = house.finish();
    let names = ["OAK", "brass", "unused oak"];
    let material = |node: &str| ["Desk", "Lamp"].iter().position(|n| *n == node).map(|i| i as u32);
    scene.trace = Some(Trace {
        meshes: (0..scene.objects.len() as u32).collect(),
        triangles: vec![0; scene.triangles.len()],
        looks: scene.objects.iter().map(|o| Look { material: material(&o.node), ..Look::default() }).collect(),
        materials: names.map(|name| Material::matt(name, [0.5, 0.4, 0.3, 1.0])).to_vec(),
    });
    [library, parlour].iter().for_each(|cell| file.cells[cell.index()].source = Some("room".into()));
    Building::new(scene, file, Looks::default())
}

fn object(building: &Building, node: &str) -> ObjectId {
    ObjectId(building.scene.objects.iter().position(|o| o.node == node).unwrap() as u32)
}

#[test]
fn rooms_nodes_and_materials_are_found_by_their_names() {
    let house = house();
    let hit = |what, name: &str| Found { what, name: name.to_owned() };
    // In any case; not the cell that nobody named, nor the material that nothing is made of.
    assert_eq!(find(&house, " oaK"), [hit(FindTarget::Room(CellId(1)), "Oak parlour"), hit(FindTarget::Material(0), "OAK")]);
    assert_eq!(find(&house, "lam"), [hit(FindTarget::Node(object(&house, "Lamp")), "Lamp")]);
    assert_eq!(find(&house, "BRASS"), [hit(FindTarget::Material(1), "brass")]);
    assert_eq!(find(&house, "book 59"), [hit(FindTarget::Node(object(&house, "book 59")), "book 59")]);
    assert_eq!(find(&house, "book").len(), MOST);
    for nothing in ["", "  ", "cellar"] {
        assert_eq!(find(&house, nothing), [], "{nothing:?}");
    }
}

#[test]
fn a_pick_tells_what_it_is() {
    let house = house();
    let told = |node: &str, cell: u32| -> Vec<String> {
        facts(&house, object(&house, node), CellId(cell), Units::Metres)
            .into_iter()
            .map(|(name, value)| format!("{name}: {value}"))
            .collect()
    };
    let number = object(&house, "Desk");
    let n = house.scene.objects.len();
    let seen_from = |node: &str| (0..3).filter(|&c| house.file.sees_object(CellId(c), object(&house, node))).count();
    assert_eq!(
        told("Desk", 0),
        [
            "Node: Desk".to_owned(),
            format!("Object: {number}"),
            "Role: furnishing".to_owned(),
            "Cell: 0 (Library)".to_owned(),
            "Triangles: 12".to_owned(),
            "Size: 1.00 m x 0.75 m x 1.60 m".to_owned(),
            "Material: OAK".to_owned(),
            // Nobody has rows of their own here: each cell that it is in or that a portal leads from sees it.
            format!(
                "Seen: from {} of 3 cells; its own sees {} of {n} objects",
                seen_from("Desk"),
                house.file.objects_seen(CellId(0)).count()
            ),
        ]
    );
    assert!(!told("wall", 1).iter().any(|line| line.starts_with("Material")));
}

#[test]
fn what_was_found_is_ahead() {
    let house = house();
    let (scene, file) = (&house.scene, &house.file);
    let (solid, rooms, culler) = (Solid::new(scene), rooms(file, scene), Culler::new(file));
    let guide = Guide { building: &house, solid: &solid, rooms: &rooms, culler: &culler };
    let (graph, rays) = (file.graph(), RayScene::new(scene));
    let locator = Locator::new(&graph);
    for (node, home) in [("Desk", 0), ("Lamp", 1)] {
        let object = object(&house, node);
        let walker = guide.before(&[object], glam::DVec3::ZERO);
        assert!(!walker.flies && locator.locate(walker.eye).map(|(cell, _)| cell) == Some(CellId(home)), "{node}");
        let met = rays.first_opaque(walker.eye, walker.forward(), f64::INFINITY).expect("something is ahead");
        assert_eq!(met.object, object, "{node}: something else is ahead");
        assert!((1.0..5.0).contains(&met.t), "{node}: {} m away", met.t);
    }
    let walker = guide.into_room(CellId(1)).unwrap();
    assert_eq!(locator.locate(walker.eye).map(|(cell, _)| cell), Some(CellId(1)));
}

#[test]
fn what_is_hidden_has_no_pixel_and_nobody_misses_it() {
    needs_device!();
    [Oracle::Software, Oracle::Device].into_iter().for_each(|oracle| hide_and_show(villa(), oracle));
}

fn hide_and_show(villa: &Building, oracle: Oracle) {
    let walk = path("villa_rotonda");
    let (canvas, mut session) = common::visit(villa, oracle, SIZE);
    (session.view.hud, session.view.layers.alarm) = (false, true);
    session.stand(&walk, walk.frames.len() / 2);
    let hidden = hide_what_is_clicked(&canvas, &mut session);
    // In full detail, too, glass and all.
    session.view.detail = Detail::Full;
    session.draw(&canvas.view, egui::RawInput::default(), 0.02).unwrap();
    session.renderer.settle().unwrap();
    assert_eq!(session.renderer.readback.missed.as_ref().expect("counted").pixels, 0);
    session.view.detail = Detail::Plain;
    hide_doors(villa, &canvas, &mut session, oracle);
    session.stand(&walk, walk.frames.len() / 2);
    // All is back; alone, nothing else is.
    session.act(Action::ShowAll);
    assert!(hidden.iter().any(|&object| pixels(&canvas, &mut session, object).0 > 0));
    // Where a door is ahead, a click opens it.
    for x in [-0.6, 0.0, 0.6] {
        session.click(DVec2::new(x, 0.0));
    }
    let [alone] = session.selection.objects[..] else { panic!("nothing is ahead") };
    session.act(Action::Isolate);
    assert!((0..villa.scene.objects.len() as u32).map(ObjectId).all(|o| session.renderer.is_hidden(o) == (o != alone)));
    assert_eq!(pixels(&canvas, &mut session, alone).1, 0);
    assert_ne!(villa.scene.objects[alone.index()].role, Role::Door);
}

/// Pixels of one object, which alone is red, and missed ones.
fn pixels(canvas: &Canvas, session: &mut Session<'_>, object: ObjectId) -> (usize, u32) {
    let mut colours = vec![[0; 3]; session.document.building.scene.objects.len() + 1];
    colours[object.index()] = [255, 0, 0];
    session.renderer.paint(colours);
    session.draw(&canvas.view, egui::RawInput::default(), 0.02).unwrap();
    session.renderer.settle().unwrap();
    let picture = canvas.read(&session.renderer.gpu).unwrap();
    let red = picture.pixels().iter().filter(|[r, g, b]| *r > 100 && *g < 60 && *b < 60).count();
    (red, session.renderer.readback.missed.as_ref().expect("counted").pixels)
}

/// Hides what is clicked, one after the other.
fn hide_what_is_clicked(canvas: &Canvas, session: &mut Session<'_>) -> BTreeSet<ObjectId> {
    let (mut hidden, mut revealed) = (BTreeSet::new(), 0);
    for at in [(-0.6, 0.0), (0.0, 0.0), (0.6, 0.0), (0.0, -0.7), (0.3, 0.3)] {
        session.click(DVec2::from(at));
        let [object] = session.selection.objects[..] else { continue };
        let seen = pixels(canvas, session, object).0;
        session.act(Action::Hide);
        assert!(session.renderer.is_hidden(object) && session.selection.objects.is_empty());
        hidden.insert(object);
        for mode in [Mode::None, Mode::Pvs, Mode::PortalsAndPvs, Mode::Chc] {
            session.view.mode = mode.into();
            for &object in &hidden {
                assert_eq!(pixels(canvas, session, object), (0, 0), "{mode}: {object}: pixels and missed ones");
            }
        }
        revealed += seen;
        // What is hidden isn't picked again.
        session.click(DVec2::from(at));
        assert!(!session.selection.objects.iter().any(|o| hidden.contains(o)));
    }
    assert!(hidden.len() >= 3 && revealed > 2000, "{hidden:?}, {revealed} pixels");
    hidden
}

/// Doors hide what is behind them while they are shut.
fn hide_doors(villa: &Building, canvas: &Canvas, session: &mut Session<'_>, oracle: Oracle) {
    let (mut doors, mut seen) = (0, 0);
    for door in villa.file.portals.iter().filter(|p| p.kind == PortalKind::Door && p.plane.y.abs() < 0.1) {
        let n = door.plane.truncate().as_dvec3();
        let middle = enfilade_viewer::doors::middle(&door.winding).as_dvec3();
        session.motion.walker = Walker::new(middle - n * 1.5, n, true);
        // The model has them open.
        session.act(Action::Door);
        session.go(1.0, &MoveInput::default());
        session.act(Action::Pick);
        let picked = session.selection.objects.first().copied();
        let Some(leaf) = picked.filter(|o| villa.scene.objects[o.index()].role == Role::Door) else { continue };
        seen += pixels(canvas, session, leaf).0;
        session.act(Action::Hide);
        assert_eq!(pixels(canvas, session, leaf), (0, 0), "{leaf}, by {oracle:?}");
        doors += 1;
    }
    assert!(doors >= 2 && seen > 2000, "{doors} doors were hidden, {seen} pixels");
}

#[test]
fn elements_are_found_and_told_by_what_their_author_says() {
    let test = "elements_are_found_and_told_by_what_their_author_says";
    let folder = data();
    let Some(duplex) = quickly_baked(test, &folder.join("duplex/Duplex_A_20110907.ifc")) else { return };
    let names = |text: &str| find(&duplex, text).into_iter().map(|found| found.name).collect::<Vec<_>>();
    // #4131 of the file, by its GlobalId, by its tag within its name, and by a property of its own.
    let id = "2O2Fr$t4X7Zf8NOew3FNld";
    let wall = find(&duplex, id);
    let [Found { what: FindTarget::Node(object), .. }] = wall[..] else { panic!("{wall:?}") };
    assert_eq!(duplex.scene.objects[object.index()].node, id);
    assert_eq!(names("138584"), ["Basic Wall:Interior - Partition (92mm Stud):138584"]);
    // Rooms come first, by their names and then by their GlobalIds.
    assert_eq!(names("foyer")[0], "A101 Foyer");
    assert!(matches!(find(&duplex, "0BTBFw6f90Nfh9rP1dlXrr")[..], [Found { what: FindTarget::Room(_), .. }]));
    // A class: 14 doors, some of several objects. A type: #38449 relates two of them.
    let hit = |text: &str, is: fn(&FindTarget) -> bool| find(&duplex, text).into_iter().find(|f| is(&f.what)).unwrap().what;
    let elements = |what: FindTarget| {
        let nodes = objects(&duplex, what).into_iter().map(|o| duplex.scene.objects[o.index()].node.as_str());
        nodes.collect::<BTreeSet<_>>()
    };
    assert_eq!(elements(hit("ifcdoor", |what| matches!(what, FindTarget::Class(_)))).len(), 14);
    let type_of = elements(hit("1250mm x 2010mm", |what| matches!(what, FindTarget::Type(_))));
    assert_eq!(type_of, BTreeSet::from(["1hOSvn6df7F8_7GcBWlRGQ", "1hOSvn6df7F8_7GcBWlRH8"]));
    let loads = hit("loadbearing: true", |what| matches!(what, FindTarget::Property(..)));
    assert!(!elements(loads).is_empty() && !elements(loads).contains(id));
    // A pick tells the class, the GlobalId and properties by their sets.
    needs_device!();
    let (_, mut session) = common::visit(&duplex, Oracle::Software, SIZE);
    session.begin(None);
    session.go_to_found(FindTarget::Node(object));
    let (facts, sheets) = session.told();
    let fact = |name: &str| facts.iter().find(|f| f.0 == name).map(|f| f.1.as_str());
    assert_eq!([fact("Class"), fact("GlobalId"), fact("Tag")], [Some("IfcWallStandardCase"), Some(id), Some("138584")]);
    let sheet = sheets.iter().find(|sheet| sheet.title == "PSet_Revit_Constraints").unwrap();
    assert!(sheet.rows.contains(&("Unconnected Height".into(), "2.795 m".into())), "{sheet:?}");
    let FindTarget::Room(foyer) = find(&duplex, "foyer")[0].what else { panic!("no room") };
    session.go_to_found(FindTarget::Room(foyer));
    let area = session.told().1.iter().flat_map(|sheet| &sheet.rows).find(|row| row.0 == "GSA BIM Area");
    assert!(area.is_some_and(|area| area.1.ends_with(" m²")), "{area:?}");
}
