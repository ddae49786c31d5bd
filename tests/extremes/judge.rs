//! What must hold of every world, wherever it stands, and what it cost.

use super::world::{Known, Motion, World};
use enfilade::bake::{BakeOptions, bake};
use enfilade::cells::{CellGraph, Locator};
use enfilade::file::{Bounds, PvsFile};
use enfilade::job::Job;
use enfilade::runtime::Mode;
use enfilade::scene::Scene;
use enfilade::{BitMatrix, CellId, ObjectId};
use enfilade_measure::verify::{CheckOptions, check};
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::tour::tour;
use enfilade_measure::walkthrough::walk::walk;
use std::io::Write;
use std::time::Instant;
use testing::bakes::{self, on};

/// How much is spent on a world.
#[derive(Clone, Copy)]
pub struct Effort {
    /// Of a bake.
    pub rays: u64,
    /// Of a check.
    pub checked: u64,
    /// Frames of the tour, about.
    pub frames: usize,
    /// Whether pixels are compared: pictures of a million triangles take long.
    pub pixels: bool,
    /// Whether it is baked once more on one thread.
    pub threads: bool,
    /// What a bake may take for rows and proofs, bytes.
    pub memory: u64,
}

/// What became of a world in one place.
pub struct Row {
    pub name: String,
    pub cells: usize,
    pub portals: usize,
    pub lower: u64,
    pub upper: u64,
    /// Known answers: visible ones without a proof, hidden ones without one.
    pub open: [usize; 2],
    pub known: usize,
    pub capped: u64,
    pub frames: u64,
    pub missed_pixels: u64,
    pub missed_rays: u64,
    pub seconds: f64,
    pub peak_mb: u64,
    /// What must not be.
    pub faults: Vec<String>,
}

/// The objects of things, as the importer made them.
fn objects(scene: &Scene, world: &World) -> Vec<Vec<ObjectId>> {
    let of =
        |name: &String| (0u32..).zip(&scene.objects).filter(|(_, o)| &o.node == name).map(|(i, _)| ObjectId(i)).collect();
    world.things.iter().map(|(name, _)| of(name)).collect()
}

/// Bakes, checks and walks a world. `given`: with its own cells, or with those that are found.
pub fn judge(world: &World, motion: &Motion, given: bool, effort: Effort) -> Row {
    let scene = world.scene(motion);
    let graph = world.graph(&scene, motion);
    let begin = Instant::now();
    let own = given.then(|| graph.clone());
    let options = BakeOptions { keep_bounds: true, given: own, memory: effort.memory, ..bakes::with_rays(effort.rays) };
    let baked = on(2, || bake(&scene, options.clone(), &Job::quiet())).unwrap();
    let seconds = begin.elapsed().as_secs_f64();
    let file = baked.file;
    let mut row = Row {
        name: format!("{}, {}{}", world.name, motion.name, if given { "" } else { ", cells found" }),
        cells: file.cells.len(),
        portals: file.portals.len(),
        lower: file.pairs.lower,
        upper: file.pairs.upper,
        open: [0; 2],
        known: 0,
        capped: file.stats.flow_over_budget,
        frames: 0,
        missed_pixels: 0,
        missed_rays: 0,
        seconds,
        peak_mb: peak_mb(),
        faults: Vec::new(),
    };
    let bytes = file.write();
    match PvsFile::read(&bytes) {
        Ok(read) if read == file => (),
        Ok(_) => row.faults.push("the file isn't read as it was written".into()),
        Err(error) => row.faults.push(format!("the file isn't read: {error}")),
    }
    if effort.threads && on(1, || bake(&scene, options, &Job::quiet())).unwrap().file.write() != bytes {
        row.faults.push("other bytes on one thread".into());
    }
    let bounds = file.bounds.as_ref().expect("kept");
    for (lower, upper) in [(&bounds.objects_lower, &bounds.objects_upper), (&bounds.cells_lower, &bounds.cells_upper)] {
        if let Some(pair) = lower.first_outside(upper) {
            row.faults.push(format!("{pair:?} is witnessed and proven hidden"));
        }
    }
    if file.stats.contradictions > 0 {
        row.faults.push(format!("{} contradictions", file.stats.contradictions));
    }
    answers(world, &scene, &graph, given, [&bounds.objects_lower, &bounds.objects_upper], &mut row);
    let report = check(&file, &scene, &CheckOptions { rays: effort.checked, views: 0, seed: 1, leaks: false }).unwrap();
    row.missed_rays = report.missed_rays + report.missed_segments + report.missed_cell_pairs;
    if !report.passed {
        row.faults.push(format!("check: {:?} of {:?}", report.examples.first(), report.structure.faults.first()));
    }
    pixels(world, motion, &scene, &file, effort, &mut row);
    row
}

/// Known answers against both bounds. Where cells are found, each room's middle tells which is whose.
fn answers(world: &World, scene: &Scene, own: &CellGraph, given: bool, [lower, upper]: [&BitMatrix; 2], row: &mut Row) {
    if !given {
        return;
    }
    let locator = Locator::new(own);
    for room in 0..own.cells.len().min(64) {
        let middle = own.cells[room].pieces[0].bounds.centre();
        if own.cells[room].pieces[0].contains(middle, 0.0)
            && locator.locate(middle).is_none_or(|(c, _)| c != CellId(room as u32))
        {
            row.faults.push(format!("the middle of room {room} is in {:?}", locator.locate(middle)));
        }
    }
    let of = objects(scene, world);
    for &(room, thing, known) in &world.known {
        let sees = |side: &BitMatrix| of[thing].iter().any(|o| side.get(room, o.index()));
        row.known += 1;
        match known {
            Known::Visible if !sees(upper) => {
                row.faults.push(format!("room {room} sees thing {thing}, which is proven hidden"))
            }
            Known::Hidden if sees(lower) => {
                row.faults.push(format!("room {room} doesn't see thing {thing}, which is witnessed"))
            }
            Known::Narrow => (),
            Known::Visible => row.open[0] += usize::from(!sees(lower)),
            Known::Hidden => row.open[1] += usize::from(sees(upper)),
        }
    }
}

/// Every frame against a picture of everything: along a tour, and from the world's own eyes.
fn pixels(world: &World, motion: &Motion, scene: &Scene, file: &PvsFile, effort: Effort, row: &mut Row) {
    if !effort.pixels {
        return;
    }
    let mut path = tour(file, 1);
    let every = path.frames.len().div_ceil(effort.frames).max(1);
    path.frames = path.frames.into_iter().step_by(every).collect();
    path.frames.extend(world.views.iter().map(|v| PathFrame { eye: motion.of(v[0]), target: motion.of(v[1]) }));
    let own = |value: f64, usual: f64| if value > 0.0 { value } else { usual };
    path.fov_y_degrees = own(world.fov, 65.0);
    path.near = own(world.near * motion.scale, path.near);
    if path.validate().is_err() {
        // Targets of a tour lie 1 m ahead: too near to matter where a world is as large as the earth.
        row.faults.push(format!("{:?}", path.validate()));
        return;
    }
    let options = bakes::walk([Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs], [96, 64]);
    let path: CameraPath = path;
    let mut first = None;
    let summaries = walk(scene, file, &path, &options, &mut |line| {
        if line.missed_pixels.unwrap_or(0) > 0 && first.is_none() {
            first = Some(format!("frame {} {}: {:?} pixels", line.frame, line.mode, line.missed_pixels));
        }
    })
    .unwrap();
    row.frames = summaries.iter().map(|s| s.frames as u64).sum();
    row.missed_pixels = summaries.iter().filter_map(|s| s.missed_pixels).sum();
    if let Some(first) = first {
        row.faults.push(format!("{} missed pixels, first in {first}", row.missed_pixels));
    }
}

/// What portals alone leave of a world, room by room: no random choice has a part in that.
pub fn flowed(world: &World, motion: &Motion) -> Bounds {
    let scene = world.scene(motion);
    let given = Some(world.graph(&scene, motion));
    bakes::baked(&scene, BakeOptions { keep_bounds: true, given, ..bakes::with_rays(0) }).bounds.expect("kept")
}

/// Most memory that this process has held, MiB; 0 where the system doesn't say.
fn peak_mb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or(0) >> 10
}

/// Prints what became of worlds, past the harness that holds back what passing tests say.
pub fn table(rows: &[Row]) {
    let mut text = String::from(
        "| scene | cells | portals | witnessed | not hidden | known: all / visible open / hidden open | capped | frames | missed pixels | missed rays | s | MiB |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for r in rows {
        text += &format!(
            "| {} | {} | {} | {} | {} | {} / {} / {} | {} | {} | {} | {} | {:.2} | {} |\n",
            r.name,
            r.cells,
            r.portals,
            r.lower,
            r.upper,
            r.known,
            r.open[0],
            r.open[1],
            r.capped,
            r.frames,
            r.missed_pixels,
            r.missed_rays,
            r.seconds,
            r.peak_mb
        );
    }
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}

/// Fails with everything that must not be.
pub fn settle(rows: &[Row]) {
    let faults: Vec<String> = rows.iter().flat_map(|r| r.faults.iter().map(move |f| format!("{}: {f}", r.name))).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
