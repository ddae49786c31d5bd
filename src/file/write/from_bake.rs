//! Converts a bake's result to a file: `f64` to `f32`, and unnecessary parts left out, with the reason.

use crate::BitMatrix;
use crate::cells::{Cell, CellGraph, Piece, Portal, ViewCell};
use crate::file::{Bounds, FileCell, FileObject, FilePortal, FileViewCell, Import, PairCounts, PvsFile, ViewBounds, Views};
use crate::math::geom::{self, Aabb, Plane};
use crate::math::tolerance::single_precision;
use crate::pvs::view_cells::ViewRows;
use crate::pvs::{Guarantee, Pvs};
use crate::scene::{ImportOptions, Scene};
use crate::types::note::{Note, plain};
use glam::{DVec3, Vec3, Vec4};

/// The line of [`PvsFile::left_out`] of a bake that was stopped.
const STOPPED: &str =
    "the last steps: the bake was stopped; nothing is missing, but rows have more than they need: bake again";

impl PvsFile {
    /// Whether the bake was stopped before its last steps.
    pub fn is_cut_short(&self) -> bool {
        self.left_out.iter().any(|line| line == STOPPED)
    }

    /// The result of a bake of `scene`, ready to write. `import`: options of the scene's import. `keep_bounds` keeps both bounds and all
    /// witnesses.
    pub fn from_bake(scene: &Scene, import: &ImportOptions, pvs: &Pvs, keep_bounds: bool) -> Self {
        let graph = &pvs.graph;
        let (lower, witnesses) = pvs.witnessed();
        let pairs = PairCounts {
            lower: lower.count_ones(),
            upper: pvs.objects_upper.count_ones(),
            cell_lower: pvs.cells_lower.count_ones(),
            cell_upper: pvs.cells_upper.count_ones(),
        };
        let (cell_rows, object_rows) = match pvs.guarantee {
            Guarantee::Conservative => (&pvs.cells_upper, &pvs.objects_upper),
            Guarantee::Sampled => (&pvs.cells_lower, &lower),
        };
        let mut file = Self {
            model_hash: scene.hash(),
            origin: scene.origin,
            guarantee: pvs.guarantee,
            import: kept(import),
            strategy: graph.strategy,
            reason: graph.reason.clone(),
            smallest_hole: graph.smallest_hole,
            closed_holes: graph.closed_holes.iter().map(|hole| hole.iter().map(|p| p.as_vec3()).collect()).collect(),
            clusters: pvs.clusters.clone(),
            left_out: Vec::new(),
            notes: plain(scene.source.notes.iter().chain(&graph.notes).chain(&too_fine(scene, graph))),
            cells: graph.cells.iter().map(cell).collect(),
            portals: graph.portals.iter().map(portal).collect(),
            objects: scene.objects.iter().map(|o| object(&o.node, o.triangles.len() as u32, &o.extent())).collect(),
            placement: pvs.placement.matrix.clone(),
            placed: pvs.placement.boxes.clone(),
            cell_rows: unless_full(cell_rows),
            object_rows: unless_full(object_rows),
            bounds: None,
            pairs,
            repairs: pvs.repairs.clone(),
            stats: pvs.stats,
            unseen: pvs.unseen.clone(),
            gap: Some(pvs.gap(&lower)).filter(|gap| gap.all() > 0),
            views: Views::default(),
            relevance: None,
            ways_in: None,
            bake: None,
        };
        let hall = file.is_one_hall() && (file.cell_rows.is_some() || file.object_rows.is_some());
        if hall {
            (file.cell_rows, file.object_rows) = (None, None);
        }
        file.left_out = left_out(&file, hall, keep_bounds);
        if !pvs.is_whole {
            file.left_out.insert(0, STOPPED.to_owned());
        }
        if keep_bounds {
            file.bounds = Some(Bounds {
                cells_lower: pvs.cells_lower.clone(),
                cells_upper: pvs.cells_upper.clone(),
                objects_lower: lower,
                objects_upper: pvs.objects_upper.clone(),
                witnesses,
            });
        }
        file
    }

    /// Adds view cells and their visibility; `keep_bounds` keeps both bounds and all witnesses.
    pub fn add_views(&mut self, views: &[ViewCell], rows: &ViewRows, keep_bounds: bool) {
        let shipped = match self.guarantee {
            Guarantee::Conservative => &rows.upper,
            Guarantee::Sampled => &rows.lower,
        };
        let ViewRows { lower, upper, witnesses, .. } = rows.clone();
        self.views = Views {
            cells: views.iter().map(|v| FileViewCell { id: v.id.clone(), pieces: pieces(&v.pieces) }).collect(),
            rows: unless_full(shipped),
            bounds: keep_bounds.then_some(ViewBounds { lower, upper, witnesses }),
        };
        if !views.is_empty() && self.views.rows.is_none() {
            self.left_out.push("view cells' rows: every view cell sees every object".to_owned());
        }
        let in_no_cell = rows.in_no_cell.iter().map(|&v| &views[v].id);
        let faults = in_no_cell.map(|id| format!("view cell {id} lies in no cell: it sees only the objects that touch it"));
        self.notes.splice(0..0, faults);
    }
}

/// The import options that a file keeps.
fn kept(import: &ImportOptions) -> Import {
    Import {
        object_triangles: import.object_triangles,
        metres_per_unit: import.metres_per_unit,
        z_up: import.z_up,
        tube_radius: import.tube_radius,
        tubes: import.tubes,
        smallest_hole: import.smallest_hole,
    }
}

/// A note if portals are degenerate in the file's single precision. The run time grows every portal by that error, so nothing is missed;
/// but such portals do not cull.
fn too_fine(scene: &Scene, graph: &CellGraph) -> Option<Note> {
    let corners = graph.portals.iter().flat_map(|p| p.winding.iter().copied());
    let bounds = scene.bounds().union(Aabb::of(corners));
    let rounding = single_precision(bounds.min.abs().max(bounds.max.abs()).max_element());
    let count = graph.portals.iter().filter(|p| geom::width(&p.winding) < rounding).count();
    (count > 0).then(|| {
        Note::cost(format!(
            "{count} portals are narrower than {rounding:.1e} m, the rounding of f32 in a model of this size: the run time widens them"
        ))
    })
}

/// A matrix, left out if every bit is set.
fn unless_full(rows: &BitMatrix) -> Option<BitMatrix> {
    (rows.count_ones() < rows.rows() as u64 * rows.columns() as u64).then(|| rows.clone())
}

/// One line for each omission of the file, with the reason.
fn left_out(file: &PvsFile, hall: bool, keep_bounds: bool) -> Vec<String> {
    let one_cell = file.cells.len() <= 1;
    let mut out = Vec::new();
    match (&file.cell_rows, &file.object_rows) {
        (None, None) if hall => out.push("rows: one closed cell without portals sees everything"),
        (None, None) if !one_cell => out.push("rows: everything sees everything"),
        (cells, objects) => {
            match cells {
                None if one_cell => out.push("cell rows: there is only one cell"),
                None => out.push("cell rows: every cell sees every cell"),
                Some(_) => {}
            }
            if objects.is_none() {
                out.push("object rows: every cell sees every object");
            }
        }
    }
    if file.portals.is_empty() {
        out.push(if one_cell { "portals: one cell has none" } else { "portals: no cell has any" });
    }
    if file.placed.is_none() && !one_cell {
        out.push("boxes of objects in cells: hardly smaller than the objects' boxes cut to the cells");
    }
    if !file.cells.iter().any(|cell| cell.open) {
        out.push("online hierarchy: the building is closed");
    }
    if !keep_bounds {
        out.push("bounds and witnesses: not requested (--rows both)");
    }
    if file.repairs.is_empty() {
        out.push("repairs: none were needed");
    }
    out.into_iter().map(str::to_owned).collect()
}

fn plane(plane: &Plane) -> Vec4 {
    plane.n.as_vec3().extend(plane.d as f32)
}

fn cell(cell: &Cell) -> FileCell {
    FileCell { name: cell.name.clone(), source: cell.source.clone(), open: cell.open, pieces: pieces(&cell.pieces) }
}

fn pieces(pieces: &[Piece]) -> Vec<Vec<Vec4>> {
    pieces.iter().map(|piece| piece.planes.iter().map(plane).collect()).collect()
}

fn portal(portal: &Portal) -> FilePortal {
    FilePortal {
        cells: portal.cells,
        plane: plane(&portal.plane),
        winding: portal.winding.iter().map(|p| p.as_vec3()).collect(),
        kind: portal.kind,
        state: portal.state,
        source: portal.source.clone(),
    }
}

fn object(node: &str, triangles: u32, bounds: &Aabb) -> FileObject {
    FileObject { node: node.to_owned(), triangles, bounds: [round_down(bounds.min), -round_down(-bounds.max)] }
}

/// The greatest `f32` that is not above, for each coordinate.
fn round_down(p: DVec3) -> Vec3 {
    let down = |x: f64| {
        let nearest = x as f32;
        if f64::from(nearest) > x { nearest.next_down() } else { nearest }
    };
    Vec3::new(down(p.x), down(p.y), down(p.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_are_rounded_outwards() {
        let bounds = Aabb { min: DVec3::new(0.1, -0.1, 1e9 + 1.0), max: DVec3::new(0.3, 0.7, 2e9 + 3.0) };
        let [min, max] = object("", 1, &bounds).bounds;
        assert!(min.as_dvec3().cmple(bounds.min).all() && bounds.max.cmple(max.as_dvec3()).all());
        // And at most to the next representable number.
        assert!((bounds.min - min.as_dvec3()).max_element() <= 128.0 && f64::from(min.x) > 0.099_999);
        assert_eq!(round_down(DVec3::new(1.5, -2.25, 0.0)), Vec3::new(1.5, -2.25, 0.0));
    }
}
