//! A building: a `.pvs` file, laid out for views.

use crate::numbers::{give, give_list, point, worked};
use enfilade::file::PvsFile;
use enfilade::runtime::Culler;
use enfilade::{CellId, ObjectId, PortalId};
use glam::DVec3;
use std::sync::Arc;
use wasm_bindgen::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// A building, shared by all that is made from it.
#[wasm_bindgen]
pub struct Building {
    pub(crate) file: PvsFile,
    pub(crate) culler: Arc<Culler>,
    /// The last list that was asked for, of ids or of coordinates.
    list: Vec<u32>,
    points: Vec<f64>,
}

/// The text of an error, for the caller's `Error`.
fn error(text: impl std::fmt::Display) -> JsError {
    JsError::new(&text.to_string())
}

/// The hash of a file's bytes, as manifests have it: XXH3, 64 bits, in hexadecimal.
#[wasm_bindgen]
pub fn hash(bytes: &[u8]) -> String {
    format!("{:016x}", xxh3_64(bytes))
}

#[wasm_bindgen]
impl Building {
    /// Reads the bytes of a `.pvs` file.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8]) -> Result<Self, JsError> {
        let file = PvsFile::read_for_frames(bytes).map_err(error)?;
        let culler = Culler::new(&file);
        let list = Vec::with_capacity(culler.object_count().max(culler.cell_count()));
        Ok(Self { file, culler, list, points: Vec::new() })
    }

    /// Gives the numbers of objects, cells and portals, the tolerance, and the origin.
    pub fn facts(&self) {
        let Self { file, culler, .. } = self;
        let DVec3 { x, y, z } = file.origin;
        let [objects, cells, portals] = [culler.object_count(), culler.cell_count(), culler.portal_count()];
        give([objects as f64, cells as f64, portals as f64, culler.tolerance(), x, y, z]);
    }

    /// The hash of its model.
    pub fn model(&self) -> String {
        format!("{:032x}", self.file.model_hash)
    }

    /// The cell of the point that the caller has written, or -1.
    #[wasm_bindgen(js_name = cellOf)]
    pub fn cell_of(&self) -> i32 {
        self.culler.cell_of(point(0, self.file.origin)).map_or(-1, |cell| cell.0 as i32)
    }

    /// Gives the objects that can be seen from a cell.
    pub fn row(&mut self, cell: u32) -> bool {
        worked(self.cell(cell).map(|cell| {
            self.list.clear();
            self.list.extend(self.culler.objects_from(cell).map(|object| object.0));
            give_list(&self.list);
        }))
    }

    /// Gives the cells that can be seen from a cell.
    #[wasm_bindgen(js_name = cellRow)]
    pub fn cell_row(&mut self, cell: u32) -> bool {
        worked(self.cell(cell).map(|cell| {
            self.list.clear();
            self.list.extend(self.culler.visible_from(cell).map(|cell| cell.0));
            give_list(&self.list);
        }))
    }

    /// Gives an object's box, its number of triangles, and its indices: the first, and the first behind them.
    pub fn object(&self, object: u32) -> bool {
        worked(self.object_id(object).map(|id| {
            let [min, max] = self.file.objects[id.index()].bounds.map(|p| p.as_dvec3() + self.file.origin);
            let (triangles, indices) = (self.culler.triangles(id), self.culler.indices(id));
            let [first, end] = [indices.start, indices.end].map(f64::from);
            give([min.x, min.y, min.z, max.x, max.y, max.z, f64::from(triangles), first, end]);
        }))
    }

    /// Gives the corners of a portal, three coordinates each.
    pub fn corners(&mut self, portal: u32) -> bool {
        worked(portal_id(&self.culler, portal).map(|portal| {
            self.points.clear();
            let corners = self.file.portals[portal.index()].winding.iter().map(|p| p.as_dvec3() + self.file.origin);
            self.points.extend(corners.flat_map(|p| p.to_array()));
            give_list(&self.points);
        }))
    }

    /// Gives the cells of a portal, its kind as the file has it, and whether it is shut in the model.
    pub fn sides(&self, portal: u32) -> bool {
        worked(portal_id(&self.culler, portal).map(|portal| {
            let portal = &self.file.portals[portal.index()];
            let [behind, before] = portal.cells.map(|cell| f64::from(cell.0));
            give([behind, before, f64::from(portal.kind as u8), f64::from(u8::from(portal.state.shut))]);
        }))
    }

    /// The node of the model that an object is a part of; nothing, if there is no such object.
    #[wasm_bindgen(js_name = objectName)]
    pub fn object_name(&self, object: u32) -> String {
        self.file.objects.get(object as usize).map(|object| object.node.clone()).unwrap_or_default()
    }

    /// The name of a cell; nothing, if there is no such cell.
    #[wasm_bindgen(js_name = cellName)]
    pub fn cell_name(&self, cell: u32) -> String {
        self.file.cells.get(cell as usize).map(|cell| cell.name.clone()).unwrap_or_default()
    }

    /// The key of a portal: the same in any bake of the model; nothing, if there is no such portal.
    #[wasm_bindgen(js_name = portalKey)]
    pub fn portal_key(&self, portal: u32) -> String {
        portal_id(&self.culler, portal).map(|portal| self.culler.portal_key(portal).to_owned()).unwrap_or_default()
    }

    /// The portal with a key, or -1.
    pub fn portal(&self, key: &str) -> i32 {
        self.culler.portal(key).map_or(-1, |portal| portal.0 as i32)
    }
}

impl Building {
    fn cell(&self, cell: u32) -> Result<CellId, String> {
        id("cell", cell, self.culler.cell_count()).map(CellId)
    }

    fn object_id(&self, object: u32) -> Result<ObjectId, String> {
        id("object", object, self.culler.object_count()).map(ObjectId)
    }
}

/// A portal of a culler.
pub fn portal_id(culler: &Culler, portal: u32) -> Result<PortalId, String> {
    id("portal", portal, culler.portal_count()).map(PortalId)
}

/// An id that is below the number of all.
pub fn id(what: &str, id: u32, all: usize) -> Result<u32, String> {
    if (id as usize) < all { Ok(id) } else { Err(format!("{what} {id} of {all}")) }
}
