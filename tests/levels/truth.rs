//! The rows of a mesh's bake against the exact rows of the level that the mesh is the faces of.
#![cfg(feature = "full")]

use enfilade::bake::BakeOptions;
use enfilade::cells::{SplitOptions, Strategy};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::{VisOptions, vis};
use qbsp::prelude::*;
use testing::bakes;
use testing::data::data;
use testing::level_mesh::{LevelMesh, metres, obj_text, units};
use testing::truth::Truth;
use testing::world::World;

const LEVEL: &str = "quake-id-gpl/dm4.bsp";
const POINTS: usize = 8;
const LINES: u64 = 50_000;
const RAYS: u64 = 300_000;

fn baked(mesh: &LevelMesh, strategy: Option<Strategy>) -> PvsFile {
    let split = SplitOptions { strategy, ..SplitOptions::default() };
    bakes::baked(&mesh.scene, BakeOptions { split, keep_bounds: true, ..bakes::with_rays(RAYS) })
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn rows_of_a_mesh_agree_with_exact_rows_and_damaged_ones_do_not() {
    let folder = data();
    let bytes = std::fs::read(folder.join(LEVEL)).unwrap();
    let world = World::read(&bytes);
    let level = Bsp::read(bytes).unwrap().level().unwrap().level;
    let exact = vis(&level, &VisOptions::default(), None, &Job::quiet()).unwrap();
    assert_eq!(exact.lower, exact.upper);
    let mesh = LevelMesh::new(&world, "dm4");
    let truth = Truth::new(&world, &mesh, &exact.upper, POINTS, 1);
    for strategy in [None, Some(Strategy::Bsp)] {
        // 1. No line shows what a row lacks, and no witness shows what is hidden.
        let mut file = baked(&mesh, strategy);
        truth.sights(&file, LINES, 2).assert_sound("dm4");
        truth.witnessed(file.bounds.as_ref().unwrap()).assert_sound("dm4");
        let figures = truth.figures(&file);
        eprintln!("{strategy:?}: {figures:?}");
        // A cell that is a part of a leaf need not see what the leaf sees; such pairs are few.
        let left_out = figures.leaves.left_out;
        assert!(figures.nowhere == 0 && 200 * left_out < figures.leaves.visible, "{figures:?}");
        let openings = truth.openings(&file, 100_000, 64, 3);
        eprintln!("{openings:?}");
        assert!(
            openings.astray == 0
                && openings.cells > 10
                && openings.portals > openings.cells
                && openings.solid < openings.area
        );
        assert!(figures.leaves.witnessed <= figures.leaves.hidden && figures.objects.witnessed <= figures.objects.hidden);

        // 2. Rows that lack what their cell sees most of are found out, both kinds.
        let rows = [&mut file.object_rows, &mut file.cell_rows].map(|rows| rows.as_mut().unwrap());
        for rows in rows {
            (0..rows.rows()).for_each(|row| (0..rows.columns()).step_by(5).for_each(|column| rows.clear(row, column)));
        }
        let sights = truth.sights(&file, LINES, 2);
        assert!(sights.missed_objects > 100 && sights.missed_cells > 100, "{sights:?}");
        assert!(truth.figures(&file).leaves.left_out > 100 * (1 + left_out));
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn the_level_read_by_hand_is_the_one_that_qbsp_reads() {
    let folder = data();
    let bytes = std::fs::read(folder.join(LEVEL)).unwrap();
    let theirs = BspData::parse(BspParseInput { bsp: &bytes, lit: None, settings: BspParseSettings::default() }).unwrap();
    let world = World::read(&bytes);
    let mesh = LevelMesh::new(&world, "dm4");

    // 1. Points are in the same leaves, and lengths survive the way to metres and back.
    let rows = enfilade::BitMatrix::new(world.leaves.len() - 1, 1);
    assert_eq!(rows.rows(), Bsp::read(bytes).unwrap().cells());
    for leaf in &world.leaves {
        let p = leaf.bounds.centre();
        assert_eq!(world.leaf_at(p), theirs.leaf_at_point(0, p.as_vec3()));
        assert!(units(metres(p)).distance(p) < 1e-9);
    }

    // 2. Faces turn their counter-clockwise side to where they are seen from, and all opaque ones are in the mesh.
    for (face, objects) in world.faces.iter().zip(&mesh.objects) {
        let corners: Vec<_> = face.corners.iter().map(|&c| world.vertices[c]).collect();
        assert!(enfilade::math::geom::newell(&corners).dot(face.plane.n) > 0.0);
        assert!(corners.iter().all(|&c| face.plane.distance(c).abs() < 0.1));
        assert_eq!(face.opaque, !objects.is_empty());
    }
    assert!(world.faces.iter().any(|face| !face.opaque), "this level has lava");
    let marked = world.leaves.iter().flat_map(|leaf| &leaf.faces).filter(|&&f| f < world.faces.len()).count();
    assert!(marked >= world.faces.len(), "each face is on the boundary of a leaf");
    assert_eq!(obj_text(&world).lines().filter(|line| line.starts_with("f ")).count(), 5210);
}
