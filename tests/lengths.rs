//! No function of `src` is longer than a screen, unless a comment with `long:` above it says why.

use crate::sources::sources;

/// Most lines of a function, from `fn` to its closing bracket.
const MOST: usize = 80;

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
    for (file, text) in sources() {
        let long = long_functions(&text);
        assert!(long.is_empty(), "{file}: {long:?}: shorten them, or say why above: `// long: ...`");
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
