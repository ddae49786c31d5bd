//! Clusters of triangles with cones of normals: what the software oracle could save if it dropped whole clusters that face
//! away from the eye, where it finds triangle by triangle. They aren't in the library, since they save too little:
//! README.md of this crate has the figures.
//!
//! Based on: Kumar, Manocha, Garrett, Lin, *Hierarchical back-face culling*, 1996: a cluster faces away from every eye in a
//! region behind all of its planes. The form of the region, an apex, an axis and a sine, is that of meshoptimizer's clusters
//! (A. Kapoulkine, 2017). Deviations: clusters are runs of an object's triangles in the order of the scene, so nothing
//! changes the order of drawing; where runs end is what costs least on average over all directions, up to the sine, which is
//! taken to the last normal of a run. Only closed opaque objects that lie beyond the near plane have backs that needn't be
//! drawn: the oracle's own rule.
//!
//! First the answers: hand-made solids, random ones, and in each frame no cluster is dropped that has a triangle which the
//! oracle's own test, in `f64`, draws. Then forty frames along the path of each scene, 1920 x 1080, one thread, each time
//! the least of several: telling which triangles face the eye by their own test, the same with clusters first, and drawing
//! with the oracle. Once for the objects in the frustum, once for those that CHC draws. `--test` takes the sparse city
//! alone.

use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::{Frustum, View};
use enfilade::scene::{ImportOptions, Object, Role, Scene};
use enfilade_formats::import;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_scenes::{Kind, generate};
use glam::DVec3;
use std::collections::HashMap;
use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;
use testing::random::Random;

/// Most triangles of a cluster.
const MOST: usize = 64;
/// What the test of a cluster costs, in tests of triangles. At 1, the sides of boxes, two triangles each, have no clusters
/// of their own; at 0.5, single triangles have.
const TEST: f64 = 0.75;
/// Of cones with a greater sine there are none: they are nearly never dropped, and the apex is far behind.
const WIDEST: f64 = 0.95;
/// Eyes are no farther from a scene than so many diagonals.
const REACH: f64 = 1e3;
/// Roundings of an `f64` that the test of a triangle may add up to, and more. Smaller: a triangle that its own test keeps
/// may be dropped.
const ROUNDINGS: f64 = 64.0;
/// Largest angle, radians, by which cones are widened for rounding: a triangle that needs more is a sliver, and in no
/// cluster.
const WIDENED: f64 = 1e-3;
/// Cones are widened by this angle, radians, for the roundings of their own test, at the least.
const LEAST_WIDENED: f64 = 1e-12;
/// Tries to place an apex, each farther behind.
const TRIES: usize = 4;

const SIZE: [usize; 2] = [1920, 1080];
const FRAMES: usize = 40;
const REPEATS: usize = 5;

/// Up to `end`, triangles that all face away from an eye which the cone behind the apex holds.
#[derive(Clone, Copy)]
struct Cluster {
    /// Behind all planes, relative to the scene's origin, metres.
    apex: [f32; 3],
    /// About the mean of the normals, towards outside; zero: never dropped.
    axis: [f32; 3],
    /// That of the widest angle between the axis and a normal, times the axis' length, squared.
    sine_squared: f32,
    end: u32,
}

fn wide(of: [f32; 3]) -> DVec3 {
    DVec3::from_array(of.map(f64::from))
}

impl Cluster {
    const NONE: Self = Self { apex: [0.0; 3], axis: [0.0; 3], sine_squared: 0.0, end: 0 };

    #[inline(always)]
    fn faces_away(&self, eye: DVec3) -> bool {
        let (way, axis) = (wide(self.apex) - eye, wide(self.axis));
        let along = way.dot(axis);
        along > 0.0 && along * along >= f64::from(self.sine_squared) * way.length_squared()
    }
}

/// 1 where corners run counter-clockwise seen from outside, -1 where clockwise; `None` where an object isn't closed. As the
/// oracle has it.
fn outside(scene: &Scene, object: &Object) -> Option<f64> {
    let (mut places, mut edges, mut volume) = (HashMap::new(), HashMap::<[u32; 2], [u32; 2]>::new(), 0.0);
    for t in object.triangles.clone() {
        let corners = scene.corners(t as usize);
        let ids = corners.map(|p| {
            let next = places.len() as u32;
            *places.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert(next)
        });
        for k in 0..3 {
            let [a, b] = [ids[k], ids[(k + 1) % 3]];
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a < b)] += 1;
        }
        let [a, b, c] = corners.map(|p| p - object.bounds.min);
        volume += a.dot(b.cross(c));
    }
    (edges.values().all(|&both| both == [1, 1]) && volume != 0.0).then(|| f64::signum(volume))
}

struct Facet {
    corners: [DVec3; 3],
    /// Of length 1, towards outside.
    normal: DVec3,
    /// What rounding may turn the triangle by, radians a metre of the eye's distance.
    noise: f64,
}

impl Facet {
    fn of(corners: [DVec3; 3], side: f64) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let noise = ROUNDINGS * 0.5 * f64::EPSILON * longest / normal.length();
        Self { corners, normal: normal.normalize_or_zero() * side, noise }
    }
}

/// Of a closed object, runs of its triangles that cost the least tests; eyes are nearer than `reach`. Empty where they spare
/// nothing.
fn clusters(scene: &Scene, object: &Object, side: f64, reach: f64) -> Vec<Cluster> {
    let facets: Vec<Facet> = object.triangles.clone().map(|t| Facet::of(scene.corners(t as usize), side)).collect();
    let sine_of = |cosine: f64| if cosine > 0.0 { (1.0 - cosine * cosine).max(0.0).sqrt() } else { 1.0 };
    // Tests that the first triangles take, and where their last run begins.
    let mut best = vec![(0.0, 0)];
    for end in 1..=facets.len() {
        let (mut least, mut cosine) = ((f64::INFINITY, 0), 1.0f64);
        for start in (end.saturating_sub(MOST)..end).rev() {
            let facet = &facets[start];
            cosine =
                if facet.noise * reach >= WIDENED { -1.0 } else { cosine.min(facet.normal.dot(facets[end - 1].normal)) };
            let kept = Some(sine_of(cosine)).filter(|&sine| sine < WIDEST).unwrap_or(1.0);
            // From a random direction far away, half of those whose cone is a line can be dropped.
            let cost = best[start].0 + TEST + (end - start) as f64 * 0.5 * (1.0 + kept);
            if cost < least.0 {
                least = (cost, start);
            }
        }
        best.push(least);
    }
    if best[facets.len()].0 >= facets.len() as f64 {
        return Vec::new();
    }
    let (mut all, mut end) = (Vec::new(), facets.len());
    while end > 0 {
        let start = best[end].1;
        all.push(Cluster { end: object.triangles.start + end as u32, ..cone(&facets[start..end], reach) });
        end = start;
    }
    all.reverse();
    all
}

/// The cone of some facets. Let `e` be the eye, `q` the apex, `n` a normal, `p` a corner of its triangle; then `n (e - p)`
/// is `n (q - p) - n (q - e)`. The apex is behind each plane by a margin, so the first is below its negative; and where `q -
/// e` is within a right angle less the cone's, widened, of the axis, the second is above the sine of what it is widened by
/// times the distance. Together they are more than rounding takes in the test of a triangle: about `noise * distance^2` of
/// the farthest corner.
fn cone(facets: &[Facet], reach: f64) -> Cluster {
    let noise = facets.iter().map(|f| f.noise).fold(0.0, f64::max);
    // What is stored counts.
    let axis = facets.iter().map(|f| f.normal).sum::<DVec3>().normalize_or_zero().as_vec3().to_array();
    let stored = wide(axis);
    let sine = |f: &Facet| if f.normal.dot(stored) > 0.0 { f.normal.cross(stored).length() / stored.length() } else { 1.0 };
    let sine = facets.iter().map(sine).fold(0.0, f64::max);
    if noise * reach >= WIDENED || sine >= WIDEST {
        return Cluster::NONE;
    }
    let corners = || facets.iter().flat_map(|f| f.corners);
    let centre = corners().sum::<DVec3>() / (3 * facets.len()) as f64;
    let size = corners().map(|p| p.distance(centre)).fold(0.0, f64::max);
    let mut behind = 0.0;
    for _ in 0..TRIES {
        let apex = (centre - stored * behind).as_vec3().to_array();
        let q = wide(apex);
        let extent = q.distance(centre) + size;
        let margin = 4.0 * noise * extent * extent;
        let lacks = |f: &Facet| (f.normal.dot(q - f.corners[0]) + margin) / f.normal.dot(stored);
        let lacking = facets.iter().map(lacks).fold(f64::NEG_INFINITY, f64::max);
        if lacking <= 0.0 {
            let angle = sine.asin() + LEAST_WIDENED + noise * (reach + 4.0 * extent);
            let sine_squared = (angle.sin() * stored.length()).powi(2) as f32;
            return Cluster { apex, axis, sine_squared: sine_squared.next_up(), end: 0 };
        }
        // A step of `f32` more each time.
        behind += lacking * (1.0 + LEAST_WIDENED) + q.abs().max_element() * f64::from(f32::EPSILON);
    }
    Cluster::NONE
}

/// The clusters of a scene.
struct Cones<'s> {
    scene: &'s Scene,
    sides: Vec<Option<f64>>,
    clusters: Vec<Cluster>,
    /// By object.
    parts: Vec<Range<usize>>,
    /// Seconds, without finding out what is closed, which the oracle does, too.
    built: f64,
}

/// Triangles of a frame.
#[derive(Clone, Copy, Default)]
struct Counts {
    all: usize,
    /// Of closed objects beyond the near plane.
    closed: usize,
    /// Of these, those that face away.
    away: usize,
    /// Of these, those in clusters that do.
    dropped: usize,
}

impl<'s> Cones<'s> {
    fn new(scene: &'s Scene) -> Self {
        let sides: Vec<_> =
            scene.objects.iter().map(|o| Some(o).filter(|o| o.opaque).and_then(|o| outside(scene, o))).collect();
        let (start, reach) = (Instant::now(), 2.0 * REACH * scene.bounds().diagonal());
        let (mut all, mut parts) = (Vec::new(), Vec::new());
        for (object, side) in scene.objects.iter().zip(&sides) {
            let first = all.len();
            all.extend(side.map(|side| clusters(scene, object, side, reach)).unwrap_or_default());
            parts.push(first..all.len());
        }
        Self { scene, sides, clusters: all, parts, built: start.elapsed().as_secs_f64() }
    }

    /// Which side of an object's triangles alone is drawn.
    fn side(&self, object: ObjectId, view: &View) -> Option<f64> {
        let Aabb { min, max } = self.scene.objects[object.index()].bounds;
        let (middle, half) = ((min + max) * 0.5, (max - min) * 0.5);
        let nearest = view.w.dot(middle - view.eye) - view.w.abs().dot(half);
        self.sides[object.index()].filter(|_| nearest > view.near)
    }

    /// As the oracle tests a triangle.
    #[inline(always)]
    fn faces(&self, triangle: u32, side: f64, eye: DVec3) -> bool {
        let [a, b, c] = self.scene.corners(triangle as usize).map(|p| p - eye);
        let volume = (b - a).cross(c - a).dot(a);
        volume != 0.0 && (volume < 0.0) == (side > 0.0)
    }

    /// How many triangles of an object face the eye: each by its own test.
    fn by_triangle(&self, object: ObjectId, side: f64, eye: DVec3) -> usize {
        let triangles = self.scene.objects[object.index()].triangles.clone();
        triangles.filter(|&t| self.faces(t, side, eye)).count()
    }

    /// The same, clusters first, and how many of these drop.
    #[inline(always)]
    fn by_cluster(&self, object: ObjectId, side: f64, eye: DVec3) -> (usize, usize) {
        let Range { mut start, end } = self.scene.objects[object.index()].triangles.clone();
        let (mut facing, mut dropped) = (0, 0);
        for cluster in &self.clusters[self.parts[object.index()].clone()] {
            if cluster.faces_away(eye) {
                dropped += (cluster.end - start) as usize;
            } else {
                facing += (start..cluster.end).filter(|&t| self.faces(t, side, eye)).count();
            }
            start = cluster.end;
        }
        (facing + (start..end).filter(|&t| self.faces(t, side, eye)).count(), dropped)
    }

    /// Checks and counts.
    fn count(&self, objects: &[ObjectId], view: &View) -> Counts {
        let mut counts = Counts::default();
        for &object in objects {
            let length = self.scene.objects[object.index()].triangles.len();
            counts.all += length;
            let Some(side) = self.side(object, view) else { continue };
            let facing = self.by_triangle(object, side, view.eye);
            let (same, dropped) = self.by_cluster(object, side, view.eye);
            assert_eq!(same, facing, "a triangle that faces the eye is in a cluster that doesn't");
            counts.closed += length;
            counts.away += length - facing;
            counts.dropped += dropped;
        }
        counts
    }
}

/// A scene of one object; corners are used as they are.
fn solid(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let bounds = Aabb::of(positions.iter().copied());
    let object = Object {
        node: String::new(),
        role: Role::Unknown,
        opaque: true,
        glass: false,
        triangles: 0..triangles.len() as u32,
        segments: 0..0,
        bounds,
        reach: None,
    };
    Scene {
        name: String::new(),
        source: Default::default(),
        origin: DVec3::ZERO,
        positions,
        triangles,
        objects: vec![object],
        tubes: Default::default(),
        together: Vec::new(),
        hints: Default::default(),
        trace: None,
    }
}

/// A ball of `rings` times `around` squares, two triangles each, less those at the poles; `radius` by corner.
fn ball(rings: u32, around: u32, mut radius: impl FnMut() -> f64) -> Scene {
    let mut positions = vec![DVec3::Y * radius()];
    for ring in 1..rings {
        let (sin, cos) = (f64::from(ring) / f64::from(rings) * std::f64::consts::PI).sin_cos();
        for k in 0..around {
            let (z, x) = (f64::from(k) / f64::from(around) * std::f64::consts::TAU).sin_cos();
            positions.push(DVec3::new(x * sin, cos, z * sin) * radius());
        }
    }
    positions.push(DVec3::NEG_Y * radius());
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, k: u32| match ring {
        0 => 0,
        _ if ring == rings => last,
        _ => 1 + (ring - 1) * around + k % around,
    };
    let mut triangles = Vec::new();
    for (ring, k) in (0..rings).flat_map(|ring| (0..around).map(move |k| (ring, k))) {
        let [a, b, c, d] = [at(ring, k), at(ring, k + 1), at(ring + 1, k + 1), at(ring + 1, k)];
        triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
    }
    solid(positions, triangles)
}

/// Seen from a place, towards the origin: how many triangles there are, face away, and are dropped.
fn seen(scene: &Scene, eye: DVec3) -> Counts {
    Cones::new(scene).count(&[ObjectId(0)], &View::look_at(eye, DVec3::ZERO, 1.0, 1.0, 1e-3))
}

/// What is known beforehand.
fn check() {
    const SIDES: [[u32; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let corner =
        |half: DVec3| (0..8).map(move |i| half * DVec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| f64::from(b) * 2.0 - 1.0)));
    let sides = || SIDES.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let cuboid = |half: DVec3| solid(corner(half).collect(), sides().collect());
    let mut random = Random::new(1);
    let mut unit = || random.real(0.0, 1.0);
    // 1. A box: of six sides, three are seen from outside of all planes, and the others are dropped; inside, none.
    let scene = cuboid(DVec3::ONE);
    assert_eq!(Cones::new(&scene).clusters.len(), 6);
    for k in 0..8 {
        let eye = DVec3::from([k & 1, k >> 1 & 1, k >> 2].map(|b| f64::from(b) * 20.0 - 10.0)) + DVec3::new(0.3, 0.2, 0.1);
        assert_eq!(seen(&scene, eye).dropped, 6, "from {eye}");
    }
    assert_eq!(seen(&scene, DVec3::Z * 5.0).dropped, 10, "one side is seen");
    assert_eq!(seen(&scene, DVec3::Z * 0.5).dropped, 0, "the eye is inside");
    // 2. A ball: a little less than half.
    let scene = ball(64, 128, || 1.0);
    for eye in [DVec3::X, DVec3::new(0.01, 1.0, 0.02), DVec3::new(0.5, -0.7, 0.3)] {
        let Counts { all, dropped, .. } = seen(&scene, eye.normalize() * 50.0);
        assert!((0.4..0.52).contains(&(dropped as f64 / all as f64)), "{dropped} of {all} from {eye}");
    }
    // 3. Nothing of an open sheet; of a board that is as thin as rounding, nothing of its rim; no cluster that faces all
    // ways.
    let mut open = cuboid(DVec3::ONE);
    open.triangles.truncate(10);
    open.objects[0].triangles.end = 10;
    assert_eq!(seen(&open, DVec3::new(3.0, 4.0, 9.0)).closed, 0);
    let thin = cuboid(DVec3::new(1.0, 1.0, 1e-13));
    let has_cone = |t: usize| cone(&[Facet::of(thin.corners(t), 1.0)], REACH).axis != [0.0; 3];
    assert!((0..12).all(|t| has_cone(t) == (t < 4)));
    let tetrahedron = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let facets = tetrahedron.map(|t| Facet::of(t.map(|i: usize| corners[i]), -1.0));
    assert_eq!(cone(&facets, 1e3).axis, [0.0; 3]);
    // 4. Random solids from random places: `Cones::count` compares.
    let mut dropped = 0;
    for round in 0..200 {
        let rough = unit();
        let scene = ball(3 + round % 9, 3 + round % 7, || 1.0 + rough * unit());
        let mut eye = || DVec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5);
        let eyes: Vec<DVec3> = (0..20).map(|k| eye() * f64::powi(10.0, k % 5)).collect();
        dropped += eyes.iter().map(|&eye| seen(&scene, eye).dropped).sum::<usize>();
    }
    assert!(dropped > 10_000, "{dropped}: a check of nothing");
}

fn least(mut work: impl FnMut()) -> f64 {
    let timed = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..REPEATS).map(timed).fold(f64::INFINITY, f64::min) * 1e3
}

/// Of some objects of a frame: triangles, and milliseconds by triangle, by cluster and of drawing.
fn frame(cones: &Cones<'_>, buffer: &mut DepthBuffer<'_>, view: &View, objects: &[ObjectId]) -> (Counts, [f64; 3]) {
    let closed: Vec<(ObjectId, f64)> = objects.iter().filter_map(|&o| Some((o, cones.side(o, view)?))).collect();
    let by_triangle = || closed.iter().map(|&(o, side)| cones.by_triangle(o, side, view.eye)).sum::<usize>();
    let by_cluster = || closed.iter().map(|&(o, side)| cones.by_cluster(o, side, view.eye).0).sum::<usize>();
    let times = [
        least(|| _ = std::hint::black_box(by_triangle())),
        least(|| _ = std::hint::black_box(by_cluster())),
        least(|| {
            buffer.begin(view);
            objects.iter().for_each(|&o| buffer.draw(o));
        }),
    ];
    (cones.count(objects, view), times)
}

fn measure(kind: Kind, name: &str, object_triangles: u32) {
    let made = generate(kind, 0).expect("a scene");
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("cones.glb");
    std::fs::write(&file, &made.glb).expect("a folder to write to");
    let scene = import(&file, &ImportOptions { object_triangles, ..ImportOptions::default() }).expect("what was generated");
    let path = CameraPath::from_json(&made.path.to_string()).expect("a path");
    let (cones, tree) = (Cones::new(&scene), Hierarchy::build(&scene, &HierarchyOptions::default()));
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    let mut sums = [(Counts::default(), [0.0; 3]); 2];
    for i in 0..FRAMES {
        let camera = path.camera(i * (path.frames.len() - 1) / (FRAMES - 1), scene.origin, SIZE[0] as f64 / SIZE[1] as f64);
        let view = camera.view(path.near);
        let frustum = Frustum::new(&view);
        buffer.begin(&view);
        let by_chc = Chc::default().cull(&tree, &frustum, &mut buffer).to_vec();
        let lists = [FrustumCuller::default().cull(&tree, &frustum).to_vec(), by_chc];
        for (sum, objects) in sums.iter_mut().zip(&lists) {
            let (Counts { all, closed, away, dropped }, times) = frame(&cones, &mut buffer, &view, objects);
            let Counts { all: a, closed: b, away: c, dropped: d } = sum.0;
            *sum = (
                Counts { all: a + all, closed: b + closed, away: c + away, dropped: d + dropped },
                std::array::from_fn(|k| sum.1[k] + times[k]),
            );
        }
    }
    let bytes = size_of_val(&cones.clusters[..]) + size_of_val(&cones.parts[..]);
    let of_scene = size_of_val(&scene.positions[..]) + size_of_val(&scene.triangles[..]);
    println!(
        "\n{name}: {} triangles, {} clusters, {:.0} % of the bytes of corners and triangles, {:.2} s",
        scene.triangles.len(),
        cones.clusters.len(),
        bytes as f64 / of_scene as f64 * 100.0,
        cones.built
    );
    for (who, (counts, times)) in ["frustum", "chc"].into_iter().zip(sums) {
        let [by_triangle, by_cluster, drawing] = times.map(|t| t / FRAMES as f64);
        let [closed, away, dropped] =
            [counts.closed, counts.away, counts.dropped].map(|n| n as f64 / counts.all as f64 * 100.0);
        let all = counts.all / FRAMES;
        print!("| {name}, {who} | {all} | {closed:.0} % | {away:.1} % | {dropped:.1} % ");
        println!("| {by_triangle:.3} | {by_cluster:.3} | {drawing:.2} |");
    }
}

fn main() {
    check();
    print!("| scene, objects | triangles a frame | closed | face away | dropped ");
    println!("| by triangle, ms | by cluster, ms | drawing, ms |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let cut = ImportOptions::default().object_triangles;
    if !std::env::args().any(|a| a == "--test") {
        let office = || Kind::Office { rooms: 1000, storeys: None, furnished: true };
        measure(office(), "office", cut);
        measure(office(), "office, meshes whole", u32::MAX);
        measure(Kind::City { dense: true }, "dense city", cut);
        measure(Kind::Teapots { count: 500, scale: 30 }, "Teapots(500, 30), meshes whole", u32::MAX);
    }
    measure(Kind::City { dense: false }, "sparse city", cut);
}
