//! What the project is built of, without a network: every crate's licence is on the list of `deny.toml`, none is banned there, all come
//! from one registry, and every crate of the workspace forbids unsafe code. Advisories take a network: `cargo deny check advisories`.

use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Every package of the workspace's graph for this machine, all features on; from the lock file and what cargo has here. `None`, and a line
/// that says so, where crates of the workspace were never fetched: `cargo test` needs those of this package only, `just test-full` has all.
fn packages() -> Option<Vec<Value>> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
    let host = Command::new(&cargo).args(["-vV"]).output().unwrap();
    let host = String::from_utf8(host.stdout).unwrap();
    let host = host.lines().find_map(|l| l.strip_prefix("host: ")).expect("cargo says what it runs on");
    let mut command = Command::new(&cargo);
    command.current_dir(root()).args(["metadata", "--offline", "--locked", "--all-features", "--format-version", "1"]);
    let out = command.args(["--filter-platform", host]).output().unwrap();
    if !out.status.success() {
        let reason = String::from_utf8_lossy(&out.stderr);
        let all_were_fetched = cfg!(feature = "full") && std::env::var_os("CI").is_some();
        assert!(!all_were_fetched, "{reason}");
        eprintln!("not run: licences: {} (`cargo fetch` first)", reason.lines().next().unwrap_or_default());
        return None;
    }
    let graph: Value = serde_json::from_slice(&out.stdout).unwrap();
    Some(graph["packages"].as_array().unwrap().clone())
}

/// The strings between `key = [` and the next `]` in `deny.toml`.
fn listed(key: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join("deny.toml")).unwrap();
    let (_, rest) = text.split_once(&format!("\n{key} = [")).expect("the list is there");
    let (list, _) = rest.split_once(']').expect("it ends");
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// True where an SPDX expression can be met by the licences of the list; `/` is an old way of saying OR.
fn allowed(expression: &str, list: &[String]) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut at = 0;
    let all = any(&words, &mut at, list);
    assert_eq!(at, words.len(), "an expression that this test can't read: {expression}");
    all
}

fn any(words: &[&str], at: &mut usize, list: &[String]) -> bool {
    let mut met = both(words, at, list);
    while words.get(*at) == Some(&"OR") {
        *at += 1;
        met |= both(words, at, list);
    }
    met
}

fn both(words: &[&str], at: &mut usize, list: &[String]) -> bool {
    let mut met = one(words, at, list);
    while words.get(*at) == Some(&"AND") {
        *at += 1;
        met &= one(words, at, list);
    }
    met
}

fn one(words: &[&str], at: &mut usize, list: &[String]) -> bool {
    let word = words.get(*at).copied().unwrap_or_default();
    *at += 1;
    if word == "(" {
        let met = any(words, at, list);
        assert_eq!(words.get(*at), Some(&")"), "a bracket is open");
        *at += 1;
        return met;
    }
    let mut licence = word.to_owned();
    if words.get(*at) == Some(&"WITH") {
        licence = format!("{word} WITH {}", words[*at + 1]);
        *at += 2;
    }
    list.contains(&licence)
}

#[test]
fn every_crate_has_a_licence_that_is_allowed() {
    let list = listed("allow");
    let Some(packages) = packages() else { return };
    assert!(packages.len() > 100, "only {} packages: this test reads nothing", packages.len());
    let fault = |p: &Value| {
        let licence = p["license"].as_str().unwrap_or_default();
        (licence.is_empty() || !allowed(licence, &list)).then(|| format!("{} {}: {licence:?}", p["name"], p["version"]))
    };
    let faults: Vec<String> = packages.iter().filter_map(fault).collect();
    assert!(faults.is_empty(), "not allowed by deny.toml:\n{}", faults.join("\n"));
}

#[test]
fn nothing_is_banned_and_all_comes_from_one_registry() {
    let banned = listed("deny");
    assert_eq!(banned, ["bincode"]);
    let Some(packages) = packages() else { return };
    let mut sources = BTreeSet::new();
    for package in packages {
        let name = package["name"].as_str().unwrap();
        assert!(!banned.iter().any(|b| b == name), "{name} is banned by deny.toml");
        sources.extend(package["source"].as_str().map(str::to_owned));
    }
    assert!(sources.len() == 1 && sources.iter().all(|s| s.starts_with("registry+")), "{sources:?}");
}

#[test]
fn expressions_are_read() {
    let list = ["MIT".to_owned(), "Apache-2.0 WITH LLVM-exception".to_owned()];
    for (expression, met) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("GPL-3.0 OR MIT", true),
        ("GPL-3.0/MIT", true),
        ("GPL-3.0 AND MIT", false),
        ("(GPL-3.0 OR MIT) AND Apache-2.0 WITH LLVM-exception", true),
        ("(MIT OR GPL-3.0) AND Unicode-3.0", false),
        ("Apache-2.0", false),
    ] {
        assert_eq!(allowed(expression, &list), met, "{expression}");
    }
}

#[test]
fn every_crate_but_that_for_c_forbids_unsafe_code() {
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    let of_all = read(&root().join("Cargo.toml"));
    assert!(of_all.contains("[workspace.lints.rust]\nunsafe_code = \"forbid\""));
    assert!(
        of_all
            .contains("members = [\".\", \"bevy_enfilade\", \"crates/*\", \"tests/support\", \"viewer\", \"web/runtime\"]"),
        "a new member"
    );
    let crates = std::fs::read_dir(root().join("crates")).unwrap().map(|e| e.unwrap().path());
    let others = [".", "bevy_enfilade", "tests/support", "viewer", "web/runtime"].map(|name| root().join(name));
    let all: Vec<_> = crates.chain(others).collect();
    assert!(all.len() > 10, "only {} crates: this reads nothing", all.len());
    for manifest in all.iter().map(|folder| folder.join("Cargo.toml")) {
        let text = read(&manifest);
        let own = text.contains("[lints.rust]\nunsafe_code = \"forbid\"");
        // What C hands over is taken on trust, and each block says which.
        if manifest.ends_with("capi/Cargo.toml") {
            assert!(text.contains("undocumented_unsafe_blocks = \"deny\""), "unsafe blocks need a reason");
            continue;
        }
        assert!(own || text.contains("[lints]\nworkspace = true"), "{} doesn't forbid unsafe code", manifest.display());
    }
}
