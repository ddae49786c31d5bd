//! No function of `src` is longer than a screen, unless a comment with `long:` above it says why.

use crate::sources::sources;
use std::collections::BTreeSet;

/// Most lines of a function, from `fn` to its closing bracket.
const MOST: usize = 80;

/// Functions that are longer without a reason; this list shrinks.
const TO_BE_SHORTENED: [&str; 3] = ["pvs/cubes/raster.rs: face", "pvs/mod.rs: bake", "pvs/view_cells.rs: sample"];

/// Names and lengths of the functions of a text that are too long, and have no reason above them.
fn long_functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let indent = &line[..line.len() - line.trim_start().len()];
        let words: Vec<&str> = line.split_whitespace().collect();
        let Some(at) = words.iter().position(|w| *w == "fn") else { continue };
        let is_before_fn = |w: &&str| w.starts_with("pub") || w.ends_with(')') || ["const", "unsafe"].contains(w);
        let (true, Some(name)) = (words[..at].iter().all(is_before_fn), words.get(at + 1)) else { continue };
        let name = name.split(['(', '<']).next().unwrap_or_default();
        let closes = |l: &&str| l.strip_prefix(indent) == Some("}") || l.strip_prefix(indent) == Some("};");
        // Without a body, or with one on its own line, it ends where it begins.
        if line.ends_with([';', '}']) {
            continue;
        }
        let length = lines[i..].iter().position(|l| closes(&l.trim_end())).map_or(lines.len() - i, |n| n + 1);
        let above = lines[..i].iter().rev().take_while(|l| l.trim_start().starts_with(['/', '#']));
        if length > MOST && !above.into_iter().any(|l| l.contains("// long: ")) {
            found.push((name.to_owned(), length));
        }
    }
    found
}

#[test]
fn no_function_is_longer_than_a_screen() {
    let mut all = BTreeSet::new();
    for (file, text) in sources() {
        for (name, length) in long_functions(&text) {
            let place = format!("{file}: {name}");
            let reason = "shorten it, or say why above it: `// long: ...`";
            assert!(TO_BE_SHORTENED.contains(&place.as_str()), "{place} has {length} lines: {reason}");
            all.insert(place);
        }
    }
    for place in TO_BE_SHORTENED {
        assert!(all.contains(place), "{place} is short by now: take it out of the list");
    }
}

#[test]
fn lengths_are_counted_from_fn_to_its_bracket() {
    let of = |lines: usize, head: &str| {
        let text = format!("{head} {{\n{}}}\nfn after();\n", "    x();\n".repeat(lines - 2));
        long_functions(&text).into_iter().map(|(name, n)| format!("{name} {n}")).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(of(80, "fn f()"), "");
    assert_eq!(of(81, "fn f()"), "f 81");
    assert_eq!(of(90, "pub(in crate::a) const fn f<T>(a: T)"), "f 90");
    assert_eq!(of(90, "// long: a table of formats.\n#[inline]\nfn f()"), "");
    assert_eq!(of(90, "// It takes long.\nfn f()"), "f 90");
}
