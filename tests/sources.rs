//! The library's sources as text, for tests of the house itself.

use std::path::{Path, PathBuf};

/// Every file below `src` by its path there, in order, with its text.
pub fn sources() -> Vec<(String, String)> {
    fn walk(folder: &Path, into: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, into);
            } else if path.extension().is_some_and(|e| e == "rs") {
                into.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    walk(&root, &mut files);
    let name = |path: &Path| path.strip_prefix(&root).unwrap().to_str().unwrap().replace('\\', "/");
    let mut all: Vec<(String, String)> =
        files.iter().map(|path| (name(path), std::fs::read_to_string(path).unwrap())).collect();
    all.sort();
    assert!(all.len() > 100, "only {} files: this reads nothing", all.len());
    all
}

/// Source text without its `//` comments; no source has `//` in a string before a path on the same line.
pub fn without_comments(text: &str) -> String {
    text.lines().map(|l| l.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

/// The same without the file's own unit tests, which stand at its end.
pub fn without_tests(text: &str) -> String {
    let text = without_comments(text);
    text.split("mod tests {").next().unwrap_or_default().to_owned()
}

/// The module of a file, from the crate's root: `a/b.rs` and `a/b/mod.rs` are `a`, `b`.
pub fn module(file: &str) -> Vec<&str> {
    file.trim_end_matches(".rs").trim_end_matches("/mod").split('/').collect()
}

/// A path that a text names, and what it is called there.
pub struct Named<'t> {
    pub path: Vec<&'t str>,
    pub name: &'t str,
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The paths of a use tree: `a::{b, c::d as e}` is `a::b` and, by the name `e`, `a::c::d`. Returns what follows the tree.
pub fn tree<'t>(text: &'t str, prefix: &[&'t str], into: &mut Vec<Named<'t>>) -> &'t str {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        loop {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix('}') {
                return after;
            }
            rest = tree(rest, prefix, into).trim_start();
            match rest.strip_prefix(',') {
                Some(after) => rest = after,
                None => {
                    assert!(rest.starts_with('}'), "a use tree that this can't read: {}", &text[..text.len().min(80)]);
                }
            }
        }
    }
    let end = text.find(|c: char| !is_word(c) && c != '*').unwrap_or(text.len());
    let path: Vec<&str> = prefix.iter().copied().chain([&text[..end]]).collect();
    match text[end..].strip_prefix("::") {
        // `module::<T>` is no path of modules; a turbofish ends it.
        Some(rest) if !rest.trim_start().starts_with('<') => tree(rest, &path, into),
        _ => {
            let mut rest = &text[end..];
            let mut name = &text[..end];
            if let Some(after) = rest.trim_start().strip_prefix("as ") {
                let after = after.trim_start();
                let end = after.find(|c: char| !is_word(c)).unwrap_or(after.len());
                (name, rest) = after.split_at(end);
            }
            into.push(Named { path, name });
            rest
        }
    }
}

/// Where `word` begins in a text, and isn't the end of a longer word or path.
pub fn begins<'t>(text: &'t str, word: &'t str) -> impl Iterator<Item = usize> + 't {
    let inside = |at: usize| text[..at].ends_with(|c: char| is_word(c) || c == '$' || c == ':' || c == '.');
    text.match_indices(word).map(|(at, _)| at).filter(move |&at| !inside(at))
}
