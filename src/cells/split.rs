//! Splits a scene into cells: column complex, labelling, graph.

use super::{BOUND, Cell, CellGraph, Strategy, authored};
use crate::cells::authored::audit::audit_rooms;
use crate::cells::authored::audit::unsound;
use crate::cells::bsp::bsp;
use crate::cells::bsp::graph::cells as cells_of_parts;
use crate::cells::complex::arrange::{Plan, arrange};
use crate::cells::complex::assemble::{Complex, around, pieces, portals};
use crate::cells::complex::bands::{Band, bands};
use crate::cells::complex::columns::{Columns, Levels, columns};
use crate::cells::complex::faces::faces;
use crate::cells::complex::facets::{Facets, Matter, facets};
use crate::cells::complex::lift;
use crate::cells::complex::limits::Limits;
use crate::cells::doors::kinds::name_openings;
use crate::cells::doors::state::find_states;
use crate::cells::doors::stoppers;
use crate::cells::leaves::leaves;
use crate::cells::plan::courtyards::part_courtyards;
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::rooms::label;
use crate::cells::plan::space::{Input, Labels};
use crate::cells::scale::HumanScale;
use crate::job::{Job, Stopped};
use crate::math::geom::Aabb;
use crate::scene::rays::RayScene;
use crate::scene::{Role, Scene};
use crate::types::note::Note;
use glam::DVec3;

/// Options of a split.
#[derive(Clone, Copy, PartialEq, Debug, serde::Serialize)]
pub struct SplitOptions {
    /// `None`: chosen for the scene.
    pub strategy: Option<Strategy>,
    /// For [`Strategy::Bsp`]: smaller surfaces make no cells, metres; `None`: chosen for the scene.
    pub smallest_occluder: Option<f64>,
    /// Whether the scene is certainly in metres: thresholds for rooms and doors then do not depend on its ceiling heights.
    pub in_metres: bool,
    /// Whether it is a module that is joined with others: then its rooms are kept, however little they hide alone, and the file of a bake has a
    /// row for each portal that leads outside.
    pub module: bool,
    /// Memory limit of the split, bytes, without the scene itself. Beyond it, the smallest surfaces do not split space, cells are coarser,
    /// and [`CellGraph::notes`] reports it.
    pub memory: u64,
}

/// Default of [`SplitOptions::memory`]: 4 GiB, half of a bake's.
const MEMORY: u64 = 4 << 30;

impl Default for SplitOptions {
    fn default() -> Self {
        Self { strategy: None, smallest_occluder: None, in_metres: false, module: false, memory: MEMORY }
    }
}

/// Errors of a split.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SplitError {
    /// `authored` was requested, but the model names no rooms.
    #[error("the model names no rooms; use --cells plan")]
    NoRooms,
    /// `leaves` was requested, but the model has none.
    #[error("the model has no leaves, only a .bsp or a closed .map has; omit --cells, or use --cells bsp")]
    NoLeaves,
    /// The user's cells are not made by a split.
    #[error("given cells come from a cells file")]
    Given,
    /// The caller stopped the job.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The author's rooms are used if at least this share is sound.
const SOUND_SHARE: f64 = 0.5;

/// The strategy that uses the author's cells, if they are usable, and why.
pub(crate) fn by_author(scene: &Scene) -> (Option<Strategy>, String) {
    let rooms = scene.hints.rooms.len();
    if scene.hints.leaves.is_some() {
        let of_map = scene.source.format == "map";
        let why = if of_map { "a tree over the map's brushes" } else { "the level's own" };
        return (Some(Strategy::Leaves), why.to_owned());
    }
    if rooms == 0 {
        return (None, "the model names no rooms".to_owned());
    }
    let audit = audit_rooms(scene);
    if audit.sound_share() >= SOUND_SHARE {
        let why = format!("{} of the model's {rooms} rooms are usable", audit.sound_rooms);
        return (Some(Strategy::Authored), why);
    }
    (None, format!("only {} of the model's {rooms} rooms are usable", audit.sound_rooms))
}

/// Splits a scene into cells and portals. Without a strategy: the author's cells if they are usable, otherwise the rooms of the floor plan;
/// [`find_cells`](crate::bake::find_cells) chooses between more.
pub fn split(scene: &Scene, options: &SplitOptions) -> Result<CellGraph, SplitError> {
    split_by(&RayScene::new(scene), options, &Job::quiet())
}

/// As [`split`], with the scene's rays.
pub(crate) fn split_by(rays: &RayScene<'_>, options: &SplitOptions, work: &Job<'_>) -> Result<CellGraph, SplitError> {
    let scene = rays.scene();
    let human = if options.in_metres { HumanScale::METRES } else { HumanScale::of(rays) };
    let (strategy, reason) = match options.strategy {
        Some(Strategy::Authored) if scene.hints.rooms.is_empty() => return Err(SplitError::NoRooms),
        Some(Strategy::Given) => return Err(SplitError::Given),
        Some(strategy) => (strategy, "requested".to_owned()),
        None => match by_author(scene) {
            (Some(strategy), why) => (strategy, why),
            (None, why) => (Strategy::Plan, why),
        },
    };
    let graph = match (strategy, &scene.hints.leaves) {
        (Strategy::Leaves, None) => return Err(SplitError::NoLeaves),
        (Strategy::Leaves, Some(found)) => return Ok(finished(rays, HumanScale::METRES, leaves(scene, found, reason))),
        (Strategy::Bsp, _) => bsp(rays, human, options, reason, work)?,
        _ => from_columns(scene, human, (strategy, reason), options, &PlanOptions::default(), work)?,
    };
    Ok(finished(rays, human, graph))
}

/// Adds kinds and states of portals.
fn finished(rays: &RayScene<'_>, human: HumanScale, mut graph: CellGraph) -> CellGraph {
    name_openings(rays.scene(), &mut graph.portals, human);
    find_states(rays, &mut graph.portals, human.metre, graph.strategy == Strategy::Leaves);
    graph.notes.extend(stoppers::note(rays, human));
    graph.link();
    graph
}

/// A scene as one open cell, without a portal.
pub fn undivided(scene: &Scene) -> CellGraph {
    one_cell(scene, HumanScale::of(&RayScene::new(scene)))
}

/// As [`undivided`], for a scene that is certainly in metres.
pub(crate) fn undivided_in_metres(scene: &Scene) -> CellGraph {
    one_cell(scene, HumanScale::METRES)
}

fn one_cell(scene: &Scene, human: HumanScale) -> CellGraph {
    let (cells, _) = cells_of_parts(Vec::new(), None, human.domain(scene.bounds()));
    CellGraph {
        strategy: Strategy::Bsp,
        reason: String::new(),
        cells,
        portals: Vec::new(),
        smallest_hole: scene.tolerance().smallest_hole(),
        closed_holes: Vec::new(),
        notes: human.note().into_iter().collect(),
    }
}

/// A graph from labels on the column complex.
fn from_columns(
    scene: &Scene,
    human: HumanScale,
    (strategy, reason): (Strategy, String),
    options: &SplitOptions,
    plan_options: &PlanOptions,
    work: &Job<'_>,
) -> Result<CellGraph, Stopped> {
    let tolerance = scene.tolerance();
    let with_rooms = strategy == Strategy::Authored;

    // 1. Planes, plan, pieces.
    let domain = human.domain(scene.bounds());
    let limits = Limits::new(scene.triangles.len(), options.memory, work);
    let Cuts { found, levels, bands, plan, columns, scale } = cuts(scene, human, with_rooms, domain, &limits)?;
    // 2. Open faces between them.
    let faces = faces(&plan, &bands, &columns, &found, &tolerance, work)?;
    // 3. Labels.
    let complex = Complex { plan: &plan, columns: &columns, facets: &found, faces: &faces, levels: &levels, domain };
    let unsound = if with_rooms { unsound(&scene.hints, human.metre) } else { Vec::new() };
    let claims = if with_rooms {
        authored::claims(&middles(&complex), &scene.hints, &unsound)
    } else {
        authored::Claims::none(columns.pieces())
    };
    let storeys_part = !scene.hints.storeys.is_empty();
    let input =
        Input { complex: &complex, claims: &claims, storeys_part, options: plan_options, human, seal: tolerance.seal };
    let mut labels = label(&input);
    part_courtyards(&input, &mut labels);
    work.go_on()?;
    // 4. The graph.
    let mut notes = notes(scene, &labels, &found, &unsound, human);
    notes.extend(coarser(human, scale));
    notes.extend(labels.least_volume.map(|volume| joined(human, volume)));
    notes.extend(labels.were_many.then(|| Note::cost(format!("{BOUND}{JOINED_AT_ONCE}"))));
    Ok(CellGraph {
        strategy,
        reason,
        cells: cells(scene, &labels, &complex),
        portals: portals(&complex, &labels.of_piece, tolerance.seal, work)?,
        smallest_hole: tolerance.smallest_hole(),
        closed_holes: Vec::new(),
        notes,
    })
}

/// The column complex and its planes.
struct Cuts {
    found: Facets,
    levels: Vec<f64>,
    bands: Vec<Band>,
    plan: Plan,
    columns: Columns,
    /// Factor on the smallest area that cuts.
    scale: f64,
}

/// The plan and its pieces. If they exceed the limits, only larger walls and sheets cut.
fn cuts(scene: &Scene, human: HumanScale, with_rooms: bool, domain: Aabb, limits: &Limits<'_>) -> Result<Cuts, Stopped> {
    let coplanar = scene.tolerance().coplanar;
    let mut scale = 1.0;
    loop {
        let (found, levels, bands, fitting) = storeys(scene, human, with_rooms, domain, scale);
        limits.work.go_on()?;
        let is_bare = found.walls.is_empty() && found.sheets.is_empty();
        // Without walls and sheets, only the author's storeys remain.
        let limits = Limits { most: if is_bare { usize::MAX } else { limits.most }, ..*limits };
        if let Some(plan) = arrange(&bands, domain, coplanar, human.metres(MEETING), &limits) {
            let heights = Levels { heights: &levels, near: human.metres(LEVEL_AWAY), coplanar };
            if let Some(columns) = columns(&plan, &bands, &found, &heights, &limits) {
                return Ok(Cuts { found, levels, bands, plan, columns, scale: fitting });
            }
        }
        scale = 2.0 * fitting;
    }
}

/// A note if walls and sheets of normal size do not cut.
fn coarser(human: HumanScale, scale: f64) -> Option<Note> {
    let [wall, sheet] = [human.least_wall(), human.least_sheet()].map(|area| area * scale);
    let says = || {
        Note::cost(format!(
            "{BOUND}walls and sheets would cut space into too many pieces; walls below {wall:.2} m² and sheets below {sheet:.2} m² \
             do not split space, so cells are larger, and more is drawn"
        ))
    };
    (scale > 1.0).then(says)
}

/// A note if rooms were joined because there were too many.
fn joined(human: HumanScale, volume: f64) -> Note {
    let volume = volume / human.metre.powi(3);
    Note::cost(format!(
        "{BOUND}there would be too many rooms or portals; rooms below {volume:.0} m³ are joined to a neighbour, so cells are larger, and more is drawn"
    ))
}

/// A note if there were too many regions to join in pairs.
const JOINED_AT_ONCE: &str = "too many spaces are open to each other to join them in pairs; large ones took in all their open neighbours, so cells are larger, and more is drawn";

/// The middle of each piece.
fn middles(Complex { plan, columns, .. }: &Complex<'_>) -> Vec<DVec3> {
    let middle = |p: u32| {
        let (column, _) = columns.of_piece(p);
        let q = plan.triangles[column].iter().map(|&i| plan.points[i as usize]).sum::<glam::DVec2>() / 3.0;
        let (floor, ceiling) = columns.heights(p);
        lift(q, (0..3).map(|i| floor[i] + ceiling[i]).sum::<f64>() / 6.0)
    };
    (0..columns.pieces() as u32).map(middle).collect()
}

/// Most lines in the plan of a band: the larger of a count and a density per square metre, up to an absolute limit. Beyond it, the least
/// wall and the least sheet are doubled until it fits. Offices have 2 to 3 lines a square metre; in rubble, crossings grow with the square
/// of the number of walls.
const MOST_LINES: usize = 24_000;
const MOST_LINES_A_SQUARE_METRE: f64 = 5.0;
const MOST_LINES_EVER: usize = 400_000;

/// A line of the plan is extended to another within this distance, human metres. Larger: real gaps close in plan, which only adds cuts.
/// Smaller: slits beside walls.
const MEETING: f64 = 0.03;
/// A level cuts where no sheet is within this distance, human metres. Larger: storeys with a slab at another height are joined. Smaller:
/// gaps between slab and level.
const LEVEL_AWAY: f64 = 0.45;
/// Smallest vertical component of a floor's unit normal.
const LEVEL_NORMAL: f64 = 0.999;
/// Smallest distance of two levels, human metres: no storey is lower.
const LEVELS_APART: f64 = 2.2;
/// Smallest floor of a level: share of the largest floor, and human square metres. Smaller: landings and tables are levels. Larger: split
/// levels are missed.
const LEVEL_SHARE: f64 = 0.15;
const LEAST_LEVEL: f64 = 8.0;
/// The model's top and bottom are levels if no other is within this distance, human metres.
const RIM_AWAY: f64 = 0.5;

/// The splitting planes, the levels, and the bands between them, for walls and sheets at least `scale` times the usual minimum. The last
/// value is the scale in use, which may be larger.
fn storeys(
    scene: &Scene,
    human: HumanScale,
    with_rooms: bool,
    domain: Aabb,
    mut scale: f64,
) -> (Facets, Vec<f64>, Vec<Band>, f64) {
    let tolerance = scene.tolerance();
    let (size, square_metre) = (domain.size(), human.metre * human.metre);
    let by_area = (MOST_LINES_A_SQUARE_METRE * size.x * size.z / square_metre) as usize;
    let most = by_area.clamp(MOST_LINES, MOST_LINES_EVER);
    loop {
        let found = facets(scene, tolerance.coplanar, tolerance.seal, human, with_rooms, scale);
        let levels = levels(scene, &found, human);
        let bands = bands(&found, &levels, [domain.min.y, domain.max.y], tolerance, human, scale);
        if bands.iter().all(|b| b.segments.len() <= most) {
            return (found, levels, bands, scale);
        }
        scale *= 2.0;
    }
}

/// Heights that separate storeys even without a slab: the author's, or those with much floor; and the model's top and bottom.
fn levels(scene: &Scene, found: &Facets, human: HumanScale) -> Vec<f64> {
    let structure = scene.objects.iter().filter(|o| matches!(o.role, Role::Structure | Role::Unknown));
    let bounds = structure.fold(Aabb::EMPTY, |b, o| b.union(o.bounds));
    let mut levels: Vec<f64> = scene.hints.storeys.iter().map(|s| s.elevation).collect();
    if levels.is_empty() {
        let mut floors: Vec<(f64, f64)> = Vec::new();
        let mut areas = vec![0.0; found.sheets.len()];
        for f in found.sheet_facets.iter().filter(|f| f.front && f.matter == Matter::Opaque) {
            areas[f.owner as usize] += crate::math::geom::area(&f.corners);
        }
        for (plane, area) in found.sheets.iter().map(|s| s.plane).zip(areas) {
            if plane.n.y > LEVEL_NORMAL && area > 0.0 {
                floors.push((area, plane.d / plane.n.y));
            }
        }
        floors.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        let most = floors.first().map_or(0.0, |f| f.0);
        for (area, y) in floors {
            let clear = levels.iter().all(|l: &f64| (l - y).abs() >= human.metres(LEVELS_APART));
            if clear && area >= LEVEL_SHARE * most && area >= LEAST_LEVEL * human.metre.powi(2) {
                levels.push(y);
            }
        }
    }
    for rim in [bounds.min.y, bounds.max.y] {
        if levels.iter().all(|l| (l - rim).abs() > human.metres(RIM_AWAY)) {
            levels.push(rim);
        }
    }
    levels.retain(|y| *y >= bounds.min.y - human.metre && *y <= bounds.max.y + human.metre);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

fn cells(scene: &Scene, labels: &Labels, complex: &Complex<'_>) -> Vec<Cell> {
    let open_air = if labels.regions.iter().any(|r| r.room.is_some()) { authored::open_air(scene) } else { Vec::new() };
    let pieces = pieces(complex, &labels.of_piece, labels.regions.len());
    let regions = labels.regions.iter().zip(pieces).enumerate();
    regions
        .map(|(i, (region, mut pieces))| {
            if region.outside {
                pieces.extend(around(complex.domain));
            }
            let hint = region.room.map(|r| &scene.hints.rooms[r as usize]);
            let name = match hint {
                Some(h) if !h.name.is_empty() => h.name.clone(),
                _ if region.outside => "outside".to_owned(),
                _ if region.courtyard => format!("court {i}"),
                _ => format!("cell {i}"),
            };
            let open = region.outside || region.courtyard || region.room.is_some_and(|r| open_air[r as usize]);
            Cell { name, source: hint.map(|h| h.id.clone()), open, pieces, portals: Vec::new() }
        })
        .collect()
}

fn notes(scene: &Scene, labels: &Labels, found: &Facets, unsound: &[bool], human: HumanScale) -> Vec<Note> {
    let mut notes = vec![Note::detail(format!("{} walls and {} sheets split space", found.walls.len(), found.sheets.len()))];
    notes.extend(human.note());
    for (i, room) in scene.hints.rooms.iter().enumerate().take(unsound.len()) {
        if labels.regions.iter().all(|r| r.room != Some(i as u32)) {
            let what = if unsound[i] {
                "is no cell: it is not closed, is empty or holds other rooms"
            } else {
                "holds no free space"
            };
            notes.push(Note::fault(format!("room {} ({}) {what}", room.id, room.name)));
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, SceneBuilder, Source};

    /// A box (wall, slab or panel) between two corners.
    fn add_box(builder: &mut SceneBuilder, [x, y, z]: [f64; 3], [to_x, to_y, to_z]: [f64; 3]) {
        let corner = |i: usize| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            DVec3::new(pick(0, x, to_x), pick(1, y, to_y), pick(2, z, to_z))
        };
        // Sides, counter-clockwise from outside.
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let positions = (0..8).map(corner).collect();
        let mesh = Mesh { node: "part".into(), role: Role::Structure, opaque: true, positions, triangles };
        builder.add(mesh).expect("twelve triangles");
    }

    /// A hall of 10 x 3 x 8 m. Along one wall stand two stalls of 1 x 1.5 m with shut doors; their panels leave 0.15 m below and a metre
    /// above.
    fn stalls() -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let walls = [
            ([-0.2, -0.2, -0.2], [10.2, 0.0, 8.2]),
            ([-0.2, 3.0, -0.2], [10.2, 3.2, 8.2]),
            ([-0.2, 0.0, -0.2], [0.0, 3.0, 8.2]),
            ([10.0, 0.0, -0.2], [10.2, 3.0, 8.2]),
            ([0.0, 0.0, -0.2], [10.0, 3.0, 0.0]),
            ([0.0, 0.0, 8.0], [10.0, 3.0, 8.2]),
            ([3.0, 0.15, 1.5], [5.0, 2.0, 1.53]),
        ];
        for (from, to) in walls {
            add_box(&mut builder, from, to);
        }
        for x in [3.0, 4.0, 5.0] {
            add_box(&mut builder, [x - 0.015, 0.15, 0.0], [x + 0.015, 2.0, 1.5]);
        }
        builder.finish("stalls").expect("a scene")
    }

    #[test]
    fn a_hall_that_takes_in_all_its_stalls_at_once_is_told_as_coarser() {
        let scene = stalls();
        let with = |plan_options: &PlanOptions| {
            let asked = (Strategy::Plan, "requested".to_owned());
            let found =
                from_columns(&scene, HumanScale::METRES, asked, &SplitOptions::default(), plan_options, &Job::quiet());
            found.expect("nobody stops it")
        };
        let is_told = |graph: &CellGraph| graph.notes.iter().any(|note| *note == format!("{BOUND}{JOINED_AT_ONCE}"));
        let in_pairs = with(&PlanOptions::default());
        let at_once = with(&PlanOptions { faces_in_pairs: 0, ..PlanOptions::default() });
        assert_eq!((in_pairs.cells.len(), at_once.cells.len()), (2, 2), "the hall with its stalls, and the outside");
        assert!(!is_told(&in_pairs), "{:?}", in_pairs.notes);
        assert!(is_told(&at_once), "{:?}", at_once.notes);
    }
}
