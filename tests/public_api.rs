//! What others may call, as it stands in docs/public-api.txt. Where it changes, that shows in a review: `ENFILADE_PUBLIC_API=write cargo test
//! --test suite public_api` writes the page anew.
//!
//! Read from the source text, all features on: what is `pub` and can be reached from the crate's root by `pub mod` and `pub use`, with fields,
//! variants, methods and signatures.

use crate::sources::{module, sources, tree, without_tests};
use std::collections::{BTreeMap, BTreeSet};

/// A declaration at the left margin: its head up to the body, and the body's lines.
struct Item {
    head: String,
    body: Vec<String>,
}

/// The declarations of a text.
fn items(text: &str) -> Vec<Item> {
    let mut items: Vec<Item> = Vec::new();
    let mut head: Option<String> = None;
    for line in text.lines() {
        let at_margin = !line.starts_with([' ', '}', ')', ']', '#']) && !line.is_empty();
        if head.is_none() && !at_margin {
            if let Some(item) = items.last_mut() {
                item.body.push(line.to_owned());
            }
            continue;
        }
        let all = format!("{} {}", head.take().unwrap_or_default(), line.trim());
        // A head ends with its line's bracket or semicolon; one that is wrapped goes on.
        if line.ends_with(['{', ';', '}']) {
            items.push(Item { head: all.trim().to_owned(), body: Vec::new() });
        } else {
            head = Some(all);
        }
    }
    items
}

/// A head without its body: what comes before the bracket, and a constant without its value.
fn signature(head: &str) -> String {
    let head = head.split(" = ").next().unwrap_or_default();
    head.trim_end_matches([';', '{', '}', ' ', ',']).trim().to_owned()
}

/// The kind and the name of a declaration that begins with `pub `.
fn declared(head: &str) -> Option<(&str, &str)> {
    let mut words = head.strip_prefix("pub ")?.split([' ', '(', '<', ':', ';', '{', '=']).filter(|w| !w.is_empty());
    let mut kind = words.next()?;
    let mut name = words.next()?;
    if kind == "const" && name == "fn" {
        (kind, name) = ("fn", words.next()?);
    }
    Some((kind, name))
}

/// The type of `impl Type {`, where it isn't of a trait.
fn implemented(head: &str) -> Option<&str> {
    let rest = head.strip_prefix("impl")?;
    if rest.contains(" for ") {
        return None;
    }
    // Behind the parameters of the block.
    let mut depth = 0;
    let end = rest.find(|c| {
        depth += i32::from(c == '<') - i32::from(c == '>');
        depth == 0 && c == ' '
    })?;
    rest[end..].trim().split(['<', ' ']).next()
}

/// Declarations in a body whose lines are indented once: wrapped heads are joined.
fn members(body: &[String]) -> Vec<String> {
    let (mut all, mut head) = (Vec::new(), None::<String>);
    for line in body {
        let inner = line.strip_prefix("    ").unwrap_or("");
        let begins = !inner.is_empty() && !inner.starts_with([' ', '}', ')', ']', '#']);
        if begins || head.is_some() {
            let joined = format!("{} {}", head.take().unwrap_or_default(), inner.trim());
            if inner.ends_with(['{', ';', '}', ',']) && !(inner.starts_with(' ') && inner.ends_with(',')) {
                all.push(joined.trim().to_owned());
            } else {
                head = Some(joined);
            }
        }
    }
    all
}

struct Crate {
    /// By module.
    files: BTreeMap<Vec<String>, Vec<Item>>,
    listed: BTreeSet<String>,
}

impl Crate {
    fn read() -> Self {
        let inside = |name: &str| name != "main.rs" && !name.starts_with("cli/");
        let read = |(name, text): (String, String)| {
            let path = if name == "lib.rs" { Vec::new() } else { module(&name).iter().map(|&s| s.to_owned()).collect() };
            (path, items(&without_tests(&text)))
        };
        let files = sources().into_iter().filter(|(name, _)| inside(name)).map(read).collect();
        Self { files, listed: BTreeSet::new() }
    }

    /// Lists what is public in a module, by its path.
    fn list(&mut self, at: &[String]) {
        let heads: Vec<String> = self.files[at].iter().map(|i| i.head.clone()).filter(|h| h.starts_with("pub ")).collect();
        for head in heads {
            if let Some(uses) = head.strip_prefix("pub use ") {
                let mut paths = Vec::new();
                tree(uses, &[], &mut paths);
                for named in paths {
                    let path: Vec<String> = named.path.iter().map(|&s| s.to_owned()).collect();
                    self.list_item(at, &path, at, named.name, 0);
                }
            } else if let Some(("mod", name)) = declared(&head) {
                let inner = [at, &[name.to_owned()]].concat();
                if self.files.contains_key(&inner) {
                    self.list(&inner);
                }
            } else if let Some((_, name)) = declared(&head) {
                self.list_item(at, &[name.to_owned()], at, name, 0);
            }
        }
    }

    /// Lists what `path`, written in `module`, leads to: as `name` of the module `shown`.
    fn list_item(&mut self, module: &[String], path: &[String], shown: &[String], name: &str, depth: usize) {
        let climbs = path.iter().take_while(|s| *s == "super").count();
        let base = if path[0] == "crate" { &[] } else { &module[..module.len() - climbs] };
        let skip = climbs.max(usize::from(path[0] == "crate" || path[0] == "self"));
        let full = [base, &path[skip..]].concat();
        let (item, home) = full.split_last().expect("a name");
        let Some(file) = self.files.get(home) else { return };
        let label = [shown, &[name.to_owned()]].concat().join("::");
        let own =
            file.iter().find(|i| declared(&i.head).is_some_and(|(kind, n)| n == item && kind != "use" && kind != "mod"));
        if let Some(own) = own {
            let mut lines = vec![format!("{label}: {}", signature(&own.head))];
            if own.head.ends_with('{') && !own.head.contains(" fn ") {
                let is_struct = own.head.contains("struct ");
                let inner = members(&own.body).into_iter().filter(|m| !is_struct || m.starts_with("pub "));
                lines.extend(inner.map(|m| format!("{label}: {}", signature(&m))));
            }
            // Its methods may be in any file of the room.
            let room = |m: &Vec<String>| m.first() == home.first();
            for block in self.files.iter().filter(|(m, _)| room(m)).flat_map(|(_, items)| items) {
                if implemented(&block.head) == Some(item) {
                    let public = members(&block.body).into_iter().filter(|m| m.starts_with("pub "));
                    lines.extend(public.map(|m| format!("{label}: {}", signature(&m))));
                }
            }
            self.listed.extend(lines);
        } else if depth < 8 {
            // Passed on from elsewhere.
            let passed_on: Vec<String> =
                file.iter().filter_map(|i| i.head.strip_prefix("pub use ")).map(str::to_owned).collect();
            let private: Vec<String> =
                file.iter().filter_map(|i| i.head.strip_prefix("pub(crate) use ")).map(str::to_owned).collect();
            let home = home.to_vec();
            for uses in passed_on.iter().chain(&private) {
                let mut paths = Vec::new();
                tree(uses, &[], &mut paths);
                if let Some(named) = paths.iter().find(|n| n.name == item) {
                    let path: Vec<String> = named.path.iter().map(|&s| s.to_owned()).collect();
                    return self.list_item(&home, &path, shown, name, depth + 1);
                }
            }
        }
    }
}

#[test]
fn the_public_api_is_as_written_down() {
    let mut library = Crate::read();
    library.list(&[]);
    assert!(library.listed.len() > 300, "only {} lines: this test reads nothing", library.listed.len());
    let now: String = library.listed.iter().map(|line| format!("{line}\n")).collect();
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/public-api.txt");
    if std::env::var_os("ENFILADE_PUBLIC_API").is_some_and(|v| v == "write") {
        return std::fs::write(&page, now).unwrap();
    }
    let written = std::fs::read_to_string(&page).unwrap_or_default();
    let (before, after): (BTreeSet<&str>, BTreeSet<&str>) = (written.lines().collect(), now.lines().collect());
    let gone = before.difference(&after).map(|l| format!("- {l}"));
    let changes: Vec<String> = gone.chain(after.difference(&before).map(|l| format!("+ {l}"))).collect();
    let again = "ENFILADE_PUBLIC_API=write cargo test --test suite public_api";
    assert!(changes.is_empty(), "the public API has changed; if that is meant, `{again}`:\n{}", changes.join("\n"));
}

#[test]
fn declarations_are_read_over_several_lines() {
    let text = "pub struct A<T> {\n    /// x\n    pub b: u8,\n    c: u8,\n}\n\nimpl<T> A<T> {\n    pub fn d(\n        &self,\n        e: u8,\n    ) -> u8 {\n        e\n    }\n    fn f() {}\n}\n";
    let found = items(&crate::sources::without_comments(text));
    assert_eq!(found.iter().map(|i| i.head.as_str()).collect::<Vec<_>>(), ["pub struct A<T> {", "impl<T> A<T> {"]);
    assert_eq!(implemented(&found[1].head), Some("A"));
    let names: Vec<String> = found.iter().flat_map(|i| members(&i.body)).map(|m| signature(&m)).collect();
    assert_eq!(names, ["pub b: u8", "c: u8", "pub fn d( &self, e: u8, ) -> u8", "fn f()"]);
}
