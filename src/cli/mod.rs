//! One file a command: its flags, its call into the library, its printing.

pub mod against;
pub mod bake;
pub mod check;
pub mod dump;
pub mod generate;
pub mod info;
mod keep;
pub mod level;
pub mod report;
pub mod scene;
pub mod stages;
pub mod vis;
pub mod walk;
pub mod why;

use std::fmt;
use std::path::Path;

/// How a command ended when nothing was wrong with its input.
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
        // One line, whatever a library put into its message.
        f.write_str(&self.0.split_whitespace().collect::<Vec<_>>().join(" "))
    }
}

/// Puts the path before a message.
pub fn at(path: &Path, error: impl fmt::Display) -> CliError {
    CliError(format!("{}: {error}", path.display()))
}

/// Threads to work on: as many as asked for, or one a core.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, CliError> {
    let threads = threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| CliError(format!("--threads {threads}: {e}")))
}
