//! A scene into cells: the column complex, a labelling, and the graph.

use super::complex::arrange::arrange;
use super::complex::assemble::{Complex, around, pieces, portals};
use super::complex::columns::columns;
use super::complex::faces::faces;
use super::complex::facets::{Facets, facets};
use super::complex::{Human, lift};
use super::rooms::{Labels, label};
use super::volume::volume;
use super::{Cell, CellGraph, Portal, PortalKind, Strategy, authored};
use crate::geom::{Aabb, middle};
use crate::scene::{OpeningKind, Role, Scene};
use glam::DVec3;

/// A door's leaf that stands open in a deep reveal is at most this far from the doorway's portal, metres.
const LEAF_AWAY: f64 = 0.5;

/// How to split.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SplitOptions {
    /// `None` lets the scene decide.
    pub strategy: Option<Strategy>,
    /// Edge of a voxel, metres, for [`Strategy::Volume`]; `None` takes what fits the scene.
    pub voxel: Option<f64>,
}

/// Why a scene can't be split as asked.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SplitError {
    /// `authored` was asked for and the model names no rooms.
    #[error("the model names no rooms; use --cells plan")]
    NoRooms,
    /// Cells that the user gives aren't found by splitting.
    #[error("given cells come from a cells file")]
    Given,
}

/// Splits a scene into cells and portals.
pub fn split(scene: &Scene, options: &SplitOptions) -> Result<CellGraph, SplitError> {
    let tolerance = scene.tolerance();
    let human = Human::for_extent(scene.bounds().diagonal());
    let has_rooms = !scene.hints.rooms.is_empty();
    let (strategy, reason) = match options.strategy {
        Some(Strategy::Authored) if !has_rooms => return Err(SplitError::NoRooms),
        Some(Strategy::Given) => return Err(SplitError::Given),
        Some(s) => (s, "asked for".to_owned()),
        None if has_rooms => (Strategy::Authored, format!("the model names {} rooms", scene.hints.rooms.len())),
        None => (Strategy::Plan, "the model names no rooms; walls and floors do".to_owned()),
    };
    if strategy == Strategy::Volume {
        let mut graph = volume(scene, human, options.voxel, reason);
        name_openings(scene, &mut graph.portals, human);
        graph.link();
        return Ok(graph);
    }
    let with_rooms = strategy == Strategy::Authored;

    // 1. Planes, plan, pieces.
    let bounds = scene.bounds();
    let domain = bounds.inflated((0.05 * bounds.diagonal()).min(3.0 * human.metre));
    let found = facets(scene, tolerance.coplanar, tolerance.seal, human, with_rooms);
    let plan = arrange(&found, domain, tolerance.coplanar, 0.03 * human.metre);
    let levels = levels(scene, &found, human);
    let columns = columns(&plan, &found, domain, tolerance.coplanar, &levels, 0.45 * human.metre);
    // 2. What is open between them.
    let faces = faces(&plan, &columns, &found, tolerance.coplanar, tolerance.seal);
    // 3. Labels.
    let rooms = if with_rooms {
        let centres: Vec<DVec3> = (0..columns.pieces() as u32)
            .map(|p| {
                let (column, _) = columns.of_piece(p);
                let q = plan.triangles[column].iter().map(|&i| plan.points[i as usize]).sum::<glam::DVec2>() / 3.0;
                let (floor, ceiling) = columns.heights(p);
                lift(q, (0..3).map(|i| floor[i] + ceiling[i]).sum::<f64>() / 6.0)
            })
            .collect();
        authored::rooms_of(&centres, &scene.hints)
    } else {
        vec![None; columns.pieces()]
    };
    let labels = label(&plan, &columns, &faces, &found, human, tolerance.seal, &rooms, !scene.hints.storeys.is_empty());
    // 4. The graph.
    let complex = Complex { plan: &plan, columns: &columns, facets: &found, faces: &faces, levels: &levels, domain };
    let mut graph = CellGraph {
        strategy,
        reason,
        cells: cells(scene, &labels, &complex),
        portals: portals(&complex, &labels.of_piece, tolerance.seal),
        smallest_hole: tolerance.smallest_hole(),
        notes: notes(scene, &labels, &found, human),
    };
    name_openings(scene, &mut graph.portals, human);
    graph.link();
    Ok(graph)
}

/// Heights that part storeys even where no slab does: the author's, or those with much floor; and the model's own rims.
fn levels(scene: &Scene, found: &Facets, human: Human) -> Vec<f64> {
    let structure = scene.objects.iter().filter(|o| matches!(o.role, Role::Structure | Role::Unknown));
    let bounds = structure.fold(Aabb::EMPTY, |b, o| b.union(o.bounds));
    let mut levels: Vec<f64> = scene.hints.storeys.iter().map(|s| s.elevation).collect();
    if levels.is_empty() {
        let mut floors: Vec<(f64, f64)> = Vec::new();
        for sheet in 0..found.sheets.len() as u32 {
            let plane = found.sheets[sheet as usize].plane;
            let of_sheet = found.sheet_facets.iter().filter(|f| f.owner == sheet && f.front && f.opaque);
            let area: f64 = of_sheet.map(|f| crate::geom::area(&f.corners)).sum();
            if plane.n.y > 0.999 && area > 0.0 {
                floors.push((area, plane.d / plane.n.y));
            }
        }
        floors.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.total_cmp(&b.1)));
        let most = floors.first().map_or(0.0, |f| f.0);
        for (area, y) in floors {
            let clear = levels.iter().all(|l: &f64| (l - y).abs() >= 2.2 * human.metre);
            if clear && area >= 0.15 * most && area >= 8.0 * human.metre.powi(2) {
                levels.push(y);
            }
        }
    }
    for rim in [bounds.min.y, bounds.max.y] {
        if levels.iter().all(|l| (l - rim).abs() > 0.5 * human.metre) {
            levels.push(rim);
        }
    }
    levels.retain(|y| *y >= bounds.min.y - human.metre && *y <= bounds.max.y + human.metre);
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

fn cells(scene: &Scene, labels: &Labels, complex: &Complex<'_>) -> Vec<Cell> {
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
                _ => format!("cell {i}"),
            };
            let open = region.outside || hint.is_some_and(|h| h.outside);
            Cell { name, source: hint.map(|h| h.id.clone()), open, pieces, portals: Vec::new() }
        })
        .collect()
}

fn notes(scene: &Scene, labels: &Labels, found: &Facets, human: Human) -> Vec<String> {
    let mut notes = vec![format!("{} walls and {} sheets make cuts", found.walls.len(), found.sheets.len())];
    if human.metre != 1.0 {
        notes.push(format!("the model is plainly not in metres: a person's metre is taken as {} units", human.metre));
    }
    for (i, room) in scene.hints.rooms.iter().enumerate() {
        if !labels.regions.is_empty() && labels.regions.iter().any(|r| r.room.is_some()) {
            let found = labels.regions.iter().any(|r| r.room == Some(i as u32));
            if !found {
                notes.push(format!("room {} ({}) holds no free space", room.id, room.name));
            }
        }
    }
    notes
}

/// Doors and windows by the author's word, or by what hangs in the opening.
fn name_openings(scene: &Scene, portals: &mut [Portal], human: Human) {
    let hinted = scene.hints.openings.iter().map(|o| {
        let around = Aabb::of(o.winding.iter().copied()).inflated(0.5 * o.thickness + 0.1 * human.metre);
        (around, o.kind, o.id.as_str(), 0.0)
    });
    let hung = scene.objects.iter().filter_map(|o| {
        let kind = match o.role {
            Role::Door => OpeningKind::Door,
            Role::Window => OpeningKind::Window,
            _ => return None,
        };
        Some((o.bounds.inflated(0.2 * human.metre), kind, o.node.as_str(), LEAF_AWAY * human.metre))
    });
    let bounds: Vec<Aabb> = portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
    let upright: Vec<bool> = portals.iter().map(|p| p.plane.n.y.abs() < 0.7).collect();
    for (around, kind, id, away) in hinted.chain(hung) {
        let (kind, found): (_, Vec<usize>) = match kind {
            OpeningKind::Virtual => continue,
            // A leaf may stand open beside the doorway, and the portal lie on the wall's far side.
            OpeningKind::Door => {
                let near = (0..portals.len()).filter(|&i| upright[i]).map(|i| (around.gap(&bounds[i]), i));
                let near: Vec<(f64, usize)> = near.filter(|n| n.0 <= away).collect();
                let nearest = near.iter().fold(f64::INFINITY, |a, n| a.min(n.0));
                (PortalKind::Door, near.into_iter().filter(|n| n.0 <= nearest).map(|n| n.1).collect())
            }
            _ => {
                let within = |&i: &usize| around.contains(middle(&portals[i].winding)) && (upright[i] || away > 0.0);
                let kind = if kind == OpeningKind::Window { PortalKind::Window } else { PortalKind::Opening };
                (kind, (0..portals.len()).filter(within).collect())
            }
        };
        for i in found {
            if portals[i].source.is_none() {
                (portals[i].kind, portals[i].source) = (kind, Some(id.to_owned()));
            }
        }
    }
}
