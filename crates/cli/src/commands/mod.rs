//! One file per command: its flags, its library call, its output.

mod backup;
pub mod bake;
pub mod check;
pub mod compare;
pub mod count;
pub mod dump;
pub mod export;
pub mod files;
pub mod generate;
pub mod ground;
pub mod info;
pub mod kinds;
pub mod level;
pub mod lost;
pub mod pack;
mod portal_file;
pub mod report;
mod resume;
pub mod scene;
pub mod stage_times;
pub mod vis;
pub mod walk;
pub mod why;

use enfilade::file::{FileError, Import};
use enfilade::scene::ImportOptions;
use std::fmt;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes a line of prose. Writing into a `String` cannot fail.
macro_rules! say {
    ($out:ident, $($text:tt)+) => {{
        let _ = writeln!($out, $($text)+);
    }};
}
pub(crate) use say;

/// The end of a command with valid input.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// Exit 0.
    Done,
    /// The check failed: exit 1.
    Failed,
}

/// Bad input or usage: one line, exit 2.
#[derive(Debug)]
pub struct CliError(pub String);

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // One line, whatever the library's message holds.
        f.write_str(&self.0.split_whitespace().collect::<Vec<_>>().join(" "))
    }
}

/// What is wrong with a file; its path is part of that.
impl From<FileError> for CliError {
    fn from(error: FileError) -> Self {
        Self(error.to_string())
    }
}

/// Folder and roles of a model's files.
#[derive(clap::Args)]
pub struct FilesFlag {
    /// Folder of files that the model names (buffers, materials), with subfolders [default: the model's folder]
    #[arg(long, value_name = "DIR", help_heading = "Model")]
    pub files_under: Option<PathBuf>,
}

impl FilesFlag {
    /// The given paths.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.files_under.iter()
    }

    /// Import options.
    pub fn options(&self) -> ImportOptions {
        ImportOptions { files_under: self.files_under.clone(), ..ImportOptions::default() }
    }

    /// Import options that repeat the import of the bake.
    pub fn again(&self, import: &Import) -> ImportOptions {
        ImportOptions { files_under: self.files_under.clone(), ..import.options() }
    }
}

/// Flags of commands with random choices and work for several threads.
#[derive(clap::Args)]
#[command(next_help_heading = "Run")]
pub struct RunFlags {
    /// Threads [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Seed of all random choices
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// An error with the path before it.
pub fn at(path: &Path, error: impl fmt::Display) -> CliError {
    CliError(format!("{}: {error}", path.display()))
}

/// Prints a command's answer, prose or JSON, to stdout. Notes, progress and errors go to stderr.
pub fn answer(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    let written = writeln!(out, "{}", text.trim_end_matches('\n')).and_then(|()| out.flush());
    match written {
        // The reader has closed the pipe.
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(CliError(format!("stdout: {e}"))),
        _ => Ok(()),
    }
}

/// Prints the answer in prose: to stdout, or to stderr beside JSON.
pub fn prose(text: &str, as_json: bool) -> Result<(), CliError> {
    if as_json {
        eprintln!("{}", text.trim_end_matches('\n'));
        return Ok(());
    }
    answer(text)
}

/// A report as JSON.
pub fn json(report: &impl serde::Serialize) -> Result<String, CliError> {
    serde_json::to_string_pretty(report).map_err(|e| CliError(format!("JSON: {e}")))
}

/// A pool of this many threads, or one per core.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, CliError> {
    let threads = threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| CliError(format!("--threads {threads}: {e}")))
}
