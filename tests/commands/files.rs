//! What commands write over: no input by any of its names, no file of another kind, none that is protected; and what can't be
//! written is said before the work.

use crate::cli::{LEVEL, done, folder, maze, run_words, text};
use std::path::{Path, PathBuf};

/// What commands read and write in a test.
struct World {
    folder: PathBuf,
}

/// A command with an output: its words, `OUT` for the output, and the inputs among them.
type Row = (&'static [&'static str], &'static [&'static str]);

/// Every command and every flag with a path that is written. The program's own tests find a flag that is missing in its files.
const TABLE: [Row; 14] = [
    (&["bake", "maze.glb", "-o", "OUT"], &["maze.glb"]),
    (&["bake", "maze.glb", "-o", "OUT", "--cells", "cells.json"], &["cells.json"]),
    (&["bake", "maze.glb", "-o", "OUT", "--view-cells", "views.json"], &["views.json"]),
    (&["check", "maze.pvs", "--model", "maze.glb", "--leak", "OUT"], &["maze.pvs", "maze.glb"]),
    (&["check", "maze.pvs", "--model", "maze.glb", "--rooms", "rooms.json", "--leak", "OUT"], &["rooms.json"]),
    (&["export", "maze.pvs", "--model", "maze.glb", "-o", "OUT"], &["maze.pvs", "maze.glb"]),
    (&["vis", "level.prt", "--rows", "OUT"], &["level.prt"]),
    (&["vis", "level.prt", "--rows", "OUT", "--against", "rows.txt"], &["rows.txt"]),
    (&["vis", "level.prt", "--against", "rows.txt", "--lost", "OUT"], &["level.prt", "rows.txt"]),
    (&["vis", "level.bsp", "-o", "OUT"], &["level.bsp"]),
    (&["report", "maze.glb", "-o", "OUT"], &["maze.glb"]),
    (&["report", "level.prt", "--against", "rows.txt", "-o", "OUT"], &["level.prt", "rows.txt"]),
    (&["ground", "hills.asc", "-o", "OUT"], &["hills.asc"]),
    (&["ground", "hills.asc", "--keep-out", "maze.glb", "-o", "OUT"], &["maze.glb"]),
];

impl World {
    fn new(test: &str) -> Self {
        let folder = folder(test);
        maze(&folder);
        for (name, bytes) in [
            ("level.prt", LEVEL.as_bytes()),
            ("level.bsp", b"BSP2"),
            ("rows.txt", b"0 4: 0 1 2 3\n1 4: 0 1 2 3\n2 4: 0 1 2 3\n3 4: 0 1 2 3\n"),
            ("cells.json", b"{\"cells\":[]}"),
            ("views.json", b"{\"cells\":[]}"),
            ("rooms.json", b"{\"rooms\":[],\"doors\":[],\"voids\":[]}"),
            ("box.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            ("box.pvs", b"\x89PVS\r\n\x1a\n"),
            ("hills.asc", b"ncols 2\nnrows 2\ncellsize 10\n1 2\n3 4\n"),
        ] {
            std::fs::write(folder.join(name), bytes).unwrap();
        }
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// All files with their bytes.
    fn files(&self) -> Vec<(String, Vec<u8>)> {
        let entries = std::fs::read_dir(&self.folder).unwrap().map(|e| e.unwrap().path());
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        let mut all: Vec<_> = entries.filter(|p| p.is_file()).map(|p| (name(&p), std::fs::read(&p).unwrap())).collect();
        all.sort();
        all
    }

    /// Exit 2 and one line that says `part`; no file is another than before, and none came.
    #[track_caller]
    fn refuses(&self, words: &[&str], out: &Path, part: &str) {
        let before = self.files();
        let words: Vec<String> = words
            .iter()
            .enumerate()
            .map(|(i, &word)| match word {
                "OUT" => text(out).to_owned(),
                word if i > 0 && word.contains('.') => text(&self.path(word)).to_owned(),
                word => word.to_owned(),
            })
            .collect();
        let said = run_words(&words.iter().map(String::as_str).collect::<Vec<_>>());
        let line = String::from_utf8(said.stderr).unwrap();
        assert!(said.status.code() == Some(2) && line.lines().count() == 1, "{words:?}: {line}");
        assert!(line.contains(part) && said.stdout.is_empty(), "{words:?}: {line}");
        assert!(self.files() == before, "{words:?}: files are others than before");
    }
}

#[test]
fn no_input_is_written_over_by_any_of_its_names() {
    let world = World::new("inputs");
    std::fs::create_dir(world.path("below")).unwrap();
    for (words, inputs) in TABLE {
        for input in inputs {
            world.refuses(words, &world.path(input), "would be overwritten");
            world.refuses(words, &world.path("below").join("..").join(input), "would be overwritten");
            #[cfg(unix)]
            for (link, name) in [(true, "soft"), (false, "hard")] {
                let alias = world.path(name).with_extension("out");
                let input = world.path(input);
                match link {
                    true => std::os::unix::fs::symlink(input, &alias).unwrap(),
                    false => std::fs::hard_link(input, &alias).unwrap(),
                }
                world.refuses(words, &alias, "would be overwritten");
                std::fs::remove_file(alias).unwrap();
            }
        }
    }
}

#[test]
fn no_file_of_another_kind_is_written_over_and_none_that_is_protected() {
    let world = World::new("kinds");
    let (notes, other, protected) = (world.path("notes.txt"), world.path("other.glb"), world.path("protected"));
    std::fs::write(&notes, "my own text, and quite long\n").unwrap();
    // A model, but none that is read.
    std::fs::write(&other, [&std::fs::read(world.path("maze.glb")).unwrap()[..], b"more"].concat()).unwrap();
    std::fs::write(&protected, "").unwrap();
    let mut permissions = std::fs::metadata(&protected).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&protected, permissions).unwrap();
    for (words, _) in TABLE {
        world.refuses(words, &notes, "so it isn't replaced");
        if words[0] != "export" {
            world.refuses(words, &other, "so it isn't replaced");
        }
        world.refuses(words, &protected, "write-protected");
        world.refuses(words, &world.path("no/such/out"), "there is no such folder");
        world.refuses(words, &world.folder, "is a folder");
        #[cfg(target_os = "linux")]
        world.refuses(words, Path::new("/proc/self/out"), "can't be written");
    }
    // Names that nobody gave are looked at, too.
    for (name, words) in [
        ("maze.bake-state", &["bake", "maze.glb"][..]),
        ("maze.report.html", &["report", "maze.glb"]),
        ("maze.report.cells.csv", &["report", "maze.glb"]),
        ("level.vis-state", &["vis", "level.prt"]),
        ("g.rooms.json", &["generate", "house", "--facts", "-o", "g.glb"]),
        ("maze.report.report-state", &["report", "maze.glb"]),
    ] {
        std::fs::write(world.path(name), "my own text").unwrap();
        world.refuses(words, &notes, &format!("{name}: "));
        std::fs::remove_file(world.path(name)).unwrap();
    }
    // The same names given twice.
    world.refuses(&["bake", "maze.glb", "-o", "o.bake-state"], &notes, "would be written twice");
}

#[test]
fn pictures_of_frames_replace_pictures_and_nothing_else() {
    let world = World::new("frames");
    let words = |folder: &'static str| ["walk", "maze.pvs", "--model", "maze.glb", "--path", "random:1", "--frames", folder];
    world.refuses(&words("maze.glb"), Path::new(""), "would be overwritten");
    world.refuses(&words("rows.txt"), Path::new(""), "is not a folder");
    let pictures = world.path("p.d");
    std::fs::create_dir(&pictures).unwrap();
    let picture = pictures.join("frame_00000_both.png");
    std::fs::write(&picture, "my own text").unwrap();
    world.refuses(&words("p.d"), Path::new(""), "frame_00000_both.png: is not a PNG picture");
    #[cfg(unix)]
    {
        std::fs::remove_file(&picture).unwrap();
        std::os::unix::fs::symlink(world.path("maze.glb"), &picture).unwrap();
        world.refuses(&words("p.d"), Path::new(""), "would be overwritten");
        std::fs::remove_file(&picture).unwrap();
    }
    let walked = || {
        let (file, model) = (world.path("maze.pvs"), world.path("maze.glb"));
        done(&run_words(&["walk", text(&file), "--model", text(&model), "--path", "random:1", "--frames", text(&pictures)]));
        std::fs::read(&picture).unwrap()
    };
    let first = walked();
    assert!(first.starts_with(b"\x89PNG") && walked().starts_with(b"\x89PNG"), "a picture is replaced by one");
}

#[test]
fn what_a_command_has_written_it_replaces() {
    let world = World::new("again");
    let path = |name: &str| text(&world.path(name)).to_owned();
    let [glb, pvs, prt, asc] = ["maze.glb", "maze.pvs", "level.prt", "hills.asc"].map(path);
    let out = |name: &str| path(&format!("out.{name}"));
    let rows: [&[&str]; 8] = [
        &["bake", &glb, "--rays", "10k", "-o", &out("pvs")],
        &["check", &pvs, "--model", &glb, "--rays", "1k", "--views", "1", "--leak", &out("obj")],
        &["export", &pvs, "--model", &glb, "-o", &out("glb")],
        &["vis", &prt, "--rows", &out("rows")],
        &["vis", &prt, "--against", &path("rows.txt"), "--lost", &out("lost.html")],
        &["vis", &prt, "--against", &path("rows.txt"), "--lost", &out("pts")],
        &["report", &prt, "-o", &out("html")],
        &["generate", "house", "--facts", "-o", &out("house.glb")],
    ];
    for words in rows {
        done(&run_words(words));
        done(&run_words(words));
    }
    done(&run_words(&["ground", &asc, "-o", &out("ground")]));
    done(&run_words(&["ground", &asc, "-o", &out("ground")]));
    // What was cut off is replaced, too: nobody has to delete it.
    std::fs::write(out("pvs"), "cut").unwrap();
    done(&run_words(rows[0]));
}

#[test]
fn a_folder_is_told_with_the_models_in_it() {
    let world = World::new("folder");
    for command in ["bake", "report"] {
        let out = run_words(&[command, text(&world.folder)]);
        let said = String::from_utf8(out.stderr).unwrap();
        assert!(out.status.code() == Some(2) && said.contains("is a folder; give a file in it: box.obj"), "{said}");
    }
    let out = run_words(&["info", text(&world.folder)]);
    assert!(String::from_utf8(out.stderr).unwrap().contains("is a folder; give a file in it: box.pvs, maze.pvs"));
}

#[test]
fn a_level_is_written_in_place_with_a_backup() {
    use testing::quake::{Layout, bsp, three_rooms};
    let folder = folder("place");
    let level = folder.join("level.bsp");
    let before = bsp(&three_rooms(-1), Layout::default());
    std::fs::write(&level, &before).unwrap();
    std::fs::write(folder.join("level.bsp.old"), "an older one").unwrap();
    let out = run_words(&["vis", text(&level)]);
    done(&out);
    assert!(String::from_utf8(out.stdout).unwrap().contains("level.bsp.old.2: a copy of the old level"));
    assert_eq!(std::fs::read_to_string(folder.join("level.bsp.old")).unwrap(), "an older one");
    assert!(std::fs::read(folder.join("level.bsp.old.2")).unwrap() == before);
    let rows = std::fs::read(&level).unwrap();
    assert!(rows != before, "it has rows now");
    // The same again changes nothing, so there is nothing to keep.
    done(&run_words(&["vis", text(&level)]));
    assert!(std::fs::read(&level).unwrap() == rows && !folder.join("level.bsp.old.3").exists());
}
