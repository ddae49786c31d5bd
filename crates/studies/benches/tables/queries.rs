//! What queries cost against triangles and number, as in Ivson's tables 6.3: the first n of Teapots(5000, 10), drawn without
//! queries, with one about all, and with one about each, asked before it is drawn. By the software oracle; with the feature
//! `gpu`, by the device's, too, whose drawing is submitted with its queries, so that it has no time without.

use crate::study::{SIZE, imported};
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::view::View;
use enfilade::scene::Scene;
use enfilade_measure::walkthrough::missed::objects_shown;
use enfilade_measure::walkthrough::raster;
use enfilade_scenes::Kind;
use std::time::Instant;

/// The study's, and more.
const COUNTS: [usize; 13] = [1, 5, 10, 50, 100, 500, 600, 700, 800, 900, 1000, 2000, 5000];
/// How often each is measured; the least counts.
const REPEATS: usize = 5;
/// On a device, which may be software: the study's counts, less often.
const ON_DEVICE: (usize, usize) = (11, 2);

pub fn table(is_test: bool) {
    let counts = if is_test { &COUNTS[..3] } else { &COUNTS[..] };
    let table = Table::new(counts, REPEATS);
    println!("\nsoftware oracle");
    table.print(&mut DepthBuffer::new(&table.scene, SIZE[0], SIZE[1]), true);
    {
        use enfilade::occlusion::queries::GpuQueries;
        let table = Table::new(&counts[..counts.len().min(ON_DEVICE.0)], ON_DEVICE.1);
        let mut gpu = match GpuQueries::new(&table.scene, SIZE[0], SIZE[1]) {
            Ok(gpu) => gpu,
            Err(e) => return println!("not run: occlusion queries: {e}"),
        };
        println!("\noracle on the device: {}", gpu.adapter());
        table.print(&mut gpu, false);
        assert_eq!(gpu.failure(), None);
    }
}

struct Table<'c> {
    scene: Scene,
    seen: raster::View,
    view: View,
    counts: &'c [usize],
    repeats: usize,
}

/// Seconds; how often a poll had no answer.
#[derive(Clone, Copy)]
struct Measured {
    drawn: f64,
    one: f64,
    polls: u64,
    each: f64,
    /// Of `each`, what questions and polls took.
    asking: f64,
}

impl<'c> Table<'c> {
    fn new(counts: &'c [usize], repeats: usize) -> Self {
        let count = counts.iter().copied().max().expect("a count");
        let (scene, path) = imported(Kind::Teapots { count, scale: 10 }, "queries");
        // From outside: all are in view.
        let camera = path.camera(0, scene.origin, SIZE[0] as f64 / SIZE[1] as f64);
        let seen = raster::View { camera, near: path.near, width: SIZE[0], height: SIZE[1] };
        Self { scene, seen, view: camera.view(path.near), counts, repeats }
    }

    /// `draws_alone`: objects are drawn as soon as that is asked for.
    fn print(&self, oracle: &mut impl OcclusionOracle, draws_alone: bool) {
        println!(
            "| teapots | triangles | drawn, ms | one query, ms | polls in vain | a query each, ms | us of asking a query |"
        );
        println!("|{}", " --- |".repeat(7));
        for &n in self.counts {
            let boxes: Vec<Bounds> = self.scene.objects[..n].iter().map(|o| Bounds::from(o.bounds)).collect();
            self.check(oracle, &boxes);
            // By turns, so that what else the machine does falls on all of them.
            let runs: Vec<Measured> = (0..self.repeats).map(|_| self.measure(oracle, &boxes)).collect();
            let least = |of: fn(&Measured) -> f64| runs.iter().map(of).fold(f64::INFINITY, f64::min);
            let drawn = if draws_alone { format!("{:.3}", least(|m| m.drawn) * 1e3) } else { String::new() };
            println!(
                "| {n} | {} | {drawn} | {:.3} | {} | {:.3} | {:.2} |",
                self.scene.objects[..n].iter().map(|o| o.triangles.len()).sum::<usize>(),
                least(|m| m.one) * 1e3,
                runs[0].polls,
                least(|m| m.each) * 1e3,
                least(|m| m.asking) / n as f64 * 1e6
            );
        }
    }

    fn measure(&self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) -> Measured {
        let start = Instant::now();
        oracle.begin(&self.view);
        (0..boxes.len() as u32).for_each(|o| oracle.draw(ObjectId(o)));
        let drawn = start.elapsed().as_secs_f64();

        let all = Aabb::of(self.scene.objects[..boxes.len()].iter().flat_map(|o| [o.bounds.min, o.bounds.max]));
        let start = Instant::now();
        oracle.begin(&self.view);
        (0..boxes.len() as u32).for_each(|o| oracle.draw(ObjectId(o)));
        let query = oracle.issue(&[Bounds::from(all)]);
        let (_, polls) = wait(oracle, query);
        let one = start.elapsed().as_secs_f64();

        let start = Instant::now();
        let (_, asking) = self.ask_each(oracle, boxes);
        Measured { drawn, one, polls, each: start.elapsed().as_secs_f64(), asking }
    }

    /// Asks about each, draws it, and waits for all answers; seconds of asking and of waiting.
    fn ask_each(&self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) -> (Vec<bool>, f64) {
        oracle.begin(&self.view);
        let (mut asked, mut seconds) = (Vec::new(), 0.0);
        for (o, around) in boxes.iter().enumerate() {
            let start = Instant::now();
            asked.push(oracle.issue(std::slice::from_ref(around)));
            seconds += start.elapsed().as_secs_f64();
            oracle.draw(ObjectId(o as u32));
        }
        let start = Instant::now();
        let answers = asked.into_iter().map(|query| wait(oracle, query).0).collect();
        (answers, seconds + start.elapsed().as_secs_f64())
    }

    /// What a picture of them shows isn't called hidden.
    fn check(&self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) {
        let (answers, _) = self.ask_each(oracle, boxes);
        let picture = raster::draw(&self.scene, &self.seen, &|o: ObjectId| o.index() < boxes.len());
        for object in objects_shown(&self.scene, &picture) {
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
