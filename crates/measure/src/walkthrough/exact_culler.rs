//! Frames of a walk by the exact judge.

use super::raster::View;
use super::timed_culler::{Seen, Times, draw_rest};
use crate::exact::{ExactScene, Judge, MOST_SPLITS};
use enfilade::ObjectId;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::runtime::FrameStats;
use enfilade::types::scene::Scene;
use glam::Vec3;
use std::time::Instant;

/// Numbers of visible and of undecided triangles.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Judged {
    pub visible: u64,
    pub undecided: u64,
}

/// Culls frames with the exact judge.
pub(super) struct ExactCuller<'s> {
    scene: &'s Scene,
    judge: Judge<'s>,
    objects: Vec<ObjectId>,
}

impl<'s> ExactCuller<'s> {
    pub fn new(scene: &'s Scene, ready: &'s ExactScene) -> Self {
        Self { scene, judge: Judge::new(ready), objects: Vec::new() }
    }

    /// Culls a frame and draws the remaining objects into the oracle, if there is one.
    pub fn cull(&mut self, view: &View, oracle: Option<&mut DepthBuffer<'_>>) -> (Seen<'_>, Judged, Times) {
        let start = Instant::now();
        let us = || start.elapsed().as_nanos() as f64 / 1e3;
        let camera = &view.camera;
        let rows = [camera.x, camera.y, camera.w].map(Vec3::as_dvec3);
        let seen = self.judge.through(camera.eye.as_dvec3(), rows, MOST_SPLITS);
        self.objects = seen.objects(self.scene);
        let cull = us();
        let with_oracle = oracle.is_some();
        if let Some(oracle) = oracle {
            draw_rest(oracle, view, &self.objects);
        }
        let frame = with_oracle.then(us);
        let triangles = |o: &ObjectId| self.scene.objects[o.index()].triangles.len() as u64;
        let stats = FrameStats {
            objects: self.objects.len() as u64,
            triangles: self.objects.iter().map(triangles).sum(),
            ..FrameStats::default()
        };
        let visible = Seen { objects: &self.objects, cells: &[], portals: &[], home: None, stats };
        let judged = Judged { visible: seen.visible.len() as u64, undecided: seen.undecided.len() as u64 };
        (visible, judged, Times { cull, frame })
    }
}
