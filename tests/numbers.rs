//! No condition of `src` compares with a number that has no name: a reader must learn its unit, and what larger and smaller break.

use crate::sources::{sources, without_tests};

/// Decimal numbers that need no name: nothing, all, half, and twice.
const PLAIN: [&str; 4] = ["0.0", "1.0", "0.5", "2.0"];

/// The first number with a point or an exponent on the right of a comparison in a condition.
fn nameless(line: &str) -> Option<&str> {
    let condition = ["if ", "while ", "filter(", "&& ", "|| "].iter().filter_map(|word| line.find(word)).min()?;
    let compared =
        [" < ", " > ", " <= ", " >= "].iter().flat_map(|sign| line[condition..].match_indices(sign).map(|(i, _)| i));
    compared
        .filter_map(|at| line[condition + at..].split([' ', '(', ')', ';', ',']).find(|w| !w.is_empty() && !is_sign(w)))
        .find(|w| {
            let number = w.trim_start_matches('-');
            number.starts_with(|c: char| c.is_ascii_digit()) && number.contains(['.', 'e']) && !PLAIN.contains(&number)
        })
}

fn is_sign(word: &str) -> bool {
    ["<", ">", "<=", ">="].contains(&word)
}

#[test]
fn conditions_compare_with_named_numbers() {
    let of = |(file, text): (String, String)| {
        let text = without_tests(&text);
        let found = text.lines().filter(|line| nameless(line).is_some()).map(|line| format!("{file}: {}", line.trim()));
        found.collect::<Vec<_>>()
    };
    let found: Vec<String> = sources().into_iter().flat_map(of).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn numbers_are_found_in_conditions_only() {
    for (line, found) in [
        ("if x.abs() > 0.79 {", Some("0.79")),
        ("    && length <= -1e-9 * (a + b)", Some("-1e-9")),
        ("if x > 0.0 && y < 1.65 {", Some("1.65")),
        ("if x > 0.0 && y < WIDE {", None),
        ("let wide = 1.65;", None),
        ("if n < 12 || m >= 1.0 {", None),
    ] {
        assert_eq!(nameless(line), found, "{line}");
    }
}
