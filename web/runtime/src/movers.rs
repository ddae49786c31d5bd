//! What moves.

use crate::building::Building;
use crate::numbers::{give, point, worked};
use enfilade::runtime::{Culler, MoverId};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use wasm_bindgen::prelude::*;

/// The movers of a building, for any number of views.
#[wasm_bindgen]
pub struct Movers {
    pub(crate) culler: Arc<Culler>,
    pub(crate) movers: enfilade::runtime::Movers,
    origin: DVec3,
}

/// Lives of a slot that a number of the caller's can tell apart; lives count on from 0 behind these.
const LIVES: u32 = 1 << 21;

/// A mover's number: exact in a double.
fn number_of(mover: MoverId) -> f64 {
    f64::from(mover.life % LIVES) * 2f64.powi(32) + f64::from(mover.slot)
}

#[wasm_bindgen]
impl Movers {
    /// None yet.
    #[wasm_bindgen(constructor)]
    pub fn new(building: &Building) -> Self {
        let culler = building.culler.clone();
        Self { movers: enfilade::runtime::Movers::new(&culler), culler, origin: building.file.origin }
    }

    /// Adds a mover with the box that the caller has written, and gives its slot, and 2^32 for each mover that had it before.
    pub fn insert(&mut self) -> bool {
        worked(self.movers.insert(self.given()).map(|mover| give([number_of(mover)])))
    }

    /// Moves a mover to the box that the caller has written.
    pub fn set(&mut self, mover: f64) -> bool {
        worked(self.movers.set(mover_of(mover), self.given()))
    }

    /// Removes a mover.
    pub fn remove(&mut self, mover: f64) -> bool {
        worked(self.movers.remove(mover_of(mover)))
    }
}

impl Movers {
    fn given(&self) -> [Vec3; 2] {
        [point(0, self.origin), point(3, self.origin)]
    }
}

fn mover_of(number: f64) -> MoverId {
    let life = (number / 2f64.powi(32)).floor();
    MoverId { slot: (number - life * 2f64.powi(32)) as u32, life: life as u32 }
}
