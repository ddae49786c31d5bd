//! A bake of pipes, of which it sees prisms, beside one of their meshes: what is proven of the one holds of the other.

use crate::cli::building;
use enfilade::bake::BakeOptions;
use enfilade::file::PvsFile;
use enfilade::runtime::Mode;
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};
use enfilade_formats::{geojson, gltf, import, obj};
use enfilade_measure::verify::{CheckOptions, check};
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::walk::walk;
use enfilade_scenes::{Kind, generate};
use enfilade_tubes::{Counts, Shape, Tubes, usual_error};
use glam::DVec3;
use testing::bakes;
use testing::random::Random;

/// The villa with pipes.
fn villa_with_pipes() -> Scene {
    with_pipes(&import(&building("villa_rotonda.glb"), &ImportOptions::default()).unwrap())
}

/// A building with pipes that go through its rooms, walls and doors, round corners.
fn with_pipes(scene: &Scene) -> Scene {
    let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
    for object in &scene.objects {
        let range = object.triangles.start as usize..object.triangles.end as usize;
        let positions = scene.positions.iter().map(|p| *p + scene.origin).collect();
        let triangles = scene.triangles[range].to_vec();
        let mesh = Mesh { node: object.node.clone(), role: object.role, opaque: object.opaque, positions, triangles };
        if object.glass { builder.add_glass(mesh) } else { builder.add(mesh) }.unwrap();
    }
    let bounds = scene.bounds();
    let mut random = Random::new(3);
    for k in 0..60 {
        let low = bounds.min + scene.origin;
        let mut at = low + bounds.size() * DVec3::from_array([0; 3].map(|_| random.real(0.2, 0.8)));
        let mut points = vec![at];
        for step in 0..4 {
            let axis = (k + step) % 3;
            at[axis] += random.signed() * [4.0, 1.5, 4.0][axis];
            points.push(at);
        }
        let radius = [0.02, 0.05, 0.15][k % 3];
        let shape = Shape { radius, inner: 0.0, capped: true };
        let mut tubes = Tubes::default();
        tubes.line(&points, false, shape, usual_error(radius), &mut Counts::default()).unwrap();
        builder.add_tubes(format!("pipe {k}"), Role::Furnishing, tubes).unwrap();
    }
    builder.finish("with pipes").unwrap()
}

fn baked(scene: &Scene) -> PvsFile {
    bakes::baked(scene, BakeOptions { keep_bounds: true, ..bakes::with_rays(1_000_000) })
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn rows_of_pipes_are_those_of_their_meshes() {
    let pipes = villa_with_pipes();
    let mut meshes = pipes.clone().meshed(|_| 32);
    meshes.tubes = Tubes::default();
    meshes.objects.iter_mut().for_each(|object| object.segments = 0..0);
    assert!(pipes.objects.iter().filter(|object| object.is_tube()).count() >= 60);

    let [of_pipes, of_meshes] = [&pipes, &meshes].map(baked);
    assert_eq!(of_pipes.cells.len(), of_meshes.cells.len(), "pipes make no rooms");
    let [a, b] = [&of_pipes, &of_meshes].map(|file| file.bounds.as_ref().unwrap());
    // 1. Nobody has seen what the other one proves hidden.
    assert_eq!(a.objects_lower.first_outside(&b.objects_upper), None);
    assert_eq!(b.objects_lower.first_outside(&a.objects_upper), None);
    // 2. Prisms cost next to no pairs.
    let [pairs_of_pipes, pairs_of_meshes] = [a, b].map(|bounds| bounds.objects_upper.count_ones() as f64);
    println!("upper pairs: {pairs_of_pipes} of tubes, {pairs_of_meshes} of meshes");
    assert!(pairs_of_pipes <= 1.02 * pairs_of_meshes, "{pairs_of_pipes} pairs, {pairs_of_meshes} of meshes");
    // 3. Along every witness, the pipe itself comes first.
    let rays = RayScene::new(&meshes);
    let mut count = 0;
    for witness in a.witnesses.iter().filter(|w| pipes.objects[w.object.index()].is_tube()) {
        let hit = rays.first_opaque(witness.from, witness.to - witness.from, f64::INFINITY);
        assert_eq!(hit.map(|hit| hit.object), Some(witness.object), "from {} to {}", witness.from, witness.to);
        count += 1;
    }
    let [seen, of_both] = [a, b].map(|bounds| {
        let is_pipe = |o: &usize| pipes.objects[*o].is_tube();
        (0..of_pipes.cells.len()).map(|cell| bounds.objects_lower.ones(cell).filter(is_pipe).count()).sum::<usize>()
    });
    assert!(count > 200 && count == seen, "{count} witnesses of {seen} pairs");
    assert!(seen as f64 > 0.97 * of_both as f64, "{seen} pairs of pipes are witnessed, {of_both} of meshes");
    // 4. Rays from outside miss nothing.
    let report = check(&of_pipes, &pipes, &CheckOptions { rays: 200_000, ..CheckOptions::default() }).unwrap();
    assert!(report.passed && report.missed_pairs == 0, "{:?}", report.examples);
    // 5. What really shows is no more than what is kept: both are counted as the file counts them, whatever sides are drawn.
    let middle = pipes.origin + pipes.bounds().centre();
    let frame = PathFrame { eye: middle, target: middle + DVec3::X };
    let path = CameraPath { name: "hall".into(), fov_y_degrees: 75.0, near: 0.01, frames: vec![frame] };
    let options = bakes::walk([Mode::Frustum], [160, 90]);
    let frustum = &walk(&meshes, &of_pipes, &path, &options, &mut |_| {}).unwrap()[0];
    assert_eq!(frustum.missed_pixels, Some(0));
    let shown = frustum.exact_triangles_mean.unwrap();
    assert!(shown > 0.0 && shown <= frustum.triangles_mean, "{shown} of {} triangles show", frustum.triangles_mean);
}

/// What it reads, and how.
type Reader<'r> = (&'r str, &'r (dyn Fn(&ImportOptions) -> Scene + Sync));

/// Tubes of each reader of lines, and what a bake makes of them: the same on one thread and on two.
#[test]
fn tubes_are_the_same_on_any_number_of_threads() {
    let streets: Vec<String> = (0..40)
        .map(|k| {
            let (x, y) = (500 + 30 * (k % 5), 20 * (k / 5));
            let points = format!("[[{x},{y}],[{},{y}],[{},{}]]", x + 25, x + 25, y + 15);
            format!(r#"{{"type":"Feature","properties":{{"radius":0.{}}},"geometry":{{"type":"LineString","coordinates":{points}}}}}"#, 1 + k % 4)
        })
        .collect();
    let mains = format!(r#"{{"type":"FeatureCollection","features":[{}]}}"#, streets.join(","));
    let mut lines = String::new();
    for k in 0..40 {
        lines += &format!("v {k} 0 0\nv {k} 5 {}\nv {} 7 3\nl -3 -2 -1\n", k % 3, k + 4);
    }
    let pipes = generate(Kind::Pipes { sections: 5_000 }, 1).unwrap().glb;
    let office = generate(Kind::Office { rooms: 6, storeys: Some(1), furnished: false }, 1).unwrap().glb;
    let read: [Reader<'_>; 4] = [
        ("GeoJSON", &|options| geojson::from_slice(mains.as_bytes(), "mains", options).unwrap()),
        ("OBJ", &|options| obj::from_slice(lines.as_bytes(), "lines", None, options).unwrap()),
        ("pipes", &|options| gltf::from_slice(&pipes, "pipes", None, options).unwrap()),
        ("office", &|options| with_pipes(&gltf::from_slice(&office, "office", None, options).unwrap())),
    ];
    for (name, read) in read {
        let [one, two] = [1, 2].map(|threads| {
            bakes::on(threads, || {
                let scene = read(&ImportOptions { tube_radius: Some(0.2), ..ImportOptions::default() });
                assert!(scene.objects.iter().filter(|object| object.is_tube()).count() >= 40, "{name}");
                let file = bakes::baked(&scene, bakes::with_rays(100_000)).write();
                (scene, file)
            })
        });
        assert!(one.0 == two.0 && one.0.hash() == two.0.hash(), "{name}: other scenes");
        assert!(one.1 == two.1, "{name}: other files");
    }
}

/// Pipes alone part nothing: everything is one open cell, which sees all of them.
#[test]
fn pipes_alone_are_one_open_cell() {
    let (_, mut scene) = bakes::generated(Kind::Pipes { sections: 3_000 }, 1);
    let ground = scene.objects.iter_mut().find(|object| object.node == "ground").unwrap();
    ground.role = Role::Furnishing;
    let options = BakeOptions { keep_bounds: true, ..BakeOptions::default() };
    let file = bakes::baked(&scene, options);
    assert!(file.cells.len() == 1 && file.cells[0].open && file.reason.contains("no walls or floors"), "{}", file.reason);
    assert_eq!(file.bounds.unwrap().objects_upper.count_ones() as usize, scene.objects.len());
}
