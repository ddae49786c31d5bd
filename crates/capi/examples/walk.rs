//! The same lines as `programs/walk.c`, by the library itself: what C says is what Rust says.

use runtime::file::PvsFile;
use runtime::glam::Vec3;
use runtime::runtime::{Camera, Culler, Doors, Mode, Movers, Pathfinder, View};
use std::time::Instant;

fn main() {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().expect("usage: walk FILE.pvs [ROUNDS]");
    let rounds = arguments.next().map_or(0, |rounds| rounds.parse().expect("a number"));
    let file = PvsFile::load(path.as_ref()).unwrap();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let (mut paths, open) = (Pathfinder::new(&culler, &Doors::passable(&culler)), Doors::open(&culler));
    view.set_doors(&Doors::as_found(&culler));
    println!("{} objects, {} cells, {} portals", culler.object_count(), culler.cell_count(), culler.portal_count());
    let middle = |p: usize| {
        let corners = &file.portals[p].winding;
        let count = corners.len().min(64);
        corners.iter().take(count).fold(Vec3::ZERO, |sum, corner| sum + *corner / count as f32)
    };
    for p in 0..culler.portal_count() {
        movers.insert([middle(p) - 0.2, middle(p) + 0.2]).unwrap();
    }
    let mut cameras = Vec::new();
    for p in 0..culler.portal_count().saturating_sub(1) {
        let [eye, target] = [p, p + 1].map(|p| middle(p).as_dvec3());
        let camera = Camera::look_at(eye, target, f64::from(1.2f32), 1.5);
        let mut frame = view.cull(&camera, Mode::PortalsAndPvs);
        let (stats, runs) = (frame.stats, frame.runs().len());
        let count = frame.objects.len();
        let sum = frame.objects.iter().fold(0u32, |sum, object| sum.wrapping_mul(31).wrapping_add(object.0));
        let seen = view.movers(&movers).len();
        let (cells, portals) = (stats.cells, stats.portals);
        let metres = paths.find(&open, middle(p), middle(p + 1)).map_or(0.0, |path| path.metres);
        println!(
            "{p}: {cells} cells, {portals} portals, {count} objects in {runs} runs, {seen} movers, {metres:.3} m, {sum:08x}"
        );
        cameras.push(camera);
    }
    let start = Instant::now();
    let mut buffer = vec![runtime::ObjectId(0); culler.object_count()];
    for camera in (0..rounds).flat_map(|_| &cameras) {
        let objects = view.cull(camera, Mode::PortalsAndPvs).objects;
        buffer[..objects.len()].copy_from_slice(objects);
    }
    if rounds > 0 {
        eprintln!("{:.1} ns", start.elapsed().as_secs_f64() * 1e9 / f64::from(rounds) / cameras.len() as f64);
    }
}
