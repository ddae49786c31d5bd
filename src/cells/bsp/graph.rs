//! From labelled leaves to cells and portals.

use super::adjacency::{self, Contact, Flat};
use super::tree::Bsp;
use crate::CellId;
use crate::cells::complex::assemble::{around, hulls};
use crate::cells::complex::coverage::Open;
use crate::cells::complex::polygon::{Shape, area, convex_hull, width};
use crate::cells::{Cell, Piece, Portal, PortalKind, PortalState};
use crate::job::{Job, Stopped};
use crate::math::geom::{Aabb, Plane, newell};
use crate::math::parallel;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Growth of hulls on every side, in seals.
const GROWN: f64 = 1.5;
/// Cells of the regions with pieces, and the cell of each region; `beyond` is the region outside the domain.
pub fn cells(pieces: Vec<Vec<Piece>>, beyond: Option<u32>, domain: Aabb) -> (Vec<Cell>, Vec<Option<u32>>) {
    let mut cells: Vec<Cell> = Vec::new();
    let mut number: Vec<Option<u32>> = vec![None; pieces.len()];
    for (r, mut pieces) in pieces.into_iter().enumerate() {
        if pieces.is_empty() {
            continue;
        }
        let outside = beyond == Some(r as u32);
        if outside {
            pieces.extend(around(domain));
        }
        let name = if outside { "outside".to_owned() } else { format!("cell {}", cells.len()) };
        number[r] = Some(cells.len() as u32);
        cells.push(Cell { name, source: None, open: outside, pieces, portals: Vec::new() });
    }
    if cells.is_empty() {
        // No region has pieces: everything is one cell.
        let mut pieces = around(domain);
        let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(domain.max, n), Plane::through(domain.min, -n)]);
        pieces.push(Piece { planes: planes.collect(), bounds: domain });
        cells.push(Cell { name: "everything".to_owned(), source: None, open: true, pieces, portals: Vec::new() });
    }
    (cells, number)
}

/// Portals between different cells, in a fixed order; see [`crate::cells::complex::assemble::portals`].
pub fn portals(
    bsp: &Bsp,
    contacts: &[Contact],
    labels: &[Option<u32>],
    along: DVec3,
    seal: f64,
    work: &Job<'_>,
) -> Result<Vec<Portal>, Stopped> {
    /// Cells in ascending order, the plane's bits, whether the lower cell is behind it.
    type Key = (u32, u32, [u64; 4], bool);
    let mut groups: BTreeMap<Key, (Plane, Vec<Shape>)> = BTreeMap::new();
    for c in contacts {
        let [Some(a), Some(b)] = c.leaves.map(|l| labels[l as usize]) else { continue };
        if a == b || c.open_area <= 0.0 {
            continue;
        }
        let plane = bsp.nodes[c.node as usize].plane;
        let bits = [plane.n.x, plane.n.y, plane.n.z, plane.d].map(|x| (x + 0.0).to_bits());
        let parts = &mut groups.entry((a.min(b), a.max(b), bits, a < b)).or_insert((plane, Vec::new())).1;
        match &c.open {
            Open::Whole => parts.push(vec![c.polygon.iter().map(|p| p.to_array()).collect()]),
            Open::Parts(p) => parts.extend(p.iter().cloned()),
        }
    }
    let groups: Vec<(Key, (Plane, Vec<Shape>))> = groups.into_iter().collect();
    let of_group = |&((low, high, _, forward), (plane, ref parts)): &(Key, (Plane, Vec<Shape>))| {
        if work.is_stopped() {
            return Vec::new();
        }
        let flat = Flat::new(&plane, along);
        let facing = if forward { plane } else { plane.flipped() };
        let winding = move |hull: Vec<DVec2>| {
            let mut winding: Vec<DVec3> = hull.iter().map(|&q| flat.from(q)).collect();
            if !forward {
                winding.reverse();
            }
            let cells = [CellId(low), CellId(high)];
            let sound = width(&hull) >= (2.0 * GROWN + adjacency::CRUMB) * seal
                && winding.len() >= 3
                && newell(&winding.iter().map(|&p| p - winding[0]).collect::<Vec<_>>()).length() > 0.0;
            let kind = PortalKind::Opening;
            sound.then(|| Portal { cells, plane: facing, winding, kind, state: PortalState::of_kind(kind), source: None })
        };
        joined(hulls(parts.clone(), seal)).into_iter().filter_map(winding).collect::<Vec<_>>()
    };
    let found = parallel::flat_map(&groups, of_group);
    work.go_on().map(|()| found)
}

/// Joins hulls whose common hull is hardly larger, such as an opening divided by a narrow ledge.
fn joined(mut hulls: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    /// Largest area of a common hull, relative to both hulls.
    const LOOSE: f64 = 1.02;
    hulls.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let mut out: Vec<Vec<DVec2>> = Vec::new();
    for hull in hulls {
        let most = |kept: &[DVec2]| LOOSE * (area(kept) + area(&hull));
        let fits = |kept: &Vec<DVec2>| {
            Some(convex_hull(kept.iter().chain(&hull).copied().collect())).filter(|both| area(both) <= most(kept))
        };
        match out.iter().enumerate().find_map(|(i, kept)| Some((i, fits(kept)?))) {
            Some((i, both)) => out[i] = both,
            None => out.push(hull),
        }
    }
    out
}
