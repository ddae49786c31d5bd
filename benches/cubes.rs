//! Visibility cubes of 256 x 256 x 6 pixels on one thread, in generated furnished offices of 60,000 to 4 million triangles: twenty eyes,
//! in rooms, corridors and doorways.
//!
//! First the answers are compared: the fast engines must agree to the bit; a smaller cube with rays in `f64`, and what Embree says, up to
//! what the tolerance explains. Then each eye's cube is made several times, and the least time counts; printed is the mean over eyes, and
//! the slowest eye. `--test` takes the smallest office alone, `--quick` none above a million triangles.
//!
//! Embree (Debian: libembree-dev) is optional: where g++ builds `benches/embree/cubes.cpp`, it is handed the same opaque triangles and eyes.

use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster, Rays};
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use glam::DVec3;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use testing::bakes::office;
use testing::cube_times::{SIZE, cubes, row, timed};
use testing::explain::{EXACT, is_explained};
use testing::eyes;
use testing::times::is_told;

const REPEATS: usize = 7;
/// Offices: 60,000, 250,000, a million and 4 million triangles.
const ROOMS: [usize; 4] = [40, 165, 660, 2650];

fn main() {
    let rooms = if is_told("--test") { &ROOMS[..1] } else { &ROOMS[..if is_told("--quick") { 3 } else { 4 }] };
    let embree = build_embree();
    if embree.is_none() {
        println!("not run: Embree (g++ or libembree-dev is missing)");
    }
    println!("| triangles | engine | mean, ms | slowest, ms | made ready, s |");
    println!("| --- | --- | --- | --- | --- |");
    for &rooms in rooms {
        let (office, scene) = office(rooms, true);
        measure(&scene, &eyes::of_an_office(&office, &scene), embree.as_deref());
    }
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
}

fn measure(scene: &Scene, eyes: &[DVec3], embree: Option<&Path>) {
    let (ready, ready_in) = timed(|| CubeScene::new(scene));
    let (rays, rays_in) = timed(|| RayScene::new(scene));
    // The answers.
    let mut truth = Rays::new(&rays);
    let (mut want, mut got) = (Cube::default(), Cube::default());
    for &eye in eyes {
        let view = CubeView::new(eye, 40);
        truth.cube(&view, &mut want);
        Raster::new(&ready).cube(&view, &mut got);
        assert_eq!(
            differing(scene, &view, &got.triangles, &want.triangles).1,
            0,
            "an id that the tolerance doesn't explain"
        );
    }
    let (cubes_of_raster, raster) = cubes(&mut Raster::new(&ready), eyes, REPEATS);
    // The times.
    row(scene, "raster", &raster, ready_in);
    let mut bare = scene.clone();
    bare.objects.retain(|o| o.opaque);
    let (ready, ready_in) = timed(|| CubeScene::new(&bare));
    row(scene, "raster, opaque only", &cubes(&mut Raster::new(&ready), eyes, REPEATS).1, ready_in);
    if let Some(program) = embree {
        run_embree(&bare, eyes, program, &cubes_of_raster);
    }
    let few = [eyes[0], eyes[10], eyes[15]];
    plain(&bare, &few);
    row(scene, "one by one, `f64` (3 eyes)", &cubes(&mut truth, &few, 1).1, rays_in);
}

/// How many ids differ, and how many of them the tolerance doesn't explain.
fn differing(scene: &Scene, view: &CubeView, a: &[u32], b: &[u32]) -> (usize, usize) {
    let differ: Vec<usize> = (0..a.len()).filter(|&p| a[p] != b[p]).collect();
    let unexplained = differ.iter().filter(|&&p| !is_explained(scene, view, p, a[p], b[p], EXACT)).count();
    (differ.len(), unexplained)
}

/// obvhs as it comes: its fastest hierarchy, `f32` triangles, one ray after the other.
fn plain(scene: &Scene, eyes: &[DVec3]) {
    let ids: Vec<u32> = scene.objects.iter().flat_map(|o| o.triangles.clone()).collect();
    let corners = |&t: &u32| scene.corners(t as usize).map(|p| p.as_vec3a());
    let triangles: Vec<Triangle> = ids.iter().map(corners).map(|[v0, v1, v2]| Triangle { v0, v1, v2 }).collect();
    let build = || build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default());
    let (bvh, ready) = timed(build);
    let triangles: Vec<Triangle> = bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
    let once = |&eye: &DVec3| {
        let view = CubeView::new(eye, SIZE);
        let cast = |pixel: usize| {
            let ray = Ray::new_inf(eye.as_vec3a(), view.direction(pixel).as_vec3a());
            let mut hit = RayHit::none();
            bvh.ray_traverse(ray, &mut hit, |ray, slot| triangles[slot].intersect(ray));
            hit.primitive_id
        };
        timed(|| std::hint::black_box((0..view.pixels()).map(cast).collect::<Vec<u32>>())).1
    };
    let times: Vec<Duration> = eyes.iter().map(once).collect();
    row(scene, "obvhs one by one, opaque only (3 eyes)", &times, ready);
}

/// Where the program is, if it could be built.
fn build_embree() -> Option<PathBuf> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/embree/cubes.cpp");
    let program = folder().join("embree-cubes");
    let built = Command::new("g++").args(["-O3", "-march=native", "-o"]).arg(&program).arg(source).arg("-lembree3").output();
    built.is_ok_and(|out| out.status.success()).then_some(program)
}

/// Embree's cubes of the opaque triangles, compared with ours.
fn run_embree(scene: &Scene, eyes: &[DVec3], program: &Path, ours: &[Cube]) {
    let ids: Vec<u32> = scene.objects.iter().flat_map(|o| o.triangles.clone()).collect();
    let (input, output) = (folder().join("embree-in"), folder().join("embree-out"));
    let head = [ids.len() as u32, eyes.len() as u32, SIZE].map(u32::to_le_bytes).concat();
    let points = ids.iter().flat_map(|&t| scene.corners(t as usize)).chain(eyes.iter().copied());
    let numbers = points.flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes);
    std::fs::write(&input, head.into_iter().chain(numbers).collect::<Vec<u8>>()).expect("a folder to write to");
    let (status, took) = timed(|| Command::new(program).args([&input, &output]).arg(REPEATS.to_string()).status());
    assert!(status.is_ok_and(|s| s.success()), "Embree's program failed");
    let bytes = std::fs::read(&output).expect("its output");
    let (times, found) = bytes.split_at(8 * eyes.len());
    let times = times.chunks(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")));
    let times: Vec<Duration> = times.map(|ms| Duration::from_secs_f64(ms / 1e3)).collect();
    let made: Duration = times.iter().sum::<Duration>() * REPEATS as u32;
    row(scene, "Embree 3, packets of 8, opaque only", &times, took.saturating_sub(made));
    let found: Vec<u32> = found.chunks(4).map(|b| u32::from_le_bytes(b.try_into().expect("four bytes"))).collect();
    let name = |&i: &u32| ids.get(i as usize).copied().unwrap_or(NONE);
    let (mut differ, mut unexplained) = (0, 0);
    for ((&eye, cube), theirs) in eyes.iter().zip(ours).zip(found.chunks(found.len() / eyes.len())) {
        let theirs: Vec<u32> = theirs.iter().map(name).collect();
        let (a, b) = differing(scene, &CubeView::new(eye, SIZE), &cube.triangles, &theirs);
        (differ, unexplained) = (differ + a, unexplained + b);
    }
    println!("Embree's ids: {differ} of {} differ, {unexplained} of them by more than our tolerance", found.len());
    assert!(unexplained * 10_000 < found.len(), "Embree sees something else");
}
