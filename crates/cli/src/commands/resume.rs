//! Long runs: Ctrl-C stops them, and the same command goes on with them; several share one by way of a folder.

use super::{CliError, Outcome, at};
use enfilade::job::{Digest, Folder, FolderError, Job, Journal, JournalError, Progress};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Set by Ctrl-C.
static STOP: AtomicBool = AtomicBool::new(false);
/// Work has so long to end by itself once it is stopped. Longer: users take it for hanging. Shorter: results that are nearly there are lost.
const GRACE: Duration = Duration::from_millis(1000);
/// What is kept if the program ends now.
static NOW: Mutex<Now> = Mutex::new(Now::Early);

/// How far the program is.
enum Now {
    /// There is nothing to keep.
    Early,
    /// At work; results are kept here.
    AtWork(Arc<Place>),
    /// It writes its files, or says why it doesn't, and ends.
    Ending,
}

/// From here on the first Ctrl-C stops work, and the second ends the program at once. Some work has no place at which it could be stopped:
/// the import of a model, what other crates do. Where it goes on, its results are given up, and those before it kept.
pub fn catch_interrupts() -> Result<(), CliError> {
    let handler = ctrlc::set_handler(|| {
        // 128 and the signal's number, as shells have it.
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        std::thread::spawn(give_up);
    });
    handler.map_err(|e| CliError(format!("Ctrl-C can't be caught: {e}")))
}

/// Ends the program where it hasn't come to an end by itself.
fn give_up() {
    std::thread::sleep(GRACE);
    // Held until the process is gone, so that nobody begins to write a file.
    let mut now = NOW.lock().unwrap_or_else(PoisonError::into_inner);
    let place = match std::mem::replace(&mut *now, Now::Ending) {
        Now::Early => Arc::new(Place::Nowhere),
        Now::AtWork(place) => place,
        Now::Ending => return,
    };
    if std::io::stderr().is_terminal() {
        // Off the line of the bar.
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

/// Flags of commands that keep what they have worked out.
#[derive(clap::Args)]
pub struct StateFlags {
    /// Drop the state that an interrupted run left beside the output, and start again
    #[arg(long, help_heading = "Run")]
    pub fresh: bool,
}

/// The state file of a run of one process: beside an output that is a plain file. A pipe or a device has none.
pub fn state_path((beside, extension): (&Path, &str)) -> Option<PathBuf> {
    (!beside.exists() || beside.is_file()).then(|| beside.with_extension(extension))
}

/// Flags of commands that several processes may share.
#[derive(clap::Args)]
pub struct WorkerFlags {
    /// Be worker K of about N, from 0 on, that share this run through a folder, on one machine or several
    #[arg(long, value_name = "K/N:DIR", value_parser = worker, conflicts_with = "fresh", help_heading = "Run")]
    with: Option<Worker>,
}

/// A process that shares a run.
#[derive(Clone)]
pub struct Worker {
    /// Its number, and about how many there are.
    place: [u32; 2],
    folder: PathBuf,
}

impl WorkerFlags {
    /// The folder that workers share.
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
        .ok_or_else(|| "takes a worker's number, how many there are, and a folder, as in 0/4:DIR; 3/4 is the last".into())
}

/// What a run is about.
pub struct Of<'a> {
    /// What the result depends on, but for this program.
    pub digest: Digest,
    /// The file beside which its state lies, and with which extension.
    pub beside: (&'a Path, &'a str),
    /// The files that it writes in the end.
    pub outputs: &'a [&'a Path],
}

/// The state of a run, on the disk.
pub struct Kept {
    place: Arc<Place>,
}

enum Place {
    Nowhere,
    File(PathBuf, Journal),
    Folder(PathBuf, Box<Folder>),
}

impl Kept {
    /// Goes on from the state in `state`, or in a folder that is shared, or begins one; says so.
    pub fn open(state: &StateFlags, flags: Option<&WorkerFlags>, of: &Of<'_>) -> Result<Self, CliError> {
        let place = match flags.and_then(|flags| flags.with.as_ref()) {
            Some(worker) => shared(worker, of)?,
            None => alone(state, of)?,
        };
        let place = Arc::new(place);
        *NOW.lock().unwrap_or_else(PoisonError::into_inner) = Now::AtWork(place.clone());
        Ok(Self { place })
    }

    /// Work that keeps its state here, and that Ctrl-C stops.
    pub fn work<'w>(&'w self, progress: Progress<'w>) -> Job<'w> {
        let work = Job::new(progress).until(&STOP);
        match &*self.place {
            Place::File(_, journal) => work.kept_in(journal),
            Place::Folder(_, folder) => work.shared_in(folder),
            Place::Nowhere => work,
        }
    }

    /// True where others have done all of it.
    pub fn is_done(&self) -> bool {
        matches!(&*self.place, Place::Folder(_, folder) if folder.done_by().is_some())
    }

    /// From here on the program ends by itself: it writes files, which nothing may cut short.
    pub fn ends(&self) {
        *NOW.lock().unwrap_or_else(PoisonError::into_inner) = Now::Ending;
    }

    /// The work came to no end here: says why, and where it goes on from.
    pub fn stopped(self) -> Result<Outcome, CliError> {
        self.ends();
        self.place.stopped()
    }

    /// The work is done and its result is safe: a state of one goes, and others who share it end.
    pub fn done(self) -> Result<(), CliError> {
        match &*self.place {
            Place::Nowhere => (),
            Place::File(path, journal) => journal.remove().map_err(|e| at(path, e))?,
            Place::Folder(path, folder) => {
                // The output is there; others will find out for themselves.
                folder
                    .finish()
                    .unwrap_or_else(|e| eprintln!("{}: {e}; others aren't told that all is done", path.display()));
            }
        }
        Ok(())
    }

    /// There is no result, and nothing to go on with.
    pub fn vain(self) -> Result<(), CliError> {
        self.ends();
        match &*self.place {
            Place::File(path, journal) => journal.remove().map_err(|e| at(path, e)),
            Place::Nowhere | Place::Folder(..) => Ok(()),
        }
    }
}

impl Place {
    /// Keeps what there is, and says where it goes on from.
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
                eprintln!("stopped; nothing was worked out yet that could be kept");
                return journal.remove().map_err(|e| at(path, e)).map(|()| Outcome::Failed);
            }
            Self::File(path, journal) => {
                journal.flush().map_err(|e| at(path, format!("{e}; what was done after that is lost")))?;
                path
            }
            Self::Nowhere => {
                eprintln!("stopped; nothing is kept");
                return Ok(Outcome::Failed);
            }
        };
        eprintln!("stopped; the same command goes on from {}", path.display());
        Ok(Outcome::Failed)
    }
}

fn alone(flags: &StateFlags, of: &Of<'_>) -> Result<Place, CliError> {
    let Some(path) = state_path(of.beside) else { return Ok(Place::Nowhere) };
    let digest = of.digest.of_this_build();
    let opened = if flags.fresh { Journal::fresh(&path, digest) } else { Journal::open(&path, digest) };
    let journal = opened.map_err(|e| match e {
        JournalError::Other(_) => at(&path, format!("{e}; an interrupted run left it. --fresh drops it and starts again")),
        JournalError::NotAJournal => at(&path, format!("{e}; move it, or give the output another name")),
        e => at(&path, e),
    })?;
    if journal.is_resumed() {
        eprintln!("goes on from {}", path.display());
    }
    Ok(Place::File(path, journal))
}

fn shared(Worker { place, folder: path }: &Worker, of: &Of<'_>) -> Result<Place, CliError> {
    // What is no plain file can't be read again.
    let outputs = of.outputs.iter().filter(|output| !output.exists() || output.is_file());
    let outputs: Vec<PathBuf> = outputs.map(|&output| output.to_owned()).collect();
    let say = Box::new(|line: &str| eprintln!("{line}"));
    let folder = Folder::open(path, *place, of.digest.of_this_build(), &outputs, say).map_err(|e| match e {
        FolderError::Other { .. } => CliError(format!("{e}; name another folder with --with")),
        e => CliError(e.to_string()),
    })?;
    if folder.is_resumed() {
        eprintln!("goes on from {}", path.display());
    }
    Ok(Place::Folder(path.clone(), Box::new(folder)))
}
