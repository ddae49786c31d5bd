//! Cities against the study that they are made after.

use super::shown::{Placed, Shown};
use super::{list, make, point};
use enfilade_scenes::{Generated, Kind};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, BTreeSet};

/// An object's outline from above, in order: its outermost corners in (x, z), of a building those of its foot.
fn outline(shown: &Shown, node: &Placed) -> Vec<DVec2> {
    let flat = |p: DVec3| DVec2::new(p.x, p.z);
    let middle = flat(node.world.col(3).truncate());
    let reach = shown.corners(node).map(|p| flat(p).distance(middle)).fold(0.0, f64::max);
    let mut ring: Vec<DVec2> = shown.corners(node).map(flat).filter(|p| p.distance(middle) > 0.999 * reach).collect();
    ring.sort_by(|a, b| (*a - middle).to_angle().total_cmp(&(*b - middle).to_angle()));
    ring.dedup();
    ring
}

fn ring_area(ring: &[DVec2]) -> f64 {
    (0..ring.len()).map(|i| ring[i].perp_dot(ring[(i + 1) % ring.len()])).sum::<f64>() / 2.0
}

/// Distance from a point to a convex ring; 0 inside.
fn distance(ring: &[DVec2], p: DVec2) -> f64 {
    let edges = || (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]));
    if edges().all(|(a, b)| (b - a).perp_dot(p - a) >= 0.0) {
        return 0.0;
    }
    let to_edge = |(a, b): (DVec2, DVec2)| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a.lerp(b, t))
    };
    edges().map(to_edge).fold(f64::MAX, f64::min)
}

/// True where a line along an edge of one convex ring has the other on its far side.
fn parted(a: &[DVec2], b: &[DVec2]) -> bool {
    let beside = |a: &[DVec2], b: &[DVec2]| {
        (0..a.len()).any(|i| b.iter().all(|p| (a[(i + 1) % a.len()] - a[i]).perp_dot(*p - a[i]) < 0.0))
    };
    beside(a, b) || beside(b, a)
}

/// V. Cunha's and M. Leitão's figures: numbers of objects (table 1), levels of the scene graph, shares of the plane.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn cities_have_the_buildings_the_levels_and_the_density_of_the_study() {
    for (dense, buildings, trees, share) in [(true, 25_426, 10_862, 0.22), (false, 2_028, 4_056, 0.02)] {
        let made = make(Kind::City { dense }, 5);
        let shown = Shown::of(&made);
        assert_eq!(made.expected["triangles"], shown.triangles());
        assert_eq!(made.expected["nodes"], shown.nodes.len());
        for (key, count) in [("buildings", buildings), ("trees", trees), ("areas", 1_024), ("groups", 64)] {
            assert_eq!(made.expected[key], count, "{key}");
        }
        let ground = shown.nodes.iter().find(|n| n.name == "ground").unwrap();
        let (low, high) = shown.corners(ground).fold((DVec3::MAX, DVec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
        let edge = high.x - low.x;
        let area = edge / 32.0;
        assert_eq!((ground.above.as_slice(), high.y, high.z - low.z), (&["city".to_owned()][..], 0.0, edge));

        let by_area = objects_by_area(&shown, [buildings, trees]);
        check_areas(&by_area, edge, share);
        check_walk(&made, &by_area, area);
    }
}

/// Outlines of the objects of each group and area; and whether it is a building, else a tree.
type ByArea = BTreeMap<[String; 2], Vec<(Vec<DVec2>, bool)>>;

/// Root, group, area, object: by the file's own tree, and by name. There are `expected` buildings and trees.
fn objects_by_area(shown: &Shown, expected: [usize; 2]) -> ByArea {
    let mut by_area = ByArea::new();
    let mut counts = [0, 0];
    for node in shown.nodes.iter().filter(|n| n.name != "ground") {
        let [root, group, in_area] = &node.above[..] else { panic!("{} hangs from {:?}", node.name, node.above) };
        let object = node.name.strip_prefix(&format!("{in_area}/")).unwrap();
        assert!(root == "city" && in_area.starts_with(&format!("{group}/a")), "{}", node.name);
        let building = object.starts_with('b');
        counts[usize::from(!building)] += 1;
        by_area.entry([group.clone(), in_area.clone()]).or_default().push((outline(shown, node), building));
        let ends = shown.corners(node).fold([f64::MAX, 0.0], |[low, high], p| [p.y.min(low), p.y.max(high)]);
        let heights = if building { 6.0..90.1 } else { 5.0..9.1 };
        assert!(ends[0] == 0.0 && heights.contains(&ends[1]), "{}: from {} to {} m", node.name, ends[0], ends[1]);
    }
    assert_eq!((counts, by_area.len()), (expected, 1_024));
    by_area
}

/// Areas leave streets free, objects stand apart and buildings cover this share of a city with this edge, metres.
fn check_areas(by_area: &ByArea, edge: f64, share: f64) {
    let area = edge / 32.0;
    let mut squares: BTreeMap<&str, BTreeSet<[i64; 2]>> = BTreeMap::new();
    let mut covered = 0.0;
    for ([group, name], feet) in by_area {
        let ahead = feet.iter().flat_map(|(ring, _)| ring).copied();
        let (least, most) = ahead.fold((DVec2::MAX, DVec2::MIN), |(a, b), p| (a.min(p), b.max(p)));
        let square = (least / area).floor();
        let (corner, end) = (square * area, (square + 1.0) * area);
        assert!(least.cmpge(corner + 3.99).all() && most.cmple(end - 3.99).all(), "{name} leaves its streets free");
        squares.entry(group).or_default().insert([square.x as i64, square.y as i64]);
        covered += feet.iter().filter(|(_, building)| *building).map(|(ring, _)| ring_area(ring)).sum::<f64>();
        for (i, (a, _)) in feet.iter().enumerate() {
            for (b, _) in &feet[..i] {
                assert!(parted(a, b), "{name}: two objects overlap");
                // Of two nearest points of convex rings that are parted, one is a corner.
                let apart = (a.iter().map(|p| distance(b, *p))).chain(b.iter().map(|p| distance(a, *p)));
                assert!(apart.fold(f64::MAX, f64::min) > 1.99, "{name}: nobody walks between two objects");
            }
        }
    }
    assert!((covered / (edge * edge) - share).abs() < 1e-4 * share, "{covered} square metres are covered");
    assert_eq!(squares.len(), 64);
    for (group, squares) in &squares {
        let least = squares.iter().fold([i64::MAX; 2], |a, s| [a[0].min(s[0]), a[1].min(s[1])]);
        let block: BTreeSet<[i64; 2]> = (0..16).map(|i| [least[0] + i % 4, least[1] + i / 4]).collect();
        assert!(*squares == block && least.iter().all(|k| k % 4 == 0), "{group} is 4 x 4 areas");
    }
}

/// The walk: at a steady speed, in the streets, from the thick of it to the rim.
fn check_walk(made: &Generated, by_area: &ByArea, area: f64) {
    let eyes: Vec<DVec3> = list(&made.path["frames"]).iter().map(|f| point(&f["eye"])).collect();
    assert!(eyes.windows(2).all(|e| (e[0].distance(e[1]) - 1.0).abs() < 1e-3));
    let feet = || by_area.values().flatten().map(|(ring, _)| ring);
    for eye in eyes.iter().step_by(20) {
        let p = DVec2::new(eye.x, eye.z);
        assert!(eye.y == 1.6 && feet().all(|ring| distance(ring, p) > 3.9), "{eye} is in a building's way");
    }
    let near = |eye: &DVec3| {
        let p = DVec2::new(eye.x, eye.z);
        feet().filter(|ring| ring[0].distance(p) < 3.0 * area).count() as f64
    };
    let (first, last) = (near(&eyes[0]), near(&eyes[eyes.len() - 1]));
    assert!((0.4..0.6).contains(&(last / first)), "{first} objects around the first frame, {last} around the last");
}
