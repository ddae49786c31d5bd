//! The user's cells and portals: `--cells FILE`, in the form that `enfilade dump --json` writes (docs/cli.md).
//!
//! The reader checks the invariants of the graph's types: ids, numbers, pieces with a volume, windings that are planar and convex and lie
//! between their two cells. The validator, which checks the graph of every strategy, tests whether the cells fit the model.

mod planes;

use crate::CellId;
use crate::cells::f32_rounding::{DECIMAL, SINGLE_UNIT, held, moved_back, unit};
use crate::cells::validate::lie_between;
use crate::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use crate::math::geom::{Plane, area, middle, newell};
use crate::math::polyhedron;
use crate::math::tolerance::{Tolerance, single_precision};
use crate::scene::Scene;
use glam::DVec3;
use serde::Deserialize;

/// A shorter normal has no reliable direction.
const LEAST_NORMAL: f64 = 1e-6;

/// Numbers are equal within this relative difference, the loss in writing decimals.
const SAME: f64 = 1e-9;

/// Threshold on the total turn of a winding, between one circle and two.
const BETWEEN_ROUNDS: f64 = 1.5 * std::f64::consts::TAU;

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
        /// The place, as in `cells[3].pieces[0].planes[2]`.
        field: String,
        /// The fault and the remedy.
        what: String,
    },
}

impl GivenError {
    pub(in crate::cells) fn at(field: String, what: impl Into<String>) -> Self {
        Self::Field { field, what: what.into() }
    }
}

/// Largest coordinate, metres, as in [`crate::scene::SceneBuilder`].
const MAX_COORDINATE: f64 = 1e12;

#[derive(Deserialize)]
struct GivenFile {
    cells: Vec<GivenCell>,
    #[serde(default)]
    portals: Vec<GivenPortal>,
    strategy: Option<Strategy>,
    smallest_hole: Option<f64>,
    #[serde(default)]
    closed_holes: Vec<Vec<[f64; 3]>>,
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
    plane: Option<[f64; 4]>,
    winding: Vec<[f64; 3]>,
    kind: Option<PortalKind>,
    state: Option<GivenState>,
    source: Option<String>,
}

/// Missing fields follow the portal's kind.
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
    let stated: Vec<bool> = file.portals.iter().map(|p| p.plane.is_some()).collect();
    let portals =
        file.portals.into_iter().enumerate().map(|(i, p)| reader.portal(i, p, cells.len())).collect::<Result<_, _>>()?;
    let holes = file.closed_holes.iter().enumerate();
    let closed_holes =
        holes.map(|(i, hole)| reader.winding(&format!("closed_holes[{i}]"), hole)).collect::<Result<_, _>>()?;
    let smallest_hole = reader.smallest_hole(file.smallest_hole)?;
    let (strategy, notes) = (file.strategy.unwrap_or(Strategy::Given), Vec::new());
    let reason = "cells and portals were given".into();
    let mut graph = CellGraph { strategy, reason, cells, portals, smallest_hole, closed_holes, notes };
    reader.turn(&mut graph, &stated)?;
    graph.link();
    Ok(graph)
}

/// Checks the input, and moves it to the scene's origin.
pub(in crate::cells) struct Reader {
    origin: DVec3,
    tolerance: Tolerance,
    /// Largest error of planes and corners from a file, metres.
    rounding: f64,
}

impl Reader {
    pub fn new(scene: &Scene) -> Self {
        let bounds = scene.bounds();
        let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
        Self { origin: scene.origin, tolerance: scene.tolerance(), rounding: single_precision(extent) }
    }

    fn cell(&self, i: usize, cell: GivenCell) -> Result<Cell, GivenError> {
        let field = format!("cells[{i}]");
        if cell.id as usize != i {
            return Err(GivenError::at(
                format!("{field}.id"),
                format!("{}; ids are consecutive from 0, so give {i}", cell.id),
            ));
        }
        let pieces = self.pieces(field, cell.pieces, cell.min, cell.max)?;
        let name = cell.name.unwrap_or_else(|| format!("cell {i}"));
        Ok(Cell { name, source: cell.source, open: cell.open, pieces, portals: Vec::new() })
    }

    /// The pieces of a cell, given as pieces or as a box.
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
        // Slivers given by planes stay pieces even if they are empty in `f32`: portals lead through them.
        let mut rounding = 0.0;
        let planes = match (piece.planes, piece.min, piece.max) {
            (Some(planes), None, None) => {
                rounding = self.rounding;
                let planes = planes.into_iter().enumerate();
                planes.map(|(k, p)| self.plane(format!("{field}.planes[{k}]"), p)).collect::<Result<Vec<_>, _>>()?
            }
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
        held(planes, self.tolerance.coplanar, rounding)
            .ok_or_else(|| GivenError::at(field, "no volume; planes are [nx, ny, nz, d] with the piece where n.p <= d"))
    }

    /// A half-space with a unit normal, moved to the scene's origin.
    fn plane(&self, field: String, [x, y, z, d]: [f64; 4]) -> Result<Plane, GivenError> {
        let n = DVec3::new(x, y, z);
        let length = n.length();
        if !(length.is_finite() && length > LEAST_NORMAL && (d / length).abs() <= MAX_COORDINATE) {
            return Err(GivenError::at(field, "no plane; give [nx, ny, nz, d] with a normal of length 1"));
        }
        // Output of `dump` has a file's single precision. Its normal was a unit vector, and its `d` is right.
        if let Some(held) = single(n).filter(|_| (length - 1.0).abs() <= SINGLE_UNIT) {
            let size = d.abs().max(held.abs().dot(self.origin.abs()));
            return Ok(Plane { n: unit(held), d: moved_back(d, held.dot(self.origin), size) });
        }
        let (n, d) = (n / length, d / length);
        Ok(Plane { n, d: d - n.dot(self.origin) })
    }

    fn point(&self, field: &str, p: [f64; 3]) -> Result<DVec3, GivenError> {
        let p = DVec3::from_array(p);
        if p.abs().max_element() > MAX_COORDINATE {
            return Err(GivenError::at(field.to_owned(), "coordinates beyond 1e12 m"));
        }
        let axis = |k: usize| moved_back(p[k], self.origin[k], p[k].abs().max(self.origin[k].abs()));
        Ok(DVec3::from_array([0, 1, 2].map(axis)))
    }

    /// Corners of a polygon.
    fn winding(&self, field: &str, corners: &[[f64; 3]]) -> Result<Vec<DVec3>, GivenError> {
        corners.iter().enumerate().map(|(k, &p)| self.point(&format!("{field}[{k}]"), p)).collect()
    }

    /// The smallest hole, at least that of the model's tolerance.
    fn smallest_hole(&self, given: Option<f64>) -> Result<f64, GivenError> {
        let least = self.tolerance.smallest_hole();
        match given {
            Some(metres) if !(0.0..=MAX_COORDINATE).contains(&metres) => {
                Err(GivenError::at("smallest_hole".into(), format!("{metres}; give metres, 0 or more")))
            }
            // The value in a dump is equal to within decimal rounding.
            Some(metres) if metres > least * (1.0 + SAME) => Ok(metres),
            _ => Ok(least),
        }
    }

    fn portal(&self, i: usize, portal: GivenPortal, cells: usize) -> Result<Portal, GivenError> {
        let field = format!("portals[{i}]");
        if let Some(id) = portal.id.filter(|&id| id as usize != i) {
            return Err(GivenError::at(format!("{field}.id"), format!("{id}; ids are consecutive from 0, so give {i}")));
        }
        if let Some(id) = portal.cells.iter().find(|&&id| id as usize >= cells) {
            let what = format!("no cell {id}; ids end at {}", cells - 1);
            return Err(GivenError::at(format!("{field}.cells"), what));
        }
        if portal.cells[0] == portal.cells[1] {
            return Err(GivenError::at(format!("{field}.cells"), "a portal joins two different cells"));
        }
        let mut winding = self.winding(&format!("{field}.winding"), &portal.winding)?;
        let plane = match portal.plane {
            Some(plane) => self.stated_plane(&field, plane, &mut winding)?,
            None => self.winding_plane(&format!("{field}.winding"), &winding)?,
        };
        self.convex(&format!("{field}.winding"), &winding, &plane)?;
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

    /// The stated plane of a portal, with its normal from the first cell into the second; orients the winding to it.
    fn stated_plane(&self, field: &str, plane: [f64; 4], winding: &mut [DVec3]) -> Result<Plane, GivenError> {
        let plane = self.plane(format!("{field}.plane"), plane)?;
        self.planar(&format!("{field}.winding"), winding, &plane, "the portal's")?;
        if winding.len() >= 3 && newell(&around(winding)).dot(plane.n) < 0.0 {
            winding.reverse();
        }
        Ok(plane)
    }

    /// Every corner must turn left, judged by the longer of its edges, because rounding spoils the direction of a short one. The total turn
    /// is one circle.
    fn convex(&self, field: &str, winding: &[DVec3], plane: &Plane) -> Result<(), GivenError> {
        let corner = |k: usize| winding[k % winding.len()];
        let mut turn = 0.0;
        for k in 0..winding.len() {
            let (before, after) = (corner(k + 1) - corner(k), corner(k + 2) - corner(k + 1));
            let left = before.cross(after).dot(plane.n);
            if left < -self.tolerance.coplanar * before.length().max(after.length()) {
                return Err(GivenError::at(field.to_owned(), format!("not convex at edge {k}; split the portal")));
            }
            turn += left.atan2(before.dot(after));
        }
        if turn > BETWEEN_ROUNDS {
            return Err(GivenError::at(
                field.to_owned(),
                "winds more than once; give the corners in order around the portal",
            ));
        }
        Ok(())
    }

    /// Orients portals without a stated plane from the first cell to the second; rejects portals elsewhere.
    fn turn(&self, graph: &mut CellGraph, stated: &[bool]) -> Result<(), GivenError> {
        // First the tolerance of distinct planes, which slivers need; then that of cells written to the millimetre.
        let coarse = |portal: &Portal| self.tolerance.clearance.max(1e-3 * area(&portal.winding).sqrt());
        let fine = lie_between(graph, |_| self.tolerance.coplanar);
        let found = fine.into_iter().zip(lie_between(graph, coarse));
        for (i, [as_is, turned]) in found.map(|(a, b)| if a == [false; 2] { b } else { a }).enumerate() {
            let portal = &mut graph.portals[i];
            if as_is {
            } else if turned && !stated[i] {
                *portal = portal.clone().turned();
            } else {
                let [a, b] = portal.cells;
                let what = if turned { "the plane's normal must lead from" } else { "the winding can't lead from" };
                return Err(GivenError::at(format!("portals[{i}]"), format!("{what} cell {a} into cell {b}")));
            }
        }
        Ok(())
    }
}

/// The `f32` vector that was written as these decimals; `None` if there is none.
fn single(n: DVec3) -> Option<DVec3> {
    let held = n.as_vec3().as_dvec3();
    ((n - held).abs().cmple(held.abs() * DECIMAL)).all().then_some(held)
}

/// A winding relative to its centre.
fn around(winding: &[DVec3]) -> Vec<DVec3> {
    let centre = middle(winding);
    winding.iter().map(|&p| p - centre).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geom::Aabb;
    use crate::math::random::SplitMix;
    use crate::scene::{Object, Role, Source};

    /// One triangle 10 m across around (1000, 0, 0).
    fn scene() -> Scene {
        let positions = vec![DVec3::new(-5., 0., -5.), DVec3::new(5., 0., -5.), DVec3::new(5., 3., 5.)];
        let bounds = Aabb::of(positions.iter().copied());
        let (node, role, triangles, segments) = ("floor".into(), Role::Structure, 0..1, 0..0);
        let object = Object { node, role, opaque: true, glass: false, triangles, segments, bounds, reach: None };
        Scene {
            name: "test".into(),
            source: Source::default(),
            origin: DVec3::new(1000., 0., 0.),
            positions,
            triangles: vec![[0, 1, 2]],
            objects: vec![object],
            tubes: Default::default(),
            together: Vec::new(),
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
    fn normals_of_a_file_are_of_length_1_and_round_to_the_same_bits() {
        let mut random = SplitMix::new(1);
        let mut x = || 2.0 * random.unit() - 1.0;
        for _ in 0..100_000 {
            let n = DVec3::new(x(), x().powi(3), x().powi(9)).normalize().as_vec3();
            // As read from decimals.
            let held = single(n.as_dvec3() * (1.0 - f64::EPSILON)).expect("one of f32");
            let again = unit(held);
            assert!(held == n.as_dvec3() && again.as_vec3() == n && (again.length() - 1.0).abs() < 1e-10, "{n} {again}");
        }
        assert!([DVec3::Y, -DVec3::X].into_iter().all(|n| unit(n).distance(n) < 1e-15));
        assert_eq!(single(DVec3::new(0.6, 0.8, 0.0)), None);
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
    fn slivers_that_rounding_left_no_volume_are_taken() {
        // Inverted slabs at x = 1000: by 1e-6 m, where the error of `f32` is 1e-5 m, and by 1 mm.
        let slab = |to: f64| {
            let sides = "[0, 1, 0, 3], [0, -1, 0, 0], [0, 0, 1, 2], [0, 0, -1, 2]";
            format!(r#"{{"cells": [{{"id": 0, "pieces": [{{"planes": [[-1, 0, 0, -1000], [1, 0, 0, {to}], {sides}]}}]}}]}}"#)
        };
        let piece = &read_cells(&slab(999.999_999), &scene()).unwrap().cells[0].pieces[0];
        assert!(piece.bounds.min.x.abs() < 1e-4 && piece.bounds.max.x.abs() < 1e-4 && piece.bounds.max.y > 2.9);
        assert!(message(&slab(999.999)).starts_with("cells[0].pieces[0]: no volume"));
    }

    #[test]
    fn each_rule_is_refused_with_its_field() {
        for (json, expected) in [
            (r#"{"cells": ["#.to_owned(), "line 1 column 11"),
            (r#"{"cells": [{"id": "a"}]}"#.to_owned(), "line 1 column 21"),
            (r#"{"cells": []}"#.to_owned(), "cells: none"),
            (rooms(DOOR).replace(r#""id": 1"#, r#""id": 2"#), "cells[1].id: 2; ids are consecutive from 0, so give 1"),
            (rooms(DOOR).replace("[0, 1]", "[0, 2]"), "portals[0].cells: no cell 2"),
            (rooms(DOOR).replace("[0, 1]", "[1, 1]"), "portals[0].cells: a portal joins two different cells"),
            (rooms(DOOR).replace("[1004, 3, 2]", "[1000, 3, 2]"), "cells[1].pieces[0]: no volume"),
            (rooms(DOOR).replace(r#", "max": [1000, 3, 2]"#, ""), "cells[0]: give either planes, or min and max"),
            (rooms(DOOR).replace("[996, 0, -2]", "[-1e13, 0, -2]"), "cells[0].min: coordinates beyond"),
            (rooms("[[1000, 0, 0], [1000, 2, 0]]"), "portals[0].winding: 2 corners"),
            (rooms("[[1000, 0, 0], [1000, 1, 0], [1000, 2, 0]]"), "portals[0].winding: no area"),
            (rooms(&DOOR.replace("[1000, 2, 0.5]", "[1000.1, 2, 0.5]")), "off the plane"),
            (rooms("[[1000,0,0], [1000,2,0], [1000,0.5,0.5], [1000,0,2]]"), "not convex"),
            // A star of five points, which turns left everywhere.
            (rooms("[[1000,2,0], [1000,1,0.5], [1000,1.6,-0.5], [1000,1.6,0.5], [1000,1,-0.5]]"), "winds more than once"),
            (
                rooms(&format!(r#"{DOOR}, "plane": [-1, 0, 0, -1000]"#)),
                "portals[0]: the plane's normal must lead from cell 0",
            ),
            (
                rooms(&format!(r#"{DOOR}, "plane": [1, 0, 0, 1001]"#)),
                "portals[0].winding: corner 0 is 1.000000 m off the portal's",
            ),
            (
                rooms(DOOR).replace(r#""kind": "door""#, r#""state": {"shut": true}"#),
                "portals[0].state: shut, but not closable",
            ),
            (rooms(&DOOR.replace("1000", "1002")), "portals[0]: the winding can't lead from cell 0 into cell 1"),
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
