//! One file a command: its flags, its call into the library, its printing.

pub mod bake;
pub mod check;
pub mod compare;
pub mod count;
pub mod dump;
pub mod export;
pub mod generate;
pub mod ground;
pub mod info;
pub mod level;
pub mod report;
mod resume;
pub mod scene;
pub mod stage_times;
pub mod vis;
pub mod walk;
pub mod why;

use enfilade::file::Import;
use enfilade::scene::ImportOptions;
use std::fmt;
use std::path::{Path, PathBuf};

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

/// Where files that a model names may lie.
#[derive(clap::Args)]
pub struct FilesFlag {
    /// Files that the model names (buffers, materials) may lie in this folder, and below it [default: in the model's own]
    #[arg(long, value_name = "DIR")]
    files_under: Option<PathBuf>,
    /// What is a door, a window or glass, by names of nodes and materials (glTF, OBJ) [default: MODEL.roles.json, if it is there]
    #[arg(long, value_name = "ROLES.json")]
    roles: Option<PathBuf>,
}

impl FilesFlag {
    /// As an import takes them.
    pub fn options(&self) -> ImportOptions {
        ImportOptions { files_under: self.files_under.clone(), roles: self.roles.clone(), ..ImportOptions::default() }
    }

    /// What imports a file's model as it was imported for the bake.
    pub fn again(&self, import: &Import) -> ImportOptions {
        ImportOptions { files_under: self.files_under.clone(), roles: self.roles.clone(), ..import.options() }
    }
}

/// Puts the path before a message.
pub fn at(path: &Path, error: impl fmt::Display) -> CliError {
    CliError(format!("{}: {error}", path.display()))
}

/// Whether a file's folder is there; asked before the work of which the file is the result.
pub fn folder_of(path: &Path) -> Result<(), CliError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        Some(folder) => Err(at(folder, "there is no such folder")),
        None => Ok(()),
    }
}

/// A report as JSON.
pub fn json(report: &impl serde::Serialize) -> Result<String, CliError> {
    serde_json::to_string_pretty(report).map_err(|e| CliError(format!("JSON: {e}")))
}

/// Threads to work on: as many as asked for, or one a core.
pub fn pool(threads: Option<usize>) -> Result<rayon::ThreadPool, CliError> {
    let threads = threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| CliError(format!("--threads {threads}: {e}")))
}
