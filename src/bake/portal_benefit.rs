//! The benefit of portals: the share of the frustum that they draw, from eyes over floors.

use crate::BitMatrix;
use crate::cells::{Cell, CellGraph, place_objects};
use crate::file::PvsFile;
use crate::job::{Job, Stopped};
use crate::math::random::SplitMix;
use crate::pvs::{Guarantee, Pvs, PvsStats, SamplingEnd};
use crate::runtime::{Camera, Culler, Mode, View};
use crate::scene::floors::Floors;
use crate::scene::rays::RayScene;
use crate::scene::{ImportOptions, Scene};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Eyes, and directions per eye.
const EYES: usize = 128;
const DIRECTIONS: usize = 4;
/// Opening angle and aspect of the cameras.
const FOV_Y: f64 = 1.1;
const ASPECT: f64 = 16.0 / 9.0;

/// Cameras over the floors of a scene; none without floors.
pub(super) fn cameras(rays: &RayScene<'_>) -> Vec<Camera> {
    let mut random = SplitMix::new(0);
    let eyes = Floors::of(rays.scene()).eyes(rays, EYES, &mut random);
    around(eyes, &mut random)
}

/// Cameras in the closed cells of some graphs, as many in each graph: a visitor of every room. Empty without closed cells.
pub(super) fn cameras_in(graphs: &[&CellGraph]) -> Vec<Camera> {
    let eye = |cell: &Cell| {
        let pieces = cell.pieces.iter().map(|piece| piece.bounds);
        pieces.max_by(|a, b| a.size().element_product().total_cmp(&b.size().element_product())).map(|b| b.centre())
    };
    let mut eyes = Vec::new();
    for graph in graphs {
        let closed: Vec<&Cell> = graph.cells.iter().filter(|cell| !cell.open).collect();
        let count = (EYES / graphs.len()).min(closed.len());
        eyes.extend((0..count).filter_map(|i| eye(closed[i * closed.len() / count])));
    }
    around(eyes, &mut SplitMix::new(0))
}

/// Cameras at some eyes, each in all directions.
fn around(eyes: Vec<DVec3>, random: &mut SplitMix) -> Vec<Camera> {
    let look = |eye: DVec3| {
        let turn = random.unit() * FRAC_PI_2;
        (0..DIRECTIONS).map(move |k| {
            let angle = turn + TAU * k as f64 / DIRECTIONS as f64;
            Camera::look_at(eye, eye + DVec3::new(angle.cos(), 0.0, angle.sin()), FOV_Y, ASPECT)
        })
    };
    eyes.into_iter().flat_map(look).collect()
}

/// Ratio of the triangles drawn with portals to those in the frustum, in the mean of cameras; 1 without cameras.
pub(super) fn drawn_share(scene: &Scene, graph: &CellGraph, cameras: &[Camera], work: &Job<'_>) -> Result<f64, Stopped> {
    let [[frustum, _], [portals, _]] = drawn(scene, graph, cameras, [Mode::Frustum, Mode::Portals], work)?;
    Ok(if frustum > 0.0 { portals / frustum } else { 1.0 })
}

/// Triangles and objects drawn by each mode, with full rows: sums over the cameras.
pub(super) fn drawn<const N: usize>(
    scene: &Scene,
    graph: &CellGraph,
    cameras: &[Camera],
    modes: [Mode; N],
    work: &Job<'_>,
) -> Result<[[f64; 2]; N], Stopped> {
    let file = without_rows(scene, graph);
    let mut view = View::new(&Culler::new(&file));
    let mut drawn = [[0.0; 2]; N];
    for camera in cameras {
        work.go_on()?;
        for (sum, mode) in drawn.iter_mut().zip(modes) {
            let culled = view.cull(camera, mode);
            sum[0] += culled.stats.triangles as f64;
            sum[1] += culled.objects.len() as f64;
        }
    }
    Ok(drawn)
}

/// The graph as a file with full rows.
fn without_rows(scene: &Scene, graph: &CellGraph) -> PvsFile {
    let (cells, objects) = (graph.cells.len(), scene.objects.len());
    let none = || BitMatrix::new(cells, objects);
    let full = |columns: usize| {
        let mut all = BitMatrix::new(cells, columns);
        (0..cells).for_each(|c| (0..columns).for_each(|o| _ = all.set(c, o)));
        all
    };
    let pvs = Pvs {
        graph: graph.clone(),
        cells_lower: BitMatrix::new(cells, cells),
        cells_upper: full(cells),
        objects_lower: none(),
        objects_upper: full(objects),
        placement: place_objects(scene, graph, 2.0 * scene.tolerance().clearance),
        unresolved: none(),
        witnesses: Vec::new(),
        unseen: None,
        sampling_end: SamplingEnd::Rays,
        is_whole: true,
        guarantee: Guarantee::Conservative,
        clusters: Vec::new(),
        repairs: Vec::new(),
        stats: PvsStats::default(),
        again: None,
    };
    PvsFile::from_bake(scene, &ImportOptions::default(), &pvs, false)
}
