//! Bad input on the command line: exit 2, one line that names the file, and never a panic.

use crate::cli::{folder, maze, run_words, text};
use enfilade::file::PvsFile;
use std::path::Path;
use testing::house;
use testing::random::Random;

/// The same bytes everywhere, and no format's.
fn random_bytes() -> Vec<u8> {
    let mut random = Random::new(7);
    (0..512).flat_map(|_| random.word().to_le_bytes()).collect()
}

/// Runs a command on a bad file and checks how it ends.
fn refused(case: &str, bad: &Path, arguments: &[&str]) {
    let out = run_words(arguments);
    let error = String::from_utf8(out.stderr).expect("what is printed is text");
    assert_eq!(out.status.code(), Some(2), "{case}: {error}");
    assert_eq!(error.lines().count(), 1, "{case}: {error}");
    let name = bad.file_name().unwrap().to_str().unwrap();
    assert!(error.contains(name), "{case}: doesn't name {name}: {error}");
    assert!(!error.contains("panicked") && !error.contains("RUST_BACKTRACE"), "{case}: {error}");
    assert!(out.stdout.is_empty(), "{case}: {}", String::from_utf8_lossy(&out.stdout));
}

/// Writes each case under `extension` and bakes it; nothing may be written.
fn bake_refuses(extension: &str, cases: &[(&str, Vec<u8>)]) {
    let folder = folder(extension);
    for (case, bytes) in cases {
        let (bad, out) = (folder.join(format!("{case}.{extension}")), folder.join(format!("{case}.pvs")));
        std::fs::write(&bad, bytes).unwrap();
        refused(&format!("{case}.{extension}"), &bad, &["bake", text(&bad), "-o", text(&out), "--rays", "10k"]);
        assert!(!out.exists(), "{case}.{extension} left a file");
    }
}

fn half(bytes: &[u8]) -> Vec<u8> {
    bytes[..bytes.len() / 2].to_vec()
}

/// A triangle's positions as they lie in a buffer.
fn triangle(first: f32) -> Vec<u8> {
    [first, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A document of one triangle over a buffer of 36 bytes.
fn document(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{{uri}"byteLength":36}}]}}"#
    )
}

const NO_TRIANGLES: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"bare"}]}"#;

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + json.len() + if bin.is_empty() { 0 } else { 8 + bin.len() };
    let mut bytes = [b"glTF".as_slice(), &word(2), &word(length), &word(json.len()), b"JSON", &json].concat();
    if !bin.is_empty() {
        bytes.extend([word(bin.len()).as_slice(), b"BIN\0", bin].concat());
    }
    bytes
}

#[test]
fn bad_glb() {
    let whole = glb(&document(""), &triangle(0.0));
    bake_refuses(
        "glb",
        &[
            ("empty", Vec::new()),
            ("random", random_bytes()),
            ("cut", half(&whole)),
            ("nan", glb(&document(""), &triangle(f32::NAN))),
            ("infinite", glb(&document(""), &triangle(f32::INFINITY))),
            ("bare", glb(NO_TRIANGLES, &[])),
        ],
    );
}

#[test]
fn bad_gltf() {
    let buffers = folder("gltf");
    std::fs::write(buffers.join("whole.bin"), triangle(0.0)).unwrap();
    std::fs::write(buffers.join("nan.bin"), triangle(f32::NAN)).unwrap();
    std::fs::write(buffers.join("cut.bin"), &triangle(0.0)[..20]).unwrap();
    let over = |bin: &str| document(&format!(r#""uri":"{bin}","#)).into_bytes();
    bake_refuses(
        "gltf",
        &[
            ("empty", Vec::new()),
            ("random", random_bytes()),
            ("cut", half(&over("whole.bin"))),
            ("cut_buffer", over("cut.bin")),
            ("no_buffer", over("absent.bin")),
            ("nan", over("nan.bin")),
            ("bare", NO_TRIANGLES.as_bytes().to_vec()),
        ],
    );
}

#[test]
fn bad_obj() {
    let whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    bake_refuses(
        "obj",
        &[
            ("empty", Vec::new()),
            ("random", random_bytes()),
            ("cut", whole.as_bytes()[..whole.len() - 3].to_vec()),
            ("nan", whole.replace("v 1", "v nan").into_bytes()),
            ("bare", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec()),
            ("beyond", whole.replace("f 1 2 3", "f 1 2 4").into_bytes()),
        ],
    );
}

/// Without the feature every `.ifc` is refused, in the same manner.
#[test]
fn bad_ifc() {
    let whole = house::House::default().text();
    let lines = |keep: &dyn Fn(&str) -> bool| whole.lines().filter(|l| keep(l)).collect::<Vec<_>>().join("\n").into_bytes();
    let nan: String = whole
        .lines()
        .map(|l| match l.find("IFCCARTESIANPOINT((") {
            Some(at) => format!("{}IFCCARTESIANPOINT((NAN,NAN,NAN));\n", &l[..at]),
            None => format!("{l}\n"),
        })
        .collect();
    assert!(nan.contains("NAN"), "the house has points");
    bake_refuses(
        "ifc",
        &[
            ("empty", Vec::new()),
            ("random", random_bytes()),
            ("cut", half(whole.as_bytes())),
            ("nan", nan.into_bytes()),
            ("bare", lines(&|l| !l.contains("IFCSHAPEREPRESENTATION("))),
        ],
    );
}

#[test]
fn bad_pvs() {
    let folder = folder("pvs");
    let (model, file) = maze(&folder);
    let whole = std::fs::read(&file).unwrap();
    let mut nan = PvsFile::load(&file).unwrap();
    nan.portals[0].winding[0].x = f32::NAN;
    let mut wide = PvsFile::load(&file).unwrap();
    wide.cells[0].pieces[0][0].w = f32::INFINITY;
    let cases = [
        ("empty", Vec::new()),
        ("random", random_bytes()),
        ("cut", half(&whole)),
        ("cut_end", whole[..whole.len() - 1].to_vec()),
        ("nan", nan.write()),
        ("infinite", wide.write()),
    ];
    for (case, bytes) in cases {
        let bad = folder.join(format!("{case}.pvs"));
        std::fs::write(&bad, bytes).unwrap();
        let commands: [&[&str]; 4] = [
            &["info", text(&bad)],
            &["dump", text(&bad), "--json"],
            &["check", text(&bad), "--model", text(&model)],
            &["walk", text(&bad), "--model", text(&model)],
        ];
        for arguments in commands {
            refused(&format!("{} {case}.pvs", arguments[0]), &bad, arguments);
        }
    }
    // A file of objects without triangles is of another model, and the model is what is wrong.
    let mut bare = PvsFile::load(&file).unwrap();
    bare.objects.iter_mut().for_each(|o| o.triangles = 0);
    let bad = folder.join("bare.pvs");
    std::fs::write(&bad, bare.write()).unwrap();
    refused("check bare.pvs", &bad, &["check", text(&bad), "--model", text(&model)]);
}

#[test]
fn bad_camera_paths() {
    let folder = folder("path");
    let (model, file) = maze(&folder);
    let whole = r#"{"name":"p","fov_y_degrees":60,"near":0.05,"frames":[{"eye":[0,1.6,0],"target":[1,1.6,0]}]}"#;
    let cases: [(&str, Vec<u8>); 6] = [
        ("empty", Vec::new()),
        ("random", random_bytes()),
        ("cut", half(whole.as_bytes())),
        ("nan", whole.replace("1.6", "NaN").into_bytes()),
        ("infinite", whole.replace("1.6", "1e999").into_bytes()),
        ("no_frames", whole.replace(r#"{"eye":[0,1.6,0],"target":[1,1.6,0]}"#, "").into_bytes()),
    ];
    for (case, bytes) in cases {
        let bad = folder.join(format!("{case}.json"));
        std::fs::write(&bad, bytes).unwrap();
        refused(case, &bad, &["walk", text(&file), "--model", text(&model), "--path", text(&bad)]);
    }
}

#[test]
fn bad_cells_files() {
    let folder = folder("cells");
    let (model, _) = maze(&folder);
    let whole = r#"{"cells":[{"id":0,"min":[0,0,0],"max":[4,3,4]},{"id":1,"min":[4,0,0],"max":[8,3,4]}],
        "portals":[{"cells":[0,1],"winding":[[4,0,1],[4,2,1],[4,2,2],[4,0,2]]}]}"#;
    let cases: [(&str, Vec<u8>); 7] = [
        ("empty", Vec::new()),
        ("random", random_bytes()),
        ("cut", half(whole.as_bytes())),
        ("nan", whole.replace("[4,2,1]", "[4,NaN,1]").into_bytes()),
        ("infinite", whole.replace("[4,2,1]", "[4,1e999,1]").into_bytes()),
        ("no_cells", br#"{"cells":[]}"#.to_vec()),
        ("no_winding", whole.replace("[[4,0,1],[4,2,1],[4,2,2],[4,0,2]]", "[]").into_bytes()),
    ];
    for (case, bytes) in cases {
        let (bad, out) = (folder.join(format!("{case}.json")), folder.join(format!("{case}.pvs")));
        std::fs::write(&bad, bytes).unwrap();
        refused(case, &bad, &["bake", text(&model), "--cells", text(&bad), "-o", text(&out), "--rays", "10k"]);
        assert!(!out.exists(), "{case} left a file");
    }
}

#[test]
fn bad_indoorgml() {
    let core = "http://www.opengis.net/indoorgml/1.0/core";
    let document = |core: &str, pos: &str, duality: &str, id: &str| {
        format!(
            r##"<c:IndoorFeatures xmlns:c="{core}" xmlns:g="http://www.opengis.net/gml/3.2" xmlns:x="http://www.w3.org/1999/xlink"
g:id="f"><c:primalSpaceFeatures><c:PrimalSpaceFeatures><c:cellSpaceMember><c:CellSpace g:id="C1"><c:cellSpaceGeometry><c:Geometry3D>
<g:Solid><g:exterior><g:Shell><g:surfaceMember><g:Polygon><g:exterior><g:LinearRing>
<g:posList>{pos}</g:posList></g:LinearRing></g:exterior></g:Polygon></g:surfaceMember></g:Shell></g:exterior></g:Solid>
</c:Geometry3D></c:cellSpaceGeometry><c:duality x:href="{duality}"/></c:CellSpace></c:cellSpaceMember></c:PrimalSpaceFeatures>
</c:primalSpaceFeatures><c:multiLayeredGraph><c:stateMember><c:State g:id="{id}"/></c:stateMember></c:multiLayeredGraph>
</c:IndoorFeatures>"##
        )
    };
    let square = "0 0 0 4 0 0 4 4 0 0 4 0 0 0 0";
    let whole = document(core, square, "#S1", "S1");
    let deep = [b"<a>".repeat(1_000_000), b"</a>".repeat(1_000_000)].concat();
    let cases: [(&str, Vec<u8>, &str); 14] = [
        ("empty", Vec::new(), "the file is empty"),
        ("random", random_bytes(), "not UTF-8"),
        ("cut", half(whole.as_bytes()), "not well-formed XML"),
        ("deep", deep, "the root is <a>"),
        ("deep_open", b"<a>".repeat(1_000_000), "not well-formed XML"),
        ("other_root", b"<kml/>".to_vec(), "the root is <kml>"),
        ("other_namespace", document("http://example.org/", square, "#S1", "S1").into_bytes(), "not IndoorGML 1"),
        (
            "laughs",
            [b"<!DOCTYPE a [<!ENTITY b \"c\">]>".as_slice(), whole.as_bytes()].concat(),
            "document types are not supported",
        ),
        (
            "nan",
            document(core, &square.replacen('4', "NaN", 1), "#S1", "S1").into_bytes(),
            "line 4: `NaN` is not a coordinate",
        ),
        ("far", document(core, &square.replacen('4', "1e300", 1), "#S1", "S1").into_bytes(), "`1e300` is not a coordinate"),
        ("plane", document(core, "0 0 4 0", "#S1", "S1").into_bytes(), "4 numbers; a corner needs three"),
        ("dangling", document(core, square, "#S9", "S1").into_bytes(), "`#S9`: no element has this gml:id"),
        ("elsewhere", document(core, square, "other.gml#S1", "S1").into_bytes(), "is in another file"),
        ("twice", document(core, square, "#S1", "C1").into_bytes(), "gml:id `C1` occurs twice; first in line 2"),
    ];
    let folder = folder("gml");
    let (model, _) = maze(&folder);
    for (case, bytes, what) in cases {
        let (bad, out) = (folder.join(format!("{case}.gml")), folder.join(format!("{case}.pvs")));
        std::fs::write(&bad, bytes).unwrap();
        refused(case, &bad, &["bake", text(&bad), "-o", text(&out), "--rays", "10k"]);
        refused(case, &bad, &["bake", text(&model), "--cells", text(&bad), "-o", text(&out), "--rays", "10k"]);
        let error = String::from_utf8(run_words(&["bake", text(&bad), "-o", text(&out)]).stderr).unwrap();
        assert!(error.contains(what), "{case}: {error}");
        assert!(!out.exists(), "{case} left a file");
    }
}

/// What an absent or an empty file is told as, before any work.
#[test]
fn what_is_missing_is_named() {
    let folder = folder("missing");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    write("empty.glb", b"");
    write("empty.obj", b"");
    write("beside.gltf", document(r#""uri":"gone.bin","#).as_bytes());
    write("whole.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let bake = |input: &str, out: &str| {
        let out = run_words(&["bake", &path(input), "-o", &path(out), "--rays", "10k"]);
        assert_eq!(out.status.code(), Some(2), "{input}");
        String::from_utf8(out.stderr).unwrap()
    };
    for (input, out, why) in [
        ("empty.glb", "x.pvs", "empty.glb: the file is empty\n"),
        ("empty.obj", "x.pvs", "empty.obj: the file is empty\n"),
        ("gone.glb", "x.pvs", "gone.glb: there is no such file\n"),
        (
            "beside.gltf",
            "x.pvs",
            "beside.gltf: buffer 0: `gone.bin` is missing: the model refers to it; put it where the model expects it\n",
        ),
        ("whole.obj", "none/x.pvs", "missing/none: there is no such folder\n"),
    ] {
        let said = bake(input, out);
        assert!(said.ends_with(why), "{said}");
    }
}
