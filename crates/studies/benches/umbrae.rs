//! What is hidden from regions by fused umbrae, in a city, where rows of cells say nothing: it is one open cell.
//!
//! Based on: P. Wonka, M. Wimmer, D. Schmalstieg, *Visibility preprocessing with occluder fusion for urban walkthroughs*, 2000: what occluders
//! that are shrunk by `e` hide from a point is hidden by the occluders themselves from everywhere within `e` of it. So points on the surface of
//! a region, no place of which is farther than `e` from one of them, tell what the region sees. Deviations: occluders are shrunk as solids in
//! all three directions, by half a pixel's diagonal more where they are, since a picture knows the middles of pixels only; and what is asked
//! about are boxes in a hierarchy (CHC) over all objects.
//!
//! An occluder is the lowest box of each building. Below it is the ground, under which nothing is seen.
//!
//! First the answers are checked: whatever the exact judge has a witness of from random points of a region is in its set. Then sets and
//! seconds over `e`. `--test` takes the sparse city and one region.

use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::view::{Frustum, View};
use enfilade::scene::{ImportOptions, Object, Scene};
use enfilade_formats::import;
use enfilade_measure::exact::{ExactScene, Judge, MOST_SPLITS};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_scenes::{Kind, generate};
use glam::DVec3;
use std::path::PathBuf;
use std::time::Instant;
use testing::random::Random;

/// By how much occluders shrink, metres.
const SHRUNK: [f64; 4] = [0.5, 1.0, 2.0, 3.0];
/// Edges of a region, metres: a street is 8 m wide.
const REGION: DVec3 = DVec3::new(6.0, 2.0, 6.0);
const REGIONS: usize = 6;
/// Random points of a region from which the judge looks.
const POINTS: usize = 60;
/// Pixels along a face. Fewer: occluders far off vanish. More: pictures take longer.
const SIDE: usize = 2048;
const NEAR: f64 = 0.05;
/// Below everything, metres.
const DEEP: f64 = -50.0;

fn main() {
    let is_test = std::env::args().any(|a| a == "--test");
    let made = generate(Kind::City { dense: !is_test }, 0).expect("a city");
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("umbrae.glb");
    std::fs::write(&file, &made.glb).expect("a folder to write to");
    let scene = import(&file, &ImportOptions::default()).expect("what was generated");
    let path = CameraPath::from_json(&made.path.to_string()).expect("a path");
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let count = if is_test { 1 } else { REGIONS };
    let regions: Vec<Aabb> = (0..count)
        .map(|i| {
            let eye = path.frames[i * (path.frames.len() - 1) / REGIONS].eye - scene.origin;
            Aabb { min: eye - REGION / 2.0, max: eye + REGION / 2.0 }
        })
        .collect();
    let seen: Vec<Vec<ObjectId>> = witnessed(&scene, &regions);
    let mean = |sets: &[Vec<ObjectId>]| sets.iter().map(Vec::len).sum::<usize>() as f64 / sets.len() as f64;
    println!("{} objects; seen from {POINTS} points of a region, mean of {count}: {:.0}", scene.objects.len(), mean(&seen));
    println!("| shrunk by, m | occluders | points a region | may be seen | over seen | hidden, % | s a region |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for by in SHRUNK {
        let (mut points, mut shrunk_boxes, start) = (0, 0, Instant::now());
        let sets: Vec<Vec<ObjectId>> = (regions.iter())
            .map(|region| {
                let eyes = surface(region, by);
                points += eyes.len();
                let shrunk = occluders(&scene, region, by);
                shrunk_boxes += shrunk.triangles.len() / 12;
                let mut buffer = DepthBuffer::new(&shrunk, SIDE, SIDE);
                from_points(&tree, &mut buffer, &eyes)
            })
            .collect();
        let seconds = start.elapsed().as_secs_f64() / count as f64;
        for (set, seen) in sets.iter().zip(&seen) {
            let missed = seen.iter().find(|o| set.binary_search(o).is_err());
            assert_eq!(missed, None, "shrunk by {by}: an object that is seen counts as hidden");
        }
        println!(
            "| {by} | {} | {} | {:.0} | {:.2} | {:.1} | {seconds:.2} |",
            shrunk_boxes / count,
            points / count,
            mean(&sets),
            mean(&sets) / mean(&seen),
            100.0 * (1.0 - mean(&sets) / scene.objects.len() as f64)
        );
    }
}

/// What the judge has a witness of, from random points, by region; ascending.
fn witnessed(scene: &Scene, regions: &[Aabb]) -> Vec<Vec<ObjectId>> {
    let ready = ExactScene::new(scene);
    let (mut judge, mut random) = (Judge::new(&ready), Random::new(1));
    let mut see = |region: &Aabb| {
        let mut seen: Vec<ObjectId> = Vec::new();
        for _ in 0..POINTS {
            let at = DVec3::new(random.real(0.0, 1.0), random.real(0.0, 1.0), random.real(0.0, 1.0));
            let eye = region.min + (region.max - region.min) * at;
            seen.extend(judge.around(eye, MOST_SPLITS).visible.iter().map(|w| scene.object_of(w.triangle as usize)));
        }
        seen.sort_unstable();
        seen.dedup();
        assert!(seen.len() > 1, "a test of nothing");
        seen
    };
    regions.iter().map(&mut see).collect()
}

/// The same objects, each with the triangles of its box shrunk by `by` and what a pixel is there, or none.
fn occluders(scene: &Scene, region: &Aabb, by: f64) -> Scene {
    let mut shrunk = Scene { positions: Vec::new(), triangles: Vec::new(), objects: Vec::new(), ..scene.clone() };
    for object in &scene.objects {
        let start = shrunk.triangles.len() as u32;
        let is_building = object.node.split('/').nth(2).is_some_and(|name| name.starts_with('b'));
        let farthest = (object.bounds.max - region.min).abs().max((region.max - object.bounds.min).abs()).length();
        let by = by + farthest * 2f64.sqrt() / SIDE as f64;
        if let Some(corners) = is_building.then(|| smaller(scene, object, by)).flatten() {
            let first = shrunk.positions.len() as u32;
            shrunk.positions.extend(corners);
            // Corners go around the foot, then around the top.
            let quads = [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
            let halves = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
            shrunk.triangles.extend(halves.map(|t: [u32; 3]| t.map(|k| first + k)));
        }
        shrunk.objects.push(Object { triangles: start..shrunk.triangles.len() as u32, opaque: true, ..object.clone() });
    }
    shrunk
}

/// The lowest box of a building, shrunk: a ring of four corners and its height; `None` where nothing is left of it.
fn smaller(scene: &Scene, object: &Object, by: f64) -> Option<[DVec3; 8]> {
    let mut points: Vec<DVec3> = object.triangles.clone().flat_map(|t| scene.corners(t as usize)).collect();
    let foot = points.iter().fold(f64::INFINITY, |low, p| low.min(p.y));
    let level = |p: &DVec3, y: f64| (p.y - y).abs() < 1e-3;
    let above = points.iter().filter(|p| !level(p, foot)).fold(f64::INFINITY, |low, p| low.min(p.y));
    points.retain(|p| level(p, foot));
    let middle = (points.iter().fold(DVec3::INFINITY, |a, b| a.min(*b))
        + points.iter().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b)))
        / 2.0;
    // The middle of the foot is a corner of its triangles, too.
    points.retain(|p| p.distance(middle) > 1.0);
    points.sort_by(|a, b| (a.z - middle.z).atan2(a.x - middle.x).total_cmp(&(b.z - middle.z).atan2(b.x - middle.x)));
    points.dedup_by(|a, b| a.distance(*b) < 1e-3);
    let [a, b, c, d] = points[..] else { panic!("a foot of {} corners: {}", points.len(), object.node) };
    let [u, v] = [b - a, d - a];
    assert!(
        (a + c).distance(b + d) < 1e-2 && u.normalize().dot(v.normalize()).abs() < 1e-3,
        "{}: not a rectangle",
        object.node
    );
    let half = |edge: DVec3| edge.normalize() * (edge.length() / 2.0 - by);
    if u.length().min(v.length()) <= 2.0 * by || above - foot <= by {
        return None;
    }
    let (u, v) = (half(u), half(v));
    let ring = [-u - v, u - v, u + v, v - u].map(|p| middle + p);
    let at = |y: f64| ring.map(|p| DVec3::new(p.x, y, p.z));
    let (low, high) = (at(DEEP), at(above - by));
    Some([low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]])
}

/// Points on the surface of a region, no place of which is farther than `reach` from one of them.
fn surface(region: &Aabb, reach: f64) -> Vec<DVec3> {
    let size = region.max - region.min;
    // Half a square's diagonal.
    let count = size.to_array().map(|length| (length / (reach * 2f64.sqrt())).ceil() as usize);
    let mut points = Vec::new();
    for k in 0..3 {
        let [i, j] = [(k + 1) % 3, (k + 2) % 3];
        for side in [region.min[k], region.max[k]] {
            for at in 0..count[i] * count[j] {
                let mut point = region.min;
                point[k] = side;
                point[i] += size[i] * ((at % count[i]) as f64 + 0.5) / count[i] as f64;
                point[j] += size[j] * ((at / count[i]) as f64 + 0.5) / count[j] as f64;
                points.push(point);
            }
        }
    }
    points
}

/// What isn't hidden from all of some points, ascending.
fn from_points(tree: &Hierarchy, buffer: &mut DepthBuffer<'_>, eyes: &[DVec3]) -> Vec<ObjectId> {
    let mut seen = Vec::new();
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for k in 0..3 {
        for side in [1.0, -1.0] {
            // What showed from one point mostly does from the next.
            let mut culler = Chc::default();
            for &eye in eyes {
                let [x, y, w] = [axes[(k + 1) % 3], axes[(k + 2) % 3], axes[k] * side];
                let view = View { eye, x, y, w, near: NEAR, far: f64::INFINITY };
                buffer.begin(&view);
                seen.extend_from_slice(culler.cull(tree, &Frustum::new(&view), buffer));
            }
        }
        seen.sort_unstable();
        seen.dedup();
    }
    seen
}
