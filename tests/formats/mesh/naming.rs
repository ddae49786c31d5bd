//! Doors, windows and glass by their names, and models whose +Z is up.

use super::read_obj;
use crate::cli;
use enfilade::cells::{PortalKind, SplitOptions, split};
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade_formats::{import, obj};
use enfilade_scenes::{Kind, generate};
use serde_json::json;
use std::path::Path;
use testing::glb::{Glb, pack, parts};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Node, role, whether it hides what is behind it, whether it is glass.
fn told(scene: &Scene) -> Vec<(&str, Role, bool, bool)> {
    scene.objects.iter().map(|o| (o.node.as_str(), o.role, o.opaque, o.glass)).collect()
}

#[test]
fn names_of_objects_and_materials_tell_what_opens() {
    let f = "f 1 2 3 4\n";
    let text = format!(
        "{SQUARE}o FrontDoor.001\nusemtl oak\n{f}o hole\nusemtl window_oak\n{f}o table\nusemtl Glass\n{f}o wall with door\nusemtl paint\n{f}"
    );
    let scene = read_obj(&text).unwrap();
    let expected = [
        ("FrontDoor.001", Role::Door, false, false),
        ("hole", Role::Window, false, false),
        ("table", Role::Unknown, false, true),
        ("wall with door", Role::Unknown, true, false),
    ];
    assert_eq!(told(&scene), expected);
    let [note] = &scene.source.notes[..] else { panic!("{:?}", scene.source.notes) };
    assert!(note.starts_with("1 meshes are doors and 1 windows by their names, and hide nothing"), "{note}");
}

/// What the author tells counts for more than names, and names of parents hold for what has none of its own.
#[test]
fn nodes_inherit_names_and_extras_count_for_more() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&super::TRIANGLE);
    let leaf = glb.push("nodes", json!({"name": "leaf", "mesh": mesh}));
    let pane = glb.push("nodes", json!({"name": "Glass", "mesh": mesh}));
    glb.node(json!({"name": "door 3", "children": [leaf, pane]}));
    let extras = json!({"enfilade": {"role": "structure"}});
    glb.node(json!({"name": "gate", "mesh": mesh, "extras": extras}));
    let scene = super::read_glb(&glb.bytes()).unwrap();
    let mut all = told(&scene);
    all.sort_by_key(|o| o.0);
    let expected =
        [("Glass", Role::Door, false, true), ("gate", Role::Structure, true, false), ("leaf", Role::Door, false, false)];
    assert_eq!(all, expected);
}

#[test]
fn a_file_of_roles_beside_the_model_gives_roles() {
    let folder = cli::folder("roles");
    let (model, beside) = (folder.join("a.b.obj"), folder.join("a.b.roles.json"));
    std::fs::write(&model, format!("{SQUARE}o Blatt 1\nusemtl x\nf 1 2 3\no door\nf 1 2 4\no Blatt 2\nusemtl y\nf 2 3 4\n"))
        .unwrap();
    let roles =
        || import(&model, &ImportOptions::default()).map(|scene| scene.objects.iter().map(|o| o.role).collect::<Vec<_>>());
    assert_eq!(roles().unwrap(), [Role::Unknown, Role::Door, Role::Unknown]);
    let rules = json!({"roles": [{"name": "blatt*", "material": "x", "role": "door"}, {"name": "door", "role": "unknown"}]});
    std::fs::write(&beside, rules.to_string()).unwrap();
    assert_eq!(roles().unwrap(), [Role::Door, Role::Unknown, Role::Unknown]);
    // Blended material that hides what is behind it.
    std::fs::write(folder.join("x.mtl"), "newmtl x\nd 0.9\n").unwrap();
    let text = std::fs::read_to_string(&model).unwrap();
    std::fs::write(&model, format!("mtllib x.mtl\n{text}")).unwrap();
    let opaque = |role: &str| {
        std::fs::write(&beside, json!({"roles": [{"material": "x", "role": role}]}).to_string()).unwrap();
        let scene = import(&model, &ImportOptions::default()).unwrap();
        (
            scene.objects[0].opaque,
            scene.source.notes.iter().any(|note| note.starts_with("67 % of the triangles have see-through materials")),
        )
    };
    assert_eq!((opaque("structure"), opaque("opaque")), ((false, true), (true, false)));
    std::fs::write(&model, text).unwrap();
    std::fs::write(&beside, json!({"roles": [{"material": "Y", "role": "stair"}]}).to_string()).unwrap();
    assert_eq!(roles().unwrap(), [Role::Unknown, Role::Door, Role::Stair]);
    for (bad, why) in [
        ("{", "a.b.roles.json: EOF"),
        (r#"{"roles": [{"role": "door"}]}"#, "a.b.roles.json: roles[0]: give a name or a material"),
        (r#"{"roles": [{"name": "a", "role": "lift"}]}"#, "a.b.roles.json: unknown variant `lift`"),
        (r#"{"roles": [{"nmae": "a", "role": "door"}]}"#, "a.b.roles.json: unknown field `nmae`"),
    ] {
        std::fs::write(&beside, bad).unwrap();
        let error = roles().unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

/// An office whose nodes say nothing but their names has the doors and windows that its author tells of.
#[test]
fn an_office_has_its_doors_by_their_names_alone() {
    let office = generate(Kind::Office { rooms: 12, storeys: Some(2), furnished: false }, 3).unwrap();
    let (mut json, bin) = parts(&office.glb);
    json["nodes"].as_array_mut().unwrap().iter_mut().for_each(|node| _ = node.as_object_mut().unwrap().remove("extras"));
    let bare = pack(json.to_string().as_bytes(), Some(&bin));
    let [told, named] = [&office.glb, &bare].map(|glb| super::read_glb(glb).unwrap());
    let (cells, doors, windows, shut) = openings(&told);
    assert!(cells > 12 && doors >= 12 && windows > 0);
    assert_eq!(openings(&named), (cells, doors, windows, shut));
    // All doors in one object, and all windows, as where an exporter joins what has one material.
    let mut text: String = told.positions.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    for (name, is_here) in [("walls", None), ("doors", Some(Role::Door)), ("windows", Some(Role::Window))] {
        text += &format!("o {name}\n");
        for object in &told.objects {
            let role = Some(object.role).filter(|role| matches!(role, Role::Door | Role::Window));
            for t in object.triangles.clone().filter(|_| role == is_here) {
                let [a, b, c] = told.triangles[t as usize].map(|i| i + 1);
                text += &format!("f {a} {b} {c}\n");
            }
        }
    }
    assert_eq!(openings(&read_obj(&text).unwrap()), (cells, doors, windows, shut));
}

/// Cells, doors, windows, and portals that are shut.
fn openings(scene: &Scene) -> (usize, usize, usize, usize) {
    let graph = split(scene, &SplitOptions::default()).unwrap();
    let of = |kind: PortalKind| graph.portals.iter().filter(|p| p.kind == kind).count();
    let shut = graph.portals.iter().filter(|p| p.state.shut).count();
    (graph.cells.len(), of(PortalKind::Door), of(PortalKind::Window), shut)
}

/// Turned on its back, and told so, a model is the model.
#[test]
fn a_model_whose_z_is_up_stands_where_its_author_says_so() {
    let house = "o house\nv 0 0 0\nv 8 0 0\nv 8 3 0\nv 0 3 0\nv 0 0 5\nv 8 0 5\nv 8 3 5\nv 0 3 5\n\
                 f 1 2 6 5\nf 4 3 7 8\nf 1 2 3 4\nf 5 6 7 8\nf 1 4 8 5\nf 2 3 7 6\n";
    let turned: String = house
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {x} -{z} {y}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    let z_up = ImportOptions { z_up: true, ..ImportOptions::default() };
    let read = |text: &str, options: &ImportOptions| obj::from_slice(text.as_bytes(), "house", None, options).unwrap();
    let (upright, found) = (read(house, &ImportOptions::default()), read(&turned, &z_up));
    assert_eq!((found.hash(), found.source.up.as_str()), (upright.hash(), "+Z"));
    assert_ne!(read(&turned, &ImportOptions::default()).hash(), upright.hash());

    // The command line says when it seems to be so, and the .pvs remembers what was said.
    let folder = cli::folder("z_up");
    let (model, pvs) = (folder.join("house.obj"), folder.join("house.pvs"));
    std::fs::write(&model, &turned).unwrap();
    let bake = |more: &[&str]| {
        cli::command(&[Path::new("bake"), &model, Path::new("--rays"), Path::new("10k")]).args(more).output().unwrap()
    };
    let out = bake(&[]);
    cli::done(&out);
    let said = String::from_utf8(out.stdout).unwrap();
    assert!(said.contains("note: its largest planes face along Z: if +Z is up, give --up z\n"), "{said}");
    let out = bake(&["--up", "z"]);
    cli::done(&out);
    assert!(!String::from_utf8(out.stderr).unwrap().contains("--up"));
    cli::done(&cli::run(&[Path::new("check"), &pvs, Path::new("--model"), &model, Path::new("--rays"), Path::new("10k")]));
    let ifc = folder.join("a.ifc");
    cli::refused(
        &cli::run(&[Path::new("bake"), &ifc, Path::new("--up"), Path::new("z")]),
        &["a.ifc: --up is for glTF, OBJ, PLY, STL"],
    );
}
