//! Which strategy a scene gets when nobody asks for one: decided by what is measured in it, said in one line.
//!
//! The author's rooms, where most of them are sound; voxels, where little of what isn't level stands upright, as in caves; else
//! the plan. Voxels are tried too where the plan closes no cell, or comes out ragged: levels of slopes and rock give it many portals to
//! a cell, buildings few. What closes a cell, or has fewer portals to a cell, is kept.

use super::volume::{VOXELS_A_BRICK, opaque_structure};
use super::{CellGraph, Strategy};
use crate::cells::authored::audit::audit_rooms;
use crate::cells::validate::structure;
use crate::geom::newell;
use crate::scene::{Scene, triangle_area};

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
    for c in opaque_structure(scene) {
        let n = newell(&c.map(|p| p - c[0]));
        let (area, up) = (n.length(), n.y.abs());
        if up <= FLOOR_NORMAL * area {
            steep += area;
            upright += if up <= WALL_NORMAL * area { area } else { 0.0 };
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

/// The least edge of voxels to try beside this plan, metres; `None` where they can't do better, or would take long. `metre` is a
/// person's.
pub(super) fn trial(scene: &Scene, metre: f64, plan: &CellGraph) -> Option<f64> {
    if closed_cells(plan) > 0 {
        return (portals_a_cell(plan) > RAGGED_PORTALS).then_some(0.0);
    }
    let surface: f64 = opaque_structure(scene).map(triangle_area).sum();
    let edge = (surface / MOST_BRICKS).sqrt() / VOXELS_A_BRICK;
    (edge <= COARSEST * metre).then_some(edge)
}

/// A poor plan, or what voxels give: whichever closes cells where the other doesn't, else has fewer portals to a cell; voxels only where
/// they validate, to `tolerance` metres.
pub(super) fn better(mut plan: CellGraph, tolerance: f64, volume: impl FnOnce(String) -> CellGraph) -> CellGraph {
    let mut voxels = volume(plan.reason.clone());
    voxels.link();
    let (is_better, says) = if closed_cells(&plan) == 0 {
        let closed = closed_cells(&voxels);
        (closed > 0, format!("the plan closes no cell, voxels {closed}"))
    } else {
        let [of_plan, of_voxels] = [&plan, &voxels].map(portals_a_cell);
        let says = format!("the plan has {of_plan:.1} portals a cell, voxels {of_voxels:.1}");
        (of_voxels < of_plan && voxels.cells.len() > 1, says)
    };
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

#[cfg(test)]
mod tests {
    use super::super::{Cell, Piece};
    use super::*;
    use crate::geom::{Aabb, Plane};
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};
    use glam::DVec3;

    /// Boxes as cells, without portals: from x to x + 1, and whether each is open.
    fn graph(strategy: Strategy, cells: &[(f64, bool)]) -> CellGraph {
        let cell = |&(x, open): &(f64, bool)| {
            let bounds = Aabb { min: DVec3::new(x, 0.0, 0.0), max: DVec3::new(x + 1.0, 1.0, 1.0) };
            let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(bounds.max, n), Plane::through(bounds.min, -n)]);
            Cell { open, pieces: vec![Piece { planes: planes.collect(), bounds }], ..Cell::default() }
        };
        let cells = cells.iter().map(cell).collect();
        CellGraph { strategy, reason: "told".into(), cells, portals: Vec::new(), smallest_hole: 0.0, notes: Vec::new() }
    }

    #[test]
    fn voxels_are_kept_where_they_alone_close_a_cell_and_are_sound() {
        let plan = || graph(Strategy::Plan, &[(0.0, true)]);
        let kept = |voxels: &[(f64, bool)]| better(plan(), 1e-6, |_| graph(Strategy::Volume, voxels));
        let better = kept(&[(0.0, true), (2.0, false), (4.0, false)]);
        assert_eq!(better.strategy, Strategy::Volume);
        assert_eq!(better.reason, "told; voxels kept: the plan closes no cell, voxels 2");
        let open = kept(&[(0.0, true), (2.0, true)]);
        assert_eq!((open.strategy, open.cells.len()), (Strategy::Plan, 1));
        assert_eq!(open.reason, "told; the plan kept: the plan closes no cell, voxels 0");
        // Two cells in the same place.
        let unsound = kept(&[(0.0, true), (2.0, false), (2.0, false)]);
        assert_eq!(unsound.strategy, Strategy::Plan, "{}", unsound.reason);
        assert!(unsound.reason.ends_with("which don't validate"), "{}", unsound.reason);
    }

    #[test]
    fn voxels_are_tried_beside_an_open_plan_unless_the_scene_is_too_large() {
        let ground = |side: f64| {
            let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
            let positions = [(0., 0.), (side, 0.), (side, side), (0., side)].map(|(x, z)| DVec3::new(x, 0., z)).to_vec();
            let (node, triangles) = ("ground".to_owned(), vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
            builder.finish("ground").unwrap()
        };
        let open = graph(Strategy::Plan, &[(0.0, true)]);
        // A square of 80 m has 10,000 bricks of voxels of 0.1 m; a city of 5,120 m has too many of voxels of 0.3 m.
        let edge = trial(&ground(80.0), 1.0, &open).expect("a yard is tried");
        assert!((edge * VOXELS_A_BRICK - 80.0 / MOST_BRICKS.sqrt()).abs() < 1e-9, "{edge}");
        assert_eq!(trial(&ground(5120.0), 1.0, &open), None);
        // What is closed and has few portals is left alone.
        assert_eq!(trial(&ground(80.0), 1.0, &graph(Strategy::Plan, &[(0.0, true), (2.0, false)])), None);
    }
}
