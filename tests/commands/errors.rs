//! Bad input on the command line: exit 2, one line that names the file, and never a panic.

use crate::cli::{folder, maze, run_words, text};
use enfilade::file::PvsFile;
use std::path::Path;
use testing::glb::pack;
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

/// Writes each case under `extension`, and what is the same for every format, and runs `commands` on it; nothing may be written.
fn refuses(folder: &Path, extension: &str, cases: &[(&str, Vec<u8>)], commands: &[&[&str]]) {
    for (case, bytes) in [("empty", Vec::new()), ("random", random_bytes())].iter().chain(cases) {
        let (bad, out) = (folder.join(format!("{case}.{extension}")), folder.join(format!("{case}.out.pvs")));
        std::fs::write(&bad, bytes).unwrap();
        for words in commands {
            let word = |word: &&str| match *word {
                "BAD" => text(&bad).to_owned(),
                "OUT" => text(&out).to_owned(),
                word => word.to_owned(),
            };
            let words: Vec<String> = words.iter().map(word).collect();
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            refused(&format!("{} {case}.{extension}", words[0]), &bad, &words);
            assert!(!out.exists(), "{case}.{extension} left a file");
        }
    }
}

/// The same of a model that is baked.
#[track_caller]
fn bake_refuses(extension: &str, cases: &[(&str, Vec<u8>)]) {
    refuses(&folder(extension), extension, cases, &[&["bake", "BAD", "-o", "OUT", "--rays", "10k"]]);
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
    pack(json.as_bytes(), (!bin.is_empty()).then_some(bin))
}

#[test]
fn bad_glb() {
    let whole = glb(&document(""), &triangle(0.0));
    bake_refuses(
        "glb",
        &[
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
        ("cut", half(&whole)),
        ("cut_end", whole[..whole.len() - 1].to_vec()),
        ("nan", nan.write()),
        ("infinite", wide.write()),
    ];
    let model = text(&model);
    let commands: [&[&str]; 4] = [
        &["info", "BAD"],
        &["dump", "BAD", "--json"],
        &["check", "BAD", "--model", model],
        &["walk", "BAD", "--model", model],
    ];
    refuses(&folder, "pvs", &cases, &commands);
    // A file of objects without triangles is of another model, and the model is what is wrong.
    let mut bare = PvsFile::load(&file).unwrap();
    bare.objects.iter_mut().for_each(|o| o.triangles = 0);
    let bad = folder.join("bare.pvs");
    std::fs::write(&bad, bare.write()).unwrap();
    refused("check bare.pvs", &bad, &["check", text(&bad), "--model", model]);
}

#[test]
fn bad_camera_paths() {
    let folder = folder("path");
    let (model, file) = maze(&folder);
    let whole = r#"{"name":"p","fov_y_degrees":60,"near":0.05,"frames":[{"eye":[0,1.6,0],"target":[1,1.6,0]}]}"#;
    let cases = [
        ("cut", half(whole.as_bytes())),
        ("nan", whole.replace("1.6", "NaN").into_bytes()),
        ("infinite", whole.replace("1.6", "1e999").into_bytes()),
        ("no_frames", whole.replace(r#"{"eye":[0,1.6,0],"target":[1,1.6,0]}"#, "").into_bytes()),
    ];
    refuses(&folder, "json", &cases, &[&["walk", text(&file), "--model", text(&model), "--path", "BAD"]]);
}

#[test]
fn bad_cells_files() {
    let folder = folder("cells");
    let (model, _) = maze(&folder);
    let whole = r#"{"cells":[{"id":0,"min":[0,0,0],"max":[4,3,4]},{"id":1,"min":[4,0,0],"max":[8,3,4]}],
        "portals":[{"cells":[0,1],"winding":[[4,0,1],[4,2,1],[4,2,2],[4,0,2]]}]}"#;
    let cases = [
        ("cut", half(whole.as_bytes())),
        ("nan", whole.replace("[4,2,1]", "[4,NaN,1]").into_bytes()),
        ("infinite", whole.replace("[4,2,1]", "[4,1e999,1]").into_bytes()),
        ("no_cells", br#"{"cells":[]}"#.to_vec()),
        ("no_winding", whole.replace("[[4,0,1],[4,2,1],[4,2,2],[4,0,2]]", "[]").into_bytes()),
    ];
    refuses(&folder, "json", &cases, &[&["bake", text(&model), "--cells", "BAD", "-o", "OUT", "--rays", "10k"]]);
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
    let as_cells = ["bake", text(&model), "--cells", "BAD", "-o", "OUT", "--rays", "10k"];
    let others: Vec<(&str, Vec<u8>)> = cases[2..].iter().map(|(case, bytes, _)| (*case, bytes.clone())).collect();
    refuses(&folder, "gml", &others, &[&["bake", "BAD", "-o", "OUT", "--rays", "10k"], &as_cells]);
    for (case, _, what) in cases {
        let bad = folder.join(format!("{case}.gml"));
        let error = String::from_utf8(run_words(&["bake", text(&bad), "-o", text(&folder.join("out.pvs"))]).stderr).unwrap();
        assert!(error.contains(what), "{case}: {error}");
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
