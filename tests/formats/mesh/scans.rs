//! STL and PLY written by hand, with known triangles; damaged ones are refused.

use super::{TRIANGLE, assert_triangles, world};
use enfilade::scene::{ImportError, ImportOptions, Scene};
use enfilade_formats::{ply, stl};

/// A square in the plane z = 2, as two triangles and as a polygon.
const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 1.0, 2.0], [0.0, 1.0, 2.0]];

fn read_stl(bytes: &[u8]) -> Result<Scene, ImportError> {
    stl::from_slice(bytes, "scan", &ImportOptions::default())
}

fn read_ply(bytes: &[u8]) -> Result<Scene, ImportError> {
    ply::from_slice(bytes, "scan", &ImportOptions::default())
}

fn square() -> Vec<[[f64; 3]; 3]> {
    let [a, b, c, d] = SQUARE.map(|p| p.map(f64::from));
    vec![[a, b, c], [a, c, d]]
}

fn binary_stl(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for corners in triangles {
        let numbers = [0.0; 3].into_iter().chain(corners.iter().flatten().copied());
        bytes.extend(numbers.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_is_read_in_both_forms() {
    let [a, b, c, d] = SQUARE;
    let triangles = [[a, b, c], [a, c, d]];
    let facet = |t: &[[f32; 3]; 3]| {
        let corners: String = t.iter().map(|[x, y, z]| format!("vertex {x} {y} {z}\n")).collect();
        format!("facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n")
    };
    let text = format!("solid square\n{}endsolid square\n", triangles.iter().map(facet).collect::<String>());
    for bytes in [binary_stl(&triangles), text.into_bytes()] {
        let scene = read_stl(&bytes).unwrap();
        assert_triangles(&world(&scene, 0), &square());
        assert_eq!((scene.positions.len(), scene.objects[0].node.as_str()), (4, "scan"));
    }
    // In inches, +Z up: (x, y, z) is (x, z, -y).
    let options = ImportOptions { metres_per_unit: Some(0.0254), z_up: true, ..ImportOptions::default() };
    let scene = stl::from_slice(&binary_stl(&[TRIANGLE]), "scan", &options).unwrap();
    assert_triangles(&world(&scene, 0), &[[[0.0; 3], [0.0254, 0.0, 0.0], [0.0, 0.0, -0.0254]]]);
}

#[test]
fn damaged_stl_is_refused() {
    let whole = binary_stl(&[TRIANGLE, TRIANGLE]);
    let mut lying = whole.clone();
    lying[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut nan = whole.clone();
    nan[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    for (bytes, why) in [
        (&whole[..whole.len() - 30], "not an STL file"),
        (&lying, "not an STL file"),
        (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex a 0 0\n", "not an STL file"),
        (&binary_stl(&[]), "no triangles in it"),
    ] {
        let error = read_stl(bytes).unwrap_err().to_string();
        assert!(error.contains(why) && !error.contains('\n'), "{error}");
    }
    // A triangle without a place is left out.
    let scene = read_stl(&nan).unwrap();
    assert!(scene.source.notes.iter().any(|note| note.contains("not a finite number")), "{:?}", scene.source.notes);
}

const HEADER: &str = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";

#[test]
fn ply_is_read_in_all_forms() {
    let text = format!("ply\nformat ascii 1.0\ncomment a square\n{HEADER}0 0 2 9\n1 0 2 9\n1 1 2 9\n0 1 2 9\n4 0 1 2 3\n");
    assert_triangles(&world(&read_ply(text.as_bytes()).unwrap(), 0), &square());
    for (form, number, index) in [
        ("binary_little_endian", f32::to_le_bytes as fn(f32) -> [u8; 4], i32::to_le_bytes as fn(i32) -> [u8; 4]),
        ("binary_big_endian", f32::to_be_bytes, i32::to_be_bytes),
    ] {
        let mut bytes = format!("ply\nformat {form} 1.0\n{HEADER}").into_bytes();
        for p in SQUARE {
            bytes.extend(p.into_iter().flat_map(number));
            bytes.push(9);
        }
        bytes.push(4);
        bytes.extend((0..4).flat_map(index));
        assert_triangles(&world(&read_ply(&bytes).unwrap(), 0), &square());
    }
}

#[test]
fn damaged_ply_is_refused() {
    let whole = format!("ply\nformat ascii 1.0\n{HEADER}0 0 2 9\n1 0 2 9\n1 1 2 9\n0 1 2 9\n4 0 1 2 3\n");
    for (from, to, why) in [
        ("ply\n", "plx\n", "not a PLY file"),
        ("vertex 4", "vertex 4000000000", "not a PLY file"),
        ("4 0 1 2 3", "4 0 1 2", "not a PLY file"),
        ("4 0 1 2 3", "4 0 1 2 4", "face 0: vertex 4 of 4 does not exist"),
        ("4 0 1 2 3", "4 0 1 2 -1", "face 0 has no list of vertices"),
        ("face 1", "face 0", "no triangles in it"),
        ("1 1 2 9", "1 nan 2 9", "not a PLY file"),
    ] {
        let text = whole.replace(from, to);
        let text = if to == "face 0" { text.replace("4 0 1 2 3\n", "") } else { text };
        let error = read_ply(text.as_bytes()).unwrap_err().to_string();
        assert!(error.contains(why) && !error.contains('\n'), "{to}: {error}");
    }
    // Points alone, and a list that says more than there is.
    let points =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
    assert!(matches!(read_ply(points.as_bytes()), Err(ImportError::Empty)));
    let mut lying =
        format!("ply\nformat binary_little_endian 1.0\n{}", HEADER.replace("uchar int", "uint int")).into_bytes();
    lying.extend([0; 4 * 13]);
    lying.extend(u32::MAX.to_le_bytes());
    assert!(read_ply(&lying).unwrap_err().to_string().contains("not a PLY file"));
}
