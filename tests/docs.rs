//! The pages: what is made is short, and what they lead to is there.

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Most lines of docs/results.md: eight tables, no diary.
const MOST: usize = 300;

#[test]
fn results_are_eight_tables_in_300_lines() {
    let text = std::fs::read_to_string(root().join("docs/results.md")).unwrap();
    assert!(text.lines().count() <= MOST, "{} lines", text.lines().count());
    assert_eq!(text.lines().filter(|line| line.starts_with("## ")).count(), 8);
}

/// The target of each `](...)` of a page.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

/// The anchors that a page's headings make.
fn anchors(text: &str) -> Vec<String> {
    let of = |line: &str| {
        let kept =
            line.trim_start_matches('#').trim().chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
        kept.collect::<String>().to_lowercase().replace(' ', "-")
    };
    text.lines().filter(|line| line.starts_with('#')).map(of).collect()
}

#[test]
fn links_of_pages_lead_somewhere() {
    let docs = std::fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let others = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "bevy_enfilade/README.md", "crates/studies/README.md"];
    let pages = docs.filter(|path| path.extension().is_some_and(|e| e == "md")).chain(others.map(|page| root().join(page)));
    let mut count = 0;
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in links(&text).filter(|link| !link.contains("://")) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(target.exists(), "{}: {link} leads nowhere", page.display());
            if !anchor.is_empty() {
                let there = anchors(&std::fs::read_to_string(&target).unwrap());
                assert!(there.iter().any(|a| a == anchor), "{}: {link}: no such heading", page.display());
            }
            count += 1;
        }
    }
    assert!(count > 40, "only {count} links: this reads nothing");
}
