//! Levels of Quake 2, Quake 3 and Source as scenes: polygons, meshes, patches, displacements, and what flags say of them.

use super::scene::{block, the_inside};
use crate::cli::{done, enfilade, folder, refused};
use enfilade::bake::BakeOptions;
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Object, Role, Scene};
use enfilade_levels::quake::{import, import_bytes};
use enfilade_measure::verify::{CheckOptions, check};
use glam::{DVec3, dvec3};
use testing::bakes::{baked, with_rays};
use testing::games::Game;
use testing::games::drawn::{Displacement, Face, Shape, Texture, level_with_faces};

/// All kinds with such faces.
const GAMES: [Game; 9] = [
    Game::Quake2,
    Game::Qbism,
    Game::Quake3,
    Game::Source(19),
    Game::Source(20),
    Game::Source(21),
    Game::Source(25),
    Game::Source21VersionFirst,
    Game::Console,
];

const IN_QUAKE_UNITS: [Game; 3] = [Game::Quake2, Game::Qbism, Game::Quake3];

pub(super) const WORLD: &str = "{\n\"classname\" \"worldspawn\"\n}\n";

const fn texture(name: &'static str, flags: u32, contents: u32) -> Texture {
    Texture { name, flags, contents }
}

const BRICK: Texture = texture("Base/Brick", 0, 1);

fn polygon(corners: Vec<[f32; 3]>, texture: Texture, leaf: usize) -> Face {
    Face { corners, shape: Shape::Polygon, texture, leaf }
}

/// The inside of the three rooms; the first room's end is sky.
pub(super) fn inside() -> Vec<Face> {
    let of = |face: testing::quake::Face| {
        let sky = texture("base/day", 0x4, 1);
        polygon(face.corners, if face.texture == "Sky1" { sky } else { BRICK }, face.leaf)
    };
    the_inside().into_iter().map(of).collect()
}

/// The outside of a box.
fn boxed(min: [f32; 3], max: [f32; 3], texture: Texture) -> Vec<Face> {
    block(min, max, "").into_iter().map(|face| polygon(face.corners, texture, 0)).collect()
}

fn scene(game: Game, models: &[Vec<Face>], entities: &str) -> Scene {
    let file = level_with_faces(game, models, entities);
    import_bytes(file, "level", &ImportOptions::default()).unwrap_or_else(|e| panic!("{game:?}: {e}"))
}

pub(super) fn object<'s>(scene: &'s Scene, node: &str) -> &'s Object {
    let names: Vec<&str> = scene.objects.iter().map(|o| o.node.as_str()).collect();
    scene.objects.iter().find(|o| o.node == node).unwrap_or_else(|| panic!("{node} among {names:?}"))
}

/// Corners of an object in the level's own units and axes, in order.
fn corners(scene: &Scene, object: &Object, unit: f64) -> Vec<DVec3> {
    let own = |p: DVec3| (p + scene.origin) / unit;
    let all = object.triangles.clone().flat_map(|t| scene.corners(t as usize));
    let mut all: Vec<DVec3> = all.map(own).map(|p| dvec3(p.x, -p.z, p.y)).collect();
    all.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    all.dedup_by(|a, b| a.distance(*b) < 1e-4);
    all
}

fn unit(game: Game) -> f64 {
    if IN_QUAKE_UNITS.contains(&game) { 1.0 / 32.0 } else { 0.01905 }
}

/// Passes `check`, and no view misses a pixel.
fn is_right(scene: &Scene) -> enfilade::file::PvsFile {
    let file = baked(scene, BakeOptions { clusters: Some(0.0), ..with_rays(200_000) });
    let report = check(&file, scene, &CheckOptions { rays: 100_000, views: 4, ..CheckOptions::default() }).unwrap();
    assert!(report.passed, "{report:?}");
    assert_eq!((report.missed_rays, report.missed_segments), (0, 0));
    file
}

#[test]
fn three_rooms_are_scenes_in_every_game() {
    let entities = format!(
        "{WORLD}{{\n\"classname\" \"func_door\"\n\"model\" \"*1\"\n}}\n{{\n\"classname\" \"func_brush\"\n\"model\" \"*2\"\n}}\n\
         {{\n\"classname\" \"trigger_once\"\n\"model\" \"*3\"\n}}\n"
    );
    let models = [
        inside(),
        boxed([4.25, -1.0, -1.0], [4.75, 1.0, 1.0], texture("wood", 0, 1)),
        boxed([6.0, -2.0, -2.0], [7.0, -1.0, -1.0], texture("crate", 0, 1)),
        boxed([9.0, -1.0, -1.0], [10.0, 1.0, 1.0], texture("trigger", 0, 1)),
    ];
    for game in GAMES {
        let scene = scene(game, &models, &entities);
        let brick = object(&scene, "leaf 5/base/brick");
        assert_eq!((brick.triangles.len(), brick.role, brick.opaque), (16, Role::Structure, true), "{game:?}");
        let sky = object(&scene, "leaf 5/sky base/day");
        assert_eq!((sky.triangles.len(), sky.opaque), (2, true), "{game:?}");
        // Normals point to where a face is seen from.
        let [a, b, c] = scene.corners(sky.triangles.start as usize);
        assert!((b - a).cross(c - a).normalize().distance(DVec3::X) < 1e-9, "{game:?}");
        assert_eq!(corners(&scene, sky, unit(game))[0], dvec3(0.0, -2.0, -2.0), "{game:?}");
        let (door, crate_) = (object(&scene, "func_door *1"), object(&scene, "func_brush *2"));
        assert_eq!((door.role, door.opaque, door.glass, door.triangles.len()), (Role::Door, false, false, 12), "{game:?}");
        assert_eq!((crate_.role, crate_.opaque, crate_.glass), (Role::Furnishing, false, false), "{game:?}");
        assert!(scene.objects.iter().all(|o| !o.node.contains("trigger")), "{game:?}");
        let file = is_right(&scene);
        assert_eq!((file.cells.len(), file.portals.len()), (5, 4), "{game:?}");
    }
}

#[test]
fn flags_tell_what_is_drawn_and_what_is_looked_through() {
    // Flags and contents, and whether such a wall is drawn and hides.
    let quake3 = [
        (texture("opaque", 0, 1), Some(true)),
        (texture("trans", 0, 0x2000_0001), Some(false)),
        (texture("water", 0, 0x20), Some(false)),
        (texture("fog", 0, 0x40), Some(false)),
        (texture("holes", 0x1_0000, 1), Some(false)),
        (texture("textures/common/invisible", 0, 1), Some(false)),
        (texture("nodraw", 0x80, 1), None),
        (texture("hint", 0x100, 1), None),
    ];
    let quake2 = [
        (texture("opaque", 0, 0), Some(true)),
        (texture("light", 0x1, 0), Some(true)),
        (texture("water", 0x8, 0), Some(false)),
        (texture("trans33", 0x10, 0), Some(false)),
        (texture("trans66", 0x20, 0), Some(false)),
        (texture("flowing", 0x40, 0), Some(true)),
        (texture("nodraw", 0x80, 0), None),
        (texture("hint", 0x100, 0), None),
        (texture("skip", 0x200, 0), None),
    ];
    let source = [
        (texture("opaque", 0, 0), Some(true)),
        (texture("trans", 0x10, 0), Some(false)),
        (texture("water", 0x8, 0), Some(false)),
        (texture("no/portal", 0x20, 0), Some(true)),
        (texture("tools/toolsfog", 0x400, 0), Some(false)),
        (texture("tools/toolsblack", 0x400, 0), Some(true)),
        (texture("tools/toolsnodraw", 0x80, 0), None),
        (texture("tools/toolstrigger", 0x440, 0), None),
        (texture("hint", 0x100, 0), None),
    ];
    for game in GAMES {
        let mut world = inside();
        let textures = match game {
            Game::Quake2 | Game::Qbism => &quake2[..],
            Game::Quake3 => &quake3,
            _ => &source,
        };
        for &(texture, _) in textures {
            // Across the second room.
            world.push(polygon(vec![[7., -2., -2.], [7., 2., -2.], [7., 2., 2.], [7., -2., 2.]], texture, 3));
        }
        let scene = scene(game, &[world], WORLD);
        for (texture, expected) in textures {
            let node = format!("leaf 3/{}", texture.name);
            let found = scene.objects.iter().find(|o| o.node == node).map(|o| (o.opaque, o.glass));
            assert_eq!(found, expected.map(|hides| (hides, !hides)), "{game:?}: {node}");
        }
    }
}

/// Control points of a wall across the first passage, as a row of columns along y, bent by so much along x.
fn patch(bend: f32) -> Face {
    let column = |y: f32, x: f32| [-1.0, 0.0, 1.0].map(|z| [4.5 + x, y, z]);
    let columns = [column(-1.0, 0.0), column(0.0, bend), column(1.0, 0.0)];
    let corners = (0..3).flat_map(|row| columns.map(|column| column[row])).collect();
    Face { corners, shape: Shape::Patch([3, 3]), texture: texture("curtain", 0, 1), leaf: 4 }
}

#[test]
fn flat_patches_hide_and_curved_ones_are_drawn_within_half_a_unit() {
    // (bend, triangles, hides): a curve's chords are off by a quarter of twice the bend over the square of their number.
    for (bend, triangles, hides) in [(0.0, 2, true), (0.1, 2, false), (-0.5, 2, false), (4.0, 4, false), (100.0, 20, false)]
    {
        let mut world = inside();
        world.push(patch(bend));
        let scene = scene(Game::Quake3, &[world], WORLD);
        let wall = object(&scene, "leaf 4/curtain");
        assert_eq!((wall.triangles.len(), wall.opaque, wall.glass), (triangles, hides, false), "{bend}");
        // All points lie on the parabola.
        for p in corners(&scene, wall, 1.0 / 32.0) {
            let expected = 4.5 + f64::from(bend) * 0.5 * (1.0 - p.y * p.y);
            assert!((p.x - expected).abs() < 1e-3 && p.z.abs() <= 1.0 + 1e-6, "{bend}: {p} {expected}");
        }
        let [a, b, c] = scene.corners(wall.triangles.start as usize);
        assert!((b - a).cross(c - a).x > 0.0, "seen from the east, as its control points go");
        // From the first room through the passage: not off the axis, where triangles meet.
        let eye = dvec3(1.0, 0.1, -0.3) / 32.0 - scene.origin;
        let hit = RayScene::new(&scene).first_opaque(eye, DVec3::X, f64::INFINITY).unwrap();
        let at = if hides { 3.5 } else { 13.0 };
        assert!((hit.t * 32.0 - at).abs() < 1e-3, "{bend}: {}", hit.t * 32.0);
        if bend.abs() < 1.0 {
            is_right(&scene);
        }
    }
}

#[test]
fn meshes_are_their_triangles_and_billboards_are_not_drawn() {
    let mut world = inside();
    let corners = vec![[6., 0., 0.], [7., 0., 0.], [7., 1., 0.], [6., 0., 1.], [99., 99., 99.]];
    let mesh = Shape::Mesh(vec![[0, 1, 2], [0, 3, 1]]);
    let steel = texture("steel", 0, 1);
    world.push(Face { corners: corners.clone(), shape: mesh, texture: steel, leaf: 3 });
    world.push(Face { corners, shape: Shape::Billboard, texture: texture("flare", 0, 1), leaf: 3 });
    let scene = scene(Game::Quake3, &[world], WORLD);
    let mesh = object(&scene, "leaf 3/steel");
    let found = corners_of(&scene, mesh);
    assert_eq!((mesh.triangles.len(), found.len()), (2, 4));
    assert!(found.iter().all(|p| p.x < 8.0));
    // Up, in the level: its first triangle.
    let normals: Vec<DVec3> = mesh
        .triangles
        .clone()
        .map(|t| scene.corners(t as usize))
        .map(|[a, b, c]| (b - a).cross(c - a).normalize())
        .collect();
    assert!(normals.iter().any(|n| n.distance(DVec3::Y) < 1e-9), "{normals:?}");
    assert!(scene.objects.iter().all(|o| !o.node.contains("flare")));
}

fn corners_of(scene: &Scene, object: &Object) -> Vec<DVec3> {
    corners(scene, object, 1.0 / 32.0)
}

/// A floor of 4 x 4 at z = -1 in the second room, raised by 0.1 times the number of each vertex.
fn floor(start: [f32; 3], drawn: u32) -> Face {
    let moved = (0..25).map(|v| [0., 0., 1., 0.1 * v as f32]).collect();
    Face {
        corners: vec![[5., -2., -1.], [9., -2., -1.], [9., 2., -1.], [5., 2., -1.]],
        shape: Shape::Displacement(Displacement { power: 2, start, moved, drawn }),
        texture: texture("ground", 0, 0),
        leaf: 0,
    }
}

#[test]
fn a_displacement_has_the_vertices_of_its_grid() {
    // In the file the corners go clockwise: (5, 2), (9, 2), (9, -2), (5, -2). Rows go from the first corner to the second.
    let starts: [([f32; 3], [f64; 2], [f64; 2]); 4] = [
        ([5., 2., -1.], [1., 0.], [0., -1.]),
        ([9., 2., -1.], [0., -1.], [-1., 0.]),
        ([9., -2., -1.], [-1., 0.], [0., 1.]),
        ([5., -2., -1.], [0., 1.], [1., 0.]),
    ];
    for game in GAMES.into_iter().filter(|game| !IN_QUAKE_UNITS.contains(game)) {
        for (start, down, along) in starts {
            let mut world = inside();
            world.push(floor(start, u32::MAX));
            let number = world.len() - 1;
            let scene = scene(game, &[world], WORLD);
            let ground = object(&scene, &format!("face {number}/ground"));
            assert_eq!((ground.triangles.len(), ground.opaque), (32, true), "{game:?}");
            let mut expected: Vec<DVec3> = (0..25)
                .map(|v| {
                    let (i, j) = (f64::from(v / 5), f64::from(v % 5));
                    let at = |k: usize| f64::from(start[k]) + down[k] * i + along[k] * j;
                    dvec3(at(0), at(1), -1.0 + 0.1 * f64::from(v))
                })
                .collect();
            expected.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
            let found = corners(&scene, ground, unit(game));
            assert_eq!(found.len(), 25, "{game:?}");
            assert!(found.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-4), "{game:?}: {found:?}");
            let up = |t: u32| {
                let [a, b, c] = scene.corners(t as usize);
                (b - a).cross(c - a).y > 0.0
            };
            assert!(ground.triangles.clone().all(up), "{game:?}");
        }
    }
    // Beside a coarser one, the second vertex of a side is not drawn.
    let mut world = inside();
    world.push(floor([5., 2., -1.], !2));
    let scene = scene(Game::Source(20), &[world], WORLD);
    let ground = scene.objects.iter().find(|o| o.node.ends_with("/ground")).unwrap();
    assert_eq!((ground.opaque, ground.glass), (false, false));
    is_right(&scene);
}

#[test]
fn faces_with_other_light_are_taken_where_there_are_no_others() {
    for game in [Game::Source(20), Game::Source(25), Game::Console] {
        let before = level_with_faces(game, &[inside()], WORLD);
        let mut file = before.clone();
        let (faces, hdr) = (8 + 16 * 7, 8 + 16 * 58);
        file.copy_within(faces..faces + 16, hdr);
        file[faces + 4..faces + 8].fill(0);
        let [a, b] = [before, file].map(|f| import_bytes(f, "level", &ImportOptions::default()).unwrap());
        assert_eq!(a.triangles.len(), b.triangles.len(), "{game:?}");
    }
}

#[test]
fn damage_is_named_by_lump_and_entry() {
    let mut with_patch = inside();
    with_patch.insert(0, patch(0.0));
    let mut with_ground = inside();
    with_ground.insert(0, floor([5., 2., -1.], u32::MAX));
    let quake3 = level_with_faces(Game::Quake3, &[with_patch], WORLD);
    let source = level_with_faces(Game::Source(20), &[with_ground], WORLD);
    let word = |file: &[u8], at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let fault = |file: &[u8], lump: usize, at: usize, value: i32| {
        let offset = word(file, 8 + lump * if file[0] == b'I' { 8 } else { 16 }) + at;
        let mut file = file.to_vec();
        file[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        import_bytes(file, "level", &ImportOptions::default()).unwrap_err().to_string()
    };
    let nan = f32::NAN.to_bits() as i32;
    for (lump, at, value, what) in [
        (13, 0, 9, "lump faces, entry 0: its texture 9 doesn't exist"),
        (13, 8, 5, "lump faces, entry 0: is of kind 5, which isn't known"),
        (13, 16, 1 << 20, "lump faces, entry 0: ends beyond the "),
        (13, 12, -1, "lump faces, entry 0: ends beyond the "),
        (13, 96, 5, "lump faces, entry 0: is a patch of 5 x 3 control points, but has 9"),
        (13, 96, -3, "lump faces, entry 0: is a patch of -3 x 3 control points, but has 9"),
        (13, 104 + 20, 1 << 20, "lump faces, entry 1: its 6 mesh vertices from 1048576 on are no triangles, or beyond the "),
        (13, 104 + 24, 5, "lump faces, entry 1: its 5 mesh vertices from 0 on are no triangles"),
        (11, 0, 77, "lump faces, entry 1: its vertex 77 doesn't exist"),
        (5, 0, -1, "lump leaves, entry 1: its face "),
        (10, 0, nan, "lump vertices, entry 0: is not within 1e7 of the origin"),
    ] {
        let said = fault(&quake3, lump, at, value);
        assert!(said.starts_with(what) && !said.contains('\n'), "{said} / {what}");
    }
    for (lump, at, value, what) in [
        (7, 10, 0x7fff, "lump faces, entry 0: its texture info 32767 doesn't exist"),
        (7, 8, 3, "lump faces, entry 0: has a displacement and 3 corners, not 4"),
        (7, 12, 7, "lump faces, entry 0: its displacement 7 doesn't exist"),
        (7, 56 + 12, 0, "lump displacements, entry 0: goes beyond the 25 displacement vertices; each belongs to one face"),
        (26, 12, 1, "lump displacements, entry 0: goes beyond the 25 displacement vertices"),
        (26, 20, 3, "lump displacements, entry 0: goes beyond the 25 displacement vertices"),
        (26, 20, 5, "lump displacements, entry 0: its power is 5, not 0 to 4"),
        (26, 20, -1, "lump displacements, entry 0: its power is -1, not 0 to 4"),
        (33, 12, nan, "lump displacements, entry 0: is not within 1e7 of the origin"),
        (6, 68, 9, "lump texture infos, entry 0: its texture 9 doesn't exist"),
    ] {
        let said = fault(&source, lump, at, value);
        assert!(said.starts_with(what) && !said.contains('\n'), "{said} / {what}");
    }
}

#[test]
fn scripts_beside_a_level_tell_what_is_looked_through() {
    let folder = folder("level_scripts");
    let (maps, scripts) = (folder.join("maps"), folder.join("scripts"));
    for made in [&maps, &scripts, &maps.join("scripts")] {
        std::fs::create_dir_all(made).unwrap();
    }
    let level = maps.join("rooms.bsp");
    std::fs::write(&level, level_with_faces(Game::Quake3, &[inside()], WORLD)).unwrap();
    let opaque = |options: &ImportOptions| {
        let scene = import(&level, options).unwrap();
        let note = scene.source.notes.iter().any(|n| n.contains("scripts/"));
        (object(&scene, "leaf 3/base/brick").opaque, note)
    };
    let usual = ImportOptions::default();
    assert_eq!(opaque(&usual), (true, true));
    // The game's folder is not the level's.
    let script = "base/brick\n{\n{\nmap a.tga\nblendFunc add\n}\n}\n";
    std::fs::write(scripts.join("a.shader"), script).unwrap();
    let _ = std::fs::remove_dir(maps.join("scripts"));
    assert_eq!(opaque(&usual), (true, true));
    let allowed = ImportOptions { files_under: Some(folder.clone()), ..ImportOptions::default() };
    assert_eq!(opaque(&allowed), (false, false));
    std::fs::create_dir_all(maps.join("scripts")).unwrap();
    std::fs::write(maps.join("scripts/b.shader"), script).unwrap();
    assert_eq!(opaque(&usual), (false, false));
    std::fs::write(maps.join("scripts/b.shader"), "base/other\n{\n}\n").unwrap();
    assert_eq!(opaque(&usual), (true, false));
}

#[test]
fn commands_take_levels_of_source() {
    let folder = folder("level_source");
    let level = folder.join("rooms.bsp");
    let entities = format!("{WORLD}{{\n\"classname\" \"prop_physics\"\n}}\n");
    std::fs::write(&level, level_with_faces(Game::Source(20), &[inside()], &entities)).unwrap();
    let baked = enfilade!("bake", &level, "--rays", "10k");
    done(&baked);
    let said = String::from_utf8_lossy(&baked.stderr).into_owned() + &String::from_utf8_lossy(&baked.stdout);
    assert!(said.contains("0 static props and 1 prop entities are left out"), "{said}");
    for command in ["check", "walk"] {
        done(&enfilade!(command, &level.with_extension("pvs"), "--model", &level));
    }
    std::fs::write(&level, level_with_faces(Game::Source(20), &[vec![polygon(vec![], BRICK, 9)]], WORLD)).unwrap();
    refused(&enfilade!("bake", &level), &["rooms.bsp"]);
}
