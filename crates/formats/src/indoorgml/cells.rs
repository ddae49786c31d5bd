//! IndoorGML as a finished graph: cell spaces become cells, transitions become portals.
//!
//! The solid of a cell space is split into convex pieces along its own planes ([`enfilade::cells::convex`]). Where two solids
//! overlap, one of them gets the volume, mostly the smaller, such as a cabinet inside a hall; a note reports it. The portal of a
//! transition is its cell space boundary in the file, else the surface that the two solids share. A transition without either
//! gets no portal, and a note reports it.

use super::{Boundary, IndoorGml, Transition, read};
use enfilade::CellId;
use enfilade::cells::convex::{Convex, convex_pieces, joined};
use enfilade::cells::convex_hull;
use enfilade::cells::{Cell, CellGraph, GivenError, Piece, Portal, PortalKind, PortalState, Strategy};
use enfilade::math::geom::{Aabb, Plane, area, clip, middle, newell};
use enfilade::math::parallel;
use enfilade::scene::{ImportError, Place, Scene};
use enfilade::types::note::Note;
use glam::DVec3;

/// Greatest distance of two solids' surfaces of one wall, in coplanar tolerances, and least cosine between them.
const TOGETHER: f64 = 10.0;
const SAME_PLANE_COSINE: f64 = 0.999;
/// Smaller shared surfaces, square metres, are edges.
const LEAST_SHARED: f64 = 1e-2;
/// Greatest distance of cells from a door's plane, metres, if solids of rooms leave out the wall.
const MOST_WALL: f64 = 0.5;
/// Parts of a shared surface become one portal if their hull is at most this much larger.
const LOOSE: f64 = 1.0 + 1e-3;

/// Reads an IndoorGML document. Coordinates are the model's own (metres in `scene`'s unit, +Z up in the document and +Y here);
/// the graph is relative to `scene`'s origin.
pub fn read_indoorgml(text: &str, scene: &Scene) -> Result<CellGraph, GivenError> {
    let scale = if scene.source.format == "IndoorGML" { scene.source.metres_per_unit } else { 1.0 };
    let mut model = read(text, scale)?;
    for polygon in model.spaces.iter_mut().flat_map(|s| &mut s.surface) {
        polygon.rings.iter_mut().flatten().for_each(|p| *p -= scene.origin);
        polygon.plane.d -= polygon.plane.n.dot(scene.origin);
    }
    for corner in model.transitions.iter_mut().filter_map(|t| t.boundary.as_mut()).flat_map(|b| &mut b.winding) {
        *corner -= scene.origin;
    }
    graph(&model, scene.tolerance().coplanar.max(model.coplanar()), scene.tolerance().smallest_hole())
}

fn graph(model: &IndoorGml, eps: f64, smallest_hole: f64) -> Result<CellGraph, GivenError> {
    let mut notes = model.notes.clone();
    // 1. Cells.
    let solids: Vec<Result<Vec<Convex>, String>> = parallel::map(&model.spaces, |s| convex_pieces(&s.surface, eps));
    let mut pieces: Vec<Vec<Convex>> = Vec::with_capacity(solids.len());
    for (space, solid) in model.spaces.iter().zip(solids) {
        pieces.push(solid.map_err(|what| ImportError::malformed(Place::File, format!("cell space {}: {what}", space.id)))?);
    }
    resolve_overlaps(model, &mut pieces, eps, &mut notes);
    let mut place: Vec<Option<CellId>> = Vec::with_capacity(pieces.len());
    let mut cells = Vec::new();
    for (space, solid) in model.spaces.iter().zip(&pieces) {
        place.push((!solid.is_empty()).then_some(CellId(cells.len() as u32)));
        if solid.is_empty() {
            notes.push(Note::fault(format!("cell space {} has no volume of its own; left out", space.id)));
        } else {
            let piece = |c: &Convex| Piece { planes: c.planes(), bounds: c.bounds() };
            let pieces = solid.iter().map(piece).collect();
            let (name, source) = (space.name.clone(), Some(space.id.clone()));
            cells.push(Cell { name, source, open: false, pieces, portals: Vec::new() });
        }
    }
    // 2. Portals.
    let mut portals = Vec::new();
    for transition in &model.transitions {
        let [Some(a), Some(b)] = transition.cells.map(|i| place[i]) else { continue };
        let solids = transition.cells.map(|i| pieces[i].as_slice());
        let (windings, kind, source) = match &transition.boundary {
            Some(door) => {
                let found: Vec<_> = drawn(door, solids, eps).into_iter().collect();
                let kind = if door.door { PortalKind::Door } else { PortalKind::Opening };
                (found, kind, &door.id)
            }
            None => (shared(solids, eps), PortalKind::Opening, &transition.id),
        };
        if windings.is_empty() {
            notes.push(Note::fault(note_without_portal(model, transition)));
        }
        portals.extend(windings.into_iter().map(|(plane, winding)| Portal {
            cells: [a, b],
            plane,
            winding,
            kind,
            state: PortalState::of_kind(kind),
            source: Some(source.clone()),
        }));
    }
    let reason = format!("the document has {} cell spaces and {} transitions", model.spaces.len(), model.transitions.len());
    let mut graph =
        CellGraph { strategy: Strategy::Given, reason, cells, portals, smallest_hole, closed_holes: Vec::new(), notes };
    graph.link();
    Ok(graph)
}

/// Gives the overlap of two solids to one of them: to the one whose surface has the door between them, if the other reaches
/// beyond it, else to the smaller (of equal ones, the earlier).
fn resolve_overlaps(model: &IndoorGml, solids: &mut [Vec<Convex>], eps: f64, notes: &mut Vec<Note>) {
    let volume = |solid: &[Convex]| solid.iter().map(Convex::volume).sum::<f64>();
    let volumes: Vec<f64> = solids.iter().map(|s| volume(s)).collect();
    let boxes: Vec<Aabb> = solids.iter().map(|s| s.iter().fold(Aabb::EMPTY, |b, c| b.union(c.bounds()))).collect();
    let mut order: Vec<usize> = (0..solids.len()).collect();
    order.sort_by(|&a, &b| volumes[a].total_cmp(&volumes[b]).then(a.cmp(&b)));
    let pairs = order.iter().enumerate().flat_map(|(rank, &large)| order[..rank].iter().map(move |&small| (small, large)));
    for (small, large) in pairs.filter(|&(small, large)| boxes[small].touches(&boxes[large])) {
        let deep = |solid: &[Convex], p: DVec3| solid.iter().any(|c| c.faces.iter().all(|f| f.0.distance(p) < -eps));
        let between = model.transitions.iter().filter(|t| t.cells == [small, large] || t.cells == [large, small]);
        let mut doors = between.filter_map(|t| t.boundary.as_ref()).map(|door| middle(&door.winding));
        let beyond = doors.any(|p| deep(&solids[small], p) && !deep(&solids[large], p));
        let (winner, other) = if beyond { (large, small) } else { (small, large) };
        let (mut rest, mut shares) = (solids[other].clone(), false);
        for piece in &solids[winner] {
            let less = |resolve_overlaps: Convex| {
                let left = resolve_overlaps.less(piece, eps);
                shares |= left.is_some();
                left.unwrap_or_else(|| vec![resolve_overlaps])
            };
            rest = rest.into_iter().flat_map(less).collect();
        }
        if shares {
            let taken = volume(&solids[other]) - volume(&rest);
            solids[other] = joined(rest, eps);
            let id = |i: usize| &model.spaces[i].id;
            let what = format!("{} and {} overlap in {taken:.2} m3; {} keeps it", id(small), id(large), id(winner));
            notes.push(Note::taken(what));
        }
    }
}

fn note_without_portal(model: &IndoorGml, transition: &Transition) -> String {
    let [a, b] = transition.cells.map(|i| &model.spaces[i].id);
    match &transition.boundary {
        Some(door) => {
            format!("transition {}: its boundary {} is not between {a} and {b}; no portal", transition.id, door.id)
        }
        None => format!("transition {}: {a} and {b} share no surface, and it has no boundary; no portal", transition.id),
    }
}

/// A door of the file, oriented from the first solid to the second; `None` if it is not between them.
fn drawn(door: &Boundary, [from, to]: [&[Convex]; 2], eps: f64) -> Option<(Plane, Vec<DVec3>)> {
    let centre = middle(&door.winding);
    let local: Vec<DVec3> = door.winding.iter().map(|&p| p - centre).collect();
    let plane = Plane::through(centre, newell(&local).try_normalize()?);
    let holds = |solid: &[Convex], p: DVec3| solid.iter().any(|c| c.faces.iter().all(|(plane, _)| plane.distance(p) <= eps));
    // Just past the door, or past the wall around it.
    let leads = |n: DVec3| {
        let steps = [4.0 * eps, 0.1 * MOST_WALL, 0.5 * MOST_WALL, MOST_WALL];
        let reaches = |solid, way: DVec3| steps.iter().any(|step| holds(solid, centre + way * *step));
        reaches(from, -n) && reaches(to, n)
    };
    if leads(plane.n) {
        Some((plane, door.winding.clone()))
    } else if leads(-plane.n) {
        Some((plane.flipped(), door.winding.iter().rev().copied().collect()))
    } else {
        None
    }
}

/// The surfaces that two solids share, oriented from the first to the second, merged into few convex parts.
fn shared([from, to]: [&[Convex]; 2], eps: f64) -> Vec<(Plane, Vec<DVec3>)> {
    let mut parts: Vec<(Plane, Vec<DVec3>)> = Vec::new();
    for a in from {
        let near = a.bounds().inflated(TOGETHER * eps);
        for b in to.iter().filter(|b| near.touches(&b.bounds())) {
            for (plane, winding) in &a.faces {
                for (other, outline) in &b.faces {
                    let facing = plane.n.dot(other.n) < -SAME_PLANE_COSINE;
                    if !facing || outline.iter().any(|&p| plane.distance(p).abs() > TOGETHER * eps) {
                        continue;
                    }
                    let common = within(winding, outline, other.n);
                    if common.len() >= 3 && area(&common) > LEAST_SHARED {
                        parts.push((*plane, common));
                    }
                }
            }
        }
    }
    let mut i = 0;
    while i < parts.len() {
        let found = (i + 1..parts.len()).find_map(|j| union(&parts[i], &parts[j], eps).map(|whole| (j, whole)));
        match found {
            Some((j, whole)) => {
                parts.remove(j);
                parts[i].1 = whole;
                i = 0;
            }
            None => i += 1,
        }
    }
    parts
}

/// The part of a winding above an outline that is counter-clockwise about `n`.
fn within(winding: &[DVec3], outline: &[DVec3], n: DVec3) -> Vec<DVec3> {
    let mut rest = winding.to_vec();
    for (k, &a) in outline.iter().enumerate() {
        let Some(out) = (outline[(k + 1) % outline.len()] - a).cross(n).try_normalize() else { continue };
        rest = clip(&rest, &Plane::through(a, out), 0.0);
        if rest.is_empty() {
            break;
        }
    }
    rest
}

/// The union of two coplanar windings, if it is convex.
fn union((plane, a): &(Plane, Vec<DVec3>), (other, b): &(Plane, Vec<DVec3>), eps: f64) -> Option<Vec<DVec3>> {
    let close = Aabb::of(a.iter().copied()).inflated(eps).touches(&Aabb::of(b.iter().copied()));
    if !close || plane.n.dot(other.n) < SAME_PLANE_COSINE || b.iter().any(|&p| plane.distance(p).abs() > eps) {
        return None;
    }
    let centre = middle(a);
    let (u, v) = plane.n.any_orthonormal_pair();
    let (u, v) = if u.cross(v).dot(plane.n) > 0.0 { (u, v) } else { (v, u) };
    let flat = a.iter().chain(b).map(|&p| glam::DVec2::new((p - centre).dot(u), (p - centre).dot(v)));
    let lift = |q: glam::DVec2| centre - plane.n * plane.distance(centre) + u * q.x + v * q.y;
    let hull: Vec<DVec3> = convex_hull(flat.collect()).into_iter().map(lift).collect();
    (area(&hull) <= LOOSE * (area(a) + area(b))).then_some(hull)
}
