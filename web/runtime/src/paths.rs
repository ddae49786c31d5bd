//! The shortest way through doors.

use crate::building::Building;
use crate::numbers::{give, give_list, point, worked};
use crate::view::View;
use enfilade::runtime::{Culler, Doors, Pathfinder};
use glam::DVec3;
use std::sync::Arc;
use wasm_bindgen::prelude::*;

/// Finds shortest ways in a building.
#[wasm_bindgen]
pub struct Paths {
    culler: Arc<Culler>,
    paths: Pathfinder,
    origin: DVec3,
    /// Of the last way.
    points: Vec<f64>,
    portals: Vec<u32>,
}

#[wasm_bindgen]
impl Paths {
    /// Prepares for ways through all portals but windows. That takes a while in a large building.
    #[wasm_bindgen(constructor)]
    pub fn new(building: &Building) -> Self {
        let culler = building.culler.clone();
        let paths = Pathfinder::new(&culler, &Doors::passable(&culler));
        Self { paths, culler, origin: building.file.origin, points: Vec::new(), portals: Vec::new() }
    }

    /// Finds the shortest way between the two points that the caller has written, through doors that are open in a view. Gives its length and a
    /// length that none is below, metres; negative: a point is in no cell, or there is no way.
    pub fn find(&mut self, view: &View) -> bool {
        if !Arc::ptr_eq(&self.culler, &view.culler) {
            return worked(Err("the view is of another building"));
        }
        let [from, to] = [point(0, self.origin), point(3, self.origin)];
        self.points.clear();
        self.portals.clear();
        give([-1.0; 2]);
        if let Some(way) = self.paths.find(view.doors(), from, to) {
            self.points.extend(way.points.iter().flat_map(|p| (p.as_dvec3() + self.origin).to_array()));
            self.portals.extend(way.portals.iter().map(|portal| portal.0));
            give([way.metres, way.at_least]);
        }
        true
    }

    /// Gives where the last way starts, passes each portal, and ends: three coordinates each.
    pub fn points(&self) {
        give_list(&self.points);
    }

    /// Gives the portals that the last way passes, as [`View::portals`] does.
    pub fn portals(&self) {
        give_list(&self.portals);
    }
}
