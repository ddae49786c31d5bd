//! Which strategy a scene gets when nobody asks for one: decided by what is measured in it, said in one line.
//!
//! The author's rooms, where most of them are sound; voxels, where little of what isn't level stands upright, as in caves; else
//! the plan. Voxels are tried too where the plan closes no cell, or comes out ragged: levels of slopes and rock give it many portals to
//! a cell, buildings few. What closes a cell, or has fewer portals to a cell, is kept.

use super::volume::VOXELS_A_BRICK;
use super::{CellGraph, Strategy};
use crate::cells::authored::audit::audit_rooms;
use crate::cells::validate::structure;
use crate::geom::newell;
use crate::scene::{Role, Scene};

/// Rooms of an author are taken where at least this share of them is sound.
const SOUND_SHARE: f64 = 0.5;
/// A plan is tried where this share of what isn't level stands upright: in houses with roofs 0.75 and more.
const UPRIGHT_SHARE: f64 = 0.5;
/// A plan with more portals than this to a cell is ragged: buildings have 1 to 20, a villa with a dome 24.
const RAGGED_PORTALS: f64 = 28.0;
/// Voxels are tried beside a plan that closes nothing where so many bricks hold the surfaces of the scene (ten seconds), and where
/// voxels of a third of a doorway are enough for that, metres of a person. More of either: minutes for models that nothing closes, as
/// cities. Less: dungeons stay one open cell.
const MOST_BRICKS: f64 = 100e3;
const COARSEST: f64 = 0.3;
/// The vertical part of a wall's unit normal is at most this; that of a floor's is at least `FLOOR_NORMAL`.
const WALL_NORMAL: f64 = 0.05;
const FLOOR_NORMAL: f64 = 0.98;

/// The strategy, and why.
pub(super) fn choose(scene: &Scene) -> (Strategy, String) {
    let rooms = scene.hints.rooms.len();
    let (strategy, why) = by_shape(scene);
    if rooms == 0 {
        return (strategy, format!("the model names no rooms; {why}"));
    }
    let audit = audit_rooms(scene);
    if audit.sound_share() >= SOUND_SHARE {
        return (Strategy::Authored, format!("{} of the {rooms} rooms that the model names are sound", audit.sound_rooms));
    }
    (strategy, format!("only {} of the {rooms} rooms that the model names are sound; {why}", audit.sound_rooms))
}

fn by_shape(scene: &Scene) -> (Strategy, String) {
    let (mut upright, mut steep) = (0.0, 0.0);
    for object in scene.objects.iter().filter(|o| o.opaque && matches!(o.role, Role::Structure | Role::Unknown)) {
        for t in object.triangles.clone() {
            let c = scene.corners(t as usize);
            let n = newell(&c.map(|p| p - c[0]));
            let (area, up) = (n.length(), n.y.abs());
            if up <= FLOOR_NORMAL * area {
                steep += area;
                upright += if up <= WALL_NORMAL * area { area } else { 0.0 };
            }
        }
    }
    let share: f64 = if steep > 0.0 { upright / steep } else { 1.0 };
    let strategy = if share >= UPRIGHT_SHARE { Strategy::Plan } else { Strategy::Volume };
    (strategy, format!("{:.0} % of what is not level stands upright", 100.0 * share))
}

fn portals_a_cell(graph: &CellGraph) -> f64 {
    graph.portals.len() as f64 / graph.cells.len().max(1) as f64
}

/// Cells that portals can keep from being drawn.
fn closed_cells(graph: &CellGraph) -> usize {
    graph.cells.iter().filter(|c| !c.open).count()
}

/// The least edge of voxels to try beside this plan, metres; `None` where they can't do better, or would take long. `metre` is a person's.
pub(super) fn trial(scene: &Scene, metre: f64, plan: &CellGraph) -> Option<f64> {
    if closed_cells(plan) > 0 {
        return (portals_a_cell(plan) > RAGGED_PORTALS).then_some(0.0);
    }
    let area = |t: u32| {
        let c = scene.corners(t as usize);
        0.5 * newell(&c.map(|p| p - c[0])).length()
    };
    let surface: f64 = scene.objects.iter().filter(|o| o.opaque).flat_map(|o| o.triangles.clone()).map(area).sum();
    let edge = (surface / MOST_BRICKS).sqrt() / VOXELS_A_BRICK;
    (edge <= COARSEST * metre).then_some(edge)
}

/// A poor plan, or what voxels give: whichever closes cells where the other doesn't, else has fewer portals to a cell; voxels only where
/// they validate, to `tolerance` metres.
pub(super) fn better(mut plan: CellGraph, tolerance: f64, volume: impl FnOnce(String) -> CellGraph) -> CellGraph {
    let mut voxels = volume(plan.reason.clone());
    voxels.link();
    let [closed, ragged] = [[&plan, &voxels].map(closed_cells).map(|n| n as f64), [&plan, &voxels].map(portals_a_cell)];
    let says = if closed[0] == 0.0 {
        format!("the plan closes no cell, voxels {}", closed[1])
    } else {
        format!("the plan has {:.1} portals a cell, voxels {:.1}", ragged[0], ragged[1])
    };
    let is_better = if closed[0] == 0.0 { closed[1] > 0.0 } else { ragged[1] < ragged[0] && voxels.cells.len() > 1 };
    if !is_better {
        plan.reason = format!("{}; the plan kept: {says}", plan.reason);
        return plan;
    }
    if !structure(&voxels, tolerance).is_empty() {
        plan.reason = format!("{}; the plan kept: {says}, which don't validate", plan.reason);
        return plan;
    }
    voxels.reason = format!("{}; voxels kept: {says}", plan.reason);
    voxels
}
