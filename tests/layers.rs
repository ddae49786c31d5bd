//! Data flows one way: a module uses only what stands before it. The arrows are read from the source text.

use crate::sources::{Named, module, sources, tree, without_comments};
use std::collections::BTreeSet;
use std::path::Path;

/// What each room may use, beside [`BASE`] and itself. `room` allows all of it, `room::item` that item only. The first three are what is built
/// without default features, and know nothing of the builder.
const MAY_USE: [(&str, &[&str]); 17] = [
    ("occlusion", &[]),
    ("file", &[]),
    ("runtime", &["file", "occlusion"]),
    ("terrain", &["runtime"]),
    ("scene", &[]),
    ("exact", &[]),
    ("cells", &["scene"]),
    ("pvs", &["scene", "cells"]),
    ("level", &["pvs", "scene::quake"]),
    (WRITERS, &["file", "scene", "cells", "pvs"]),
    ("bake", &["scene", "cells", "pvs", "file", "runtime"]),
    ("proof", &["scene", "cells", "pvs", "file"]),
    ("walkthrough", &["scene", "file", "occlusion", "runtime", "exact"]),
    ("verify", &["scene", "file", "exact", "walkthrough::path", "level::Level"]),
    ("pages", &["scene", "file", "verify", "terrain"]),
    ("generate", &["scene::Role", "scene::gltf"]),
    ("export", &["scene", "file"]),
];

/// Below everything; uses nothing but itself.
const BASE: [&str; 13] =
    ["bits", "bvh", "geom", "gpu", "ids", "job", "parallel", "polygon", "random", "simd", "tolerance", "tubes", "types"];

/// Parts of `file` that only the builder has, since they name what it makes: a room of their own here.
const WRITERS: &str = "file::write";

/// The room of a file below `src`.
fn room(name: &str) -> &str {
    if name == "file/graph.rs" || name.starts_with("file/write/") {
        return WRITERS;
    }
    name.split(['/', '.']).next().unwrap_or(name)
}

/// A use of `module::item` (or of the whole `module`) by a source file.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Arrow {
    file: String,
    from: String,
    to: String,
    item: Option<String>,
}

impl Arrow {
    fn is_allowed(&self) -> bool {
        if self.to == self.from || BASE.contains(&self.to.as_str()) {
            return true;
        }
        let Some((_, allowed)) = MAY_USE.iter().find(|(module, _)| *module == self.from) else { return false };
        allowed.iter().any(|a| self.falls_under(a))
    }

    fn falls_under(&self, allowed: &str) -> bool {
        match allowed.split_once("::") {
            None => allowed == self.to,
            Some((module, item)) => module == self.to && self.item.as_deref() == Some(item),
        }
    }
}

/// The module that a path from the crate's root leads to, and the item in it.
fn target(path: &[&str]) -> (String, Option<String>) {
    let owned = |s: &&str| (*s).to_owned();
    match path[0] {
        "BitMatrix" => ("bits".to_owned(), Some("BitMatrix".to_owned())),
        "CellId" | "DirectedPortal" | "ObjectId" | "PortalId" => ("ids".to_owned(), Some(path[0].to_owned())),
        module => (module.to_owned(), path.get(1).map(owned)),
    }
}

/// Every arrow of a file whose path below `src` is given.
fn arrows_of(file: &Path, text: &str) -> Vec<Arrow> {
    let text = without_comments(text);
    let name = file.to_str().unwrap().replace('\\', "/");
    let parts = module(&name);
    let mut paths = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        let inside_a_name = text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$');
        if !inside_a_name {
            tree(&text[at + "crate::".len()..], &[], &mut paths);
        }
    }
    // A chain of `super` that climbs to the root says the same as `crate`.
    let tests = text.find("mod tests").unwrap_or(text.len());
    let mut at = 0;
    while let Some(found) = text[at..].find("super::") {
        let start = at + found;
        let rest = text[start..].trim_start_matches("super::");
        let climbed = (text.len() - start - rest.len()) / "super::".len();
        if climbed >= parts.len() + usize::from(start > tests) {
            tree(rest, &[], &mut paths);
        }
        at = text.len() - rest.len();
    }
    let arrow = |named: Named| {
        let (to, item) = target(&named.path);
        Arrow { file: name.clone(), from: room(&name).to_owned(), to, item }
    };
    paths.into_iter().map(arrow).collect()
}

fn arrows() -> BTreeSet<Arrow> {
    // The crate's root names every module; the binary stands outside of the library.
    let inside = |name: &str| !["lib.rs", "main.rs"].contains(&name) && !name.starts_with("cli/");
    let files = sources().into_iter().filter(|(name, _)| inside(name));
    files.flat_map(|(name, text)| arrows_of(Path::new(&name), &text)).collect()
}

fn list(arrows: &[&Arrow]) -> String {
    let line = |a: &&Arrow| format!("  {}: {} -> {}::{}", a.file, a.from, a.to, a.item.as_deref().unwrap_or(""));
    arrows.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn no_arrow_points_back() {
    let arrows = arrows();
    assert!(arrows.len() > 100, "only {} arrows were found: this test reads nothing", arrows.len());
    let back: Vec<&Arrow> = arrows.iter().filter(|a| !a.is_allowed()).collect();
    assert!(back.is_empty(), "these point back:\n{}", list(&back));
}

#[test]
fn every_exception_is_needed() {
    let arrows = arrows();
    for (module, allowed) in MAY_USE {
        for entry in allowed {
            let used = arrows.iter().any(|a| a.from == module && a.falls_under(entry));
            assert!(used, "{module} no longer uses {entry}: take it out of the list");
        }
    }
}

/// The check shares nothing with the bake but the triangles and the decoded file. No bake uses the exact judge.
#[test]
fn the_check_is_independent_of_the_bake() {
    const ALLOWED: [&str; 4] = ["file", "scene::Scene", "exact", "walkthrough::path"];
    let of_check = |a: &&Arrow| a.file.starts_with("verify/") && a.file != "verify/level_lines.rs";
    let arrows = arrows();
    let all: Vec<&Arrow> = arrows.iter().filter(of_check).collect();
    assert!(all.len() > 5, "only {} arrows were found: this test reads nothing", all.len());
    let base = |a: &Arrow| BASE.contains(&a.to.as_str()) || a.to == "verify";
    let shared: Vec<&Arrow> = all.into_iter().filter(|a| !base(a) && !ALLOWED.iter().any(|x| a.falls_under(x))).collect();
    // Scenes for its own unit tests are not the check's.
    assert!(shared.is_empty(), "the check shares:\n{}", list(&shared));
}

/// Lines that check rows share nothing with what makes rows but the level.
#[test]
fn lines_are_independent_of_vis() {
    let arrows = arrows();
    let of_lines: Vec<&Arrow> = arrows.iter().filter(|a| a.file == "verify/level_lines.rs").collect();
    assert!(of_lines.len() > 2, "only {} arrows were found: this test reads nothing", of_lines.len());
    let known = |a: &Arrow| ["level::Level"].iter().any(|x| a.falls_under(x));
    let shared: Vec<&Arrow> = of_lines.into_iter().filter(|a| !BASE.contains(&a.to.as_str()) && !known(a)).collect();
    assert!(shared.is_empty(), "lines share:\n{}", list(&shared));
}

/// rayon is compiled anew for each loop that is given to it, so one file has the loops. The others make pools or count threads.
#[test]
fn one_file_names_rayon_for_loops() {
    const POOLS: [&str; 5] =
        ["cli/mod.rs", "cli/report/building.rs", "cli/report/level.rs", "cli/stage_times.rs", "scene/ifc/workers.rs"];
    let texts = || sources().into_iter().map(|(name, text)| (name, without_comments(&text)));
    let named: Vec<String> = texts().filter(|(_, text)| text.contains("rayon")).map(|(name, _)| name).collect();
    let mut expected: Vec<&str> = POOLS.into_iter().chain(["parallel.rs"]).collect();
    expected.sort_unstable();
    assert_eq!(named, expected, "files that name rayon");
    for (name, text) in texts().filter(|(name, _)| POOLS.contains(&name.as_str())) {
        let of_pools = text.matches("rayon::ThreadPool").count() + text.matches("rayon::current_num_threads").count();
        assert_eq!(text.matches("rayon").count(), of_pools, "{name} names more of rayon than pools");
    }
}

#[test]
fn the_reader_sees_arrows_however_they_are_written() {
    let read = |file: &str, text: &str| {
        let arrows = arrows_of(Path::new(file), text);
        arrows.into_iter().map(|a| (a.to.clone(), a.item.clone().unwrap_or_default(), a.is_allowed())).collect::<Vec<_>>()
    };
    let one = |to: &str, item: &str, allowed| vec![(to.to_owned(), item.to_owned(), allowed)];
    assert_eq!(read("runtime/a.rs", "use crate::scene::Scene;"), one("scene", "Scene", false));
    assert_eq!(read("runtime/a.rs", "let x = crate::verify::check();"), one("verify", "check", false));
    assert_eq!(read("runtime/a.rs", "use super::super::cells::Cell;"), one("cells", "Cell", false));
    assert_eq!(read("runtime/mod.rs", "use super::pvs;"), one("pvs", "", false));
    assert_eq!(read("verify/a.rs", "use crate::level::Level;"), one("level", "Level", true));
    assert_eq!(read("runtime/a.rs", "// use crate::scene::Scene;\nuse super::Mode;"), Vec::new());
    assert_eq!(read("geom.rs", "use crate::CellId;"), one("ids", "CellId", true));
    assert_eq!(read("geom.rs", "use crate::scene;"), one("scene", "", false));
    let several = read("runtime/a.rs", "use crate::{file::{PvsFile, FileCell as F}, pvs::{self, Pvs}};");
    let names: Vec<String> = several.iter().map(|(to, item, allowed)| format!("{to}::{item} {allowed}")).collect();
    assert_eq!(names, ["file::PvsFile true", "file::FileCell true", "pvs::self false", "pvs::Pvs false"]);
}
