//! The default strategy of a scene: chosen by measurements, explained in one line.
//!
//! 1. `authored`, if most of the author's rooms are sound.
//! 2. `bsp`, if little of the non-horizontal area is vertical (caves), if walls show their backs to the outside (levels), or if nothing has
//!    a ceiling.
//! 3. `plan` otherwise.
//!
//! If the plan has no closed cell or many portals per cell (slopes and rock), `bsp` is tried, too. The graph with closed cells or with
//! fewer portals per cell is kept.

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

/// The author's rooms are used if at least this share is sound.
const SOUND_SHARE: f64 = 0.5;
/// The plan is tried if at least this share of the non-horizontal area is vertical (houses with roofs: 0.75 and more). The first value is
/// for models without any hint of a building, where a search for rooms takes minutes and finds few.
const UPRIGHT_SHARE: [f64; 2] = [0.75, 0.5];
/// A plan with more portals per cell is poor: buildings have 1 to 16, a villa with a dome 8, a level of slopes 23.
const RAGGED_PORTALS: f64 = 20.0;
/// A scene has ceilings if at least this share of the horizontal area is covered. Larger: a house on a large site has none. Smaller: cities
/// are searched for rooms.
const COVERED_SHARE: f64 = 0.05;
/// Largest vertical component of a wall's unit normal; a floor's is at least `FLOOR_NORMAL`.
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
        let reason = format!("{} of the model's {rooms} rooms are usable", audit.sound_rooms);
        return (Strategy::Authored, reason);
    }
    (strategy, format!("only {} of the model's {rooms} rooms are usable; {why}", audit.sound_rooms))
}

/// The vertical share of the non-horizontal area; 1 if all is horizontal.
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

/// Whether a plan may find rooms in a scene without hints: houses with one-sided walls look like levels.
pub(crate) fn may_be_house(scene: &Scene) -> bool {
    upright_share(scene) >= UPRIGHT_SHARE[0]
}

fn by_shape(rays: &RayScene<'_>) -> (Strategy, String) {
    let scene = rays.scene();
    let share = upright_share(scene);
    let nothing = says_nothing(scene);
    let by_walls = |why: String| (Strategy::Bsp, format!("{why}, so space is split along the largest walls"));
    if share < UPRIGHT_SHARE[usize::from(!nothing)] {
        return by_walls(format!("{:.0} % of the non-horizontal area is not vertical", 100.0 * (1.0 - share)));
    }
    if nothing && Facing::new(rays).shows_backs {
        return by_walls("its walls show their backs to the outside, as in game levels".to_owned());
    }
    match Floors::new(scene, opaque_structure(scene), FLOOR_NORMAL).covered(rays) {
        Some(covered) if covered < COVERED_SHARE => by_walls(format!("{:.0} % of the floors are covered", 100.0 * covered)),
        _ => (Strategy::Plan, "walls are vertical, so rooms come from the floor plan".to_owned()),
    }
}

fn portals_a_cell(graph: &CellGraph) -> f64 {
    graph.portals.len() as f64 / graph.cells.len().max(1) as f64
}

/// Number of closed cells.
fn closed_cells(graph: &CellGraph) -> usize {
    graph.cells.iter().filter(|c| !c.open).count()
}

/// True if the model names no room, opening or storey.
fn says_nothing(scene: &Scene) -> bool {
    scene.hints.rooms.is_empty() && scene.hints.openings.is_empty() && scene.hints.storeys.is_empty()
}

/// Whether another graph should be tried, too.
pub(super) fn is_poor(plan: &CellGraph) -> bool {
    closed_cells(plan) == 0 || portals_a_cell(plan) > RAGGED_PORTALS
}

/// A poor plan or a bsp graph: the one with closed cells, or else the one with fewer portals per cell. The bsp graph must validate to
/// `tolerance` metres.
pub(super) fn better(mut plan: CellGraph, tolerance: f64, mut walls: CellGraph) -> CellGraph {
    walls.link();
    let (is_better, says) = if closed_cells(&plan) == 0 {
        let closed = closed_cells(&walls);
        (closed > 0, format!("the plan finds no closed room, the split along walls finds {closed}"))
    } else {
        let [of_plan, of_walls] = [&plan, &walls].map(portals_a_cell);
        let says = format!("the plan has {of_plan:.1} portals per cell, the split along walls {of_walls:.1}");
        (of_walls < of_plan && walls.cells.len() > 1, says)
    };
    if !is_better {
        plan.reason = format!("{}; the plan is kept: {says}", plan.reason);
        return plan;
    }
    if !structure(&walls, tolerance).is_empty() {
        plan.reason = format!("{}; the plan is kept: {says}, but the split along walls leaves gaps", plan.reason);
        return plan;
    }
    walls.reason = format!("{}; space is split along walls instead: {says}", plan.reason);
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
        assert_eq!(
            better.reason,
            "told; space is split along walls instead: the plan finds no closed room, the split along walls finds 2"
        );
        let open = kept(&[(0.0, true), (2.0, true)]);
        assert_eq!((open.strategy, open.cells.len()), (Strategy::Plan, 1));
        assert_eq!(open.reason, "told; the plan is kept: the plan finds no closed room, the split along walls finds 0");
        // Two cells in the same place.
        let unsound = kept(&[(0.0, true), (2.0, false), (2.0, false)]);
        assert_eq!(unsound.strategy, Strategy::Plan, "{}", unsound.reason);
        assert!(unsound.reason.ends_with("but the split along walls leaves gaps"), "{}", unsound.reason);
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
        // Two of three sheets are covered.
        let share = covered(&sheets(&[0.0, 3.0, 6.0])).unwrap();
        assert!((share - 2.0 / 3.0).abs() < 0.06, "{share}");
    }
}
