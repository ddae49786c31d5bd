//! No circles of imports: none between rooms, and within a room none of more than three files. Read from the source text, without unit tests.
//!
//! A `pub use` needs nothing: who imports a name that a file passes on needs the file that has it.

use crate::sources::{begins, module, sources, tree, without_tests};
use std::collections::{BTreeMap, BTreeSet};

/// Most files of a circle within a room.
const MOST: usize = 3;

/// From the crate's root.
type Path = Vec<String>;

fn owned(path: &[&str]) -> Path {
    path.iter().map(|&s| s.to_owned()).collect()
}

/// What one file names.
#[derive(Default)]
struct Names {
    /// Paths that it uses.
    uses: Vec<Path>,
    /// What it passes on: the name, and where it is.
    passes_on: BTreeMap<String, Path>,
}

/// Files by their modules, and what each names.
struct House {
    files: BTreeMap<Path, String>,
    names: BTreeMap<Path, Names>,
}

/// `path`, written in `module`, from the crate's root; `None` where it leads out of the crate.
fn absolute(module: &[String], path: &[&str], children: &BTreeSet<&str>) -> Option<Path> {
    let climbs = path.iter().take_while(|s| **s == "super").count();
    let (base, rest) = match path[0] {
        "crate" => (&module[..0], &path[1..]),
        "self" => (module, &path[1..]),
        "super" => (&module[..module.len().checked_sub(climbs)?], &path[climbs..]),
        first if children.contains(first) => (module, path),
        _ => return None,
    };
    Some(base.iter().cloned().chain(owned(rest)).collect())
}

impl House {
    fn read(sources: &[(String, String)]) -> Self {
        let inside = || sources.iter().filter(|(name, _)| !["lib.rs", "main.rs"].contains(&name.as_str()));
        let files: BTreeMap<Path, String> = inside().map(|(name, _)| (owned(&module(name)), name.clone())).collect();
        let mut house = Self { files, names: BTreeMap::new() };
        for (name, text) in inside() {
            let module = owned(&module(name));
            let names = house.names_of(&module, &without_tests(text).replace("(in crate::", "(in "));
            house.names.insert(module, names);
        }
        house
    }

    fn names_of(&self, module: &[String], text: &str) -> Names {
        let below = self.files.keys().filter(|m| m.len() == module.len() + 1 && m.starts_with(module));
        let children: BTreeSet<&str> = below.map(|m| m[m.len() - 1].as_str()).collect();
        let mut names = Names::default();
        // Statements first; what is left names paths on the spot.
        let mut body = String::new();
        let mut rest = text;
        while let Some(at) = begins(rest, "use ").next() {
            let (before, statement) = rest.split_at(at);
            let line = before.rsplit('\n').next().unwrap_or_default().trim();
            let end = statement.find(';').map_or(statement.len(), |e| e + 1);
            body += before;
            rest = &statement[end..];
            let mut paths = Vec::new();
            tree(&statement["use ".len()..], &[], &mut paths);
            for named in paths {
                let Some(path) = absolute(module, &named.path, &children) else { continue };
                if line.starts_with("pub") {
                    names.passes_on.insert(named.name.to_owned(), path);
                } else {
                    names.uses.push(path);
                }
            }
        }
        body += rest;
        for word in ["crate", "self", "super"].iter().chain(&children) {
            let word = format!("{word}::");
            // `pub(in crate::a)` needs nothing.
            for at in begins(&body, &word).filter(|&at| !body[..at].ends_with("(in ")) {
                let mut paths = Vec::new();
                tree(&body[at..], &[], &mut paths);
                names.uses.extend(paths.iter().filter_map(|n| absolute(module, &n.path, &children)));
            }
        }
        names
    }

    /// The module whose file has what a path leads to, through the files that pass it on.
    fn home(&self, path: &[String], depth: usize) -> Option<Path> {
        let path: Path = path.iter().filter(|s| *s != "self").cloned().collect();
        let length = (1..=path.len()).rev().find(|&n| self.files.contains_key(&path[..n]))?;
        let (module, rest) = path.split_at(length);
        let further = rest.first().and_then(|name| self.names[module].passes_on.get(name)).filter(|_| depth < 8);
        let further = further.and_then(|to| self.home(&[to, &rest[1..]].concat(), depth + 1));
        Some(further.unwrap_or_else(|| module.to_vec()))
    }

    /// By module: the modules whose files its file needs.
    fn needs(&self) -> BTreeMap<&Path, BTreeSet<Path>> {
        let of = |(module, names): (&Path, &Names)| {
            names.uses.iter().filter_map(|p| self.home(p, 0)).filter(|m| m != module).collect()
        };
        self.names.iter().map(|(module, names)| (module, of((module, names)))).collect()
    }

    /// Sets of files that all need one another, of two and more.
    fn circles(&self) -> Vec<Vec<&str>> {
        let needs = self.needs();
        let reached: BTreeMap<&Path, BTreeSet<&Path>> = needs
            .keys()
            .map(|&from| {
                let (mut seen, mut next) = (BTreeSet::new(), vec![from]);
                while let Some(module) = next.pop() {
                    next.extend(needs[module].iter().filter(|&m| seen.insert(m)));
                }
                (from, seen)
            })
            .collect();
        let circle = |from: &&Path| -> Vec<&str> {
            let members = reached[*from].iter().filter(|m| reached[**m].contains(*from));
            members.map(|m| self.files[*m].as_str()).collect()
        };
        let all: BTreeSet<Vec<&str>> = needs.keys().map(circle).filter(|c| c.len() > 1).collect();
        all.into_iter().collect()
    }
}

#[test]
fn rooms_need_one_another_one_way_only() {
    let sources = sources();
    let house = House::read(&sources);
    assert!(house.needs().values().map(BTreeSet::len).sum::<usize>() > 500, "this test reads nothing");
    for circle in house.circles() {
        let rooms: BTreeSet<&str> = circle.iter().map(|file| module(file)[0]).collect();
        assert_eq!(rooms.len(), 1, "a circle of rooms: {circle:?}");
    }
}

#[test]
fn no_circle_is_of_more_than_three_files() {
    let house = House::read(&sources());
    let circles = house.circles();
    assert!(!circles.is_empty(), "no circle at all: this finds nothing");
    let large: Vec<_> = circles.iter().filter(|c| c.len() > MOST).collect();
    assert!(large.is_empty(), "{large:#?}");
}

#[test]
fn circles_are_found_however_names_are_written() {
    let circles = |files: &[(&str, &str)]| {
        let sources: Vec<(String, String)> = files.iter().map(|&(a, b)| (a.to_owned(), b.to_owned())).collect();
        House::read(&sources).circles().concat().join(" ")
    };
    assert_eq!(circles(&[("a.rs", "use crate::b::{B, self as c};"), ("b.rs", "fn f() { crate::a::g() }")]), "a.rs b.rs");
    // A file that passes a name on doesn't need it, and isn't needed for it.
    let passes_on = ("a/mod.rs", "mod b; mod c;\npub use b::{B as D};");
    assert_eq!(circles(&[passes_on, ("a/b.rs", "use super::c::C;"), ("a/c.rs", "use crate::a::D;")]), "a/b.rs a/c.rs");
    assert_eq!(circles(&[passes_on, ("a/b.rs", "use super::c::C;"), ("a/c.rs", "use crate::a::Other;")]), "");
    // One that uses a child on the spot does.
    assert_eq!(circles(&[("a/mod.rs", "mod b;\nfn f() { b::g() }"), ("a/b.rs", "use super::f;")]), "a/mod.rs a/b.rs");
    // What unit tests name doesn't count.
    assert_eq!(circles(&[("a.rs", "use crate::b::B;"), ("b.rs", "mod tests {\nuse crate::a::f; }")]), "");
}
