//! Faults of a file's cells and portals that need no triangles.
//!
//! Based on: S. Gottschalk, M. C. Lin, D. Manocha, *OBBTree*, 1996: most pairs of pieces have a separating plane among their own
//! faces; the others are clipped to their intersection.

use super::cells::{Cells, Piece, faces};
use super::tight::rim;
use enfilade::file::PvsFile;
use enfilade::math::geom::{Plane, clip, middle, newell};
use enfilade::math::parallel;
use enfilade::{CellId, PortalId};
use glam::DVec3;
use serde::Serialize;

/// Maximum listed faults.
const LISTED: usize = 20;

/// Kind of a fault.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// A portal's corner is off its plane.
    NotPlanar,
    /// A portal's winding is not convex.
    NotConvex,
    /// A portal's winding runs clockwise about its normal.
    Clockwise,
    /// No point of the portal has its two cells on the sides that the normal gives.
    NotBetween,
    /// Two pieces overlap.
    Overlap,
}

/// A fault.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Fault {
    /// Its kind.
    pub fault: FaultKind,
    /// The portal, if it concerns one.
    pub portal: Option<PortalId>,
    /// The cells that it concerns.
    pub cells: [CellId; 2],
    /// Where, in the model's own coordinates, metres.
    pub at: DVec3,
}

/// Every fault.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Structure {
    /// Up to 20 faults: portals first, in the order of their ids.
    pub faults: Vec<Fault>,
    /// Number of faults.
    pub count: usize,
}

/// Tests every portal, and every two pieces that are near each other.
pub(super) fn structure(file: &PvsFile, cells: &Cells) -> Structure {
    let mut faults: Vec<Fault> = parallel::flat_map_range(0..file.portals.len(), |i| portal(file, cells, i));
    let pieces = parallel::flat_map_range(0..cells.pieces().len(), |i| {
        let beside = cells.beside(i).into_iter().filter(move |&j| j > i);
        beside.filter_map(move |j| overlap(cells, i, j))
    });
    faults.extend(pieces);
    let count = faults.len();
    faults.truncate(LISTED);
    faults.iter_mut().for_each(|f| f.at += file.origin);
    Structure { faults, count }
}

fn portal(file: &PvsFile, cells: &Cells, i: usize) -> Vec<Fault> {
    let (portal, own) = (&cells.portals()[i], file.portals[i].cells);
    let (w, n, tolerance) = (&portal.winding, portal.plane.n, cells.tolerance());
    let mut found = Vec::new();
    let mut fault = |fault, at| found.push(Fault { fault, portal: Some(PortalId(i as u32)), cells: own, at });
    if let Some(&corner) = w.iter().find(|&&p| portal.plane.distance(p).abs() > tolerance) {
        fault(FaultKind::NotPlanar, corner);
    }
    let local: Vec<DVec3> = w.iter().map(|&p| p - w[0]).collect();
    let edges = w.iter().zip(w.iter().cycle().skip(1));
    let rounding = cells.rounding() * edges.map(|(a, b)| a.distance(*b)).sum::<f64>();
    let area = newell(&local).dot(n);
    if area < -rounding {
        fault(FaultKind::Clockwise, w[0]);
    } else if area > rounding {
        // Below that, `f32` gives no reliable orientation; run time and segments treat such a portal as wider.
        let edges = rim(w, &portal.plane);
        if let Some(&corner) = w.iter().find(|&&p| edges.iter().any(|e| e.distance(p) > tolerance)) {
            fault(FaultKind::NotConvex, corner);
        }
    }
    // A portal may be larger than its opening, so one point is enough.
    let centre = middle(w);
    let samples = w.iter().flat_map(|&c| [0.02, 0.35, 0.7, 0.98].map(|t| centre.lerp(c, t))).chain([centre]);
    let off = n * (2.0 * tolerance);
    let sampled = samples.into_iter().any(|p| cells.near_cell(own[0], p - off) && cells.near_cell(own[1], p + off));
    if !sampled && !meets(cells, &portal.plane, w, own) {
        fault(FaultKind::NotBetween, centre);
    }
    found
}

/// Whether faces of the two cells lie on a portal, face away from each other and come within the tolerance of each other there.
/// The test stays in the portal's plane, since pieces thinner than the tolerance end close beyond it. The overlap may be of any
/// size: a portal may be larger than its opening, and segments grow portals by the tolerance anyway.
fn meets(cells: &Cells, plane: &Plane, winding: &[DVec3], own: [CellId; 2]) -> bool {
    let tolerance = 2.0 * cells.tolerance();
    let cut = |polygon: &[DVec3], by: &[DVec3]| {
        let grown = rim(by, plane).into_iter().map(|edge| Plane { d: edge.d + cells.tolerance(), ..edge });
        grown.fold(polygon.to_vec(), |left, edge| clip(&left, &edge, 0.0))
    };
    let shares = |k: usize| -> Vec<Vec<DVec3>> {
        let out = if k == 0 { plane.n } else { -plane.n };
        let pieces = cells.pieces_of(own[k]).iter().map(|&(i, _)| &cells.pieces()[i]);
        let faces = pieces.flat_map(|piece| &piece.faces).filter(|face| {
            let local: Vec<DVec3> = face.iter().map(|&p| p - face[0]).collect();
            newell(&local).dot(out) > 0.0 && face.iter().all(|&p| plane.distance(p).abs() <= tolerance)
        });
        faces.map(|face| cut(winding, face)).filter(|part| part.len() > 2).collect()
    };
    let (behind, before) = (shares(0), shares(1));
    behind.iter().any(|a| before.iter().any(|b| cut(a, b).len() > 2))
}

/// A point inside two pieces, deeper in both than rounding.
fn overlap(cells: &Cells, i: usize, j: usize) -> Option<Fault> {
    let (a, b, depth) = (&cells.pieces()[i], &cells.pieces()[j], 2.0 * cells.tolerance());
    if apart(a, b, depth) || apart(b, a, depth) {
        return None;
    }
    let deep: Vec<Plane> = a.planes.iter().chain(&b.planes).map(|p| Plane { d: p.d - depth, ..*p }).collect();
    let corners: Vec<DVec3> = faces(&deep, cells.region()).into_iter().flatten().collect();
    let at = middle(&corners);
    let shared = corners.len() > 3 && deep.iter().all(|p| p.distance(at) < 0.5 * depth);
    shared.then_some(Fault { fault: FaultKind::Overlap, portal: None, cells: [a.cell, b.cell], at })
}

/// Whether a plane of `a` has all of `b` beyond it, or at most `depth` behind it.
fn apart(a: &Piece, b: &Piece, depth: f64) -> bool {
    a.planes.iter().any(|plane| b.faces.iter().flatten().all(|&p| plane.distance(p) >= -depth))
}
