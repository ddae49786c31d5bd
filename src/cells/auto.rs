//! Which strategy a scene gets when nobody asks for one: decided by what is measured in it, said in one line.
//!
//! The author's rooms, where most of them are sound; a tree of walls, where little of what isn't level stands upright, as in caves, where
//! walls show their backs from outside, as in levels, or where nothing has a ceiling; else the plan. The tree is tried too where the plan closes no cell, or comes out ragged: levels of slopes and
//! rock give it many portals to a cell, buildings few. What closes a cell, or has fewer portals to a cell, is kept.

use super::bsp::facing::Facing;
use super::bsp::planes::opaque_structure;
use super::{CellGraph, Strategy};
use crate::cells::authored::audit::audit_rooms;
use crate::cells::validate::structure;
use crate::geom::{Aabb, newell};
use crate::scene::Scene;
use crate::scene::bulk::bulk;
use crate::scene::floors::Floors;
use crate::scene::rays::RayScene;
use glam::DVec3;

/// Rooms of an author are taken where at least this share of them is sound.
const SOUND_SHARE: f64 = 0.5;
/// A plan is tried where this share of what isn't level stands upright: in houses with roofs 0.75 and more. The first where a model says
/// nothing of a building, in which a search for rooms takes minutes and ends with few.
const UPRIGHT_SHARE: [f64; 2] = [0.75, 0.5];
/// A plan with more portals than this to a cell is ragged: buildings have 1 to 16, a villa with a dome 8, a level of slopes 23.
const RAGGED_PORTALS: f64 = 20.0;
/// A scene has ceilings where something is above this share of what is level. More: a house on a large site has none. Less: cities are
/// searched for rooms.
const COVERED_SHARE: f64 = 0.05;
/// The vertical part of a wall's unit normal is at most this; that of a floor's is at least `FLOOR_NORMAL`.
const WALL_NORMAL: f64 = 0.05;
const FLOOR_NORMAL: f64 = 0.98;

/// The strategy, and why.
pub(super) fn choose(rays: &RayScene<'_>) -> (Strategy, String) {
    let scene = rays.scene();
    let rooms = scene.hints.rooms.len();
    let (strategy, why) = by_shape(rays);
    if rooms == 0 {
        return (strategy, format!("the model names no rooms; {why}"));
    }
    let audit = audit_rooms(scene);
    if audit.sound_share() >= SOUND_SHARE {
        let reason = format!("{} of the {rooms} rooms that the model names can be used", audit.sound_rooms);
        return (Strategy::Authored, reason);
    }
    (strategy, format!("only {} of the {rooms} rooms that the model names can be used; {why}", audit.sound_rooms))
}

/// Of what isn't level in a scene, the share that stands upright; 1 where all is level.
fn upright_share(scene: &Scene) -> f64 {
    let (mut upright, mut steep) = (0.0, 0.0);
    let part = bulk(scene);
    let is_near = |c: &[DVec3; 3]| part.is_none_or(|part| part.touches(&Aabb::of(*c)));
    for c in opaque_structure(scene).filter(is_near) {
        let n = newell(&c.map(|p| p - c[0]));
        let (area, up) = (n.length(), n.y.abs());
        if up <= FLOOR_NORMAL * area {
            steep += area;
            upright += if up <= WALL_NORMAL * area { area } else { 0.0 };
        }
    }
    if steep > 0.0 { upright / steep } else { 1.0 }
}

/// Whether a plan may find rooms in a scene that says nothing of a building: houses whose walls are drawn on one side look like levels.
pub(crate) fn may_be_house(scene: &Scene) -> bool {
    upright_share(scene) >= UPRIGHT_SHARE[0]
}

fn by_shape(rays: &RayScene<'_>) -> (Strategy, String) {
    let scene = rays.scene();
    let share = upright_share(scene);
    let nothing = says_nothing(scene);
    let by_walls = |why: String| (Strategy::Bsp, format!("{why}, so space is cut along the largest walls"));
    if share < UPRIGHT_SHARE[usize::from(!nothing)] {
        return by_walls(format!("{:.0} % of the walls lean", 100.0 * (1.0 - share)));
    }
    if nothing && Facing::new(rays).shows_backs {
        return by_walls("from outside its walls show their backs, as those of levels do".to_owned());
    }
    match Floors::new(scene, opaque_structure(scene), FLOOR_NORMAL).covered(rays) {
        Some(covered) if covered < COVERED_SHARE => {
            by_walls(format!("{:.0} % of the floors have something above them", 100.0 * covered))
        }
        _ => (Strategy::Plan, "walls are vertical, so rooms come from the floor plan".to_owned()),
    }
}

fn portals_a_cell(graph: &CellGraph) -> f64 {
    graph.portals.len() as f64 / graph.cells.len().max(1) as f64
}

/// Cells that portals can keep from being drawn.
fn closed_cells(graph: &CellGraph) -> usize {
    graph.cells.iter().filter(|c| !c.open).count()
}

/// True where a model names no room, door, window or storey.
fn says_nothing(scene: &Scene) -> bool {
    scene.hints.rooms.is_empty() && scene.hints.openings.is_empty() && scene.hints.storeys.is_empty()
}

/// Whether another graph should be tried beside this plan.
pub(super) fn is_poor(plan: &CellGraph) -> bool {
    closed_cells(plan) == 0 || portals_a_cell(plan) > RAGGED_PORTALS
}

/// A poor plan, or a tree of walls: whichever closes cells where the other doesn't, else has fewer portals to a cell; the tree only
/// where it validates, to `tolerance` metres.
pub(super) fn better(mut plan: CellGraph, tolerance: f64, mut walls: CellGraph) -> CellGraph {
    walls.link();
    let (is_better, says) = if closed_cells(&plan) == 0 {
        let closed = closed_cells(&walls);
        (closed > 0, format!("the plan finds no closed room, cuts along walls {closed}"))
    } else {
        let [of_plan, of_walls] = [&plan, &walls].map(portals_a_cell);
        let says = format!("the plan has {of_plan:.1} portals a cell, cuts along walls {of_walls:.1}");
        (of_walls < of_plan && walls.cells.len() > 1, says)
    };
    if !is_better {
        plan.reason = format!("{}; the plan is kept: {says}", plan.reason);
        return plan;
    }
    if !structure(&walls, tolerance).is_empty() {
        plan.reason = format!("{}; the plan is kept: {says}, but these leave gaps", plan.reason);
        return plan;
    }
    walls.reason = format!("{}; but space is cut along walls: {says}", plan.reason);
    walls
}

#[cfg(test)]
mod tests {
    use super::super::{Cell, Piece, Portal, PortalKind, PortalState};
    use super::*;
    use crate::CellId;
    use crate::geom::{Aabb, Plane};
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// Boxes as cells, without portals: from x to x + 1, and whether each is open.
    fn graph(strategy: Strategy, cells: &[(f64, bool)]) -> CellGraph {
        let cell = |&(x, open): &(f64, bool)| {
            let bounds = Aabb { min: DVec3::new(x, 0.0, 0.0), max: DVec3::new(x + 1.0, 1.0, 1.0) };
            let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(bounds.max, n), Plane::through(bounds.min, -n)]);
            Cell { open, pieces: vec![Piece { planes: planes.collect(), bounds }], ..Cell::default() }
        };
        let cells = cells.iter().map(cell).collect();
        CellGraph { strategy, reason: "told".into(), ..CellGraph::given(cells, Vec::new()) }
    }

    #[test]
    fn walls_are_kept_where_they_alone_close_a_cell_and_are_sound() {
        let plan = || graph(Strategy::Plan, &[(0.0, true)]);
        let kept = |walls: &[(f64, bool)]| better(plan(), 1e-6, graph(Strategy::Bsp, walls));
        let better = kept(&[(0.0, true), (2.0, false), (4.0, false)]);
        assert_eq!(better.strategy, Strategy::Bsp);
        assert_eq!(better.reason, "told; but space is cut along walls: the plan finds no closed room, cuts along walls 2");
        let open = kept(&[(0.0, true), (2.0, true)]);
        assert_eq!((open.strategy, open.cells.len()), (Strategy::Plan, 1));
        assert_eq!(open.reason, "told; the plan is kept: the plan finds no closed room, cuts along walls 0");
        // Two cells in the same place.
        let unsound = kept(&[(0.0, true), (2.0, false), (2.0, false)]);
        assert_eq!(unsound.strategy, Strategy::Plan, "{}", unsound.reason);
        assert!(unsound.reason.ends_with("but these leave gaps"), "{}", unsound.reason);
    }

    #[test]
    fn a_plan_without_a_closed_cell_is_poor_and_so_is_a_ragged_one() {
        let mut plan = graph(Strategy::Plan, &[(0.0, true)]);
        assert!(is_poor(&plan));
        plan.cells[0].open = false;
        assert!(!is_poor(&plan));
        let portal = Portal {
            cells: [CellId(0); 2],
            plane: Plane { n: DVec3::X, d: 0.0 },
            winding: Vec::new(),
            kind: PortalKind::Opening,
            state: PortalState::default(),
            source: None,
        };
        plan.portals = vec![portal; 28];
        assert!(is_poor(&plan));
    }

    #[test]
    fn ceilings_are_what_is_above_something_level() {
        let sheets = |heights: &[f64]| {
            let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
            for &y in heights {
                let positions = [(0., 0.), (9., 0.), (9., 9.), (0., 9.)].map(|(x, z)| DVec3::new(x, y, z)).to_vec();
                let (node, triangles) = (format!("at {y}"), vec![[0, 1, 2], [0, 2, 3]]);
                builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
            }
            builder.finish("sheets").unwrap()
        };
        let covered =
            |scene: &Scene| Floors::new(scene, opaque_structure(scene), FLOOR_NORMAL).covered(&RayScene::new(scene));
        assert_eq!(covered(&sheets(&[0.0])), Some(0.0));
        // Of three sheets, two have something above them.
        let share = covered(&sheets(&[0.0, 3.0, 6.0])).unwrap();
        assert!((share - 2.0 / 3.0).abs() < 0.06, "{share}");
    }
}
