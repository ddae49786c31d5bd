//! Cells that share a row: by cost in a hall whose rows are known, and on a real level.

use enfilade::bake::{BakeOptions, Baked, bake};
use enfilade::cells::{CellGraph, Portal, PortalKind};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::scene::Scene;
use enfilade_measure::verify::{CheckOptions, check};
use glam::DVec3;
use testing::bakes::with_rays;
use testing::meshes::{scene, solid};
use testing::rooms::{ball, box_piece, graph, portal};

/// A hall of 12 x 4 m, 3 m high, and behind its end, through a hole of 0.4 m, a closet. A ball in the closet is beside every line
/// through the hole.
fn hall() -> Scene {
    let shell = [
        ([-0.2, -0.2, -0.2], [16.4, 0.0, 4.2]),
        ([-0.2, 3.0, -0.2], [16.4, 3.2, 4.2]),
        ([-0.2, 0.0, -0.2], [0.0, 3.0, 4.2]),
        ([16.2, 0.0, -0.2], [16.4, 3.0, 4.2]),
        ([0.0, 0.0, -0.2], [16.2, 3.0, 0.0]),
        ([0.0, 0.0, 4.0], [16.2, 3.0, 4.2]),
        // The wall with the hole.
        ([12.0, 0.0, 0.0], [12.2, 3.0, 0.2]),
        ([12.0, 0.0, 0.6], [12.2, 3.0, 4.0]),
        ([12.0, 0.0, 0.2], [12.2, 1.0, 0.6]),
        ([12.0, 2.0, 0.2], [12.2, 3.0, 0.6]),
    ];
    let solids = shell.iter().enumerate().map(|(i, &(min, max))| solid(&format!("wall {i}"), min, max));
    scene(solids.chain([ball("ball", DVec3::new(12.6, 1.5, 3.4), 0.3, 4)]))
}

/// The hall in three cells, and the closet.
fn cells(scene: &Scene, between: [PortalKind; 2]) -> CellGraph {
    let origin = scene.origin;
    let part = |x0: f64, x1: f64| box_piece([x0, 0.0, 0.0], [x1, 3.0, 4.0], origin);
    let closet = vec![part(12.2, 16.2), box_piece([12.0, 1.0, 0.2], [12.2, 2.0, 0.6], origin)];
    // The first two cells have two portals side by side.
    let side = |x: f64, y0: f64, y1: f64, kind: PortalKind, cells: [u32; 2]| Portal {
        kind,
        ..portal(cells, 0, [x, y0, 0.0], [x, y1, 4.0], origin)
    };
    let portals = vec![
        side(4.0, 0.0, 1.5, between[0], [0, 1]),
        side(4.0, 1.5, 3.0, between[1], [0, 1]),
        side(8.0, 0.0, 3.0, PortalKind::Opening, [1, 2]),
        portal([2, 3], 0, [12.0, 1.0, 0.2], [12.0, 2.0, 0.6], origin),
    ];
    graph(vec![vec![part(0.0, 4.0)], vec![part(4.0, 8.0)], vec![part(8.0, 12.0)], closet], portals)
}

fn baked(scene: &Scene, given: Option<CellGraph>, clusters: Option<f64>, rays: u64) -> PvsFile {
    with_details(scene, given, clusters, rays).file
}

fn with_details(scene: &Scene, given: Option<CellGraph>, clusters: Option<f64>, rays: u64) -> Baked {
    bake(scene, BakeOptions { given, clusters, keep_bounds: true, ..with_rays(rays) }, &Job::quiet()).unwrap()
}

#[test]
fn cells_are_joined_as_far_as_their_rows_may_grow() {
    let scene = hall();
    let ball = scene.objects.iter().position(|o| o.node == "ball").unwrap();
    let triangles = |o: usize| scene.objects[o].triangles.len() as f64;
    let [walls, ball_triangles] = [(0..ball).map(triangles).sum::<f64>(), triangles(ball)];
    assert_eq!((walls, scene.objects.len()), (120.0, 11));
    // From the hall all but the ball shows, from the closet all.
    let [hall, closet] = [12.0 * 3.0 * 4.0, 4.0 * 3.0 * 4.0 + 0.2 * 1.0 * 0.4];
    let mean = (hall * walls + closet * (walls + ball_triangles)) / (hall + closet);
    let all_in_one = (walls + ball_triangles) / mean - 1.0;
    for (growth, expected) in [
        (0.0, vec![]),
        (1e-6, vec![3, 1]),
        (0.05, vec![3, 1]),
        (all_in_one - 1e-3, vec![3, 1]),
        (all_in_one + 1e-3, vec![4]),
        (10.0, vec![4]),
    ] {
        let given = Some(cells(&scene, [PortalKind::Opening; 2]));
        let Baked { file, details, .. } = with_details(&scene, given, Some(growth), 200_000);
        let sees = |cell: usize| file.object_rows.as_ref().is_none_or(|rows| rows.get(cell, ball));
        assert_eq!(file.clusters, expected, "{growth}");
        let count = if expected.is_empty() { 4 } else { expected.len() };
        assert_eq!((file.cells.len(), sees(0), sees(count - 1)), (count, count == 1, true), "{growth}");
        // A detail says what rows cost before and after, to a tenth of a triangle.
        let after = if count == 1 { walls + ball_triangles } else { mean };
        let note = format!("4 cells joined to {count}; a row grows from {mean:.1} to {after:.1} triangles");
        assert_eq!(details.iter().filter(|n| n.contains(&note)).count(), usize::from(growth > 0.0), "{details:?}");
        let report = check(&file, &scene, &CheckOptions { rays: 50_000, views: 4, ..CheckOptions::default() }).unwrap();
        assert_eq!((report.passed, report.structure.count), (true, 0), "{growth}: {:?}", report.examples);
        assert_eq!(PvsFile::read(&file.write()).unwrap(), file);
    }
}

#[test]
fn a_door_keeps_cells_apart() {
    let scene = hall();
    // A door beside an opening counts, too: it can shut, and as a part of one cell it could not.
    for between in [[PortalKind::Door; 2], [PortalKind::Opening, PortalKind::Door]] {
        let file = baked(&scene, Some(cells(&scene, between)), Some(0.05), 50_000);
        assert_eq!((file.clusters, file.portals.len()), (vec![1, 2, 1], 3));
        let file = baked(&scene, Some(cells(&scene, between)), Some(10.0), 50_000);
        assert_eq!((file.clusters, file.portals.len()), (vec![1, 3], 2));
    }
}

#[test]
fn open_and_closed_cells_stay_apart() {
    let scene = hall();
    let mut given = cells(&scene, [PortalKind::Opening; 2]);
    given.cells[1].open = true;
    assert_eq!(baked(&scene, Some(given), Some(10.0), 50_000).clusters, [1, 1, 2]);
}

mod level {
    use super::*;
    use enfilade::math::geom::{Plane, area, clip};
    use enfilade::proof::{Asker, Goal, Why};
    use enfilade::scene::ImportOptions;
    use enfilade::{BitMatrix, CellId, ObjectId};
    use enfilade_levels::quake::import_bytes;
    use glam::Vec4;
    use testing::data::data;

    /// Cubic metres of a bounded convex piece: pyramids over its faces.
    fn volume(piece: &[Vec4]) -> f64 {
        let planes: Vec<Plane> = piece.iter().map(|h| Plane { n: h.truncate().as_dvec3(), d: f64::from(h.w) }).collect();
        let pyramid = |i: usize| {
            let (u, v) = planes[i].n.any_orthonormal_pair();
            let square = [u + v, v - u, -u - v, u - v].map(|c| planes[i].n * planes[i].d + c * 1e4).to_vec();
            let others = planes.iter().enumerate().filter(|&(j, _)| j != i);
            planes[i].d * area(&others.fold(square, |face, (_, other)| clip(&face, other, 1e-9))) / 3.0
        };
        (0..planes.len()).map(pyramid).sum()
    }

    /// Of a level's leaves, with exact rows: clusters have the unions of rows, cost what was allowed, and lose nothing.
    #[test]
    #[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
    fn clusters_of_leaves_have_their_rows_and_cost_a_twentieth_more() {
        let folder = data();
        let bytes = std::fs::read(folder.join("quake-id-gpl/dm4.bsp")).unwrap();
        let scene = import_bytes(bytes, "dm4", &ImportOptions::default()).unwrap();
        let leaves = baked(&scene, None, Some(0.0), 300_000);
        let clusters = baked(&scene, None, None, 300_000);
        assert!(leaves.clusters.is_empty() && 4 * clusters.cells.len() < leaves.cells.len(), "{}", clusters.cells.len());
        assert_eq!(clusters.clusters.iter().sum::<u32>() as usize, leaves.cells.len());

        let [few, many] = [&clusters, &leaves].map(|file| file.object_rows.as_ref().unwrap());
        let triangles =
            |rows: &BitMatrix, row: usize| rows.ones(row).map(|o| f64::from(leaves.objects[o].triangles)).sum::<f64>();
        let (mut before, mut after, mut found) = (0.0, 0.0, 0);
        for (c, cell) in clusters.cells.iter().enumerate() {
            let member = |piece| leaves.cells.iter().position(|leaf| leaf.pieces == [piece].map(Clone::clone)).unwrap();
            let members: Vec<usize> = cell.pieces.iter().map(member).collect();
            found += members.len();
            let mut united = vec![0; few.row(c).len()];
            for &leaf in &members {
                united.iter_mut().zip(many.row(leaf)).for_each(|(all, more)| *all |= more);
                let volume = volume(&leaves.cells[leaf].pieces[0]);
                before += volume * triangles(many, leaf);
                after += volume * triangles(few, c);
            }
            assert_eq!(united, few.row(c), "cluster {c}");
        }
        assert_eq!(found, leaves.cells.len());
        let growth = after / before - 1.0;
        assert!(growth <= 0.05 && growth > 0.04, "{growth}");

        let report =
            check(&clusters, &scene, &CheckOptions { rays: 200_000, views: 10, ..CheckOptions::default() }).unwrap();
        assert!(report.passed, "{:?}", report.examples);
        // Every pair that is hidden is said to be, whatever portals of clusters let through.
        let asker = Asker::new(&clusters, None).unwrap();
        let (mut hidden, mut joined) = (0, 0);
        for (c, o) in (0..clusters.cells.len()).flat_map(|c| (c % 29..scene.objects.len()).step_by(29).map(move |o| (c, o)))
        {
            if !few.get(c, o) {
                let why = asker.why(CellId(c as u32), Goal::Object(ObjectId(o as u32))).unwrap();
                hidden += 1;
                joined += usize::from(matches!(why, Why::Joined(n) if n == clusters.clusters[c]));
                assert!(matches!(why, Why::Joined(_) | Why::Separated(_) | Why::Apart), "{c} {o}: {why:?}");
            }
        }
        assert!(joined > 0 && joined < hidden, "{joined} of {hidden}");
    }
}
