//! The example `wgpu_loop`: its frames are those of everything, and it says so where they aren't. Needs an adapter, of software at least:
//! with `CI` set, it fails without one.

#![cfg(feature = "gpu")]

#[path = "../examples/wgpu_loop.rs"]
#[allow(dead_code, clippy::duplicate_mod, reason = "its main; two examples share files")]
mod program;

use crate::cli::folder;
use enfilade::bake::BakeOptions;
use enfilade_scenes::Kind;
use testing::bakes;

#[test]
fn frames_are_those_of_everything_unless_rows_lie() {
    let folder = folder("frames");
    let [model, pvs, lying] = ["glb", "pvs", "lying.pvs"].map(|end| folder.join("wgpu_loop").with_extension(end));
    let (office, scene) = bakes::generated(Kind::Office { rooms: 6, storeys: None, furnished: true }, 5);
    std::fs::write(&model, &office.glb).unwrap();
    let mut file = bakes::baked(&scene, BakeOptions::default());
    file.save(&pvs).unwrap();
    let line = match program::run(&pvs, &model, None) {
        Err(line) if line.starts_with("no graphics processor") => {
            assert!(std::env::var_os("CI").is_none(), "{line}");
            return eprintln!("not run: {line}");
        }
        result => result.unwrap(),
    };
    let all = format!(" of {} triangles drawn a frame", scene.triangles.len());
    let (before, _) = line.split_once(&all).expect(&line);
    let drawn: usize = before.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(0 < drawn && drawn < scene.triangles.len(), "{line}");

    // Rows that leave out what is seen are found out.
    let rows = file.object_rows.as_mut().unwrap();
    (0..rows.rows()).for_each(|cell| (0..rows.columns()).for_each(|object| rows.clear(cell, object)));
    (file.pairs.lower, file.pairs.upper, file.gap) = (0, 0, None);
    file.save(&lying).unwrap();
    let found_out = program::run(&lying, &model, None).unwrap_err();
    assert!(found_out.contains("differs from one of everything"), "{found_out}");
    // Bad input is one line that names the file.
    let missing = program::run(&folder.join("missing.pvs"), &model, None).unwrap_err();
    assert!(missing.contains("missing.pvs: ") && missing.lines().count() == 1, "{missing}");
}
