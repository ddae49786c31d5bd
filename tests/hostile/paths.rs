//! Files that a model names: read from the model's folder and below it, and from nowhere else.

use crate::cli::folder;
use enfilade::scene::{ImportError, ImportOptions, Scene};
use enfilade_formats::import;
use std::path::{Path, PathBuf};

/// `model/` with a folder below it, and beside it what nobody may read.
struct World {
    root: PathBuf,
}

impl World {
    fn new(test: &str) -> Self {
        let root = folder(test);
        std::fs::create_dir_all(root.join("model/sub")).unwrap();
        for place in ["secret.bin", "model/a b.bin", "model/sub/a.bin"] {
            std::fs::write(root.join(place), triangle()).unwrap();
        }
        std::fs::write(root.join("secret.mtl"), GLASS).unwrap();
        std::fs::write(root.join("model/sub/a.mtl"), GLASS).unwrap();
        Self { root }
    }

    fn gltf(&self, uri: &str) -> Result<Scene, ImportError> {
        let path = self.root.join("model/x.gltf");
        std::fs::write(&path, document(uri)).unwrap();
        import(&path, &ImportOptions::default())
    }

    fn obj(&self, library: &str) -> Scene {
        let path = self.root.join("model/x.obj");
        let text = format!("mtllib {library}\nusemtl pale\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        std::fs::write(&path, text).unwrap();
        import(&path, &ImportOptions::default()).unwrap()
    }
}

const GLASS: &str = "newmtl pale\nd 0.2\n";

fn triangle() -> Vec<u8> {
    [0f32, 0., 0., 1., 0., 0., 0., 1., 0.].iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn document(uri: &str) -> String {
    let uri = serde_json::Value::from(uri);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"uri":{uri},"byteLength":36}}]}}"#
    )
}

/// Names that lead elsewhere, from a folder in which `secret` lies one level up.
fn elsewhere(world: &World, secret: &str) -> Vec<String> {
    let absolute = world.root.join(secret).to_str().unwrap().to_owned();
    [
        &format!("../{secret}"),
        &format!("sub/../../{secret}"),
        &format!("./../{secret}"),
        &format!("..\\{secret}"),
        &format!("%2e%2e/{secret}"),
        &format!("%2E%2E%2F{secret}"),
        &format!("sub/%2e%2e/%2e%2e/{secret}"),
        &absolute,
        &format!("file://{absolute}"),
        &format!("https://example.org/{secret}"),
        &format!("//example.org/{secret}"),
        &format!("\\\\host\\share\\{secret}"),
        &format!("C:\\{secret}"),
        "/dev/zero",
        "/proc/self/environ",
        "sub",
        ".",
        "",
    ]
    .map(str::to_owned)
    .to_vec()
}

#[test]
fn buffers_outside_of_the_models_folder_are_refused() {
    let world = World::new("gltf");
    for inside in ["a%20b.bin", "a b.bin", "sub/a.bin", "./sub/a.bin", "sub\\a.bin"] {
        assert_eq!(world.gltf(inside).unwrap().triangles.len(), 1, "{inside}");
    }
    for name in elsewhere(&world, "secret.bin") {
        let error = world.gltf(&name).expect_err(&name).to_string();
        assert!(error.starts_with("buffer 0: ") && !error.contains('\n'), "{name}: {error}");
    }
}

#[test]
fn materials_outside_of_the_models_folder_are_not_read() {
    let world = World::new("obj");
    // Read, a library shows: what is pale is see-through.
    assert!(!world.obj("sub/a.mtl").objects[0].opaque);
    for name in elsewhere(&world, "secret.mtl").iter().filter(|n| !n.is_empty() && !n.contains('%')) {
        let scene = world.obj(name);
        assert!(scene.objects[0].opaque, "{name} was read");
        assert_eq!(scene.source.notes.len(), 1, "{name}: {:?}", scene.source.notes);
    }
}

/// What is allowed is read, and nothing beside it.
#[test]
fn a_folder_that_is_allowed_is_read_from() {
    let world = World::new("allowed");
    let path = world.root.join("model/x.gltf");
    let read = |uri: &str, under: &Path| {
        std::fs::write(&path, document(uri)).unwrap();
        import(&path, &ImportOptions { files_under: Some(under.to_owned()), ..ImportOptions::default() })
    };
    for uri in ["../secret.bin", "sub/a.bin", "..%2Fsecret.bin", world.root.join("secret.bin").to_str().unwrap()] {
        assert_eq!(read(uri, &world.root).unwrap().triangles.len(), 1, "{uri}");
    }
    for uri in ["../secret.bin", "../../../secret.bin", "/dev/zero", "https://example.org/a.bin"] {
        let error = read(uri, &world.root.join("model")).expect_err(uri).to_string();
        assert!(error.starts_with("buffer 0: "), "{uri}: {error}");
    }
}

/// An archive may hold links.
#[cfg(unix)]
#[test]
fn links_that_lead_out_of_the_models_folder_are_not_followed() {
    let world = World::new("links");
    std::os::unix::fs::symlink("../secret.bin", world.root.join("model/link.bin")).unwrap();
    std::os::unix::fs::symlink("..", world.root.join("model/up")).unwrap();
    std::os::unix::fs::symlink("sub/a.bin", world.root.join("model/within.bin")).unwrap();
    assert_eq!(world.gltf("within.bin").unwrap().triangles.len(), 1);
    for name in ["link.bin", "up/secret.bin"] {
        let error = world.gltf(name).expect_err(name).to_string();
        assert!(error.contains("leads out of the model's folder"), "{name}: {error}");
    }
}
