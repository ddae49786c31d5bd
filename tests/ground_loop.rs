//! The example `ground_loop`: it draws ground through windows, from tiles that are there, and says so. Needs an adapter, of software at least: with
//! `CI` set, it fails without one.

#![cfg(feature = "gpu")]

#[path = "../examples/ground_loop.rs"]
#[allow(dead_code, clippy::duplicate_mod, reason = "its main; two examples share files")]
mod program;

use crate::cli::folder;
use enfilade::bake::BakeOptions;
use enfilade_scenes::Kind;
use testing::bakes;
use testing::ground::{Raster, written};

#[test]
fn ground_is_drawn_through_windows_from_tiles_that_are_there() {
    let folder = folder("ground-loop");
    let [model, pvs, ground, picture] = ["glb", "pvs", "ground", "png"].map(|end| folder.join("office").with_extension(end));
    let (office, scene) = bakes::generated(Kind::Office { rooms: 6, storeys: None, furnished: false }, 5);
    std::fs::write(&model, &office.glb).unwrap();
    bakes::baked(&scene, BakeOptions::default()).save(&pvs).unwrap();
    // More tiles than its cache holds.
    let mut hills = Raster::of([513, 513], |c, r| 90.0 * (f64::from(c) / 31.0).sin() * (f64::from(r) / 23.0).cos());
    written(&mut hills, &ground);
    let line = match program::run(&ground, &pvs, Some(&picture)) {
        Err(line) if line.starts_with("no graphics processor") => {
            assert!(std::env::var_os("CI").is_none(), "{line}");
            return eprintln!("not run: {line}");
        }
        result => result.unwrap(),
    };
    let before = |what: &str| -> f64 {
        let (before, _) = line.split_once(what).expect(&line);
        before.rsplit(' ').next().unwrap().parse().expect(&line)
    };
    let [frames, seen, drawn] = [before(" frames, "), before(" with a window"), before(" tiles drawn")];
    assert!(0.0 < seen && seen < frames && drawn > seen, "{line}");
    assert!(before(" pixels wrong") <= 1.0, "{line}");
    let (present, wanted) = (before(" of "), before(" wanted ones there"));
    assert!(0.0 < present && present < wanted, "none is there at the start: {line}");
    assert!(picture.exists());
    // Bad input is one line that names the file.
    for (ground, pvs, named) in
        [(&model, &pvs, "office.glb: "), (&ground, &model, "office.glb: "), (&ground, &picture, "office.png: ")]
    {
        let refused = program::run(ground, pvs, None).unwrap_err();
        assert!(refused.contains(named) && refused.lines().count() == 1, "{refused}");
    }
}
