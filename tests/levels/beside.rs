//! Files of games beside a level: textures and their palette, scripts, and archives of them.

use super::drawn::{WORLD, inside, object};
use crate::cli::folder;
use enfilade::scene::{ImportOptions, Material, Picture, Scene};
use enfilade_levels::quake::import;
use std::path::{Path, PathBuf};
use testing::games::Game;
use testing::games::drawn::{Face, Shape, Texture, level_with_faces};
use testing::games::files::{colormap, pak, pk3, wal};

/// A file of the folder, with the folders that it is in.
fn put(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    std::fs::write(path, bytes).unwrap();
}

/// A level of Quake 2 with a wall of water in `maps` of a folder.
fn quake2(folder: &Path) -> PathBuf {
    let mut world = inside();
    let texture = Texture { name: "base/water", flags: 0x8, contents: 0 };
    let corners = vec![[7., -2., -2.], [7., 2., -2.], [7., 2., 2.], [7., -2., 2.]];
    world.push(Face { corners, shape: Shape::Polygon, texture, leaf: 3 });
    put(folder, "maps/rooms.bsp", &level_with_faces(Game::Quake2, &[world], WORLD));
    folder.join("maps/rooms.bsp")
}

fn seen(level: &Path, under: Option<&Path>) -> Scene {
    let options = ImportOptions { trace: true, files_under: under.map(Path::to_path_buf), ..ImportOptions::default() };
    import(level, &options).unwrap()
}

/// The material of an object, and the texture coordinates of its first corner.
fn look(scene: &Scene, node: &str) -> (Material, [f32; 2]) {
    let found = std::ptr::from_ref(object(scene, node));
    let number = scene.objects.iter().position(|o| std::ptr::eq(o, found)).unwrap();
    let trace = scene.trace.as_ref().unwrap();
    let look = &trace.looks[trace.meshes[number] as usize];
    (trace.materials[look.material.unwrap() as usize].clone(), look.texture_coordinates[0][0])
}

/// Width and first pixel of a picture.
fn first(picture: &Picture) -> (u32, [u8; 3]) {
    let Picture::Within(bytes) = picture else { panic!("a picture within") };
    let image = image_of(bytes);
    (image.0, image.1)
}

fn image_of(bytes: &[u8]) -> (u32, [u8; 3]) {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    (reader.info().width, *pixels.first_chunk().unwrap())
}

const PALETTE_NOTE: &str = "pics/colormap.pcx";

fn says(scene: &Scene, what: &str) -> bool {
    scene.source.notes.iter().any(|note| note.contains(what))
}

#[test]
fn textures_of_quake_2_have_the_colours_of_the_palette() {
    let folder = folder("wal");
    let level = quake2(&folder);
    let maps = folder.join("maps");
    // 1. Nothing is there: plain colours, without a word.
    let scene = seen(&level, None);
    let (brick, plain) = look(&scene, "leaf 3/base/brick");
    assert!(brick.texture.is_none() && !says(&scene, PALETTE_NOTE));
    // 2. Without a palette: a note.
    put(&maps, "textures/base/brick.wal", &wal("base/brick", [32, 16], 7));
    put(&maps, "textures/base/water.wal", &wal("base/water", [64, 64], 9));
    let scene = seen(&level, None);
    assert!(look(&scene, "leaf 3/base/brick").0.texture.is_none() && says(&scene, PALETTE_NOTE));
    // 3. With one.
    put(&maps, "pics/colormap.pcx", &colormap(|i| [i, 100, 200 - i % 200]));
    let scene = seen(&level, None);
    assert!(!says(&scene, PALETTE_NOTE));
    let (brick, laid) = look(&scene, "leaf 3/base/brick");
    assert_eq!((first(&brick.texture.unwrap()), brick.colour), ((32, [7, 100, 193]), [1.0; 4]));
    // A missing texture is taken for 64 x 64: these have half and a quarter of that.
    assert_eq!(laid, [2.0 * plain[0], 4.0 * plain[1]]);
    // What is looked through is drawn so.
    let water = look(&scene, "leaf 3/base/water").0;
    assert_eq!((first(&water.texture.unwrap()).1, water.colour[3]), ([9, 100, 191], 0.5));
    assert!(look(&scene, "leaf 5/sky base/day").0.texture.is_none());
    // 4. Damage is skipped.
    for damaged in [&b"PCX"[..], &colormap(|i| [i; 3])[..800], &[0; 898]] {
        put(&maps, "pics/colormap.pcx", damaged);
        assert!(says(&seen(&level, None), PALETTE_NOTE));
    }
    put(&maps, "textures/base/brick.wal", &wal("base/brick", [32, 16], 7)[..400]);
    assert!(look(&seen(&level, None), "leaf 3/base/brick").0.texture.is_none());
}

#[test]
fn archives_of_quake_2_are_read_beside_the_level_and_in_the_folder_that_is_allowed() {
    let folder = folder("pak");
    let level = quake2(&folder);
    let of = |texel| {
        let brick = ("textures/base/brick.wal", wal("base/brick", [16, 16], texel));
        pak(&[("pics/colormap.pcx", colormap(|i| [i; 3])), brick])
    };
    let colour = |under: Option<&Path>| {
        let material = look(&seen(&level, under), "leaf 3/base/brick").0;
        material.texture.map(|picture| first(&picture).1[0])
    };
    put(&folder, "pak0.pak", &of(40));
    assert_eq!((colour(None), colour(Some(&folder))), (None, Some(40)));
    // The later of two counts, and a file in a folder before both.
    put(&folder, "pak1.pak", &of(50));
    assert_eq!(colour(Some(&folder)), Some(50));
    put(&folder, "textures/base/brick.wal", &wal("base/brick", [16, 16], 60));
    assert_eq!(colour(Some(&folder)), Some(60));
    // Beside the level.
    put(&folder, "maps/pak0.pak", &of(70));
    assert_eq!(colour(None), Some(70));
}

#[test]
fn scripts_in_archives_tell_what_is_looked_through() {
    let folder = folder("pk3");
    put(&folder, "maps/rooms.bsp", &level_with_faces(Game::Quake3, &[inside()], WORLD));
    let level = folder.join("maps/rooms.bsp");
    let clear = b"Base/Brick\n{\n{\nmap a.tga\nblendFunc add\n}\n}\n".to_vec();
    let other = b"base/other\n{\n}\n".to_vec();
    let opaque = |under: Option<&Path>| {
        let scene = seen(&level, under);
        (object(&scene, "leaf 3/base/brick").opaque, says(&scene, ".pk3"))
    };
    assert_eq!(opaque(None), (true, true));
    put(&folder, "pak0.pk3", &pk3(&[("scripts/a.shader", clear.clone())]));
    assert_eq!((opaque(None), opaque(Some(&folder))), ((true, true), (false, false)));
    // Scripts of folders and archives count together.
    put(&folder, "scripts/b.shader", &other);
    assert_eq!(opaque(Some(&folder)), (false, false));
    put(&folder, "maps/x.pk3", &pk3(&[("scripts/more/a.shader", clear.clone()), ("scripts/c.txt", clear.clone())]));
    assert_eq!(opaque(None), (true, true));
    put(&folder, "maps/x.pk3", &pk3(&[("scripts/b.shader", other), ("raw/a.shader", clear)]));
    assert_eq!(opaque(None), (true, false));
    put(&folder, "maps/x.pk3", b"PK\x03\x04 but no zip");
    assert_eq!(opaque(None), (true, true));
}
