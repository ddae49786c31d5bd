//! Long runs: Ctrl-C stops them, and the same command goes on with them.

use super::{CliError, Outcome, at};
use enfilade::job::{Job, Journal, JournalError, Progress, of_this_build};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);

/// From here on the first Ctrl-C stops work, and the second ends the program at once.
pub fn catch_interrupts() -> Result<(), CliError> {
    let handler = ctrlc::set_handler(|| {
        // 128 and the signal's number, as shells have it.
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    handler.map_err(|e| CliError(format!("Ctrl-C can't be caught: {e}")))
}

/// The state of a run, on the disk.
pub struct Kept(Option<(PathBuf, Journal)>);

impl Kept {
    /// Goes on from the state in `path`, or begins one; says so. `digest` is of all that the result depends on, but for this program. An
    /// output that is no plain file (a pipe, `/dev/null`) has no state beside it.
    pub fn open(path: Option<&Path>, output: &Path, digest: u128, default: &str) -> Result<Self, CliError> {
        if path.is_none() && output.exists() && !output.is_file() {
            return Ok(Self(None));
        }
        let path = path.map_or_else(|| output.with_extension(default), Path::to_owned);
        let journal = Journal::open(&path, of_this_build(digest)).map_err(|e| match e {
            JournalError::NotAJournal | JournalError::Other => {
                at(&path, format!("{e}; delete it, or name another with --state"))
            }
            e => at(&path, e),
        })?;
        if journal.is_resumed() {
            eprintln!("goes on from {}", path.display());
        }
        Ok(Self(Some((path, journal))))
    }

    /// Work that keeps its state here, and that Ctrl-C stops.
    pub fn work<'w>(&'w self, progress: Progress<'w>) -> Job<'w> {
        let work = Job::new(progress).until(&STOP);
        match &self.0 {
            Some((_, journal)) => work.kept_in(journal),
            None => work,
        }
    }

    /// The work was stopped: says where it goes on from.
    pub fn stopped(self) -> Result<Outcome, CliError> {
        match self.0 {
            Some((path, journal)) => {
                journal.flush().map_err(|e| at(&path, format!("{e}; what was done after that is lost")))?;
                eprintln!("stopped; the same command goes on from {}", path.display());
            }
            None => eprintln!("stopped"),
        }
        Ok(Outcome::Failed)
    }

    /// The work is done and its result is safe, or there is nothing to go on with: the state goes.
    pub fn done(self) -> Result<(), CliError> {
        self.0.map_or(Ok(()), |(path, journal)| journal.remove().map_err(|e| at(&path, e)))
    }
}
