//! What to load next, as one walks.

use crate::building::{Building, id};
use crate::camera::given;
use crate::numbers::{give, number, worked};
use crate::view::View;
use enfilade::runtime::prefetch::{ChunkId, Chunks, Prefetcher, Step};
use enfilade::runtime::{Culler, Motion};
use glam::DVec3;
use std::sync::Arc;
use wasm_bindgen::prelude::*;

/// What is loaded of a building, and what to load next, for one eye.
#[wasm_bindgen]
pub struct Prefetch {
    culler: Arc<Culler>,
    prefetcher: Prefetcher,
    motion: Motion,
    origin: DVec3,
    chunks: usize,
}

#[wasm_bindgen]
impl Prefetch {
    /// Nothing is loaded yet. `chunk_of`: the chunk of each object; `bytes`: what each chunk takes when it is loaded; `budget`: bytes for all.
    #[wasm_bindgen(constructor)]
    pub fn new(building: &Building, chunk_of: &[u32], bytes: &[f64], budget: f64) -> Result<Self, JsError> {
        let (objects, chunks) = (building.culler.object_count(), bytes.len());
        if chunk_of.len() != objects {
            return Err(JsError::new(&format!("chunks of {} objects, and there are {objects}", chunk_of.len())));
        }
        // What is no number of bytes becomes 0, or more than any budget.
        let bytes = bytes.iter().map(|&bytes| bytes as u64).collect();
        let Some(of) = Chunks::new(chunk_of.iter().copied().map(ChunkId).collect(), bytes) else {
            return Err(JsError::new(&format!("an object is in a chunk beyond the {chunks} that there are")));
        };
        let (culler, origin) = (building.culler.clone(), building.file.origin);
        let prefetcher = Prefetcher::new(&building.file, &culler, of, budget as u64);
        Ok(Self { culler, prefetcher, motion: Motion::default(), origin, chunks })
    }

    /// Begins a frame: the camera that the caller has written, with its time in seconds behind it, and the last frame of a view. Gives the number
    /// of objects that are seen and not loaded. A camera that shows nothing in particular keeps the last plan.
    pub fn frame(&mut self, view: &mut View) -> bool {
        if !Arc::ptr_eq(&self.culler, &view.culler) {
            return worked(Err("the view is of another building"));
        }
        let Ok(camera) = given(self.origin) else {
            give([0.0]);
            return true;
        };
        self.motion.see(&camera, number(19));
        self.prefetcher.set_doors(view.doors());
        give([self.prefetcher.frame(camera.eye, &self.motion, view.last_objects()) as f64]);
        true
    }

    /// What to do next, given as a chunk and metres: 1, load it, since the eye has at least so far to go before it may be seen; 2, let it go;
    /// 0, nothing in this frame.
    pub fn next(&mut self) -> u32 {
        match self.prefetcher.next_step() {
            Some(Step::Load { chunk, metres }) => {
                give([f64::from(chunk.0), f64::from(metres)]);
                1
            }
            Some(Step::Evict(chunk)) => {
                give([f64::from(chunk.0), 0.0]);
                2
            }
            None => 0,
        }
    }

    /// A chunk is loaded.
    pub fn loaded(&mut self, chunk: u32) -> bool {
        worked(id("chunk", chunk, self.chunks).map(|chunk| self.prefetcher.loaded(ChunkId(chunk))))
    }

    /// A chunk could not be loaded; it is not asked for again.
    pub fn failed(&mut self, chunk: u32) -> bool {
        worked(id("chunk", chunk, self.chunks).map(|chunk| self.prefetcher.failed(ChunkId(chunk))))
    }

    /// Bytes of chunks that are loaded and under way.
    pub fn used(&self) -> f64 {
        self.prefetcher.used() as f64
    }
}
