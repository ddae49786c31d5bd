//! The command as a user runs it, and what it works on.

use serde_json::Value;
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

/// Four rooms in a row along x; the last door is so far aside that the first and the last room don't see each other.
pub const LEVEL: &str = "PRT1\n4\n3\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n\
    4 1 2 (8 -1 -1) (8 1 -1) (8 1 1) (8 -1 1)\n\
    4 2 3 (12 9 -1) (12 11 -1) (12 11 1) (12 9 1)\n";

/// An empty folder for what a test makes, named after its file and what it calls itself there.
#[track_caller]
pub fn folder(test: &str) -> PathBuf {
    let file = Path::new(Location::caller().file()).with_extension("").to_string_lossy().replace('\\', "/");
    let file = file.rsplit_once("tests/").map_or(&*file, |(_, below)| below).replace('/', "_");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{file}_{test}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A model of `data/buildings`, or a file beside one.
pub fn building(file: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("data/buildings").join(file)
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

/// The same, of words.
pub fn run_words(arguments: &[&str]) -> Output {
    run(&arguments.iter().map(Path::new).collect::<Vec<_>>())
}

/// The same, of words and paths: `enfilade!("vis", &level)`.
macro_rules! enfilade {
    ($($argument:expr),+ $(,)?) => { crate::cli::run(&[$(std::path::Path::new($argument)),+]) };
}
#[allow(unused_imports)]
pub(crate) use enfilade;

/// Names of what is in a folder, in order.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Runs a command with a limit of so many KiB on any file, as on a disk that is full.
#[cfg(target_os = "linux")]
pub fn limited(command: &Command, kib: u64) -> Output {
    // The shell's blocks are of 512 bytes or of 1024. Ignored, the signal becomes an error of the write.
    let script = format!("trap '' XFSZ; ulimit -f {kib}; exec \"$@\"");
    let mut bash = Command::new("bash");
    bash.args(["-c", &script, "bash"]).arg(command.get_program()).args(command.get_args()).output().unwrap()
}

/// Waits until a file has so many bytes, or a process has ended.
pub fn wait_for(child: &mut Child, file: &Path, bytes: u64) {
    while std::fs::metadata(file).map_or(0, |m| m.len()) < bytes && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Ends by itself, or by a signal after a while; what it said, and its exit code if it came to its end.
#[cfg(unix)]
pub fn signalled(mut child: Child, signal: &str, after: Duration) -> (String, Option<i32>) {
    let begin = Instant::now();
    while begin.elapsed() < after && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    if child.try_wait().unwrap().is_none() {
        Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    }
    let out = child.wait_with_output().unwrap();
    (String::from_utf8(out.stderr).unwrap(), out.status.code())
}

/// A path as a word.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("an ordinary name")
}

/// It ended well.
#[track_caller]
pub fn done(out: &Output) {
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
}

/// What a check that failed printed as JSON; exit 1.
#[track_caller]
pub fn failed(out: &Output) -> Value {
    assert_eq!(out.status.code(), Some(1), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("JSON and nothing else")
}

/// It ended well and said nothing but this.
#[track_caller]
pub fn json(out: &Output) -> Value {
    done(out);
    serde_json::from_slice(&out.stdout).expect("JSON and nothing else")
}

/// One line, which says all of `parts`; exit 2.
#[track_caller]
pub fn refused(out: &Output, parts: &[&str]) {
    let said = String::from_utf8(out.stderr.clone()).unwrap();
    assert_eq!((out.status.code(), said.lines().count(), out.stdout.len()), (Some(2), 1, 0), "{said}");
    parts.iter().for_each(|part| assert!(said.contains(part), "no '{part}': {said}"));
}

/// A small maze, baked: the model and its file.
pub fn maze(folder: &Path) -> (PathBuf, PathBuf) {
    let (model, file) = (folder.join("maze.glb"), folder.join("maze.pvs"));
    done(&enfilade!("generate", "maze", "--rooms", "4", "-o", &model));
    done(&enfilade!("bake", &model, "-o", &file, "--rays", "100k"));
    (model, file)
}
