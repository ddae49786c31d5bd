//! A regular grid whose cells are asked about from near to far, some at a time, with nothing kept from frame to frame.

use super::Culled;
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::{ALL_PLANES, Frustum, Side};
use enfilade::scene::Scene;
use glam::DVec3;

/// Objects in a cell, in the mean over a grid that is full. Fewer: more questions. More: more is drawn for nothing.
const OBJECTS: f64 = 8.0;

/// A cell with something in it.
struct GridCell {
    bounds: Bounds,
    objects: Vec<ObjectId>,
}

pub struct Grid {
    cells: Vec<GridCell>,
    at_a_time: usize,
}

impl Grid {
    /// Cells are cubes; each object is in that of its middle, and a cell's box holds all of its objects.
    pub fn new(scene: &Scene, at_a_time: usize) -> Self {
        let all = scene.objects.iter().fold(Aabb::EMPTY, |all, o| all.union(o.bounds));
        let size = all.max - all.min;
        let volume = size.max(DVec3::splat(1e-3)).element_product();
        let edge = (volume * OBJECTS / scene.objects.len() as f64).cbrt();
        let mut placed: Vec<([u64; 3], ObjectId)> = (scene.objects.iter().enumerate())
            .map(|(i, o)| (((o.bounds.centre() - all.min) / edge).to_array().map(|k| k as u64), ObjectId(i as u32)))
            .collect();
        placed.sort_unstable();
        let cells = placed.chunk_by(|a, b| a.0 == b.0).map(|cell| {
            let objects: Vec<ObjectId> = cell.iter().map(|(_, o)| *o).collect();
            let bounds = objects.iter().fold(Aabb::EMPTY, |all, o| all.union(scene.objects[o.index()].bounds));
            GridCell { bounds: Bounds::from(bounds), objects }
        });
        Self { cells: cells.collect(), at_a_time }
    }

    pub fn cull(&mut self, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> Culled {
        let is_inside = |c: &&GridCell| matches!(frustum.side(&c.bounds, ALL_PLANES, 0, &mut 0), Side::Crosses(_));
        let mut cells: Vec<&GridCell> = self.cells.iter().filter(is_inside).collect();
        cells.sort_by(|a, b| a.bounds.distance(frustum.eye()).total_cmp(&b.bounds.distance(frustum.eye())));
        let (mut drawn, mut queries) = (Vec::new(), 0);
        for some in cells.chunks(self.at_a_time) {
            let asked: Vec<_> = some
                .iter()
                .map(|cell| (!frustum.meets_near(&cell.bounds)).then(|| oracle.issue(std::slice::from_ref(&cell.bounds))))
                .collect();
            for (cell, query) in some.iter().zip(asked) {
                queries += u64::from(query.is_some());
                if query.is_none_or(|query| oracle.poll(query).expect("an answer at once")) {
                    cell.objects.iter().for_each(|&o| oracle.draw(o));
                    drawn.extend_from_slice(&cell.objects);
                }
            }
        }
        (drawn, queries)
    }
}
