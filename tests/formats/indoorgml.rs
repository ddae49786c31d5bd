//! IndoorGML, by hand and as others wrote it: a ready graph, and a scene of its own.

use enfilade::CellId;
use enfilade::cells::{Locator, PortalKind};
use enfilade::math::geom::{Aabb, area};
use enfilade::scene::{ImportOptions, OpeningKind, Scene};
use enfilade_formats::indoorgml::read_indoorgml;
use enfilade_formats::{import, indoorgml};
use glam::DVec3;
use testing::data;
use testing::meshes::area_of;
use testing::sound::assert_sealed;

type Ring = Vec<[f64; 3]>;

/// The sides of a box, every second one facing in.
fn cuboid(min: [f64; 3], max: [f64; 3]) -> Vec<Ring> {
    let c = |i: usize| std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] });
    let sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    sides.map(|s| s.map(c).to_vec()).to_vec()
}

fn polygon(ring: &Ring) -> String {
    let pos = |p: &[f64; 3]| format!("<gml:pos>{} {} {}</gml:pos>", p[0], p[1], p[2]);
    let corners: String = ring.iter().chain(&ring[..1]).map(pos).collect();
    format!("<gml:Polygon><gml:exterior><gml:LinearRing>{corners}</gml:LinearRing></gml:exterior></gml:Polygon>")
}

fn space(id: &str, surface: &[Ring]) -> String {
    let members: String = surface.iter().map(|r| format!("<gml:surfaceMember>{}</gml:surfaceMember>", polygon(r))).collect();
    format!(
        r##"<cellSpaceMember><CellSpace gml:id="{id}"><gml:name> {id} room </gml:name><cellSpaceGeometry><Geometry3D><gml:Solid>
        <gml:exterior><gml:Shell>{members}</gml:Shell></gml:exterior></gml:Solid></Geometry3D></cellSpaceGeometry>
        <duality xlink:href="#S-{id}"/></CellSpace></cellSpaceMember>"##
    )
}

fn door(id: &str, transition: &str, ring: &Ring) -> String {
    format!(
        r##"<cellSpaceBoundaryMember><navi:ConnectionBoundary gml:id="{id}"><duality xlink:href="#{transition}"/>
        <cellSpaceBoundaryGeometry><geometry3D>{}</geometry3D></cellSpaceBoundaryGeometry>
        </navi:ConnectionBoundary></cellSpaceBoundaryMember>"##,
        polygon(ring)
    )
}

fn transition(id: &str, a: &str, b: &str) -> String {
    format!(
        r##"<transitionMember><Transition gml:id="{id}"><connects xlink:href="#S-{a}"/><connects xlink:href="#S-{b}"/>
        </Transition></transitionMember>"##
    )
}

/// Two rooms of 4 x 5 x 3 m side by side with a door between them, drawn from either side; a stair from the first to a room over
/// it; and a transition to a shed that stands apart.
fn house() -> String {
    let way: Ring = vec![[4., 2., 0.], [4., 3., 0.], [4., 3., 2.1], [4., 2., 2.1]];
    let back: Ring = way.iter().rev().copied().collect();
    let spaces = [
        space("A", &cuboid([0., 0., 0.], [4., 5., 3.])),
        space("B", &cuboid([4., 0., 0.], [8., 5., 3.])),
        space("C", &cuboid([0., 0., 3.], [4., 5., 6.])),
        space("D", &cuboid([20., 0., 0.], [22., 2., 3.])),
    ];
    let doors = [door("D1", "T1", &way), door("D1-REVERSE", "T1-REVERSE", &back)];
    let transitions = [
        transition("T1", "A", "B"),
        transition("T1-REVERSE", "B", "A"),
        transition("T2", "C", "A"),
        transition("T3", "B", "D"),
    ];
    let states: String =
        ["A", "B", "C", "D"].iter().map(|s| format!(r#"<stateMember><State gml:id="S-{s}"/></stateMember>"#)).collect();
    format!(
        r#"<IndoorFeatures xmlns="http://www.opengis.net/indoorgml/1.0/core" xmlns:gml="http://www.opengis.net/gml/3.2"
        xmlns:navi="http://www.opengis.net/indoorgml/1.0/navigation" xmlns:xlink="http://www.w3.org/1999/xlink">
        <primalSpaceFeatures><PrimalSpaceFeatures>{}{}</PrimalSpaceFeatures></primalSpaceFeatures>
        <multiLayeredGraph><SpaceLayer>{states}{}</SpaceLayer></multiLayeredGraph></IndoorFeatures>"#,
        spaces.concat(),
        doors.concat(),
        transitions.concat()
    )
}

fn scene(text: &str) -> Scene {
    indoorgml::from_str(text, "test", &ImportOptions::default()).unwrap()
}

fn sealed(scene: &Scene, text: &str, segments: u64) {
    assert_sealed(&read_indoorgml(text, scene).unwrap(), scene, 20.0, segments);
}

#[test]
fn spaces_are_cells_and_transitions_portals() {
    let text = house();
    let scene = scene(&text);
    let graph = read_indoorgml(&text, &scene).unwrap();
    let cells: Vec<_> = graph.cells.iter().map(|c| (c.name.as_str(), c.source.as_deref(), c.pieces.len())).collect();
    let one = |name, id| (name, Some(id), 1);
    assert_eq!(cells, [one("A room", "A"), one("B room", "B"), one("C room", "C"), one("D room", "D")]);
    assert_eq!(graph.portals.len(), 2);
    // +Z up becomes +Y up: y 2..3 turns into z -3..-2.
    let (way, stair) = (&graph.portals[0], &graph.portals[1]);
    let corners = |w: &[DVec3]| Aabb::of(w.iter().map(|p| p + scene.origin));
    assert_eq!((way.cells, way.kind, way.source.as_deref()), ([CellId(0), CellId(1)], PortalKind::Door, Some("D1")));
    assert_eq!((way.plane.n, corners(&way.winding).min), (DVec3::X, DVec3::new(4., 0., -3.)));
    assert_eq!(corners(&way.winding).max, DVec3::new(4., 2.1, -2.));
    assert_eq!(
        (stair.cells, stair.kind, stair.source.as_deref()),
        ([CellId(2), CellId(0)], PortalKind::Opening, Some("T2"))
    );
    assert!(stair.plane.n.distance(-DVec3::Y) < 1e-12 && (area(&stair.winding) - 20.0).abs() < 1e-9);
    assert_eq!(graph.notes, ["transition T3: B and D share no surface, and it has no boundary; no portal"]);
    sealed(&scene, &text, 20_000);
}

#[test]
fn the_scene_is_the_surfaces_less_the_ways_through() {
    let scene = scene(&house());
    let nodes: Vec<&str> = scene.objects.iter().map(|o| o.node.as_str()).collect();
    assert_eq!(nodes, ["A", "B", "C", "D"]);
    // Boxes of 4 x 5 x 3 m have 94 square metres; the door is 2.1, the stairwell 20.
    for (object, expected) in scene.objects.iter().zip([94.0 - 2.1 - 20.0, 94.0 - 2.1, 94.0 - 20.0, 32.0]) {
        let area = area_of(&scene, object);
        assert!((area - expected).abs() < 1e-6, "{}: {area} for {expected}", object.node);
    }
    let rooms = &scene.hints.rooms;
    let whole: f64 = rooms[0].surface.iter().map(|t| area(t)).sum();
    assert!((whole - 94.0).abs() < 1e-6 && rooms[0].drawn);
    let openings: Vec<_> = scene.hints.openings.iter().map(|o| (o.id.as_str(), o.kind, o.rooms)).collect();
    assert_eq!(openings, [("D1", OpeningKind::Door, [Some(0), Some(1)])]);
}

#[test]
fn layers_units_and_flat_spaces() {
    let flat = house().replace(
        "</PrimalSpaceFeatures>",
        "<cellSpaceMember><CellSpace gml:id=\"F\"/></cellSpaceMember></PrimalSpaceFeatures>",
    );
    let layer = "<SpaceLayer gml:id=\"second\"></SpaceLayer></multiLayeredGraph>";
    let text = flat.replace("<SpaceLayer>", "<SpaceLayer gml:id=\"first\">").replace("</multiLayeredGraph>", layer);
    let model = indoorgml::read(&text, 0.5).unwrap();
    assert_eq!((model.spaces.len(), model.transitions.len()), (4, 3));
    assert_eq!(model.notes, ["2 space layers; only first is read"]);
    assert_eq!(indoorgml::read(&flat, 0.5).unwrap().notes, ["1 cell spaces without a solid left out"]);
    let half = ImportOptions { metres_per_unit: Some(0.5), ..ImportOptions::default() };
    let scene = indoorgml::from_str(&house(), "half", &half).unwrap();
    assert_eq!(scene.bounds().size(), DVec3::new(11.0, 3.0, 2.5));
    let graph = read_indoorgml(&house(), &scene).unwrap();
    assert!(graph.cells[0].pieces[0].bounds.size().distance(DVec3::new(2.0, 1.5, 2.5)) < 1e-9);
}

#[test]
fn an_outline_and_its_holes_may_be_one_ring() {
    // Around a shaft of 1 x 1 m; floor and ceiling with the shaft's ring behind their own, closed by its first corner again.
    let mut walls = cuboid([0., 0., 0.], [5., 5., 3.]);
    let shaft = cuboid([2., 2., 0.], [3., 3., 3.]);
    for side in [0, 1] {
        let [outline, hole] = [&walls[side], &shaft[side]].map(|r| r.iter().chain(&r[..1]).copied().collect::<Ring>());
        walls[side] = [outline, hole].concat();
    }
    walls.extend(shaft[2..].iter().cloned());
    let text = house().replace(&space("A", &cuboid([0., 0., 0.], [4., 5., 3.])), &space("A", &walls));
    assert_ne!(text, house());
    let scene = scene(&text);
    let room = &scene.hints.rooms[0];
    let whole: f64 = room.surface.iter().map(|t| area(t)).sum();
    // Floor and ceiling of 24 m2 each, 60 m2 of outer walls, 12 m2 of the shaft's.
    assert!((whole - 120.0).abs() < 1e-6, "{whole}");
    let graph = read_indoorgml(&text, &scene).unwrap();
    let locator = Locator::new(&graph);
    let holds = |x: f64, y: f64| locator.locate(DVec3::new(x, 1.5, -y) - scene.origin).map(|f| f.0) == Some(CellId(0));
    assert!(holds(1.0, 1.0) && holds(3.5, 1.0) && holds(2.5, 4.5) && !holds(2.5, 2.5));
}

#[test]
fn what_two_spaces_both_hold_is_the_smaller_ones() {
    // A cabinet of 1 x 1 x 3 m drawn inside the first room, and a closet that reaches half a metre into the second.
    let members = [space("E", &cuboid([1., 1., 0.], [2., 2., 3.])), space("G", &cuboid([7.5, 0., 0.], [9., 2., 3.]))];
    let text = house().replace("</PrimalSpaceFeatures>", &format!("{}</PrimalSpaceFeatures>", members.concat()));
    let states =
        r#"<SpaceLayer><stateMember><State gml:id="S-E"/></stateMember><stateMember><State gml:id="S-G"/></stateMember>"#;
    let text = text.replace("<SpaceLayer>", states);
    let scene = scene(&text);
    let graph = read_indoorgml(&text, &scene).unwrap();
    let locator = Locator::new(&graph);
    let name = |p: DVec3| locator.locate(p - scene.origin).map(|(cell, _)| graph.cells[cell.index()].name.as_str());
    for (x, y, expected) in [(1.5, 1.5, "E room"), (0.5, 1.5, "A room"), (7.8, 1.0, "G room"), (7.4, 1.0, "B room")] {
        assert_eq!(name(DVec3::new(x, 1.5, -y)), Some(expected));
    }
    let told: Vec<_> = graph.notes.iter().filter(|n| n.contains("overlap in")).collect();
    assert_eq!(told, ["E and A overlap in 3.00 m3; E keeps it", "G and B overlap in 3.00 m3; G keeps it"]);
    sealed(&scene, &text, 20_000);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn files_of_others_have_all_their_spaces_and_ways() {
    let folder = data::data();
    // Cell spaces, and pairs of them that transitions join, as counted in the files' text.
    for (file, spaces, pairs) in
        [("201", 80, 85), ("FJK-Haus_IndoorGML_withEXR-corrected_1_0_3", 14, 14), ("v103-PNU-bldg201_3d", 80, 85)]
    {
        let path = folder.join(format!("indoorgml-apache/{file}.gml"));
        let scene = import(&path, &ImportOptions::default()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let graph = read_indoorgml(&text, &scene).unwrap();
        assert_eq!(graph.cells.len(), spaces, "{file}");
        let mut joined: Vec<_> =
            graph.portals.iter().map(|p| [p.cells[0].min(p.cells[1]), p.cells[0].max(p.cells[1])]).collect();
        joined.sort_unstable();
        joined.dedup();
        assert_eq!(joined.len(), pairs, "{file}: {:?}", graph.notes);
        sealed(&scene, &text, 200_000);
    }
}
