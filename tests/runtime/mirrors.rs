//! Pictures of real buildings with mirrors on their walls, by rays: whatever a pixel shows, after however many mirrors, is in the set of that
//! reflection, in every mode. `MIRROR_VIEWS` says how many views a building (40); `just torture` asks for ten thousand.

use crate::cli::building;
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Mirror, Mode, Reflection, View};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Scene};
use enfilade::{CellId, ObjectId};
use enfilade_formats::import;
use enfilade_measure::verify::random_path;
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;
use testing::bakes;

const DEPTH: u32 = 2;
const MIRRORS: usize = 12;
/// Pixels of a picture.
const SIZE: [usize; 2] = [32, 18];
/// Nearer to a mirror's edge than this, metres, a ray may be on either side of it: so much do `f32` corners move.
const EDGE: f64 = 1e-4;

struct Hung {
    mirror: Mirror,
    corners: [DVec3; 4],
    normal: DVec3,
}

impl Hung {
    /// How far along a ray from its front the mirror is met; `Err` where it's too near to an edge to tell.
    fn meet(&self, origin: DVec3, along: DVec3) -> Result<Option<f64>, ()> {
        let speed = self.normal.dot(along);
        let t = self.normal.dot(self.corners[0] - origin) / speed;
        if speed >= 0.0 || t.is_nan() || t <= 0.0 {
            return Ok(None);
        }
        let p = origin + along * t;
        let inside = (0..4).map(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 4]);
            self.normal.cross(b - a).normalize().dot(p - a)
        });
        let inside = inside.fold(f64::INFINITY, f64::min);
        if inside.abs() < EDGE { Err(()) } else { Ok((inside > 0.0).then_some(t)) }
    }
}

/// A mirror of 0.8 x 1 m, a centimetre before the upright wall that a ray from a closed cell meets; none where it would reach over the cell's
/// border or behind something.
fn hang(file: &PvsFile, culler: &Culler, rays: &RayScene<'_>, eye: DVec3, along: DVec3) -> Option<Hung> {
    let cell_of = |p: DVec3| culler.cell_of(p.as_vec3());
    let cell = cell_of(eye).filter(|c| !file.cells[c.index()].open)?;
    let hit = rays.first_opaque(eye, along, f64::INFINITY)?;
    let [a, b, c] = rays.scene().corners(hit.triangle as usize);
    let normal = (b - a).cross(c - a).normalize();
    let normal = if normal.dot(along) < 0.0 { normal } else { -normal };
    if normal.y.abs() > 1e-6 {
        return None;
    }
    let (middle, across) = (eye + along * hit.t + normal * 0.01, DVec3::Y.cross(normal));
    let corner = |x: f64, y: f64| middle + across * (x * 0.4) + DVec3::Y * (y * 0.5);
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)].map(DVec3::as_vec3);
    let is_clear = |p: DVec3| rays.first_opaque(middle + normal * 0.005, p - middle, 1.0).is_none();
    let fits = corners.iter().all(|p| is_clear(p.as_dvec3()) && cell_of(p.as_dvec3() + normal * 0.01) == Some(cell));
    let mirror = Mirror::new(cell, &corners).expect("a rectangle");
    fits.then(|| Hung { mirror, corners: corners.map(|p| p.as_dvec3()), normal })
}

/// What a pixel shows: by which mirrors, and what.
fn trace(hung: &[Hung], rays: &RayScene<'_>, mut origin: DVec3, mut along: DVec3) -> Option<(Vec<usize>, ObjectId)> {
    let mut turned = Vec::new();
    loop {
        let first = rays.first_opaque(origin, along, f64::INFINITY);
        let mut nearest: Option<(f64, usize)> = None;
        for (i, mirror) in hung.iter().enumerate().filter(|(i, _)| turned.last() != Some(i)) {
            match mirror.meet(origin, along) {
                Ok(Some(t)) if nearest.is_none_or(|(n, _)| t < n) => nearest = Some((t, i)),
                Ok(_) => {}
                Err(()) => return None,
            }
        }
        match nearest.filter(|&(t, _)| first.is_none_or(|hit| t < hit.t)) {
            Some(_) if turned.len() == DEPTH as usize => return None,
            Some((t, i)) => {
                origin += along * t;
                along -= hung[i].normal * (2.0 * hung[i].normal.dot(along));
                turned.push(i);
            }
            None => return first.map(|hit| (turned, hit.object)),
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn pictures_with_mirrors_miss_nothing_in_any_mode() {
    let views = std::env::var("MIRROR_VIEWS").map_or(40, |n| n.parse().expect("a number"));
    println!("| building | mirrors | views | pixels | by one mirror | by two | missed |");
    for name in ["gallery100", "villa_rotonda", "office"] {
        let model = building(name).with_extension("glb");
        let mut scene = import(&model, &ImportOptions::default()).unwrap();
        let file = bakes::baked(&scene, bakes::with_rays(200_000));
        // As it is drawn: leaves and glass hide what is behind them.
        scene.objects.iter_mut().for_each(|o| o.opaque = true);
        let counts = pictures(&scene, &file, views);
        println!("| {name} | {MIRRORS} | {views} | {} | {} | {} | 0 |", counts.iter().sum::<u64>(), counts[1], counts[2]);
        assert!(counts[1] > 500 && counts[2] > 0, "{name}: {counts:?}");
    }
}

/// Mirrors in front of some cameras, each with one that faces it.
fn hang_all(file: &PvsFile, culler: &Culler, rays: &RayScene<'_>, cameras: &[Camera]) -> Vec<Hung> {
    let mut hung: Vec<Hung> = Vec::new();
    for camera in cameras {
        let one = hang(file, culler, rays, camera.eye.as_dvec3(), camera.w.as_dvec3());
        let other = one.as_ref().and_then(|m| {
            let middle = (m.corners[0] + m.corners[2]) * 0.5;
            hang(file, culler, rays, middle + m.normal * 0.02, m.normal)
        });
        if let (Some(one), Some(other)) = (one, other) {
            hung.extend([one, other]);
        }
        if hung.len() == MIRRORS {
            break;
        }
    }
    assert_eq!(hung.len(), MIRRORS);
    hung
}

/// Whether what is drawn by these mirrors, in turn, has an object.
fn shows(views: &[Reflection<'_>], turned: &[usize], object: ObjectId) -> bool {
    views.iter().any(|view| match *turned {
        [last] => view.mirror == last && view.parent.is_none() && view.objects.contains(&object),
        [first, last] => {
            let before = view.parent.map(|p| &views[p]);
            let way = before.is_some_and(|b| b.mirror == first && b.parent.is_none());
            view.mirror == last && way && view.objects.contains(&object)
        }
        _ => unreachable!("one or two"),
    })
}

/// Checks every pixel; returns how many there were by the number of mirrors.
fn pictures(scene: &Scene, file: &PvsFile, views: u32) -> [u64; 3] {
    let (rays, culler) = (RayScene::new(scene), Culler::new(file));
    // Enough that there are as many in the mirrors' cells.
    let path = random_path(scene, file, (20 * views).max(20_000), 5);
    let cameras: Vec<Camera> = (0..path.frames.len()).map(|i| path.camera(i, file.origin, 16.0 / 9.0)).collect();
    let hung = hang_all(file, &culler, &rays, &cameras);
    let mirrors: Vec<Mirror> = hung.iter().map(|h| h.mirror.clone()).collect();
    let (mut view, mut counts) = (View::new(&culler), [0; 3]);
    // Every other view is turned to a mirror of its own cell, if there is one.
    let facing = |camera: &Camera, number: usize, cell: Option<CellId>| {
        let mirror = hung.iter().find(|h| number.is_multiple_of(2) && Some(h.mirror.cell()) == cell)?;
        let middle = (mirror.corners[0] + mirror.corners[2]) * 0.5;
        Some(Camera::look_at(camera.eye.as_dvec3(), middle, 1.2, 16.0 / 9.0))
    };
    let in_mirrors: BTreeSet<CellId> = mirrors.iter().map(Mirror::cell).collect();
    let near = cameras.iter().filter(|c| culler.cell_of(c.eye).is_some_and(|cell| in_mirrors.contains(&cell)));
    let chosen: Vec<Camera> = near.chain(&cameras).take(views as usize).copied().collect();
    for (number, camera) in chosen.iter().enumerate() {
        let cell = culler.cell_of(camera.eye);
        let camera = facing(camera, number, cell).unwrap_or(*camera);
        let pixel = |p: usize| DVec2::new((p % SIZE[0]) as f64 + 0.5, (p / SIZE[0]) as f64 + 0.5);
        let ndc = |p: usize| pixel(p) * 2.0 / DVec2::new(SIZE[0] as f64, SIZE[1] as f64) - 1.0;
        let seen: BTreeSet<(Vec<usize>, ObjectId)> = (0..SIZE[0] * SIZE[1])
            .filter_map(|p| trace(&hung, &rays, camera.eye.as_dvec3(), camera.ray(ndc(p))))
            .inspect(|(turned, _)| counts[turned.len()] += 1)
            .collect();
        for mode in Mode::WITHOUT_QUERIES {
            let direct: BTreeSet<ObjectId> = view.cull(&camera, mode).objects.iter().copied().collect();
            let out: Vec<Reflection<'_>> = view.mirrors(&mirrors, DEPTH, None).collect();
            for (turned, object) in &seen {
                let shown = if turned.is_empty() { direct.contains(object) } else { shows(&out, turned, *object) };
                assert!(
                    shown || out.iter().any(|reflection| reflection.stats.capped > 0),
                    "view {number}, {mode}: object {object} by {turned:?} from {}",
                    camera.eye
                );
            }
        }
    }
    counts
}
