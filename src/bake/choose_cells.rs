//! The choice of cells if no strategy is requested: candidates are built, each is scored by the share of the frustum that portals draw, and
//! the best is kept.
//!
//! The author's leaves are used as they are, and so are the author's rooms if half of them are sound. Otherwise the candidates are the
//! split along walls (`bsp`), the rooms of the floor plan, and one open cell. The walls are fast to split along, so they come first; a plan
//! is searched only if enough of the walls are vertical. Tilted models are split upright.

use super::portal_benefit::{cameras, cameras_in, drawn_share};
use crate::cells::lean::Lean;
use crate::cells::validate::structure;
use crate::cells::{BOUND, CellGraph, SplitError, SplitOptions, Strategy};
use crate::cells::{by_author, split_by, undivided, undivided_in_metres, upright_share};
use crate::job::Job;
use crate::pvs;
use crate::scene::rays::RayScene;
use crate::scene::{Object, Role, Scene};
use crate::types::note::{Note, NoteKind};

/// A graph is useless if it saves less than this share of the frustum: all is one open cell.
const WORTH: f64 = 0.05;
/// What rooms save indoors counts if floors are in them: if they save this share of the frustum over all floors, too. Larger: museums on wide
/// ground lose their rooms.
const ENTERED: f64 = 0.01;
/// It counts in any case if no more of the frustum is drawn indoors. Larger: a city's hollow houses count as rooms (0.42), and its file has 17
/// times the size. Smaller: a house alone on wide ground loses its rooms (a villa: 0.36 without the ground).
const SHUT_OFF: f64 = 0.4;
/// A split along walls replaces a plan only if it saves this share of the frustum more at least, and `PER_DOUBLING` for each time that it has
/// twice the plan's portals, because its cells are no rooms, and portals cost time. Larger: models whose plan finds few rooms draw more (a
/// museum 14 % at 9 times the portals, a hospital 26 % at 20 times). Smaller: a villa loses its rooms for 7 % (4 times), a maze for 14 % (65
/// times).
const REPLACES: f64 = 0.1;
const PER_DOUBLING: f64 = 1.0 / 30.0;
/// A plan is searched if at least this share of the non-horizontal area is vertical (houses with roofs: 0.75 and more). The first value is
/// for models without any hint of a building, where a search for rooms takes minutes and finds few.
const UPRIGHT_SHARE: [f64; 2] = [0.75, 0.5];

/// The score of a graph.
struct Score {
    closed_cells: usize,
    portals: usize,
    /// Triangles drawn with its portals, over those in the frustum, in the mean of cameras over floors, and of those in the closed cells
    /// of all candidates.
    drawn: f64,
    indoors: f64,
}

/// Finds the cells for [`bake`](super::bake()) if none are given.
///
/// # Errors
///
/// If the scene cannot be split, or the work was stopped.
pub fn find_cells(scene: &Scene, options: &SplitOptions, work: &Job<'_>) -> Result<CellGraph, SplitError> {
    choose(&RayScene::new(scene), options, work)
}

/// As [`find_cells`], with the scene's rays.
pub(super) fn choose(rays: &RayScene<'_>, options: &SplitOptions, work: &Job<'_>) -> Result<CellGraph, SplitError> {
    let scene = rays.scene();
    let tolerance = scene.tolerance();
    let may_lean = scene.hints.leaves.is_none() && scene.hints.storeys.is_empty();
    let graph = match Lean::of(scene, tolerance.coplanar).filter(|_| may_lean) {
        Some(lean) => {
            let upright = lean.levelled(scene);
            lean.back(choose_upright(&RayScene::new(&upright), options, work)?, 0.1 * tolerance.coplanar)
        }
        None => choose_upright(rays, options, work)?,
    };
    Ok(if_affordable(scene, graph))
}

/// The cells by a strategy that was chosen before, which may have been to divide nothing. `None` if today it is not to be had, or the author's
/// are.
pub(super) fn split_as(
    rays: &RayScene<'_>,
    (strategy, is_undivided): (Strategy, bool),
    options: &SplitOptions,
    work: &Job<'_>,
) -> Result<Option<CellGraph>, SplitError> {
    let scene = rays.scene();
    let is_authors = matches!(strategy, Strategy::Authored | Strategy::Leaves);
    let is_as_before = by_author(scene).0 == is_authors.then_some(strategy);
    if options.strategy.is_some() || strategy == Strategy::Given || !is_as_before {
        return Ok(None);
    }
    if is_undivided && !is_authors {
        return Ok(Some(one_cell(scene, options)));
    }
    choose(rays, &SplitOptions { strategy: Some(strategy), ..*options }, work).map(Some)
}

fn choose_upright(rays: &RayScene<'_>, options: &SplitOptions, work: &Job<'_>) -> Result<CellGraph, SplitError> {
    let scene = rays.scene();
    if options.strategy.is_some() {
        return split_by(rays, options, work);
    }
    let (authors, why) = by_author(scene);
    let with = |strategy: Strategy| split_by(rays, &SplitOptions { strategy: Some(strategy), ..*options }, work);
    if let Some(strategy) = authors {
        return Ok(CellGraph { reason: why, ..with(strategy)? });
    }
    let may_part = |object: &Object| object.opaque && matches!(object.role, Role::Structure | Role::Unknown);
    if !scene.objects.iter().any(may_part) {
        let reason = format!("{why}; it has no walls or floors, only pipes or furniture: one open cell");
        return Ok(CellGraph { reason, ..one_cell(scene, options) });
    }
    let walls = with(Strategy::Bsp)?;
    let upright = upright_share(scene);
    let plan = (upright >= UPRIGHT_SHARE[usize::from(names_any(scene))]).then(|| with(Strategy::Plan)).transpose()?;
    best(rays, options, (walls, plan), (&why, upright), work)
}

/// The best of a split along walls, the rooms of a plan if there is one, and one open cell. `upright`: the vertical share of the walls.
fn best(
    rays: &RayScene<'_>,
    options: &SplitOptions,
    (walls, plan): (CellGraph, Option<CellGraph>),
    (why, upright): (&str, f64),
    work: &Job<'_>,
) -> Result<CellGraph, SplitError> {
    let scene = rays.scene();
    let all = cameras(rays);
    let graphs: Vec<&CellGraph> = std::iter::once(&walls).chain(&plan).collect();
    let inside = cameras_in(&graphs);
    let inside = if inside.is_empty() { &all } else { &inside };
    let score = |graph: &CellGraph| -> Result<Score, SplitError> {
        Ok(Score {
            closed_cells: graph.cells.iter().filter(|cell| !cell.open).count(),
            portals: graph.portals.len(),
            drawn: drawn_share(scene, graph, &all, work)?,
            indoors: drawn_share(scene, graph, inside, work)?,
        })
    };
    let of_walls = score(&walls)?;
    let of_plan = plan.as_ref().map(score).transpose()?;
    let has_gaps = plan.is_some() && !structure(&walls, scene.tolerance().coplanar).is_empty();
    let keeps_plan = of_plan.as_ref().is_some_and(|of_plan| has_gaps || is_better(of_plan, &of_walls));
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let mut table = vec![("the split along walls", &of_walls)];
    table.extend(of_plan.as_ref().map(|score| ("the floor plan", score)));
    if keeps_plan {
        table.reverse();
    }
    let details: Vec<Note> = table
        .iter()
        .map(|(name, s)| {
            let counts = format!("{} closed cells, {} portals", s.closed_cells, s.portals);
            let [drawn, indoors] = [s.drawn, s.indoors].map(percent);
            Note::detail(format!("candidate: {name}: {counts}, {drawn} of the frustum drawn, {indoors} indoors"))
        })
        .collect();
    let (name, score) = table[0];
    // Rooms of a plan are places to be; pockets between walls are not.
    let are_places = keeps_plan && (score.drawn <= 1.0 - ENTERED || score.indoors <= SHUT_OFF);
    let drawn = if are_places { score.drawn.min(score.indoors) } else { score.drawn };
    if drawn > 1.0 - WORTH && !(options.module && score.closed_cells > 0) {
        let drawn = percent(drawn);
        let reason =
            format!("{why}; walls hide too little ({drawn} of the frustum's triangles would be drawn): one open cell");
        let mut graph = CellGraph { reason, ..one_cell(scene, options) };
        let of_kept = if keeps_plan { plan } else { Some(walls) };
        let costs = of_kept.into_iter().flat_map(|graph| graph.notes).filter(|note| note.kind == NoteKind::Cost);
        graph.notes.extend(costs.chain(details));
        return Ok(graph);
    }
    let mut reason = format!("{why}; with {name}, {} of the frustum's triangles are drawn indoors", percent(score.indoors));
    reason += &match table.get(1) {
        Some((other, _)) if has_gaps => format!("; {other} has gaps"),
        Some((other, score)) => format!(", {} with {other}", percent(score.indoors)),
        None => format!("; no floor plan was made, because only {} of the walls' area is vertical", percent(upright)),
    };
    let mut graph = if keeps_plan { plan.unwrap_or(walls) } else { walls };
    graph.notes.extend(details);
    Ok(CellGraph { reason, ..graph })
}

fn one_cell(scene: &Scene, options: &SplitOptions) -> CellGraph {
    if options.in_metres { undivided_in_metres(scene) } else { undivided(scene) }
}

/// Whether the model names rooms, openings or storeys.
fn names_any(scene: &Scene) -> bool {
    !(scene.hints.rooms.is_empty() && scene.hints.openings.is_empty() && scene.hints.storeys.is_empty())
}

/// Whether a plan is kept beside a split along walls.
fn is_better(plan: &Score, walls: &Score) -> bool {
    let times = walls.portals.max(1) as f64 / plan.portals.max(1) as f64;
    let saving = plan.indoors - walls.indoors;
    plan.closed_cells > 0 && saving <= REPLACES.max(PER_DOUBLING * times.log2())
}

/// Replaces a graph that would take flow hours by one open cell; only rough walls make so many portals between few cells.
fn if_affordable(scene: &Scene, graph: CellGraph) -> CellGraph {
    if !pvs::flow::is_over_budget(&graph, scene.tolerance().coplanar) {
        return graph;
    }
    let (cells, portals) = (graph.cells.len(), graph.portals.len());
    let bound = format!(
        "{BOUND}{cells} cells would have {portals} portals, typical of cracks in rough walls; portal flow would take hours, so the model is one open cell"
    );
    CellGraph {
        strategy: graph.strategy,
        reason: graph.reason,
        notes: graph.notes.into_iter().chain([Note::cost(bound)]).collect(),
        ..undivided(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellId;
    use crate::cells::{Cell, Portal, PortalKind, PortalState};
    use crate::math::geom::Plane;
    use crate::scene::{ImportOptions, Mesh, SceneBuilder, Source};
    use glam::DVec3;

    #[test]
    fn too_many_cracks_are_not_searched() {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let corners = [DVec3::ZERO, DVec3::Y, DVec3::Y + DVec3::Z, DVec3::Z];
        let (positions, triangles) = (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
        builder.add(Mesh { node: "wall".into(), role: Role::Unknown, opaque: true, positions, triangles }).unwrap();
        let scene = builder.finish("wall").unwrap();
        let crack = |i: u32| Portal {
            cells: [CellId(0), CellId(1)],
            plane: Plane { n: DVec3::X, d: 0.0 },
            winding: corners.map(|p| (p + f64::from(i)) * (DVec3::Y + DVec3::Z)).to_vec(),
            kind: PortalKind::Opening,
            state: PortalState::of_kind(PortalKind::Opening),
            source: None,
        };
        let between = |cracks: u32| CellGraph {
            strategy: Strategy::Bsp,
            ..CellGraph::given(vec![Cell::default(); 2], (0..cracks).map(crack).collect())
        };
        let few = between(100);
        assert_eq!(if_affordable(&scene, few.clone()), few);
        let one = if_affordable(&scene, between(40_000));
        assert_eq!((one.strategy, one.cells.len(), one.portals.len()), (Strategy::Bsp, 1, 0));
        assert!(one.notes.iter().any(|note| note.starts_with("bound: 2 cells would have 40000 portals")), "{:?}", one.notes);
    }
}
