//! What queries cost against triangles and number, as in Ivson's tables 6.3: the first n of Teapots(5000, 10), drawn without
//! queries, with one about all, and with one about each, asked before it is drawn. By the software oracle; with the feature
//! `gpu`, by the device's, too, whose drawing is submitted with its queries, so that it has no time without.

use crate::study::{SIZE, imported};
use enfilade::ObjectId;
use enfilade::generate::Kind;
use enfilade::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::view::View;
use enfilade::scene::Scene;
use enfilade::walkthrough::missed::objects_shown;
use enfilade::walkthrough::raster;
use std::time::Instant;

/// The study's, and more.
const COUNTS: [usize; 13] = [1, 5, 10, 50, 100, 500, 600, 700, 800, 900, 1000, 2000, 5000];
/// Most for a device, which may be software.
#[cfg(feature = "gpu")]
const MOST_ON_DEVICE: usize = 1000;
const REPEATS: usize = 5;

pub fn table(is_test: bool) {
    let counts = if is_test { &COUNTS[..3] } else { &COUNTS[..] };
    let (scene, path) = imported(Kind::Teapots { count: counts[counts.len() - 1], scale: 10 }, "queries");
    // From outside: all are in view.
    let camera = path.camera(0, scene.origin, SIZE[0] as f64 / SIZE[1] as f64);
    let seen = raster::View { camera, near: path.near, width: SIZE[0], height: SIZE[1] };
    let view = camera.view(path.near);
    println!("\nsoftware oracle");
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    Table { scene: &scene, seen, view }.print(&mut buffer, counts, true);
    #[cfg(feature = "gpu")]
    {
        use enfilade::occlusion::queries::GpuQueries;
        let mut gpu = match GpuQueries::new(&scene, SIZE[0], SIZE[1]) {
            Ok(gpu) => gpu,
            Err(e) => return println!("not run: occlusion queries: {e}"),
        };
        println!("\noracle on the device: {}", gpu.adapter());
        let few = counts.iter().position(|&n| n > MOST_ON_DEVICE).unwrap_or(counts.len());
        Table { scene: &scene, seen, view }.print(&mut gpu, &counts[..few], false);
        assert_eq!(gpu.failure(), None);
    }
}

struct Table<'s> {
    scene: &'s Scene,
    seen: raster::View,
    view: View,
}

impl Table<'_> {
    fn print(&self, oracle: &mut impl OcclusionOracle, counts: &[usize], draws_alone: bool) {
        print!("| teapots | triangles | drawn, ms | one query, ms | polls in vain | a query each, ms ");
        println!("| us an object | us each more |");
        println!("|{}", " --- |".repeat(8));
        let mut before = (0, 0.0);
        for &n in counts {
            let boxes: Vec<Bounds> = self.scene.objects[..n].iter().map(|o| Bounds::from(o.bounds)).collect();
            let all = Aabb::of(self.scene.objects[..n].iter().flat_map(|o| [o.bounds.min, o.bounds.max]));
            self.check(oracle, &boxes);
            let drawn = least(|| {
                oracle.begin(&self.view);
                (0..n as u32).for_each(|o| oracle.draw(ObjectId(o)));
            });
            let mut polls = 0;
            let one = least(|| {
                oracle.begin(&self.view);
                (0..n as u32).for_each(|o| oracle.draw(ObjectId(o)));
                let query = oracle.issue(&[Bounds::from(all)]);
                polls = wait(oracle, query).1;
            });
            let each = least(|| {
                self.ask_each(oracle, &boxes);
            });
            // Beside those of the row above.
            let more = (each - before.1) / (n - before.0) as f64 * 1e6;
            let drawn = if draws_alone { format!("{:.3}", drawn * 1e3) } else { String::new() };
            println!(
                "| {n} | {} | {drawn} | {:.3} | {polls} | {:.3} | {:.2} | {more:.2} |",
                self.scene.objects[..n].iter().map(|o| o.triangles.len()).sum::<usize>(),
                one * 1e3,
                each * 1e3,
                each / n as f64 * 1e6
            );
            before = (n, each);
        }
    }

    /// Asks about each, draws it, and waits for all answers.
    fn ask_each(&self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) -> Vec<bool> {
        oracle.begin(&self.view);
        let asked: Vec<QueryId> = (boxes.iter().enumerate())
            .map(|(o, around)| {
                let query = oracle.issue(std::slice::from_ref(around));
                oracle.draw(ObjectId(o as u32));
                query
            })
            .collect();
        asked.into_iter().map(|query| wait(oracle, query).0).collect()
    }

    /// What a picture of them shows isn't called hidden.
    fn check(&self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) {
        let answers = self.ask_each(oracle, boxes);
        let picture = raster::draw(self.scene, &self.seen, &|o: ObjectId| o.index() < boxes.len());
        for object in objects_shown(self.scene, &picture) {
            assert!(answers[object.index()], "an object that shows is called hidden");
        }
    }
}

/// The answer, and how often there was none.
fn wait(oracle: &mut impl OcclusionOracle, query: QueryId) -> (bool, u64) {
    let mut polls = 0;
    loop {
        if let Some(shows) = oracle.poll(query) {
            return (shows, polls);
        }
        polls += 1;
    }
}

fn least(mut work: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    (0..REPEATS).map(time).fold(f64::INFINITY, f64::min)
}
