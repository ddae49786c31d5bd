//! The command as a user runs it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Four rooms in a row along x; the last door is so far aside that the first and the last room don't see each other.
pub const LEVEL: &str = "PRT1\n4\n3\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n\
    4 1 2 (8 -1 -1) (8 1 -1) (8 1 1) (8 -1 1)\n\
    4 2 3 (12 9 -1) (12 11 -1) (12 11 1) (12 9 1)\n";

/// An empty folder of this test's own.
pub fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}_{test}", env!("CARGO_CRATE_NAME")));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The command, not yet run.
pub fn command(arguments: &[&Path]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade"));
    command.args(arguments);
    command
}

/// Runs it to its end.
pub fn run(arguments: &[&Path]) -> Output {
    command(arguments).output().unwrap()
}

/// One line, which says all of `parts`; exit 2.
pub fn refused(out: &Output, parts: &[&str]) {
    let said = String::from_utf8(out.stderr.clone()).unwrap();
    assert_eq!((out.status.code(), said.lines().count(), out.stdout.len()), (Some(2), 1, 0), "{said}");
    parts.iter().for_each(|part| assert!(said.contains(part), "no '{part}': {said}"));
}
