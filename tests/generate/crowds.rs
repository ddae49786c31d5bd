//! Teapots and decks against the studies that they are made after.

use super::shown::Shown;
use super::{list, make, point, scene};
use enfilade::scene::Role;
use enfilade_scenes::Kind;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Surface of the upright box around points.
fn box_area(points: impl Iterator<Item = DVec3>) -> f64 {
    let (low, high) = points.fold((DVec3::MAX, DVec3::MIN), |(low, high), p| (low.min(p), high.max(p)));
    let size = high - low;
    2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
}

/// P. Ivson's figures (2006): vertices of a teapot (section 6.1); boxes around one teapot and around 500 and 5,000 of scale 10
/// (table 6.2.1).
#[test]
fn teapots_have_the_vertices_and_the_boxes_of_the_study() {
    for (count, area) in [(1, None), (500, Some(10_623.51)), (5_000, Some(10_835.0))] {
        let made = make(Kind::Teapots { count, scale: 10 }, 7);
        let shown = Shown::of(&made);
        let [(positions, triangles)] = &shown.meshes[..] else { panic!("{} meshes", shown.meshes.len()) };
        // Four closed surfaces of genus 0 have 2 V - 4 * 4 triangles (Euler).
        assert_eq!((shown.nodes.len(), positions.len(), *triangles), (count, 1_364, 2 * 1_364 - 16));
        assert_eq!(made.expected["triangles"], count * triangles);
        assert_eq!((&made.expected["teapots"], &made.expected["nodes"]), (&count.into(), &count.into()));
        assert!((box_area(positions.iter().map(|&p| p * 10.0)) - 22.70).abs() < 0.005);
        let mut middles = BTreeSet::new();
        for node in &shown.nodes {
            let [x, y, z] = [0, 1, 2].map(|i| node.world.col(i).truncate());
            let apart = [x.dot(y), y.dot(z), z.dot(x), x.length_squared() - 100.0, y.cross(z).dot(x) - 1000.0];
            assert!(apart.iter().all(|d| d.abs() < 1e-3), "{}: turned and scaled by 10, no more", node.name);
            let middle = node.world.col(3).truncate();
            assert!(middle.abs().max_element() <= 20.0, "{} at {middle}", node.name);
            middles.insert(middle.to_array().map(f64::to_bits));
        }
        assert_eq!(middles.len(), count);
        if let Some(published) = area {
            let area = box_area(shown.nodes.iter().flat_map(|n| shown.corners(n)));
            assert!((area / published - 1.0).abs() < 0.02, "{count}: {area} where {published} is published");
        }
    }
}

#[test]
fn teapots_are_closed_and_their_camera_comes_from_outside() {
    let made = make(Kind::Teapots { count: 3, scale: 2 }, 1);
    let scene = scene(&made);
    assert_eq!((scene.objects.len(), scene.triangles.len()), (3, 3 * 2_712));
    for object in &scene.objects {
        // A closed surface shows each direction as much of its outside as of its inside.
        let area: DVec3 =
            (object.triangles.clone()).map(|t| scene.corners(t as usize)).map(|[a, b, c]| (b - a).cross(c - a)).sum();
        assert!(area.length() < 1e-6 && object.role == Role::Furnishing, "{}", object.node);
    }
    let eyes: Vec<DVec3> = list(&made.path["frames"]).iter().map(|f| point(&f["eye"])).collect();
    // The box's corners are 34.6 m from its middle.
    assert!(eyes.len() == 600 && eyes[0].length() > 35.0);
    assert!(eyes.windows(2).all(|e| e[1].length() < e[0].length()) && eyes[599].length() < 20.0);
}

/// P. Ivson's figures (2006, section 6.1): 90,867 objects with 4,717,749 vertices in all.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_whole_deck_has_the_objects_and_vertices_of_the_study() {
    let made = make(Kind::Deck { objects: 90_867 }, 0);
    let shown = Shown::of(&made);
    let vertices: usize = shown.nodes.iter().map(|node| shown.meshes[node.mesh].0.len()).sum();
    assert_eq!((shown.nodes.len(), &made.expected["vertices"]), (90_867, &vertices.into()));
    assert!((vertices as f64 / 4_717_749.0 - 1.0).abs() < 0.02, "{vertices} vertices");
}

#[test]
fn a_deck_is_uneven_and_its_names_lead_from_decks_to_modules_to_objects() {
    let made = make(Kind::Deck { objects: 8_000 }, 3);
    let shown = Shown::of(&made);
    assert_eq!((shown.nodes.len(), made.expected["triangles"].as_u64()), (8_000, Some(shown.triangles() as u64)));
    let mut modules: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut triangles, mut sizes) = (Vec::new(), Vec::new());
    for node in &shown.nodes {
        let [root, deck, module] = &node.above[..] else { panic!("{} hangs from {:?}", node.name, node.above) };
        assert!(root == "deck" && module.starts_with(&format!("{deck}/m")), "{}", node.name);
        assert!(node.name.starts_with(&format!("{module}/")), "{} in {module}", node.name);
        *modules.entry(module).or_default() += 1;
        triangles.push(shown.meshes[node.mesh].1);
        let (low, high) = shown.corners(node).fold((DVec3::MAX, DVec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
        sizes.push((high - low).length());
    }
    // Few large ones, very many small ones, by triangles and by size; and modules with several times what others have.
    triangles.sort_unstable();
    sizes.sort_by(f64::total_cmp);
    assert!(triangles[7_999] > 50 * triangles[4_000], "{} and {}", triangles[4_000], triangles[7_999]);
    assert!(sizes[4_000] < 2.0 && sizes[7_999] > 15.0, "{} and {} m", sizes[4_000], sizes[7_999]);
    let counts: Vec<usize> = modules.values().copied().filter(|&n| n > 10).collect();
    assert_eq!(counts.len() as u64, made.expected["modules"].as_u64().unwrap());
    assert!(counts.iter().max() > counts.iter().min().map(|n| 2 * n).as_ref(), "{counts:?}");
}

#[test]
fn a_deck_is_imported_whole_and_its_camera_walks_on_its_floors() {
    let made = make(Kind::Deck { objects: 2_000 }, 1);
    let scene = scene(&made);
    assert_eq!((scene.objects.len(), &scene.source.notes), (2_000, &Vec::new()));
    assert_eq!(made.expected["triangles"], scene.triangles.len());
    // Closed, whatever the placement: no sum of areas points anywhere, and normals lead outwards.
    for object in &scene.objects {
        let (middle, mut area, mut volume) = (object.bounds.centre(), DVec3::ZERO, 0.0);
        for [a, b, c] in object.triangles.clone().map(|t| scene.corners(t as usize).map(|p| p - middle)) {
            area += (b - a).cross(c - a);
            volume += a.dot(b.cross(c));
        }
        assert!(area.length() < 1e-4 && volume > 0.0, "{}: {area}, {volume}", object.node);
    }
    let eyes: Vec<DVec3> = list(&made.path["frames"]).iter().map(|f| point(&f["eye"])).collect();
    let bounds = scene
        .objects
        .iter()
        .fold((DVec3::MAX, DVec3::MIN), |(low, high), o| (low.min(o.bounds.min), high.max(o.bounds.max)));
    let is_inside = |eye: &DVec3| {
        let p = *eye - scene.origin;
        p.cmpge(bounds.0).all() && p.cmple(bounds.1).all()
    };
    assert!(eyes[300..].iter().all(|eye| is_inside(eye) && (eye.y - 9.6).abs() < 1e-9), "1.6 m over the second deck");
}
