//! A scene before a bake, as a file, to display it immediately.

use crate::BitMatrix;
use crate::cells::{Placement, undivided_in_metres};
use crate::file::PvsFile;
use crate::pvs::{Guarantee, Pvs, PvsStats, SamplingEnd};
use crate::scene::{ImportOptions, Scene};

/// The file of a scene as one open cell that contains and sees every object. It casts no ray, and is almost immediate.
pub fn without_rows(scene: &Scene, import: &ImportOptions) -> PvsFile {
    let graph = undivided_in_metres(scene);
    let (none, mut all) = (BitMatrix::new(1, scene.objects.len()), BitMatrix::new(1, scene.objects.len()));
    (0..scene.objects.len()).for_each(|object| _ = all.set(0, object));
    let mut itself = BitMatrix::new(1, 1);
    itself.set(0, 0);
    let pvs = Pvs {
        graph,
        cells_lower: itself.clone(),
        cells_upper: itself,
        objects_lower: none.clone(),
        objects_upper: all.clone(),
        placement: Placement { matrix: all, boxes: None },
        unresolved: none,
        witnesses: Vec::new(),
        unseen: None,
        sampling_end: SamplingEnd::Rays,
        is_whole: true,
        guarantee: Guarantee::Conservative,
        clusters: Vec::new(),
        repairs: Vec::new(),
        stats: PvsStats::default(),
        again: None,
    };
    PvsFile::from_bake(scene, import, &pvs, true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::{BakeOptions, bake};
    use crate::cells::undivided;
    use crate::job::Job;
    use crate::pvs::PvsOptions;
    use crate::scene::{Mesh, Role, SceneBuilder, Source};
    use glam::DVec3;

    /// Two walls of a room in metres, one behind the other.
    fn walls() -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for x in [0.0, 5.0] {
            let corners = [(0., 0.), (4., 0.), (4., 2.7), (0., 2.7)].map(|(z, y)| DVec3::new(x, y, z)).to_vec();
            let (node, triangles) = (format!("wall at {x}"), vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions: corners, triangles }).unwrap();
        }
        builder.finish("walls").unwrap()
    }

    #[test]
    fn it_is_what_a_bake_of_one_open_cell_finds_without_a_ray() {
        let scene = walls();
        let pvs = PvsOptions { ray_budget: 0, ..PvsOptions::default() };
        let options = BakeOptions { given: Some(undivided(&scene)), pvs, keep_bounds: true, ..BakeOptions::default() };
        let baked = bake(&scene, options, &Job::quiet()).unwrap().file;
        let quick = without_rows(&scene, &ImportOptions::default());
        assert_eq!(quick.cells, baked.cells);
        assert_eq!((quick.object_rows, quick.placement), (baked.object_rows, baked.placement));
        assert_eq!((quick.model_hash, quick.objects), (baked.model_hash, baked.objects));
        assert!(quick.cells[0].open && quick.portals.is_empty());
    }
}
