//! Levels of five games, as their own tools wrote them, with the rows that another reader found in them.
#![cfg(feature = "full")]

use enfilade::BitMatrix;
use enfilade::job::Job;
use enfilade_levels::bsp::Bsp;
use enfilade_levels::prt::{Dialect, Prt, read_prt};
use enfilade_levels::rows::read_rows;
use enfilade_levels::{VisOptions, pairs_on_digits, vis};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use testing::data::data;

/// The unpacked file, if it is there.
fn file(path: &Path) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    flate2::read::GzDecoder::new(std::fs::File::open(path).ok()?).read_to_end(&mut bytes).unwrap();
    Some(bytes)
}

/// A level of the folder.
pub struct Case {
    /// As in `hl/id_dm4`.
    pub name: String,
    begin: PathBuf,
}

impl Case {
    pub fn part(&self, end: &str) -> Option<Vec<u8>> {
        file(&self.begin.with_file_name(format!("{}.{end}.gz", self.begin.file_name().unwrap().to_str().unwrap())))
    }

    fn rows(&self, end: &str, count: usize) -> Option<BitMatrix> {
        self.part(end).map(|text| read_rows(&text, count).unwrap_or_else(|e| panic!("{}: {e}", self.name)))
    }

    pub fn prt(&self) -> Option<Prt> {
        self.part("prt").map(|text| read_prt(&text).unwrap_or_else(|e| panic!("{}: {e}", self.name)))
    }
}

/// Every level, by name.
pub fn cases() -> Vec<Case> {
    let root = data().join("other-games");
    let mut found = BTreeMap::new();
    for folder in ["hl", "q1", "q2", "q3", "source"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if let Some((level, _)) = name.split_once(".vis.bsp").or_else(|| name.split_once(".novis.bsp")) {
                found.insert(format!("{folder}/{level}"), path.with_file_name(level));
            }
        }
    }
    assert!(found.len() >= 36, "{}", found.len());
    found.into_iter().map(|(name, begin)| Case { name, begin }).collect()
}

#[test]
fn rows_are_those_that_another_reader_finds() {
    let mut read = 0;
    for case in cases() {
        for end in ["novis.bsp", "vis.bsp"] {
            let Some(bytes) = case.part(end) else { continue };
            let level = Bsp::read(bytes).unwrap_or_else(|e| panic!("{} {end}: {e}", case.name));
            read += 1;
            let rows = level.rows().unwrap();
            if end == "novis.bsp" {
                assert_eq!(rows, None, "{}", case.name);
                continue;
            }
            // Files made out of another level have that level's rows.
            let Some(theirs) = case.rows("rows.txt", level.cells()) else {
                assert!(case.name.starts_with("source/made"), "{}", case.name);
                continue;
            };
            assert!(rows == Some(theirs), "{}", case.name);
            assert!(level.second_rows().unwrap() == case.rows("second.txt", level.cells()), "{}", case.name);
        }
    }
    assert!(read >= 58, "{read}");
}

/// With the rows that its own tool found, a level becomes the file that its tool wrote. What may differ: where empty lumps point; in Quake 2,
/// ericw-tools' second rows, which are too few; in Quake 3, the command line that q3map2 notes among the entities.
#[test]
fn a_level_with_the_rows_of_its_tool_is_the_file_of_its_tool() {
    let mut same = 0;
    for case in cases() {
        let (Some(before), Some(after)) = (case.part("novis.bsp"), case.part("vis.bsp")) else { continue };
        let (level, theirs) = (Bsp::read(before).unwrap(), Bsp::read(after.clone()).unwrap());
        let (rows, clusters) = by_cluster(&case, theirs.rows().unwrap().unwrap());
        let ours = level.with_rows(&rows, &clusters, None).unwrap().bytes;
        let again = Bsp::read(ours.clone()).unwrap();
        assert!(again.rows().unwrap() == theirs.rows().unwrap(), "{}", case.name);
        if let Some(second) = again.second_rows().unwrap() {
            assert!(second == union(&rows), "{}", case.name);
        }
        let differing: Vec<usize> = (0..ours.len().min(after.len())).filter(|&i| ours[i] != after[i]).collect();
        let in_directory = differing.iter().all(|&i| i < 160);
        same += usize::from(ours.len() == after.len() && in_directory);
        if case.name.starts_with("hl/") || case.name.starts_with("q1/") {
            assert!(ours.len() == after.len() && in_directory, "{}: {differing:?}", case.name);
        }
    }
    // All of Half-Life's and Quake's, and those of Quake 2 whose second rows are whole.
    assert!(same >= 10, "{same}");
}

/// What can be heard from a cluster: whatever is seen from a cluster that it sees.
fn union(rows: &BitMatrix) -> BitMatrix {
    let mut all = BitMatrix::new(rows.rows(), rows.columns());
    for a in 0..rows.rows() {
        for b in rows.ones(a) {
            rows.ones(b).for_each(|c| _ = all.set(a, c));
        }
    }
    all
}

/// Rows of the portal file's clusters, and the cluster of each cell.
fn by_cluster(case: &Case, rows: BitMatrix) -> (BitMatrix, Vec<u32>) {
    let cells = rows.rows();
    let leaves = match case.prt() {
        Some(prt) if prt.leaves.len() == cells => prt.leaves,
        _ => (0..cells as u32).collect(),
    };
    let clusters = leaves.iter().max().map_or(0, |&last| last as usize + 1);
    let mut folded = BitMatrix::new(clusters, clusters);
    for leaf in 0..cells {
        rows.ones(leaf).for_each(|other| _ = folded.set(leaves[leaf] as usize, leaves[other] as usize));
    }
    (folded, leaves)
}

#[test]
fn portal_files_of_all_games_are_read_and_fit_their_levels() {
    let mut dialects = BTreeMap::new();
    for case in cases() {
        let Some(prt) = case.prt() else { continue };
        *dialects.entry(prt.dialect.to_string()).or_insert(0) += 1;
        let level = Bsp::read(case.part("vis.bsp").or_else(|| case.part("novis.bsp")).unwrap()).unwrap();
        let fit = level.fit(&prt);
        assert!(fit.is_taken(), "{}: {fit}", case.name);
        // Some of two levels are narrower than the compiler's own tolerance.
        assert!(fit.elsewhere.len() <= if case.name.contains("/msr_") { 3 } else { 0 }, "{}: {fit}", case.name);
    }
    eprintln!("{dialects:?}");
    assert_eq!(dialects[&Dialect::HalfLife.to_string()], 7);
    assert_eq!(dialects[&Dialect::Quake3.to_string()], 5);
}

/// Half-Life's vis takes the leaves of clusters out of the portal file; rows that leaves share tell them again.
#[test]
fn shared_rows_tell_clusters_again() {
    for case in cases() {
        let (Some(prt), Some(bytes)) = (case.prt(), case.part("vis.bsp")) else { continue };
        let level = Bsp::read(bytes).unwrap();
        if prt.dialect == Dialect::HalfLife {
            assert_eq!(level.clusters_by_offset(), Some(prt.leaves), "{}", case.name);
        }
    }
}

/// Portals from the tree instead of the file give the same rows, but for pairs that are undecided or hang on the last digit of either.
/// Not for two levels: in `msr_insomnia` the compilers moved corners by up to a thousandth of a unit, in `wop_tinyCTL` by five.
#[test]
fn rows_from_the_tree_are_those_from_the_file() {
    let mut compared = 0;
    for case in cases() {
        let Some(prt) = case.prt() else { continue };
        let level = Bsp::read(case.part("vis.bsp").or_else(|| case.part("novis.bsp")).unwrap()).unwrap();
        if prt.level.portals.len() > 3000 || level.cells() != prt.level.cells {
            continue;
        }
        let tree = level.level().unwrap_or_else(|e| panic!("{}: {e}", case.name)).level;
        let run = |level| vis(level, &VisOptions::default(), None, &Job::quiet()).unwrap();
        let (ours, theirs) = (run(&tree), run(&prt.level));
        let digits = [pairs_on_digits(&tree, &ours), pairs_on_digits(&prt.level, &theirs)];
        let excused = |a: usize, b: usize| {
            let pair = [a.min(b) as u32, a.max(b) as u32];
            digits.iter().any(|pairs| pairs.binary_search(&pair).is_ok())
        };
        let count = |a: &BitMatrix, b: &BitMatrix| {
            (0..a.rows()).map(|i| a.ones(i).filter(|&j| !b.get(i, j) && !excused(i, j)).count()).sum::<usize>()
        };
        let differing = [count(&ours.lower, &theirs.upper), count(&theirs.lower, &ours.upper)];
        let most = match case.name.as_str() {
            "hl/msr_insomnia" => [140, 0],
            "q2/msr_insomnia_qbism" => [350, 12],
            "q3/wop_tinyCTL" => [0, 32],
            _ => [0, 0],
        };
        assert!(differing[0] <= most[0] && differing[1] <= most[1], "{}: {differing:?}", case.name);
        compared += 1;
    }
    assert!(compared >= 18, "{compared}");
}

/// Levels of Half-Life and Quake 2 as scenes: the world's faces have the area that another reader gives them, the leaves are cells, and what is
/// seen along random lines is in the rows.
#[test]
fn levels_of_half_life_and_quake_2_are_baked() {
    use enfilade::bake::BakeOptions;
    use enfilade_measure::verify::{CheckOptions, check};
    use qbsp::prelude::*;
    for name in ["hl/ab_vis_test", "hl/id_dm4", "q2/id_dm4", "q2/et_detail_qbism"] {
        let case = cases().into_iter().find(|case| case.name == name).unwrap();
        let bytes = case.part("vis.bsp").unwrap();
        let theirs =
            BspData::parse(BspParseInput { bsp: &bytes, lit: None, settings: BspParseSettings::default() }).unwrap();
        let world = &theirs.models[0];
        let faces = &theirs.faces[world.first_face as usize..(world.first_face + world.num_faces) as usize];
        let expected: f64 = faces.iter().map(|face| area(&theirs, face)).sum();
        let scene = enfilade_levels::quake::import_bytes(bytes, name, &Default::default()).unwrap();
        let of_world = scene.objects.iter().filter(|o| !o.node.contains(" *"));
        let triangles = of_world.flat_map(|o| o.triangles.clone());
        let found: f64 =
            triangles.map(|t| enfilade::math::geom::area(&scene.corners(t as usize))).sum::<f64>() * 32.0 * 32.0;
        // Faces of hints, skies and triggers are not drawn.
        assert!(found > 0.9 * expected && found < 1.0001 * expected, "{name}: {found} of {expected}");
        let file = testing::bakes::baked(&scene, BakeOptions { clusters: Some(0.0), ..testing::bakes::with_rays(300_000) });
        assert!(file.cells.iter().all(|cell| cell.name.starts_with("leaf ")), "{name}");
        let report = check(&file, &scene, &CheckOptions { rays: 200_000, views: 4, ..CheckOptions::default() }).unwrap();
        assert!(report.passed, "{name}: {report:?}");
    }
}

/// Levels of Quake 3 and Source as scenes: what is seen along random lines is in the rows, and no view misses a pixel.
#[test]
fn levels_of_quake_3_and_source_are_baked() {
    use enfilade::runtime::Mode;
    use enfilade_measure::verify::{CheckOptions, check};
    use enfilade_measure::walkthrough::tour::tour;
    use enfilade_measure::walkthrough::walk::walk;
    let (mut baked, mut dark) = (0, Vec::new());
    for case in cases().into_iter().filter(|case| case.name.starts_with("q3/") || case.name.starts_with("source/")) {
        let bytes = case.part("vis.bsp").or_else(|| case.part("novis.bsp")).unwrap();
        let scene = match enfilade_levels::quake::import_bytes(bytes, &case.name, &Default::default()) {
            Ok(scene) => scene,
            Err(e) => {
                assert!(case.name.contains("id_e1m1") && e.to_string().contains("its faces end at"), "{}: {e}", case.name);
                continue;
            }
        };
        baked += 1;
        if scene.objects.iter().all(|o| !o.opaque) {
            dark.push(case.name.clone());
        }
        let file = testing::bakes::baked(&scene, testing::bakes::with_rays(200_000));
        let report = check(&file, &scene, &CheckOptions { rays: 200_000, views: 4, ..CheckOptions::default() }).unwrap();
        assert!(report.passed, "{}: {report:?}", case.name);
        let mut path = tour(&file, 1);
        // Steps from piece to piece may end a millimetre within a wall.
        let is_inside = |eye: glam::DVec3| {
            let within = |plane: &glam::Vec4| plane.truncate().as_dvec3().dot(eye) < f64::from(plane.w) - 0.01;
            file.cells.iter().flat_map(|cell| &cell.pieces).any(|piece| piece.iter().all(within))
        };
        path.frames.retain(|frame| is_inside(frame.eye - file.origin));
        let each = path.frames.len().div_ceil(40);
        path.frames = path.frames.into_iter().step_by(each).collect();
        let options = testing::bakes::walk([Mode::PortalsAndPvs], [160, 90]);
        let walked = walk(&scene, &file, &path, &options, &mut |_| ()).unwrap();
        assert_eq!(walked[0].missed_pixels, Some(0), "{}", case.name);
    }
    assert!(baked == 16 && dark.is_empty(), "{baked} {dark:?}");
}

/// Displacements of a level, against the vertices that the crate `vbsp` 0.9 finds: their sum, and the area of the triangles.
#[test]
fn displacements_are_where_another_reader_has_them() {
    let case = cases().into_iter().find(|case| case.name == "source/bt_v20_test2").unwrap();
    let options = enfilade::scene::ImportOptions { metres_per_unit: Some(1.0), ..Default::default() };
    for end in ["bt_v20_test2", "made_v19_test2", "made_v21_test2", "made_v21_test2_l4d2", "made_v20_test2_lzma"] {
        let case = Case { name: end.into(), begin: case.begin.with_file_name(end) };
        let scene = enfilade_levels::quake::import_bytes(case.part("vis.bsp").unwrap(), end, &options).unwrap();
        let grounds = scene.objects.iter().filter(|o| o.node.starts_with("face "));
        let found: Vec<(usize, f64)> = grounds
            .map(|o| {
                let areas = o.triangles.clone().map(|t| enfilade::math::geom::area(&scene.corners(t as usize)));
                (o.triangles.len(), areas.sum())
            })
            .collect();
        let theirs = [(128, 266488.445), (32, 66452.636), (32, 49454.062)];
        assert_eq!(found.len(), 3, "{end}");
        for ((count, area), (their_count, their_area)) in found.into_iter().zip(theirs) {
            assert!(
                count == their_count && (area - their_area).abs() < 1e-3 * their_area,
                "{end}: {count} {area} {their_area}"
            );
        }
    }
}

/// The area of a face, by the crate `qbsp`.
fn area(level: &qbsp::BspData, face: &qbsp::data::BspFace) -> f64 {
    let edges = &level.surface_edges[face.first_edge as usize..][..face.num_edges.0 as usize];
    let vertex = |&e: &i32| {
        let edge = level.edges[e.unsigned_abs() as usize];
        let at = level.vertices[if e < 0 { edge.b.0 } else { edge.a.0 } as usize];
        glam::DVec3::from_array(at.to_array().map(f64::from))
    };
    enfilade::math::geom::area(&edges.iter().map(vertex).collect::<Vec<_>>())
}
