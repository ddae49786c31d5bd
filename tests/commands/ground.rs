//! `enfilade ground` from the command line: what it prints, and what it says of bad input.

#[cfg(target_os = "linux")]
use crate::cli::limited;
use crate::cli::{command, done, enfilade, folder, json, refused, run};
use enfilade_terrain::Ground;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Output;
use testing::tiffs::Tiff;

/// Metres of a plane, 30 m a sample, the corner at 500,000 m east and so many metres north.
fn placed(tiff: Tiff, north: f64) -> Tiff {
    tiff.doubles(33550, &[30.0, 30.0, 0.0])
        .doubles(33922, &[0.0, 0.0, 0.0, 500_000.0, north, 0.0])
        .shorts(34735, &[1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3076, 0, 1, 9001])
}

fn plain() -> Tiff {
    Tiff::wholes([40, 30], &std::array::from_fn::<i16, 1200, _>(|k| (k * k % 811) as i16))
}

struct World {
    folder: PathBuf,
    out: PathBuf,
}

impl World {
    /// With what stood there before.
    fn new(test: &str) -> Self {
        let folder = folder(test);
        let out = folder.join("o.ground");
        std::fs::write(&out, OLD).unwrap();
        Self { folder, out }
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        std::fs::write(self.folder.join(name), bytes).unwrap();
        self.folder.join(name)
    }

    fn ground(&self, rasters: &[&Path], more: &[&str]) -> Output {
        let mut command = command(&[Path::new("ground"), Path::new("-o"), &self.out]);
        command.args(rasters).args(more).output().unwrap()
    }

    /// One line with the file and what is wrong; what stood there before stays, and nothing else is there.
    #[track_caller]
    fn refuses(&self, rasters: &[&Path], more: &[&str], says: &[&str]) {
        let name = rasters[0].file_name().unwrap().to_str().unwrap();
        refused(&self.ground(rasters, more), &[&[name], says].concat());
        assert_eq!(std::fs::read(&self.out).unwrap(), OLD);
        let mut left = std::fs::read_dir(&self.folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        assert!(left.all(|name| !name.ends_with(".tmp")));
    }
}

const OLD: &[u8] = b"the old file";

#[test]
fn a_raster_that_cannot_be_read_is_told_with_its_place() {
    let world = World::new("raster");
    // What else is wrong with rasters is in tests/terrain/raster.rs.
    world.refuses(&[&world.write("noise.tif", b"no tiff at all")], &[], &["not a TIFF: it begins with neither II nor MM"]);
    let comma = b"ncols 2
nrows 2
cellsize 10
1 2
3,5 4
";
    world.refuses(&[&world.write("comma.asc", comma)], &[], &["line 5: "]);
    world.refuses(&[&world.folder.join("absent.tif")], &[], &["No such file"]);
    world.refuses(&[&world.folder], &[], &["a folder; give the files in it"]);
}

#[test]
fn heights_that_are_no_ground_are_told_with_their_file() {
    let world = World::new("heights");
    let voids = Tiff { tags: vec![(42113, 2, b"5\0".to_vec())], ..Tiff::wholes([3, 3], &[5; 9]) };
    let void = world.write("void.tif", &placed(voids, 5e6).bytes());
    world.refuses(&[&void], &[], &["void.tif: no sample has a height; give another raster"]);
    let row = world.write("row.tif", &Tiff::wholes([9, 1], &[5; 9]).bytes());
    world.refuses(&[&row], &[], &["row.tif: 9 x 1 samples", "at least 2 x 2 samples"]);
    let flat = world.write("flat.tif", &Tiff::wholes([3, 3], &[5; 9]).bytes());
    world.refuses(&[&flat], &["--spacing", "1e300"], &["flat.tif: the spacing is not above 0, or the ground is infinite"]);
    // A flat ground is one, and so is one of heights that differ by next to nothing.
    let out = world.ground(&[&flat], &[]);
    done(&out);
    let said = String::from_utf8(out.stdout).unwrap();
    assert!(said.contains("flat.tif: no georeference: 1 m a sample, assumed\n"), "{said}");
    let xml = b"<GDALMetadata><Item name=\"SCALE\" sample=\"0\" role=\"scale\">1e-300</Item></GDALMetadata>\0".to_vec();
    let tiny = Tiff { tags: vec![(42112, 2, xml)], ..plain() };
    done(&world.ground(&[&world.write("tiny.tif", &tiny.bytes())], &[]));
    assert_eq!(Ground::open(&world.out, 0).unwrap().sample(0, [3, 3]), Some(0.0));
}

#[test]
fn rasters_that_abut_are_one() {
    let world = World::new("apart");
    let a = world.write("a.tif", &placed(plain(), 5e6).bytes());
    let far = world.write("far.tif", &placed(plain(), 6e6).bytes());
    world.refuses(&[&a, &far], &[], &["far.tif: ", "a.tif; give rasters of one lattice that abut"]);
    let north = world.write("north.tif", &placed(plain(), 5e6 + 900.0).bytes());
    assert_eq!(json(&world.ground(&[&a, &north], &["--json"]))["samples"], json!([40, 60]));
}

#[test]
fn flags_are_checked() {
    let world = World::new("flags");
    let a = world.write("a.tif", &plain().bytes());
    for bad in ["0", "-3", "nan", "inf"] {
        let spacing = format!("--spacing={bad}");
        let out = world.ground(&[&a], &[&spacing]);
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && said.contains("--spacing"), "{bad}: {said}");
    }
    for bad in [&["--tile", "34"][..], &["--threads", "x"], &["--keep-out", "a.glb", "--place", "1,2"]] {
        let out = world.ground(&[&a], bad);
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && said.contains(if bad.len() == 4 { "--place" } else { bad[0] }), "{said}");
    }
    let said = String::from_utf8(world.ground(&[&a], &["--place", "0,0,0,0"]).stderr).unwrap();
    assert!(said.contains("--keep-out"), "{said}");
    refused(&world.ground(&[&a], &["--keep-out", "absent.glb"]), &["absent.glb: "]);
    assert_eq!(std::fs::read(&world.out).unwrap(), OLD);
    assert!(command(&[Path::new("ground"), &a]).output().unwrap().status.code() == Some(2), "an output is wanted");
    let given = world.ground(&[&a], &["--spacing", "2.5", "--json"]);
    let told = json(&given);
    assert_eq!((&told["spacing_m"], &told["samples"]), (&json!([2.5, 2.5]), &json!([40, 30])));
    assert!(told["notes"][0].as_str().unwrap().ends_with("a.tif: no georeference: 2.5 m a sample, as given"), "{told}");
}

/// A box of 4 x 4 m in the middle of samples a metre apart: 25 of them are on or under it.
#[test]
fn there_is_no_ground_under_a_building() {
    let world = World::new("under");
    let a = world.write("a.tif", &Tiff::wholes([41, 31], &[7; 41 * 31]).bytes());
    let corner = |k: usize| format!("v {} {} {}\n", k & 1, k >> 1 & 1, k >> 2);
    let box_ = (0..8).map(corner).collect::<String>().replace('1', "4");
    let faces = "f 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\nf 1 5 7 3\nf 2 4 8 6\n";
    let model = world.write("box.obj", (box_ + faces).as_bytes());
    let model = model.to_str().unwrap();
    let told = json(&world.ground(&[&a], &["--keep-out", model, "--place", "-2,0,-2,0", "--json"]));
    assert_eq!((&told["voids"], &told["kept_out"]), (&json!(25), &json!(25)));
    let ground = Ground::open(&world.out, u64::MAX).unwrap();
    assert_eq!((ground.height_at(0.0, 0.0), ground.height_at(5.5, 5.5)), (None, Some(0.0)));
}

#[test]
fn where_nobody_may_write_is_told() {
    let world = World::new("place");
    let a = world.write("a.tif", &plain().bytes());
    let missing = world.folder.join("no/such/folder");
    for (out, said) in [(missing.join("o.ground"), &missing), (world.folder.clone(), &world.folder)] {
        refused(&run(&[Path::new("ground"), &a, Path::new("-o"), &out]), &[said.to_str().unwrap()]);
    }
    #[cfg(target_os = "linux")]
    refused(&run(&[Path::new("ground"), &a, Path::new("-o"), Path::new("/dev/full")]), &["/dev/full: "]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_file_and_nothing_else() {
    let world = World::new("full");
    let a = world.write("a.tif", &plain().bytes());
    let ground = command(&[Path::new("ground"), &a, Path::new("-o"), &world.out]);
    refused(&limited(&ground, 1), &["o.ground: File too large"]);
    assert_eq!(std::fs::read(&world.out).unwrap(), OLD);
    assert_eq!(std::fs::read_dir(&world.folder).unwrap().count(), 2);
}

#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_run_that_is_killed_leaves_what_stood_there_before() {
    use std::time::{Duration, Instant};
    let world = World::new("killed");
    let (raster, whole) = (world.folder.join("a.tif"), world.folder.join("whole.ground"));
    done(&enfilade!("generate", "ground", "--size", "1025", "--spacing", "10", "-o", &raster));
    let begin = Instant::now();
    done(&enfilade!("ground", &raster, "-o", &whole));
    let took = begin.elapsed();
    let whole = std::fs::read(whole).unwrap();
    let (mut kills, kills_wanted) = (0, 8);
    for attempt in 0..100 {
        std::fs::write(&world.out, OLD).unwrap();
        let mut child = command(&[Path::new("ground"), &raster, Path::new("-o"), &world.out])
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::min(took, took.mul_f64(0.12 * f64::from(1 + attempt % kills_wanted))));
        child.kill().unwrap();
        let ended = child.wait().unwrap().success();
        let found = std::fs::read(&world.out).unwrap();
        assert!(found == if ended { whole.as_slice() } else { OLD } || found == whole, "{} bytes", found.len());
        kills += i32::from(!ended);
        if kills == kills_wanted {
            break;
        }
    }
    assert_eq!(kills, kills_wanted);
    done(&world.ground(&[&raster], &[]));
    assert!(std::fs::read(&world.out).unwrap() == whole);
}
