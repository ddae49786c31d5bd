//! Long runs: Ctrl-C stops one, the same command resumes it, and several processes share one through a folder.

use super::{CliError, Outcome, at};
use enfilade::job::{Digest, Folder, FolderError, Job, Journal, JournalError, Progress};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);
/// Time for stopped work to end by itself. Longer: it seems to hang. Shorter: results that are nearly complete are lost.
const GRACE: Duration = Duration::from_millis(1000);
/// What to keep if the program ends now.
static NOW: Mutex<Now> = Mutex::new(Now::Early);

/// The phase of the program.
enum Now {
    /// Before the work.
    Early,
    /// During the work; results are kept here.
    AtWork(Arc<Place>),
    /// It writes its files or reports an error, and ends.
    Ending,
}

/// From here on the first Ctrl-C stops the work, and the second ends the program at once. Some work can't be stopped:
/// the import of a model, and work in other crates. If it goes on too long, its results are lost and earlier ones kept.
pub fn catch_interrupts() -> Result<(), CliError> {
    let handler = ctrlc::set_handler(|| {
        // 128 plus the signal's number, as in shells.
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        std::thread::spawn(give_up);
    });
    handler.map_err(|e| CliError(format!("Ctrl-C can't be caught: {e}")))
}

/// Ends the program if it has not ended by itself.
fn give_up() {
    std::thread::sleep(GRACE);
    // Held until the process ends, so that no file is begun.
    let mut now = NOW.lock().unwrap_or_else(PoisonError::into_inner);
    let place = match std::mem::replace(&mut *now, Now::Ending) {
        Now::Early => Arc::new(Place::Nowhere),
        Now::AtWork(place) => place,
        Now::Ending => return,
    };
    if std::io::stderr().is_terminal() {
        // Below the progress bar.
        eprintln!();
    }
    let code = place.stopped().map_or_else(
        |error| {
            eprintln!("enfilade: {error}");
            2
        },
        |outcome| i32::from(outcome != Outcome::Done),
    );
    std::process::exit(code);
}

/// Flags of commands that can be resumed.
#[derive(clap::Args)]
pub struct StateFlags {
    /// Delete the state of an interrupted run beside the output, and start again
    #[arg(long, help_heading = "Run")]
    pub fresh: bool,
}

/// The state file of a single process, beside its output; none for a pipe or a device.
pub fn state_path((beside, extension): (&Path, &str)) -> Option<PathBuf> {
    (!beside.exists() || beside.is_file()).then(|| beside.with_extension(extension))
}

/// Flags of commands that several processes can share.
#[derive(clap::Args)]
pub struct WorkerFlags {
    /// Be worker K, counted from 0, of about N that share this run through a folder, on one machine or several
    #[arg(long, value_name = "K/N:DIR", value_parser = worker, conflicts_with = "fresh", help_heading = "Run")]
    with: Option<Worker>,
}

/// A process of a shared run.
#[derive(Clone)]
pub struct Worker {
    /// Its number, and the approximate number of workers.
    place: [u32; 2],
    folder: PathBuf,
}

impl WorkerFlags {
    /// The shared folder.
    pub fn folder(&self) -> Option<PathBuf> {
        self.with.as_ref().map(|worker| worker.folder.clone())
    }
}

/// `K/N:DIR`, with K below N.
fn worker(text: &str) -> Result<Worker, String> {
    let parse = |text: &str| {
        let (place, folder) = text.split_once(':').filter(|(_, folder)| !folder.is_empty())?;
        let (k, n) = place.split_once('/')?;
        let place: [u32; 2] = [k.parse().ok()?, n.parse().ok()?];
        (place[0] < place[1]).then(|| Worker { place, folder: folder.into() })
    };
    parse(text)
        .ok_or_else(|| "takes a worker's number, the number of workers and a folder, as in 0/4:DIR; 3/4 is the last".into())
}

/// Identifies a run.
pub struct Of<'a> {
    /// Everything the result depends on, except this program.
    pub digest: Digest,
    /// The file beside the state, and the state's extension.
    pub beside: (&'a Path, &'a str),
    /// Its output files.
    pub outputs: &'a [&'a Path],
}

/// The state of a run on disk.
pub struct Kept {
    place: Arc<Place>,
}

enum Place {
    Nowhere,
    File(PathBuf, Journal),
    Folder(PathBuf, Box<Folder>),
}

impl Kept {
    /// Resumes from the state beside the output or in a shared folder, and reports that, or begins a new one.
    pub fn open(state: &StateFlags, flags: Option<&WorkerFlags>, of: &Of<'_>) -> Result<Self, CliError> {
        let place = match flags.and_then(|flags| flags.with.as_ref()) {
            Some(worker) => shared(worker, of)?,
            None => alone(state, of)?,
        };
        let place = Arc::new(place);
        *NOW.lock().unwrap_or_else(PoisonError::into_inner) = Now::AtWork(place.clone());
        Ok(Self { place })
    }

    /// Work with its state here; Ctrl-C stops it.
    pub fn work<'w>(&'w self, progress: Progress<'w>) -> Job<'w> {
        let work = Job::new(progress).until(&STOP);
        match &*self.place {
            Place::File(_, journal) => work.kept_in(journal),
            Place::Folder(_, folder) => work.shared_in(folder),
            Place::Nowhere => work,
        }
    }

    /// True if other workers have finished.
    pub fn is_done(&self) -> bool {
        matches!(&*self.place, Place::Folder(_, folder) if folder.done_by().is_some())
    }

    /// From here on the program ends by itself: nothing may interrupt its writing of files.
    pub fn ends(&self) {
        *NOW.lock().unwrap_or_else(PoisonError::into_inner) = Now::Ending;
    }

    /// Reports why the work stopped and where to resume.
    pub fn stopped(self) -> Result<Outcome, CliError> {
        self.ends();
        self.place.stopped()
    }

    /// The result is on disk: deletes the state of a single process, and ends the other workers.
    pub fn done(self) -> Result<(), CliError> {
        match &*self.place {
            Place::Nowhere => (),
            Place::File(path, journal) => journal.remove().map_err(|e| at(path, e))?,
            Place::Folder(path, folder) => {
                // The output exists, so this is not an error; other workers finish without the message.
                folder.finish().unwrap_or_else(|e| {
                    eprintln!("{}: {e}; other workers don't learn that the work is done", path.display())
                });
            }
        }
        Ok(())
    }

    /// There is no result, and nothing to resume from.
    pub fn vain(self) -> Result<(), CliError> {
        self.ends();
        match &*self.place {
            Place::File(path, journal) => journal.remove().map_err(|e| at(path, e)),
            Place::Nowhere | Place::Folder(..) => Ok(()),
        }
    }
}

impl Place {
    /// Keeps the results so far, and reports where to resume.
    fn stopped(&self) -> Result<Outcome, CliError> {
        let path = match self {
            Self::Folder(path, folder) => {
                if let Some(disagreement) = folder.disagreement() {
                    eprintln!("{}: {disagreement}", path.display());
                    return Ok(Outcome::Failed);
                }
                if let Some(by) = folder.done_by() {
                    eprintln!("{}: done by {by}", path.display());
                    return Ok(Outcome::Done);
                }
                folder.flush();
                path
            }
            Self::File(path, journal) if journal.is_empty() => {
                eprintln!("stopped; there are no results to keep yet");
                return journal.remove().map_err(|e| at(path, e)).map(|()| Outcome::Failed);
            }
            Self::File(path, journal) => {
                journal.flush().map_err(|e| at(path, format!("{e}; later results are lost")))?;
                path
            }
            Self::Nowhere => {
                eprintln!("stopped; nothing is kept");
                return Ok(Outcome::Failed);
            }
        };
        eprintln!("stopped; the same command resumes from {}", path.display());
        Ok(Outcome::Failed)
    }
}

fn alone(flags: &StateFlags, of: &Of<'_>) -> Result<Place, CliError> {
    let Some(path) = state_path(of.beside) else { return Ok(Place::Nowhere) };
    let digest = of.digest.of_this_build();
    let opened = if flags.fresh { Journal::fresh(&path, digest) } else { Journal::open(&path, digest) };
    let journal = opened.map_err(|e| match e {
        JournalError::Other(_) => at(&path, format!("{e}; an interrupted run left it. --fresh deletes it and starts again")),
        JournalError::NotAJournal => at(&path, format!("{e}; move it, or give the output another name")),
        e => at(&path, e),
    })?;
    if journal.is_resumed() {
        eprintln!("resumes from {}", path.display());
    }
    Ok(Place::File(path, journal))
}

fn shared(Worker { place, folder: path }: &Worker, of: &Of<'_>) -> Result<Place, CliError> {
    // Only plain files can be read again.
    let outputs = of.outputs.iter().filter(|output| !output.exists() || output.is_file());
    let outputs: Vec<PathBuf> = outputs.map(|&output| output.to_owned()).collect();
    let say = Box::new(|line: &str| eprintln!("{line}"));
    let folder = Folder::open(path, *place, of.digest.of_this_build(), &outputs, say).map_err(|e| match e {
        FolderError::Other { .. } => CliError(format!("{e}; name another folder with --with")),
        e => CliError(e.to_string()),
    })?;
    if folder.is_resumed() {
        eprintln!("resumes from {}", path.display());
    }
    Ok(Place::Folder(path.clone(), Box::new(folder)))
}
