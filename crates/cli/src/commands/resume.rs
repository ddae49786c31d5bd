//! Long runs: Ctrl-C stops them, and the same command goes on with them; several share one by way of a folder.

use super::{CliError, Outcome, at};
use enfilade::job::{Digest, Folder, FolderError, Job, Journal, JournalError, Progress, Trace};
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
    /// What an interrupted run leaves, and the next goes on from [default: the output's name, or the level's, with an extension of
    /// its own]
    #[arg(long, value_name = "FILE")]
    pub state: Option<PathBuf>,
    /// Drop what an interrupted run has left, and begin anew
    #[arg(long)]
    pub fresh: bool,
}

impl StateFlags {
    /// Where the state of a run of one lies, if it has any: an output that is no plain file (a pipe, `/dev/null`) has none beside it.
    pub fn path(&self, (beside, extension): (&Path, &str)) -> Option<PathBuf> {
        let has_none = self.state.is_none() && beside.exists() && !beside.is_file();
        (!has_none).then(|| self.state.clone().unwrap_or_else(|| beside.with_extension(extension)))
    }
}

/// Flags of commands that several processes may share.
#[derive(clap::Args)]
pub struct WorkerFlags {
    /// Share the work with other processes, on this machine or on others, by way of this folder; all of them run the same
    /// command
    #[arg(long, value_name = "DIR", requires = "worker", conflicts_with_all = ["state", "fresh"])]
    pub with: Option<PathBuf>,
    /// Which worker this is, from 0 on, and of about how many
    #[arg(long, value_name = "K/N", requires = "with", value_parser = place)]
    worker: Option<[u32; 2]>,
    /// Write down how long each item of work takes: map,item,worker,seconds,stage
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
}

/// `K/N`, with K below N.
fn place(text: &str) -> Result<[u32; 2], String> {
    let numbers = text.split_once('/').and_then(|(k, n)| Some([k.parse().ok()?, n.parse().ok()?]));
    numbers.filter(|[k, n]| k < n).ok_or_else(|| "takes a number and how many there are, as in 0/4; 3/4 is the last".into())
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
    trace: Option<(PathBuf, Trace)>,
}

enum Place {
    Nowhere,
    File(PathBuf, Journal),
    Folder(PathBuf, Box<Folder>),
}

impl Kept {
    /// Goes on from the state in `state`, or in a folder that is shared, or begins one; says so.
    pub fn open(state: &StateFlags, flags: Option<&WorkerFlags>, of: &Of<'_>) -> Result<Self, CliError> {
        let worker = flags.and_then(|flags| flags.worker).map_or(0, |[k, _]| k);
        let create = |path: &PathBuf| Ok((path.clone(), Trace::create(path, worker).map_err(|e| at(path, e))?));
        let trace = flags.and_then(|flags| flags.trace.as_ref()).map(create).transpose()?;
        let place = match flags.and_then(|flags| flags.with.as_ref().zip(flags.worker)) {
            Some((folder, place)) => shared(folder, place, of)?,
            None => alone(state, of)?,
        };
        let place = Arc::new(place);
        *NOW.lock().unwrap_or_else(PoisonError::into_inner) = Now::AtWork(place.clone());
        Ok(Self { place, trace })
    }

    /// Work that keeps its state here, and that Ctrl-C stops.
    pub fn work<'w>(&'w self, progress: Progress<'w>) -> Job<'w> {
        let work = Job::new(progress).until(&STOP);
        let work = match &self.trace {
            Some((_, trace)) => work.traced_by(trace),
            None => work,
        };
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
        if let Some((path, trace)) = self.trace {
            trace.close().map_err(|e| at(&path, e))?;
        }
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
    let Some(path) = flags.path(of.beside) else { return Ok(Place::Nowhere) };
    let digest = of.digest.of_this_build();
    let opened = if flags.fresh { Journal::fresh(&path, digest) } else { Journal::open(&path, digest) };
    let journal = opened.map_err(|e| match e {
        JournalError::Other(_) => {
            let remedy = "--fresh drops it and begins anew, --state FILE keeps it and begins another";
            at(&path, format!("{e}, of which an interrupted run has left it; {remedy}"))
        }
        JournalError::NotAJournal => at(&path, format!("{e}; name another with --state")),
        e => at(&path, e),
    })?;
    if journal.is_resumed() {
        eprintln!("goes on from {}", path.display());
    }
    Ok(Place::File(path, journal))
}

fn shared(path: &Path, place: [u32; 2], of: &Of<'_>) -> Result<Place, CliError> {
    // What is no plain file can't be read again.
    let outputs = of.outputs.iter().filter(|output| !output.exists() || output.is_file());
    let outputs: Vec<PathBuf> = outputs.map(|&output| output.to_owned()).collect();
    let say = Box::new(|line: &str| eprintln!("{line}"));
    let folder = Folder::open(path, place, of.digest.of_this_build(), &outputs, say).map_err(|e| match e {
        FolderError::Other { .. } => CliError(format!("{e}; name another folder with --with")),
        e => CliError(e.to_string()),
    })?;
    if folder.is_resumed() {
        eprintln!("goes on from {}", path.display());
    }
    Ok(Place::Folder(path.to_owned(), Box::new(folder)))
}
