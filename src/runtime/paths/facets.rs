//! Portals as convex polygons in `f64`, for distances.

use super::super::culler::{Culler, Lists};
use super::super::doors::Doors;
use crate::math::geom::Aabb;
use crate::{CellId, DirectedPortal};
use glam::DVec3;
use std::ops::Range;

/// Edges shorter than this don't bound anything, metres. Larger: the corner of a small portal is cut. Smaller: edges without a direction.
const SHORTEST_EDGE: f64 = 1e-7;

/// An edge of a portal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// Where it starts: a corner.
    pub start: DVec3,
    /// Its direction, of length 1.
    pub along: DVec3,
    /// Metres.
    pub length: f64,
    /// In the portal's plane, of length 1, towards the inside.
    pub inwards: DVec3,
}

/// The plane of a portal: `n . p = d`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub n: DVec3,
    pub d: f64,
}

/// All portals of a culler, and those out of its cells that are ever passed.
#[derive(Clone, Debug)]
pub(super) struct Facets {
    planes: Vec<Plane>,
    boxes: Vec<Aabb>,
    starts: Vec<u32>,
    edges: Vec<Edge>,
    out: Lists<DirectedPortal>,
}

impl Facets {
    pub fn new(culler: &Culler, passable: &Doors) -> Self {
        let (mut planes, mut boxes, mut starts, mut edges) = (Vec::new(), Vec::new(), vec![0], Vec::new());
        for portal in 0..culler.portal_count() {
            let corners: Vec<DVec3> = culler.portal_corners.get(portal).iter().map(|p| p.as_dvec3()).collect();
            let plane = plane_of(&corners);
            let flat: Vec<DVec3> = corners.iter().map(|&p| p - plane.n * (plane.n.dot(p) - plane.d)).collect();
            boxes.push(Aabb::of(flat.iter().copied()));
            edges.extend(edges_of(plane.n, &flat));
            planes.push(plane);
            starts.push(edges.len() as u32);
        }
        let is_passed = |portal: &DirectedPortal| {
            let portal = portal.portal();
            let any = (0..2).any(|side| passable.is_open(portal.directed(side)));
            any && starts[portal.index()] < starts[portal.index() + 1]
        };
        let portals = |cell: usize| culler.cell_portals.get(cell).iter().copied().filter(is_passed);
        let out = Lists::new((0..culler.cell_count()).map(portals));
        Self { planes, boxes, starts, edges, out }
    }

    pub fn plane(&self, portal: usize) -> Plane {
        self.planes[portal]
    }

    /// The portals out of a cell that have an area and are passed, at least the other way.
    pub fn out(&self, cell: CellId) -> &[DirectedPortal] {
        self.out.get(cell.index())
    }

    /// The edges of a portal, counter-clockwise; none of one without an area.
    pub fn edges(&self, portal: usize) -> &[Edge] {
        &self.edges[self.edge_range(portal)]
    }

    /// Its edges among those of all portals.
    pub fn edge_range(&self, portal: usize) -> Range<usize> {
        self.starts[portal] as usize..self.starts[portal + 1] as usize
    }

    /// The corner where an edge starts.
    pub fn corner(&self, edge: usize) -> DVec3 {
        self.edges[edge].start
    }

    /// Number of edges of all portals.
    pub fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// The least distance of two portals' boxes, metres: no more than that of the portals.
    pub fn gap(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (&self.boxes[a], &self.boxes[b]);
        (a.min - b.max).max(b.min - a.max).max(DVec3::ZERO).length()
    }

    /// The distance of a point from a portal's box, metres.
    pub fn distance(&self, portal: usize, p: DVec3) -> f64 {
        let bounds = &self.boxes[portal];
        (bounds.min - p).max(p - bounds.max).max(DVec3::ZERO).length()
    }
}

fn plane_of(corners: &[DVec3]) -> Plane {
    let middle = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let next = |i: usize| corners[(i + 1) % corners.len()] - middle;
    let n = (0..corners.len()).map(|i| (corners[i] - middle).cross(next(i))).sum::<DVec3>().normalize_or(DVec3::Y);
    Plane { n, d: n.dot(middle) }
}

fn edges_of(n: DVec3, corners: &[DVec3]) -> impl Iterator<Item = Edge> + '_ {
    (0..corners.len()).filter_map(move |i| {
        let (start, end) = (corners[i], corners[(i + 1) % corners.len()]);
        let length = (end - start).length();
        let along = (end - start) / length;
        (length > SHORTEST_EDGE).then(|| Edge { start, along, length, inwards: n.cross(along) })
    })
}
