//! Rows that a thread of its own works out while somebody walks: for a building of which only cells and portals are known.
//!
//!     cargo run --release --example rows_while_walking -- data/buildings/office.glb
//!
//! The thread always works for the cell in which the eye is: first its row, then those of the cells around it, until the eye is elsewhere. Each
//! second says how many rows are known, and how many triangles portals alone and portals with rows draw.

use enfilade::bake::{BakeOptions, bake, find_cells};
use enfilade::cells::{CellGraph, SplitOptions, place_objects};
use enfilade::job::{Job, Stopped};
use enfilade::math::geom::Aabb;
use enfilade::pvs::PvsOptions;
use enfilade::pvs::flow::FlowInput;
use enfilade::pvs::flow::by_cell::{CellRow, FlowByCell};
use enfilade::runtime::{Culler, Mode, View};
use enfilade::scene::{ImportOptions, Scene};
use enfilade::{BitMatrix, CellId};
use enfilade_formats::import;
use enfilade_measure::walkthrough::stroll::Stroll;
use std::collections::VecDeque;
use std::error::Error;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

const FRAMES_A_SECOND: usize = 60;
const SECONDS: usize = 10;
/// Metres a second.
const SPEED: f64 = 1.4;

fn main() -> Result<(), Box<dyn Error>> {
    let model = std::env::args().nth(1).unwrap_or_else(|| "data/buildings/office.glb".into());
    let scene = import(model.as_ref(), &ImportOptions::default())?;
    let cells = find_cells(&scene, &SplitOptions::default(), &Job::quiet())?;
    // Cells and portals, and rows that hold whatever isn't behind a portal's plane: no search, no rays.
    let pvs = PvsOptions { ray_budget: 0, flow_steps: 0, ..PvsOptions::default() };
    let file = bake(&scene, BakeOptions { given: Some(cells.clone()), pvs, ..BakeOptions::default() }, &Job::quiet())?.file;
    let culler = Culler::new(&file);
    let mut view = View::new(&culler);
    let stroll = Stroll::through(&file, 0, SPEED / FRAMES_A_SECOND as f64);

    let (stop, known) = (AtomicBool::new(false), AtomicUsize::new(0));
    let (ask, asked) = channel();
    let (scene, graph, learner, ends) = (&scene, &cells, (&*culler, &known), &stop);
    std::thread::scope(|threads| {
        threads.spawn(move || work_out_rows(scene, graph, &asked, learner, &Job::new(&|_, _| ()).until(ends)));
        let (mut home, mut triangles) = (None, [0; 2]);
        for (i, frame) in stroll.legs.iter().flatten().take(SECONDS * FRAMES_A_SECOND).enumerate() {
            let camera = stroll.camera(frame, file.origin, 16.0 / 9.0);
            let now = culler.cell_of(camera.eye);
            if now != home {
                home = now;
                now.into_iter().for_each(|cell| ask.send(cell).expect("the thread waits for cells"));
            }
            for (sum, mode) in triangles.iter_mut().zip([Mode::Portals, Mode::PortalsAndPvs]) {
                *sum += view.cull(&camera, mode).stats.triangles;
            }
            if (i + 1) % FRAMES_A_SECOND == 0 {
                let [portals, both] = triangles.map(|sum| sum / FRAMES_A_SECOND as u64);
                let (second, all) = ((i + 1) / FRAMES_A_SECOND, file.cells.len());
                let known = known.load(Ordering::Relaxed);
                println!("{second} s: {known} of {all} rows; portals {portals} triangles a frame, with rows {both}");
                triangles = [0; 2];
            }
            std::thread::sleep(Duration::from_secs_f64(1.0 / FRAMES_A_SECOND as f64));
        }
        stop.store(true, Ordering::Relaxed);
        drop(ask);
    });
    Ok(())
}

/// Works out rows for the newest cell that was asked about and for those around it, until nobody can ask any more or it is stopped.
fn work_out_rows(
    scene: &Scene,
    graph: &CellGraph,
    asked: &Receiver<CellId>,
    (culler, known): (&Culler, &AtomicUsize),
    work: &Job<'_>,
) -> Result<(), Stopped> {
    let placement = place_objects(scene, graph, 2.0 * scene.tolerance().clearance);
    let object_bounds: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let nothing = |columns| BitMatrix::new(graph.cells.len(), columns);
    let (cells_lower, objects_lower) = (nothing(graph.cells.len()), nothing(object_bounds.len()));
    let flow = FlowByCell::new(FlowInput {
        graph,
        placement: &placement.matrix,
        placed_boxes: placement.boxes.as_deref(),
        object_bounds: &object_bounds,
        cells_lower: &cells_lower,
        objects_lower: &objects_lower,
        max_steps: PvsOptions::default().flow_steps,
        coplanar: scene.tolerance().coplanar,
        fronts: None,
    });
    let mut is_done = vec![false; graph.cells.len()];
    while let Ok(first) = asked.recv() {
        let mut home = first;
        let (mut reached, mut queue) = (vec![false; graph.cells.len()], VecDeque::from([home]));
        while let Some(cell) = queue.pop_front() {
            if let Some(newest) = asked.try_iter().last().filter(|&newest| newest != home) {
                home = newest;
                reached.fill(false);
                queue = VecDeque::from([home]);
                continue;
            }
            if std::mem::replace(&mut reached[cell.index()], true) {
                continue;
            }
            if !std::mem::replace(&mut is_done[cell.index()], true) {
                let CellRow { cells, objects } = flow.row(cell, work)?;
                known.fetch_add(usize::from(culler.learn_row(cell, &objects, &cells)), Ordering::Relaxed);
            }
            let around = graph.portals.iter().filter(|portal| portal.cells.contains(&cell));
            queue.extend(around.flat_map(|portal| portal.cells));
        }
    }
    Ok(())
}
