//! Damaged manifests are refused with the field, and none panics.

use enfilade_pack::{FileEntry, Manifest, ManifestError};
use glam::DVec3;
use proptest::prelude::*;
use serde_json::{Value, json};

fn sample() -> Manifest {
    let file = |name: &str| FileEntry::of(name, name.as_bytes());
    let chunk = |name: &str, objects, meshes, pictures| enfilade_pack::Chunk { file: file(name), objects, meshes, pictures };
    Manifest {
        pvs: file("building.pvs"),
        model: 0xabc,
        origin: DVec3::new(1.5, -2.0, 3e6),
        objects: 9,
        chunks: vec![
            chunk("chunks/0.glb", vec![0..2, 5..8], vec![0, 1], vec![1]),
            chunk("chunks/1.glb", vec![2..5, 8..9], vec![], vec![]),
        ],
        meshes: vec![
            enfilade_pack::MeshFile { file: file("meshes/0.glb"), meshes: 0..3, pictures: vec![0] },
            enfilade_pack::MeshFile { file: file("meshes/1.glb"), meshes: 3..4, pictures: vec![] },
        ],
        pictures: vec![file("pictures/0.png"), file("pictures/1.jpg")],
        page: vec![file("index.html")],
    }
}

fn value() -> Value {
    serde_json::from_str(&sample().write()).unwrap()
}

#[test]
fn what_is_written_is_read() {
    assert_eq!(Manifest::read(&sample().write()).unwrap(), sample());
    // XXH3-64 of the empty input, from its specification.
    assert_eq!(FileEntry::of("a", b"").hash, 0x2d06_8005_38d3_94c2);
    assert_eq!(value()["chunks"][0]["objects"], json!([0, 2, 5, 8]));
}

#[test]
fn each_field_is_checked() {
    let changes: [(&str, Value, &str); 29] = [
        ("/page", json!({}), "page"),
        ("/page/0/file", json!("../index.html"), "page[0].file"),
        ("/enfilade", json!(1), "enfilade"),
        ("/pvs", json!([]), "pvs"),
        ("/pvs/file", json!("../building.pvs"), "pvs.file"),
        ("/pvs/file", json!("/building.pvs"), "pvs.file"),
        ("/pvs/file", json!("https://elsewhere/building.pvs"), "pvs.file"),
        ("/pvs/file", json!("chunks//0"), "pvs.file"),
        ("/pvs/file", json!("a\\b"), "pvs.file"),
        ("/pvs/file", json!("%2e%2e/b"), "pvs.file"),
        ("/pvs/bytes", json!(-1), "pvs.bytes"),
        ("/pvs/bytes", json!(1e300), "pvs.bytes"),
        ("/pvs/hash", json!("ABCDEF0123456789"), "pvs.hash"),
        ("/pvs/hash", json!("+123456789abcdef"), "pvs.hash"),
        ("/model", json!("abc"), "model"),
        ("/origin", json!([1, 2]), "origin"),
        ("/origin/0", json!(null), "origin"),
        ("/objects", json!(8), "chunks[1].objects"),
        ("/objects", json!(10), "chunks"),
        ("/objects", json!(1u64 << 32), "objects"),
        ("/chunks", json!({}), "chunks"),
        ("/chunks/0/objects", json!([0, 2, 5]), "chunks[0].objects"),
        ("/chunks/1/objects", json!([1, 5]), "chunks[1].objects"),
        ("/chunks/1/objects/1", json!(4294967296u64), "chunks[1].objects"),
        ("/chunks/0/meshes", json!([0, 2]), "chunks[0].meshes"),
        ("/chunks/0/pictures", json!([1, 1]), "chunks[0].pictures"),
        ("/meshes/1/meshes", json!([2, 4]), "meshes[1].meshes"),
        ("/meshes/0/pictures", json!([2]), "meshes[0].pictures"),
        ("/pictures/1/file", json!("pictures/0.png"), "pictures/0.png"),
    ];
    for (place, new, field) in changes {
        let mut value = value();
        *value.pointer_mut(place).unwrap() = new.clone();
        match Manifest::read(&value.to_string()) {
            Err(ManifestError::Field { field: found, .. }) => assert_eq!(found, field, "{place}: {new}"),
            other => panic!("{place}: {new}: {other:?}"),
        }
    }
    assert!(matches!(Manifest::read("{"), Err(ManifestError::Json(_))));
}

#[test]
fn no_field_may_be_left_out_but_empty_lists() {
    for key in ["enfilade", "pvs", "model", "origin", "objects", "chunks", "meshes", "pictures"] {
        let mut value = value();
        value.as_object_mut().unwrap().remove(key);
        assert!(
            matches!(Manifest::read(&value.to_string()), Err(ManifestError::Field { field, .. }) if field == key),
            "{key}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    /// What is still accepted keeps all promises.
    #[test]
    fn a_damaged_manifest_is_refused_or_consistent(
        damage in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(b"0123456789[]{},.\"/:ae-".to_vec())), 1..4),
    ) {
        let mut text = sample().write().into_bytes();
        damage.iter().for_each(|(at, byte)| *at.get_mut(&mut text) = *byte);
        if let Ok(manifest) = Manifest::read(std::str::from_utf8(&text).unwrap()) {
            let objects: usize = manifest.chunks.iter().flat_map(|chunk| &chunk.objects).map(|range| range.len()).sum();
            prop_assert_eq!(objects, manifest.objects as usize);
            prop_assert_eq!(manifest.chunk_of_object().len(), objects);
            let is_within = |part: &str| !part.is_empty() && !part.starts_with('.') && !part.contains([':', '\\', '%']);
            prop_assert!(manifest.files().all(|entry| entry.file.split('/').all(is_within)));
            enfilade_pack::Needed::of(&manifest, 0..manifest.chunks.len() as u32).bytes(&manifest);
        }
    }
}
