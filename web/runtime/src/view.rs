//! Views: what a camera sees.

use crate::building::{Building, portal_id};
use crate::camera::given;
use crate::movers::Movers;
use crate::numbers::{give, give_list, worked};
use enfilade::ObjectId;
use enfilade::runtime::{Camera, Culler, Doors, MinPixels, Mode};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use wasm_bindgen::prelude::*;

/// A camera where none is needed.
const ANY: Camera = Camera { eye: Vec3::ZERO, x: Vec3::X, y: Vec3::Y, w: Vec3::NEG_Z };

/// One camera's culling. Views of one building are independent of each other.
#[wasm_bindgen]
pub struct View {
    pub(crate) culler: Arc<Culler>,
    view: enfilade::runtime::View,
    doors: Doors,
    origin: DVec3,
    /// The last list that was made of a frame.
    list: Vec<u32>,
}

#[wasm_bindgen]
impl View {
    /// A view with all doors open.
    #[wasm_bindgen(constructor)]
    pub fn new(building: &Building) -> Self {
        let culler = building.culler.clone();
        let (view, doors) = (enfilade::runtime::View::new(&culler), Doors::open(&culler));
        let most = culler.object_count().max(2 * culler.portal_count());
        Self { view, doors, origin: building.file.origin, list: Vec::with_capacity(most + 1), culler }
    }

    /// Culls the frame of the camera that the caller has written, and gives its objects. A camera that shows nothing in particular, as of a matrix
    /// that is not finite, shows everything.
    /// `mode`: its place in [`Mode::WITHOUT_QUERIES`].
    pub fn cull(&mut self, mode: u32) {
        let mode = Mode::WITHOUT_QUERIES.get(mode as usize).copied().unwrap_or(Mode::PortalsAndPvs);
        let (camera, mode) = match given(self.origin) {
            Ok(camera) => (camera, mode),
            Err(_) => (ANY, Mode::None),
        };
        let frame = self.view.cull(&camera, mode);
        give_list(frame.objects);
    }

    /// Gives the ranges of an index buffer with the objects' triangles in the order of their ids that the last frame draws: each the first, and the
    /// first behind it.
    pub fn runs(&mut self) {
        self.list.clear();
        if let Some(mut frame) = self.view.visible() {
            self.list.extend(frame.runs().iter().flat_map(|run| [run.start, run.end]));
        }
        give_list(&self.list);
    }

    /// Gives the cells that the last frame reached, the eye's first.
    pub fn cells(&mut self) {
        match self.view.visible() {
            Some(frame) => give_list(frame.cells),
            None => give_list::<u32>(&[]),
        }
    }

    /// Gives the cells that the eye of the last frame was in.
    pub fn homes(&mut self) {
        match self.view.visible() {
            Some(frame) => give_list(frame.homes),
            None => give_list::<u32>(&[]),
        }
    }

    /// Gives the portals that the last frame saw through, nearest first: twice the portal, and 1 more against its direction.
    pub fn portals(&mut self) {
        self.list.clear();
        if let Some(frame) = self.view.visible() {
            self.list.extend(frame.portals.iter().map(|crossed| crossed.portal.0));
        }
        give_list(&self.list);
    }

    /// Gives the numbers of cells, portals, objects and triangles of the last frame, and of small objects that it left out.
    pub fn counts(&mut self) {
        let counts = self.view.visible().map(|frame| frame.stats).unwrap_or_default();
        give([counts.cells, counts.portals, counts.objects, counts.triangles, counts.small].map(|count| count as f64));
    }

    /// Opens or shuts a portal, for later frames.
    #[wasm_bindgen(js_name = setOpen)]
    pub fn set_open(&mut self, portal: u32, open: bool) -> bool {
        worked(portal_id(&self.culler, portal).map(|portal| {
            self.doors.set_open(portal, open);
            self.view.set_doors(&self.doors);
        }))
    }

    /// Whether a portal is there and open.
    #[wasm_bindgen(js_name = isOpen)]
    pub fn is_open(&self, portal: u32) -> bool {
        portal_id(&self.culler, portal).is_ok_and(|portal| self.doors.is_open(portal.directed(0)))
    }

    /// Doors as they stand in the model.
    #[wasm_bindgen(js_name = asFound)]
    pub fn as_found(&mut self) {
        self.doors = Doors::as_found(&self.culler);
        self.view.set_doors(&self.doors);
    }

    /// Leaves out what covers fewer than `pixels` in pictures of `width` by `height`; 0: nothing.
    #[wasm_bindgen(js_name = setMinPixels)]
    pub fn set_min_pixels(&mut self, pixels: u32, width: u32, height: u32) {
        self.view.set_min_pixels(MinPixels { pixels, picture: [width, height] });
    }

    /// Gives the slots of the movers that the last frame may show.
    pub fn movers(&mut self, movers: &Movers) -> bool {
        if !Arc::ptr_eq(&self.culler, &movers.culler) {
            return worked(Err("the movers are of another building"));
        }
        self.list.clear();
        self.list.extend(self.view.movers(&movers.movers).iter().map(|mover| mover.slot));
        give_list(&self.list);
        true
    }
}

impl View {
    pub(crate) fn doors(&self) -> &Doors {
        &self.doors
    }

    /// The objects of the last frame.
    pub(crate) fn last_objects(&mut self) -> &[ObjectId] {
        self.view.visible().map_or(&[], |frame| frame.objects)
    }
}
