//! `pack`: the folder that is written, and what it replaces.

use crate::cli::{done, enfilade, folder, json, maze, names, refused, text};
use enfilade_pack::{Manifest, gunzip};
use std::collections::BTreeMap;
use std::path::Path;

/// All files below a folder, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for name in names(folder) {
        let path = folder.join(&name);
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            all.insert(name, std::fs::read(path).unwrap());
        }
    }
    all
}

fn manifest_of(files: &BTreeMap<String, Vec<u8>>) -> Manifest {
    let text = gunzip(&files["manifest.jsonz"], 1 << 20).unwrap();
    Manifest::read(std::str::from_utf8(&text).unwrap()).unwrap()
}

#[test]
fn the_folder_has_what_its_manifest_says() {
    let folder = folder("folder");
    let (model, pvs) = maze(&folder);
    let out = folder.join("out");
    let told = json(&enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--json"));
    let found = files(&out);
    let manifest = manifest_of(&found);
    assert_eq!(found.len(), manifest.files().count() + 1);
    for entry in manifest.files() {
        let bytes = &found[&entry.file];
        assert_eq!((entry.bytes, entry.hash), (bytes.len() as u64, xxhash_rust::xxh3::xxh3_64(bytes)), "{}", entry.file);
    }
    // What a walk never asks for is left out.
    assert!(found["building.pvs"].len() < std::fs::read(&pvs).unwrap().len());
    assert_eq!(told["bytes"], found.values().map(Vec::len).sum::<usize>());
    assert_eq!(told["chunks"], manifest.chunks.len());
    assert_eq!(told["objects"], manifest.objects);
    // Again, over it and with other threads: the same bytes, and nothing left beside it.
    let before = names(&folder);
    done(&enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--threads", "1"));
    assert_eq!((files(&out), names(&folder)), (found, before));
}

#[test]
fn a_page_is_in_the_folder_and_in_its_manifest() {
    let folder = folder("page");
    let (model, pvs) = maze(&folder);
    let (out, page) = (folder.join("out"), folder.join("page"));
    std::fs::create_dir(&page).unwrap();
    std::fs::write(page.join("walk.js"), "walk()").unwrap();
    refused(&enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--page", &page), &["page", "it has no index.html"]);
    std::fs::write(page.join("index.html"), "<script src=walk.js></script>").unwrap();
    done(&enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--page", &page));
    let found = files(&out);
    let manifest = manifest_of(&found);
    assert_eq!(manifest.page.iter().map(|file| &*file.file).collect::<Vec<_>>(), ["index.html", "walk.js"]);
    assert_eq!((&*found["walk.js"], found.len()), (&b"walk()"[..], manifest.files().count() + 1));
    // Over it, and without a page.
    done(&enfilade!("pack", &pvs, "--model", &model, "-o", &out));
    assert!(!files(&out).contains_key("walk.js"));
    std::fs::create_dir(page.join("more")).unwrap();
    refused(
        &enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--page", &page),
        &["has more, which is no file of a page"],
    );
    refused(
        &enfilade!("pack", &pvs, "--model", &model, "-o", &out, "--page", &out.join("chunks")),
        &["would be overwritten"],
    );
}

#[test]
fn only_a_folder_that_pack_wrote_is_replaced() {
    let folder = folder("replaced");
    let (model, pvs) = maze(&folder);
    let out = folder.join("out");
    let refuses = |out: &Path, part: &str| {
        let before = files(&folder);
        refused(&enfilade!("pack", &pvs, "--model", &model, "-o", out), &[part, text(out)]);
        assert_eq!(files(&folder), before);
    };
    std::fs::create_dir(&out).unwrap();
    refuses(&out, "is not a folder that pack wrote");
    std::fs::write(out.join("manifest.jsonz"), "{\"name\": \"my app\"}").unwrap();
    refuses(&out, "is not a folder that pack wrote");
    std::fs::remove_dir_all(&out).unwrap();
    std::fs::write(&out, "my own text").unwrap();
    refuses(&out, "is not a folder that pack wrote");
    std::fs::remove_file(&out).unwrap();
    refused(&enfilade!("pack", &pvs, "--model", &model, "-o", &folder.join("no/such/folder")), &["there is no such folder"]);
    refuses(&pvs, "would be overwritten");
    refuses(&model, "would be overwritten");

    done(&enfilade!("pack", &pvs, "--model", &model, "-o", &out));
    for own in ["notes.txt", "chunks/mine.glbz"] {
        std::fs::write(out.join(own), "my own").unwrap();
        refuses(&out, &format!("has {own}, which pack did not write"));
        std::fs::remove_file(out.join(own)).unwrap();
    }
    std::fs::create_dir(out.join("mine")).unwrap();
    refuses(&out, "has mine, which pack did not write");
    std::fs::remove_dir(out.join("mine")).unwrap();
    let inside = out.join("building.pvs");
    refused(
        &enfilade!("pack", &inside, "--model", &model, "-o", &out),
        &["has an input", "building.pvs", "would be overwritten"],
    );
    done(&enfilade!("pack", &pvs, "--model", &model, "-o", &out));
}

#[test]
fn another_model_is_refused() {
    let folder = folder("other");
    let (_, pvs) = maze(&folder);
    let other = folder.join("other.obj");
    std::fs::write(&other, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    refused(&enfilade!("pack", &pvs, "--model", &other, "-o", &folder.join("out")), &["not the file's model", text(&pvs)]);
    refused(&enfilade!("pack", &folder.join("gone.pvs"), "--model", &other, "-o", &folder.join("out")), &["gone.pvs"]);
    assert!(!folder.join("out").exists());
}
