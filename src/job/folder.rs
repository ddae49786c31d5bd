//! Work that several processes share by way of a folder, on one machine or on many.
//!
//! Each worker runs the whole program. Worker K appends its results to `worker-K`, a journal that nobody else writes, and
//! reads everybody else's; nothing else is exchanged. Results are pure functions of what was known before, so that it
//! doesn't matter whose is taken: a worker that is lost, late or cut off costs time and nothing else. One result in a
//! thousand is worked out again and compared, so that a machine that works out something else is found.

use super::block::{Head, read_head};
use super::digest::{Difference, Digest};
use super::done::{self, Done};
use super::host::Host;
use super::journal::{Journal, JournalError};
use super::reader::{Reader, WHO};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::xxh3_64;

/// Results wait at most so long to be written. More: others wait longer for them. Less: blocks are small and compress badly.
const PROMPT: Duration = Duration::from_millis(50);
/// The folder is looked into at most so often; and, with much to read, as often as takes this fraction of the time, or half
/// of it where there is nothing better to do.
const LOOK: Duration = Duration::from_millis(5);
const LOOKING: u32 = 20;
/// Of so many results of others, one is worked out again.
const CHECKED: u64 = 1000;

/// Why work can't be shared in a folder.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// The system's word on a file.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        error: io::Error,
    },
    /// Another process is this worker.
    #[error("{}: worker {worker} is at work already{by}", .path.display())]
    InUse {
        /// Its file.
        path: PathBuf,
        /// Its number.
        worker: u32,
        /// On which host, and in which process, if its file tells.
        by: String,
    },
    /// A file of other work is in there.
    #[error("{}: belongs {difference}", .path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// In what the work differs.
        difference: Difference,
    },
}

/// A worker's place in a shared folder. While it is open no other process can have the same.
pub struct Folder {
    path: PathBuf,
    worker: u32,
    workers: u32,
    digest: Digest,
    host: Host,
    journal: Journal,
    /// What is written in the end: who is done first leaves its checksum.
    outputs: Vec<PathBuf>,
    inbox: Mutex<Inbox>,
    is_full: AtomicBool,
    is_over: AtomicBool,
    disagreement: OnceLock<String>,
    done: OnceLock<Done>,
    say: Box<dyn Fn(&str) + Send + Sync>,
}

/// A result of an item, and whose it is; of this worker itself where it goes on.
pub(super) struct Arrival {
    pub item: u32,
    pub worker: u32,
    pub bytes: Box<[u8]>,
}

#[derive(Default)]
struct Inbox {
    readers: BTreeMap<u32, Reader>,
    /// By map: what has come and wasn't asked for yet.
    results: HashMap<u32, Vec<Arrival>>,
    /// Workers of whom it was said that their results are of the wrong shape.
    misshapen: Vec<u32>,
    /// A mark that doesn't fit the output here.
    unfit: Option<Done>,
    looked: Option<Instant>,
    took: Duration,
}

impl Folder {
    /// Takes the place of `worker`, below `workers`, in a folder, which is made if it isn't there. `outputs` are the files
    /// that will be written in the end; `say` gets what users should know, a line each.
    ///
    /// # Errors
    ///
    /// [`FolderError`]; nothing in the folder is touched then.
    pub fn open(
        path: &Path,
        [worker, workers]: [u32; 2],
        digest: Digest,
        outputs: &[PathBuf],
        say: Box<dyn Fn(&str) + Send + Sync>,
    ) -> Result<Self, FolderError> {
        std::fs::create_dir_all(path).map_err(|error| io_error(path, error))?;
        check(path, &digest)?;
        let own = path.join(name(worker));
        let is_new = !own.exists();
        let journal = own_journal(&own, worker, digest, &*say)?.written_every(PROMPT);
        // Others may have begun at the same time.
        if let Err(error) = check(path, &digest) {
            if is_new {
                let _ = journal.remove();
            }
            return Err(error);
        }
        if journal.cut() > 0 {
            say(&format!("{}: is not whole: its last {} bytes count for nothing", own.display(), journal.cut()));
        }
        let host = Host::this();
        let mut results: HashMap<u32, Vec<Arrival>> = HashMap::new();
        for ((map, item), bytes) in journal.take_all() {
            results.entry(map).or_default().push(Arrival { item, worker, bytes });
        }
        journal.keep(WHO, &host);
        let folder = Self {
            path: path.to_owned(),
            worker,
            workers: workers.max(1),
            digest,
            host,
            journal,
            outputs: outputs.to_vec(),
            inbox: Mutex::new(Inbox { results, ..Inbox::default() }),
            is_full: AtomicBool::new(false),
            is_over: AtomicBool::new(false),
            disagreement: OnceLock::new(),
            done: OnceLock::new(),
            say,
        };
        folder.flush();
        folder.look_for_mark(&mut folder.inbox.lock().unwrap_or_else(PoisonError::into_inner));
        Ok(folder)
    }

    /// True where it held results of this worker when it was opened.
    pub fn is_resumed(&self) -> bool {
        self.journal.is_resumed()
    }

    /// Where another worker has worked out something else than this one: what to say. Then nothing must be written.
    pub fn disagreement(&self) -> Option<&str> {
        self.disagreement.get().map(String::as_str)
    }

    /// Who has written the outputs already, if somebody has, and they are here.
    pub fn done_by(&self) -> Option<&str> {
        self.done.get().map(|done| done.by.as_str())
    }

    /// The outputs are written: leaves their checksum, so that the others end.
    ///
    /// # Errors
    ///
    /// The system's.
    pub fn finish(&self) -> io::Result<()> {
        self.flush();
        if self.outputs.is_empty() {
            return Ok(());
        }
        let by = format!("worker {} ({})", self.worker, self.host);
        Done { digest: self.digest, sum: done::sum(&self.outputs)?, by }.write(&self.path, self.worker)
    }

    /// This worker's number, and how many there are.
    pub(super) fn place(&self) -> [usize; 2] {
        [self.worker as usize, self.workers as usize]
    }

    pub(super) fn is_own(&self, arrival: &Arrival) -> bool {
        arrival.worker == self.worker
    }

    /// True where the rest is in vain: somebody is done, or two have worked out different things.
    pub(super) fn is_over(&self) -> bool {
        self.is_over.load(Relaxed)
    }

    /// Keeps a result for all.
    pub(super) fn keep(&self, map: u32, item: usize, result: &impl Serialize) {
        if !self.is_full.load(Relaxed) {
            self.journal.keep((map, item as u32), result);
        }
    }

    /// Writes what others don't know yet.
    pub fn flush(&self) {
        if self.is_full.load(Relaxed) {
            return;
        }
        if let Err(e) = self.journal.flush() {
            self.is_full.store(true, Relaxed);
            let path = self.path.join(name(self.worker));
            (self.say)(&format!("{}: {e}; goes on without keeping anything", path.display()));
        }
    }

    /// Results of a map that have come since the last time, of all workers. Looks into the folder only now and then; more
    /// often where the caller is idle. Results of earlier maps are dropped.
    pub(super) fn receive(&self, map: u32, is_idle: bool) -> Vec<Arrival> {
        let mut inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        let pause = if is_idle { inbox.took } else { LOOK.max(inbox.took * LOOKING) };
        if inbox.looked.is_none_or(|looked| looked.elapsed() >= pause) {
            let begin = Instant::now();
            self.look(&mut inbox, map);
            inbox.took = begin.elapsed();
            inbox.looked = Some(Instant::now());
        }
        inbox.results.remove(&map).unwrap_or_default()
    }

    fn look(&self, inbox: &mut Inbox, map: u32) {
        for (worker, path) in workers(&self.path) {
            if worker != self.worker {
                inbox.readers.entry(worker).or_insert_with(|| Reader::new(path, worker));
            }
        }
        let Inbox { readers, results, .. } = inbox;
        for reader in readers.values_mut() {
            let worker = reader.worker;
            let mut take = |(of, item): (u32, u32), bytes: Vec<u8>| {
                if of >= map {
                    results.entry(of).or_default().push(Arrival { item, worker, bytes: bytes.into_boxed_slice() });
                }
            };
            if let Some(wrong) = reader.read(&self.digest, &mut take) {
                (self.say)(&wrong);
            }
        }
        results.retain(|&of, _| of >= map);
        self.look_for_mark(inbox);
    }

    fn look_for_mark(&self, inbox: &mut Inbox) {
        if self.outputs.is_empty() || self.done.get().is_some() {
            return;
        }
        let Some(done) = Done::read(&self.path).filter(|done| done.digest == self.digest) else { return };
        if inbox.unfit.as_ref() == Some(&done) {
            return;
        }
        if done::sum(&self.outputs).is_ok_and(|sum| sum == done.sum) {
            let _ = self.done.set(done);
            self.is_over.store(true, Relaxed);
        } else {
            let mark = self.path.join(done::NAME);
            (self.say)(&format!("{}: {} wrote another output than is here; goes on", mark.display(), done.by));
            inbox.unfit = Some(done);
        }
    }

    /// True for results that are to be worked out again: others for each worker.
    pub(super) fn is_checked(&self, map: u32, arrival: &Arrival) -> bool {
        let bytes: Vec<u8> = [map, arrival.item, self.worker].into_iter().flat_map(u32::to_le_bytes).collect();
        xxh3_64(&bytes).is_multiple_of(CHECKED)
    }

    /// Another worker's result is not what comes out here: the work ends.
    pub(super) fn disagree(&self, map: u32, arrival: &Arrival) {
        let inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        let host = inbox.readers.get(&arrival.worker).and_then(|reader| reader.host.as_ref());
        let host = host.map(|host| format!(" ({host})")).unwrap_or_default();
        let _ = self.disagreement.set(format!(
            "map {map}, item {}: worker {}{host} has another result than worker {} ({}), which worked it out again; \
             nothing is written",
            arrival.item, arrival.worker, self.worker, self.host
        ));
        self.is_over.store(true, Relaxed);
    }

    /// A result can't be read: said once of each worker.
    pub(super) fn is_misshapen(&self, arrival: &Arrival) {
        let mut inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        if !inbox.misshapen.contains(&arrival.worker) {
            inbox.misshapen.push(arrival.worker);
            let path = self.path.join(name(arrival.worker));
            (self.say)(&format!("{}: has results of the wrong shape, which count for nothing", path.display()));
        }
    }
}

fn name(worker: u32) -> String {
    format!("worker-{worker}")
}

/// The workers' files in a folder, ascending.
fn workers(folder: &Path) -> BTreeMap<u32, PathBuf> {
    let number = |path: &Path| -> Option<u32> {
        let number = path.file_name()?.to_str()?.strip_prefix("worker-")?.parse().ok()?;
        // No signs or zeros before it.
        (path.file_name()?.to_str()? == name(number)).then_some(number)
    };
    let paths = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    paths.filter_map(|path| Some((number(&path)?, path))).collect()
}

fn io_error(path: &Path, error: io::Error) -> FolderError {
    FolderError::Io { path: path.to_owned(), error }
}

/// Nothing in the folder belongs to other work.
fn check(folder: &Path, digest: &Digest) -> Result<(), FolderError> {
    for (_, path) in workers(folder) {
        // What can't be read, or is no worker's, is told of later.
        let Ok(mut file) = std::fs::File::open(&path) else { continue };
        if let Ok(Head::Whole(found)) = read_head(&mut file)
            && let Some(difference) = digest.difference(&found)
        {
            return Err(FolderError::Other { path, difference });
        }
    }
    let difference = Done::read(folder).and_then(|done| digest.difference(&done.digest));
    difference.map_or(Ok(()), |difference| Err(FolderError::Other { path: folder.join(done::NAME), difference }))
}

/// Opens the worker's own file. One that is no journal makes room for one.
fn own_journal(path: &Path, worker: u32, digest: Digest, say: &dyn Fn(&str)) -> Result<Journal, FolderError> {
    let failed = |e| match e {
        JournalError::Other(difference) => FolderError::Other { path: path.to_owned(), difference },
        JournalError::InUse => FolderError::InUse { path: path.to_owned(), worker, by: who(path, worker, &digest) },
        JournalError::NotAJournal => io_error(path, io::Error::other("is no worker's file")),
        JournalError::Io(error) => io_error(path, error),
    };
    match Journal::open(path, digest) {
        Err(JournalError::NotAJournal) => {
            let aside = path.with_extension("strange");
            std::fs::rename(path, &aside).map_err(|error| io_error(path, error))?;
            say(&format!("{}: is no worker's file; it is {} now", path.display(), aside.display()));
            Journal::open(path, digest).map_err(failed)
        }
        opened => opened.map_err(failed),
    }
}

/// Who writes a file, in words.
fn who(path: &Path, worker: u32, digest: &Digest) -> String {
    let mut reader = Reader::new(path.to_owned(), worker);
    reader.read(digest, &mut |_, _| ());
    reader.host.map(|host| format!(", on host {host}")).unwrap_or_default()
}
