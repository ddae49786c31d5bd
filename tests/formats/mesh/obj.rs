//! OBJ written by hand, with known triangles.

use super::{assert_sound, assert_triangles, read_obj, world};
use crate::cli::folder;
use enfilade::scene::{ImportError, ImportOptions, Role};
use enfilade_formats::import;
use glam::DVec3;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn every_form_of_a_face_is_read() {
    let expected = [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]];
    for face in [
        "f 1 2 3",
        "f 1/1 2/2 3/3",
        "f 1//1 2//1 3//1",
        "f 1/1/1 2/2/1 3/3/1",
        "f -4 -3 -2",
        "f\t1  2\\\n 3 # x",
        "f +1 2 3\r",
    ] {
        let scene = read_obj(&format!("{SQUARE}{face}\n")).unwrap();
        assert_triangles(&world(&scene, 0), &expected);
    }
    // Vertices may come after the faces that use them, with weights or colours.
    let scene = read_obj("f 1 2 3\nv 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 1.0 1e0 -0").unwrap();
    assert_triangles(&world(&scene, 0), &expected);
}

#[test]
fn polygons_are_cut_into_triangles_that_cover_them_once() {
    let area = |text: &str| {
        let scene = read_obj(text).unwrap();
        let areas = world(&scene, 0).into_iter().map(|[a, b, c]| (b - a).cross(c - a).dot(DVec3::Z) / 2.0);
        (scene.triangles.len(), areas.clone().sum::<f64>(), areas.fold(f64::MAX, f64::min) > 0.0)
    };
    assert_eq!(area(&format!("{SQUARE}f 1 2 3 4")), (2, 1.0, true));
    // A dart: fans from two of its corners would reach outside.
    for face in ["f 1 2 3 4", "f 2 3 4 1", "f 3 4 1 2", "f 4 1 2 3"] {
        assert_eq!(area(&format!("v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\n{face}")), (2, 1.0, true));
    }
    // An L.
    assert_eq!(area("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 3 4 5 6 1 2"), (4, 3.0, true));
}

#[test]
fn groups_and_materials_make_objects_in_order_of_first_use() {
    let names = |text: &str| {
        let scene = read_obj(&format!("{SQUARE}{text}")).unwrap();
        assert_sound(&scene, &ImportOptions::default());
        assert!(scene.objects.iter().all(|o| o.role == Role::Unknown && o.opaque));
        scene.objects.iter().map(|o| (o.node.clone(), o.triangles.len())).collect::<Vec<_>>()
    };
    let pairs = |pairs: &[(&str, usize)]| pairs.iter().map(|&(n, t)| (n.to_owned(), t)).collect::<Vec<_>>();
    let f = "f 1 2 3\n";
    assert_eq!(names(f), pairs(&[("mesh", 1)]));
    assert_eq!(names(&format!("usemtl red\n{f}")), pairs(&[("red", 1)]));
    assert_eq!(names(&format!("o object_0\n{f}{f}o object_1\nusemtl red\n{f}")), pairs(&[("object_0", 2), ("object_1", 1)]));
    assert_eq!(names(&format!("g slot 2\nusemtl x\n{f}g b\n{f}g slot 2\n{f}")), pairs(&[("slot 2", 2), ("b", 1)]));
    assert_eq!(names(&format!("o a\ng b\n{f}g a\n{f}")), pairs(&[("a/b", 1), ("a", 1)]));
    assert_eq!(
        names(&format!("o a\nusemtl red\n{f}usemtl blue\n{f}usemtl red\n{f}o b\n{f}")),
        pairs(&[("a/red", 2), ("a/blue", 1), ("b", 1)])
    );
}

#[test]
fn a_material_library_says_what_is_see_through() {
    let folder = folder("a_material_library");
    let text = format!(
        "mtllib my lib.mtl\nmtllib none.mtl other.mtl\nmtllib ../up.mtl\n{SQUARE}\
         usemtl wall\nf 1 2 3\nusemtl glass\nf 1 2 3\nusemtl leaf\nf 1 2 3\nusemtl lost\nf 1 2 3\n"
    );
    std::fs::write(folder.join("a.obj"), text).unwrap();
    std::fs::write(folder.join("my lib.mtl"), "newmtl wall\nd 1\nillum 0\nnewmtl glass\nd 0.4\n").unwrap();
    std::fs::write(folder.join("other.mtl"), "newmtl leaf\nTr 0.1\n").unwrap();
    let scene = import(&folder.join("a.obj"), &ImportOptions::default()).unwrap();
    let found: Vec<_> = scene.objects.iter().map(|o| (o.node.as_str(), o.opaque)).collect();
    assert_eq!(found, [("wall", true), ("glass", false), ("leaf", false), ("lost", true)]);
    assert_eq!(scene.source.notes.len(), 3);
    assert!(scene.source.notes[2].starts_with("50 % of the triangles have see-through materials"));
    assert!(scene.source.notes[0].starts_with("materials count as opaque: `none.mtl` is missing"));
    assert!(scene.source.notes[1].starts_with("materials count as opaque: `../up.mtl` leads out of the model's folder"));
}

#[test]
fn what_is_skipped_is_noted() {
    let scene =
        read_obj(&format!("{SQUARE}l 1 2\np 1\nsurf 0 1 0 1 1 2\nfrobnicate\nbanana 3\nvt 0 0\ns off\nf 1 2 3\nf 1 2 2\n"))
            .unwrap();
    assert_eq!(
        scene.source.notes,
        [
            "1 lines left out; --tubes METRES makes them tubes",
            "1 points left out",
            "1 free-form curves and surfaces left out",
            "2 unknown statements skipped, the first is `frobnicate` in line 8",
            "1 triangles without area dropped",
        ]
    );
}

#[test]
fn metres_per_unit_scales_positions() {
    let options = ImportOptions { metres_per_unit: Some(0.0254), ..ImportOptions::default() };
    let scene = enfilade_formats::obj::from_slice(format!("{SQUARE}f 1 2 3").as_bytes(), "inch", None, &options).unwrap();
    assert!((scene.bounds().size().x - 0.0254).abs() < 1e-15);
    assert_eq!(scene.source.metres_per_unit, 0.0254);
}

#[test]
fn errors_name_the_line_and_what_is_wrong() {
    for (line, why) in [
        ("v 1 2", "line 5: a vertex needs three numbers"),
        ("v 1 2 x", "line 5: `x` is not a number"),
        ("f 1 2", "line 5: a face needs three vertices or more, this one has 2"),
        ("f", "line 5: a face needs three vertices or more, this one has 0"),
        ("f 1 2 5", "line 5: vertex 5 of 4 does not exist"),
        ("f 1 2 0", "line 5: vertex 0 of 4 so far does not exist"),
        ("f 1 2 -5", "line 5: vertex -5 of 4 so far does not exist"),
        ("f 1 2 99999999999", "line 5: vertex 99999999999 of 4 so far does not exist"),
        ("f 1 2 99999999999999999999", "line 5: `99999999999999999999` is not a vertex"),
        ("f 1 2 -9223372036854775808", "line 5: vertex -9223372036854775808 of 4 so far does not exist"),
        ("f 1 2 /3", "line 5: `/3` is not a vertex"),
        ("f 1 2 a", "line 5: `a` is not a vertex"),
        ("f 1 \\\n2 \\\n9", "line 5: vertex 9 of 4 does not exist"),
    ] {
        let error = read_obj(&format!("{SQUARE}{line}\nf 1 2 3\n")).unwrap_err();
        assert_eq!(error.to_string(), why);
    }
    let error = read_obj("\0\u{1}garbage").unwrap_err().to_string();
    assert_eq!(error, "not an OBJ file: no vertices in it, and it begins with the bytes 00 01 67 61 72 62 61 67");
    for empty in ["", SQUARE, "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3"] {
        assert!(matches!(read_obj(empty), Err(ImportError::Empty)), "{empty:?}");
    }
    assert!(
        matches!(read_obj("v 0 0 0\nv 1 0 0\nv 0 1e13 0\nf 1 2 3"), Err(ImportError::NotFinite { node }) if node == "mesh")
    );
    // One among others costs its triangles.
    for bad in ["nan", "inf", "1e999", "1e13"] {
        let scene = read_obj(&format!("{SQUARE}v 1 2 {bad}\nf 1 2 5\nf 1 2 3\n")).unwrap();
        assert_eq!(scene.triangles.len(), 1, "{bad}");
        assert!(scene.source.notes[0].starts_with("1 triangles left out: a corner is not a finite number"), "{bad}");
    }
}
