//! Cells and portals that someone gives: `--cells-file`, in the form that `enfilade dump --json` writes (docs/cli.md).
//!
//! Checked here is what the graph's types promise: ids, numbers, pieces with a volume, windings that are planar and convex and
//! lie between their two cells. Whether the cells fit the model is for the validator that every strategy's graph goes through.

use crate::CellId;
use crate::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy, polyhedron};
use crate::geom::{Aabb, Plane, area, middle, newell};
use crate::scene::Scene;
use crate::tolerance::Tolerance;
use glam::DVec3;
use serde::Deserialize;

/// A shorter normal has no direction that can be relied on.
const LEAST_NORMAL: f64 = 1e-6;

/// Why a cells file can't be used. One line; the command line puts the path before it.
#[derive(Debug, thiserror::Error)]
pub enum GivenError {
    /// Not JSON, or not of the right form: the message ends with line and column.
    #[error("{0}; see docs/cli.md for the form of a cells file")]
    Json(#[from] serde_json::Error),
    /// Not IndoorGML, or broken.
    #[error(transparent)]
    IndoorGml(#[from] crate::scene::ImportError),
    /// A field breaks a rule.
    #[error("{field}: {what}")]
    Field {
        /// Where, as in `cells[3].pieces[0].planes[2]`.
        field: String,
        /// What is wrong, and what to do.
        what: String,
    },
}

impl GivenError {
    pub(in crate::cells) fn at(field: String, what: impl Into<String>) -> Self {
        Self::Field { field, what: what.into() }
    }
}

/// Coordinates, metres: beyond this they mean nothing, as in [`crate::scene::SceneBuilder`].
const MAX_COORDINATE: f64 = 1e12;

#[derive(Deserialize)]
struct GivenFile {
    cells: Vec<GivenCell>,
    #[serde(default)]
    portals: Vec<GivenPortal>,
}

#[derive(Deserialize)]
struct GivenCell {
    id: u32,
    #[serde(default)]
    open: bool,
    name: Option<String>,
    source: Option<String>,
    pieces: Option<Vec<GivenPiece>>,
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(in crate::cells) struct GivenPiece {
    planes: Option<Vec<[f64; 4]>>,
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct GivenPortal {
    id: Option<u32>,
    cells: [u32; 2],
    winding: Vec<[f64; 3]>,
    kind: Option<PortalKind>,
    state: Option<GivenState>,
    source: Option<String>,
}

/// What is left out is as the portal's kind has it.
#[derive(Default, Deserialize)]
struct GivenState {
    shut: Option<bool>,
    see_through: Option<bool>,
    closable: Option<bool>,
    ajar: Option<bool>,
}

/// Reads cells and portals in the model's own coordinates (metres, +Y up); the graph is relative to `scene`'s origin. Windings
/// may run either way round; the graph's run as the crate root says.
pub fn read_cells(json: &str, scene: &Scene) -> Result<CellGraph, GivenError> {
    let file: GivenFile = serde_json::from_str(json)?;
    let reader = Reader::new(scene);
    if file.cells.is_empty() {
        return Err(GivenError::at("cells".into(), "none; give one cell at least"));
    }
    let cells = file.cells.into_iter().enumerate().map(|(i, c)| reader.cell(i, c)).collect::<Result<Vec<_>, _>>()?;
    let portals =
        file.portals.into_iter().enumerate().map(|(i, p)| reader.portal(i, p, &cells)).collect::<Result<_, _>>()?;
    let mut graph = CellGraph {
        strategy: Strategy::Given,
        reason: "cells and portals were given".into(),
        cells,
        portals,
        smallest_hole: reader.tolerance.smallest_hole(),
        closed_holes: Vec::new(),
        notes: Vec::new(),
    };
    graph.link();
    Ok(graph)
}

/// Checks what is given, and moves it to the scene's origin.
pub(in crate::cells) struct Reader {
    origin: DVec3,
    tolerance: Tolerance,
}

impl Reader {
    pub fn new(scene: &Scene) -> Self {
        Self { origin: scene.origin, tolerance: scene.tolerance() }
    }

    fn cell(&self, i: usize, cell: GivenCell) -> Result<Cell, GivenError> {
        let field = format!("cells[{i}]");
        if cell.id as usize != i {
            return Err(GivenError::at(format!("{field}.id"), format!("{}; ids count up from 0, so give {i}", cell.id)));
        }
        let pieces = self.pieces(field, cell.pieces, cell.min, cell.max)?;
        let name = cell.name.unwrap_or_else(|| format!("cell {i}"));
        Ok(Cell { name, source: cell.source, open: cell.open, pieces, portals: Vec::new() })
    }

    /// The pieces of a cell that is given as pieces or as a box.
    pub fn pieces(
        &self,
        field: String,
        pieces: Option<Vec<GivenPiece>>,
        min: Option<[f64; 3]>,
        max: Option<[f64; 3]>,
    ) -> Result<Vec<Piece>, GivenError> {
        let pieces = match (pieces, min, max) {
            (Some(pieces), None, None) => pieces
                .into_iter()
                .enumerate()
                .map(|(k, piece)| self.piece(format!("{field}.pieces[{k}]"), piece))
                .collect::<Result<Vec<_>, _>>()?,
            (None, min, max) => vec![self.piece(field.clone(), GivenPiece { planes: None, min, max })?],
            _ => {
                return Err(GivenError::at(field, "both pieces and a box; give one of them"));
            }
        };
        if pieces.is_empty() {
            return Err(GivenError::at(format!("{field}.pieces"), "none; give one piece at least"));
        }
        Ok(pieces)
    }

    fn piece(&self, field: String, piece: GivenPiece) -> Result<Piece, GivenError> {
        let planes = match (piece.planes, piece.min, piece.max) {
            (Some(planes), None, None) => planes
                .into_iter()
                .enumerate()
                .map(|(k, plane)| self.plane(format!("{field}.planes[{k}]"), plane))
                .collect::<Result<Vec<_>, _>>()?,
            (None, Some(min), Some(max)) => {
                let (min, max) = (self.point(&format!("{field}.min"), min)?, self.point(&format!("{field}.max"), max)?);
                DVec3::AXES.iter().flat_map(|&n| [Plane { n, d: n.dot(max) }, Plane { n: -n, d: -n.dot(min) }]).collect()
            }
            _ => return Err(GivenError::at(field, "give either planes, or min and max")),
        };
        if planes.len() > polyhedron::MAX_PLANES {
            let what = format!("{} planes, at most {}; split the piece", planes.len(), polyhedron::MAX_PLANES);
            return Err(GivenError::at(field, what));
        }
        match polyhedron::bounds(&planes, self.tolerance.coplanar) {
            Some(bounds) => Ok(Piece { planes, bounds }),
            None => Err(GivenError::at(field, "no volume; planes are [nx, ny, nz, d] with the piece where n.p <= d")),
        }
    }

    /// A half-space, moved to the scene's origin, its normal made a unit vector.
    fn plane(&self, field: String, [x, y, z, d]: [f64; 4]) -> Result<Plane, GivenError> {
        let n = DVec3::new(x, y, z);
        let length = n.length();
        if !(length.is_finite() && length > LEAST_NORMAL && (d / length).abs() <= MAX_COORDINATE) {
            return Err(GivenError::at(field, "no plane; give [nx, ny, nz, d] with a normal of length 1"));
        }
        let n = n / length;
        Ok(Plane { n, d: d / length - n.dot(self.origin) })
    }

    fn point(&self, field: &str, p: [f64; 3]) -> Result<DVec3, GivenError> {
        let p = DVec3::from_array(p);
        if p.abs().max_element() > MAX_COORDINATE {
            return Err(GivenError::at(field.to_owned(), "coordinates beyond 1e12 m"));
        }
        Ok(p - self.origin)
    }

    fn portal(&self, i: usize, portal: GivenPortal, cells: &[Cell]) -> Result<Portal, GivenError> {
        let field = format!("portals[{i}]");
        if let Some(id) = portal.id.filter(|&id| id as usize != i) {
            return Err(GivenError::at(format!("{field}.id"), format!("{id}; ids count up from 0, so give {i}")));
        }
        if let Some(id) = portal.cells.iter().find(|&&id| id as usize >= cells.len()) {
            let what = format!("no cell {id}; ids end at {}", cells.len() - 1);
            return Err(GivenError::at(format!("{field}.cells"), what));
        }
        if portal.cells[0] == portal.cells[1] {
            return Err(GivenError::at(format!("{field}.cells"), "a portal joins two different cells"));
        }
        let mut winding = Vec::with_capacity(portal.winding.len());
        for (k, &p) in portal.winding.iter().enumerate() {
            winding.push(self.point(&format!("{field}.winding[{k}]"), p)?);
        }
        let mut plane = self.winding_plane(&format!("{field}.winding"), &winding)?;
        let sides = portal.cells.map(|id| &cells[id as usize]);
        if !self.leads(&winding, &plane, sides) {
            if !self.leads(&winding, &plane.flipped(), sides) {
                let [a, b] = portal.cells;
                let what = format!("the winding's middle is not where cells {a} and {b} meet; move it there");
                return Err(GivenError::at(field, what));
            }
            winding.reverse();
            plane = plane.flipped();
        }
        let kind = portal.kind.unwrap_or(PortalKind::Opening);
        let (given, usual) = (portal.state.unwrap_or_default(), PortalState::of_kind(kind));
        let state = PortalState {
            shut: given.shut.unwrap_or(usual.shut),
            see_through: given.see_through.unwrap_or(usual.see_through),
            closable: given.closable.unwrap_or(usual.closable),
            ajar: given.ajar.unwrap_or(usual.ajar),
        };
        if state.shut && !state.closable {
            return Err(GivenError::at(format!("{field}.state"), "shut, but not closable; say closable: true"));
        }
        if state.ajar && !state.shut {
            return Err(GivenError::at(format!("{field}.state"), "ajar, but not shut; say shut: true"));
        }
        Ok(Portal { cells: portal.cells.map(CellId), plane, winding, kind, state, source: portal.source })
    }

    /// The plane of a winding, which must be planar and convex.
    fn winding_plane(&self, field: &str, winding: &[DVec3]) -> Result<Plane, GivenError> {
        let error = |what: String| Err(GivenError::at(field.to_owned(), what));
        if winding.len() < 3 {
            return error(format!("{} corners; give 3 at least", winding.len()));
        }
        let eps = self.tolerance.coplanar;
        let centre = middle(winding);
        let local: Vec<DVec3> = winding.iter().map(|&p| p - centre).collect();
        if area(&local) <= eps * Aabb::of(local.iter().copied()).diagonal() {
            return error("no area; give the corners in order around the portal".into());
        }
        let plane = Plane::through(centre, newell(&local).normalize());
        if let Some(k) = winding.iter().position(|&p| plane.distance(p).abs() > eps) {
            let off = plane.distance(winding[k]).abs();
            return error(format!("corner {k} is {off:.6} m off the plane of the others; split the portal"));
        }
        for (k, &a) in local.iter().enumerate() {
            let edge = local[(k + 1) % local.len()] - a;
            let inwards = plane.n.cross(edge).normalize_or_zero();
            if local.iter().any(|&p| inwards.dot(p - a) < -eps) {
                return error(format!("not convex at edge {k}; split the portal"));
            }
        }
        Ok(plane)
    }

    /// Whether a step along the normal from the winding's middle is in the second cell, and a step back in the first.
    fn leads(&self, winding: &[DVec3], plane: &Plane, [from, to]: [&Cell; 2]) -> bool {
        let holds = |cell: &Cell, p| cell.pieces.iter().any(|piece| piece.contains(p, self.tolerance.clearance));
        let centre = middle(winding);
        // A step that is long beside `clearance` and short beside the cell; in a large room a longer one is safer.
        let short = 4.0 * self.tolerance.clearance;
        [short, short.max(1e-3 * area(winding).sqrt())]
            .iter()
            .any(|&step| holds(to, centre + plane.n * step) && holds(from, centre - plane.n * step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Object, Role, Source};

    /// One triangle 10 m across around (1000, 0, 0).
    fn scene() -> Scene {
        let positions = vec![DVec3::new(-5., 0., -5.), DVec3::new(5., 0., -5.), DVec3::new(5., 3., 5.)];
        let bounds = Aabb::of(positions.iter().copied());
        let (node, role, triangles, segments) = ("floor".into(), Role::Structure, 0..1, 0..0);
        let object = Object { node, role, opaque: true, glass: false, triangles, segments, bounds };
        Scene {
            name: "test".into(),
            source: Source::default(),
            origin: DVec3::new(1000., 0., 0.),
            positions,
            triangles: vec![[0, 1, 2]],
            objects: vec![object],
            tubes: Default::default(),
            hints: Default::default(),
            trace: None,
        }
    }

    /// Two rooms of 4 x 3 x 4 m on either side of x = 1000, and a door between them with its corners in this order.
    fn rooms(winding: &str) -> String {
        format!(
            r#"{{"cells": [{{"id": 0, "min": [996, 0, -2], "max": [1000, 3, 2]}},
                          {{"id": 1, "name": "hall", "open": true, "pieces": [{{"min": [1000, 0, -2], "max": [1004, 3, 2]}}]}}],
                 "portals": [{{"cells": [0, 1], "winding": {winding}, "kind": "door"}}]}}"#
        )
    }

    const DOOR: &str = "[[1000, 0, -0.5], [1000, 2, -0.5], [1000, 2, 0.5], [1000, 0, 0.5]]";

    fn message(json: &str) -> String {
        read_cells(json, &scene()).expect_err("must be refused").to_string()
    }

    #[test]
    fn windings_are_turned_to_lead_from_the_first_cell_to_the_second() {
        let other_way = "[[1000, 0, 0.5], [1000, 2, 0.5], [1000, 2, -0.5], [1000, 0, -0.5]]";
        for winding in [DOOR, other_way] {
            let graph = read_cells(&rooms(winding), &scene()).unwrap();
            let portal = &graph.portals[0];
            assert_eq!((portal.plane.n, portal.plane.d), (DVec3::X, 0.0));
            assert!(newell(&portal.winding).dot(DVec3::X) > 0.0);
            assert_eq!((portal.kind, portal.state), (PortalKind::Door, PortalState::of_kind(PortalKind::Door)));
            assert_eq!(graph.cells[0].portals.len() + graph.cells[1].portals.len(), 2);
        }
    }

    #[test]
    fn states_are_taken_and_what_they_leave_out_is_the_kinds() {
        let json = rooms(DOOR).replace(r#""kind": "door""#, r#""kind": "door", "state": {"shut": true}"#);
        let state = read_cells(&json, &scene()).unwrap().portals[0].state;
        assert_eq!(state, PortalState { shut: true, see_through: false, closable: true, ajar: false });
    }

    #[test]
    fn coordinates_become_relative_to_the_origin() {
        let graph = read_cells(&rooms(DOOR), &scene()).unwrap();
        assert_eq!(graph.cells[0].pieces[0].bounds.min, DVec3::new(-4., 0., -2.));
        assert_eq!(graph.cells[1].pieces[0].bounds.max, DVec3::new(4., 3., 2.));
        assert_eq!((graph.cells[1].name.as_str(), graph.cells[1].open, graph.cells[0].open), ("hall", true, false));
        // A half-space 2 * x <= 2004, that is x <= 1002, which nothing bounds elsewhere.
        let half = r#"{"cells": [{"id": 0, "pieces": [{"planes": [[2, 0, 0, 2004]]}]}]}"#;
        let piece = &read_cells(half, &scene()).unwrap().cells[0].pieces[0];
        assert_eq!((piece.planes[0].n, piece.planes[0].d, piece.bounds.max.x), (DVec3::X, 2.0, 2.0));
        assert!(piece.bounds.min.x.is_infinite() && piece.bounds.max.y.is_infinite());
    }

    #[test]
    fn each_rule_is_refused_with_its_field() {
        for (json, expected) in [
            (r#"{"cells": ["#.to_owned(), "line 1 column 11"),
            (r#"{"cells": [{"id": "a"}]}"#.to_owned(), "line 1 column 21"),
            (r#"{"cells": []}"#.to_owned(), "cells: none"),
            (rooms(DOOR).replace(r#""id": 1"#, r#""id": 2"#), "cells[1].id: 2; ids count up from 0, so give 1"),
            (rooms(DOOR).replace("[0, 1]", "[0, 2]"), "portals[0].cells: no cell 2"),
            (rooms(DOOR).replace("[0, 1]", "[1, 1]"), "portals[0].cells: a portal joins two different cells"),
            (rooms(DOOR).replace("[1004, 3, 2]", "[1000, 3, 2]"), "cells[1].pieces[0]: no volume"),
            (rooms(DOOR).replace(r#", "max": [1000, 3, 2]"#, ""), "cells[0]: give either planes, or min and max"),
            (rooms(DOOR).replace("[996, 0, -2]", "[-1e13, 0, -2]"), "cells[0].min: coordinates beyond"),
            (rooms("[[1000, 0, 0], [1000, 2, 0]]"), "portals[0].winding: 2 corners"),
            (rooms("[[1000, 0, 0], [1000, 1, 0], [1000, 2, 0]]"), "portals[0].winding: no area"),
            (rooms(&DOOR.replace("[1000, 2, 0.5]", "[1000.1, 2, 0.5]")), "off the plane"),
            (rooms("[[1000,0,0], [1000,2,0], [1000,0.5,0.5], [1000,0,2]]"), "not convex"),
            (
                rooms(DOOR).replace(r#""kind": "door""#, r#""state": {"shut": true}"#),
                "portals[0].state: shut, but not closable",
            ),
            (rooms(&DOOR.replace("1000", "1002")), "portals[0]: the winding's middle is not where cells 0 and 1 meet"),
            (
                r#"{"cells": [{"id": 0, "pieces": [{"planes": [[0, 0, 0, 1]]}]}]}"#.to_owned(),
                "cells[0].pieces[0].planes[0]: no plane",
            ),
        ] {
            let message = message(&json);
            assert!(message.contains(expected), "{message} / {expected}");
            assert!(!message.contains('\n'));
        }
    }
}
