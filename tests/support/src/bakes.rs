//! Scenes that generators make, and bakes of scenes.

use enfilade::bake::{BakeOptions, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::pvs::PvsOptions;
use enfilade::runtime::Mode;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_measure::walkthrough::walk::WalkOptions;
use enfilade_scenes::{Generated, Kind, generate};

/// A generated model and its scene.
pub fn generated(kind: Kind, seed: u64) -> (Generated, Scene) {
    let made = generate(kind, seed).expect("a model");
    let scene = enfilade_formats::gltf::from_slice(&made.glb, "model", None, &ImportOptions::default());
    (made, scene.expect("what was generated"))
}

/// An office of so many rooms, and its scene.
pub fn office(rooms: usize, furnished: bool) -> (Generated, Scene) {
    generated(Kind::Office { rooms, storeys: None, furnished }, 0)
}

/// So many rays, and the rest as usual.
pub fn with_rays(ray_budget: u64) -> BakeOptions {
    BakeOptions { pvs: PvsOptions { ray_budget, ..PvsOptions::default() }, ..BakeOptions::default() }
}

/// Bakes a scene.
pub fn baked(scene: &Scene, options: BakeOptions) -> PvsFile {
    bake(scene, options, &Job::quiet()).expect("a bake").file
}

/// Runs something on so many threads.
pub fn on<T: Send>(threads: usize, run: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(run)
}

/// A walk whose pixels are compared in every frame.
pub fn walk(modes: impl IntoIterator<Item = Mode>, [width, height]: [usize; 2]) -> WalkOptions {
    let modes = modes.into_iter().map(Into::into).collect();
    let min_pixels = vec![0];
    WalkOptions {
        modes,
        width,
        height,
        verify_pixels: true,
        pictures: None,
        every: 1,
        doors_as_found: false,
        min_pixels,
        movers: 0,
    }
}
