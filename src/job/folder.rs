//! Work shared by several processes through a folder, on one machine or on many.
//!
//! Each worker runs the whole program. Worker K appends its results to `worker-K`, a journal that only it writes, and reads all others;
//! nothing else is exchanged. Results are pure functions of previous results, so any worker's result will do: a lost or late worker costs
//! only time. One result in a thousand is computed again and compared, to find a machine with other results.

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

/// Longest delay before results are written. Longer: others wait longer for them. Shorter: blocks are small and compress badly.
const PROMPT: Duration = Duration::from_millis(50);
/// Least interval between reads of the folder; with much to read, reads take at most one in `LOOKING` of the time, or half of it if the
/// worker is idle.
const LOOK: Duration = Duration::from_millis(5);
const LOOKING: u32 = 20;
/// One in this many results of others is computed again.
const CHECKED: u64 = 1000;

/// Errors of shared work.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A system error on a file.
    #[error("{}: {error}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error.
        error: io::Error,
    },
    /// Another process has this worker's number.
    #[error("{}: worker {worker} is already running{by}", .path.display())]
    InUse {
        /// Its file.
        path: PathBuf,
        /// Its number.
        worker: u32,
        /// Its host and process, if its file states them.
        by: String,
    },
    /// The folder has a file of other work.
    #[error("{}: belongs {difference}", .path.display())]
    Other {
        /// The file.
        path: PathBuf,
        /// The difference of the work.
        difference: Difference,
    },
}

/// A worker in a shared folder. While it is open, no other process can have the same number.
pub struct Folder {
    path: PathBuf,
    worker: u32,
    workers: u32,
    digest: Digest,
    host: Host,
    journal: Journal,
    /// The final outputs: the first worker to finish leaves their checksum.
    outputs: Vec<PathBuf>,
    inbox: Mutex<Inbox>,
    is_full: AtomicBool,
    is_over: AtomicBool,
    disagreement: OnceLock<String>,
    done: OnceLock<Done>,
    say: Box<dyn Fn(&str) + Send + Sync>,
}

/// A result of an item, and its worker; this worker itself after a resume.
pub(super) struct Arrival {
    pub item: u32,
    pub worker: u32,
    pub bytes: Box<[u8]>,
}

#[derive(Default)]
struct Inbox {
    readers: BTreeMap<u32, Reader>,
    /// By map: results received before they were needed.
    results: HashMap<u32, Vec<Arrival>>,
    /// Workers reported for results of the wrong shape.
    misshapen: Vec<u32>,
    /// A mark that does not match the output here.
    unfit: Option<Done>,
    looked: Option<Instant>,
    took: Duration,
}

impl Folder {
    /// Opens a folder as number `worker` of `workers`, and creates it if necessary. `outputs` are the final output files; `say` receives
    /// messages for users, a line each.
    ///
    /// # Errors
    ///
    /// [`FolderError`]; then nothing in the folder changes.
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
        // Others may have started at the same time.
        if let Err(error) = check(path, &digest) {
            if is_new {
                let _ = journal.remove();
            }
            return Err(error);
        }
        if journal.cut() > 0 {
            say(&format!("{}: is incomplete: its last {} bytes are ignored", own.display(), journal.cut()));
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

    /// True if it had results of this worker when it was opened.
    pub fn is_resumed(&self) -> bool {
        self.journal.is_resumed()
    }

    /// The message if another worker has a different result. Then no output must be written.
    pub fn disagreement(&self) -> Option<&str> {
        self.disagreement.get().map(String::as_str)
    }

    /// The worker that has already written the outputs, if they are here.
    pub fn done_by(&self) -> Option<&str> {
        self.done.get().map(|done| done.by.as_str())
    }

    /// Call it after the outputs are written: leaves their checksum, so that the other workers end.
    ///
    /// # Errors
    ///
    /// A system error.
    pub fn finish(&self) -> io::Result<()> {
        self.flush();
        if self.outputs.is_empty() {
            return Ok(());
        }
        let by = format!("worker {} ({})", self.worker, self.host);
        Done { digest: self.digest, sum: done::sum(&self.outputs)?, by }.write(&self.path, self.worker)
    }

    /// This worker's number, and the number of workers.
    pub(super) fn place(&self) -> [usize; 2] {
        [self.worker as usize, self.workers as usize]
    }

    pub(super) fn is_own(&self, arrival: &Arrival) -> bool {
        arrival.worker == self.worker
    }

    /// True if further work is useless: a worker is done, or two have different results.
    pub(super) fn is_over(&self) -> bool {
        self.is_over.load(Relaxed)
    }

    /// Stores a result for all workers.
    pub(super) fn keep(&self, map: u32, item: usize, result: &impl Serialize) {
        if !self.is_full.load(Relaxed) {
            self.journal.keep((map, item as u32), result);
        }
    }

    /// Writes pending results.
    pub fn flush(&self) {
        if self.is_full.load(Relaxed) {
            return;
        }
        if let Err(e) = self.journal.flush() {
            self.is_full.store(true, Relaxed);
            let path = self.path.join(name(self.worker));
            (self.say)(&format!("{}: {e}; continues without keeping results", path.display()));
        }
    }

    /// New results of a map from all workers. Reads the folder only at intervals; more often if the caller is idle. Results of earlier maps
    /// are dropped.
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
            (self.say)(&format!("{}: the output of {} differs from the one here; continues", mark.display(), done.by));
            inbox.unfit = Some(done);
        }
    }

    /// True for results to compute again: a different sample for each worker.
    pub(super) fn is_checked(&self, map: u32, arrival: &Arrival) -> bool {
        let bytes: Vec<u8> = [map, arrival.item, self.worker].into_iter().flat_map(u32::to_le_bytes).collect();
        xxh3_64(&bytes).is_multiple_of(CHECKED)
    }

    /// Another worker's result differs from ours: the work ends.
    pub(super) fn disagree(&self, map: u32, arrival: &Arrival) {
        let inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        let host = inbox.readers.get(&arrival.worker).and_then(|reader| reader.host.as_ref());
        let host = host.map(|host| format!(" ({host})")).unwrap_or_default();
        let _ = self.disagreement.set(format!(
            "map {map}, item {}: worker {}{host} has another result than worker {} ({}), which computed it again; nothing is written",
            arrival.item, arrival.worker, self.worker, self.host
        ));
        self.is_over.store(true, Relaxed);
    }

    /// A result cannot be decoded: reported once per worker.
    pub(super) fn is_misshapen(&self, arrival: &Arrival) {
        let mut inbox = self.inbox.lock().unwrap_or_else(PoisonError::into_inner);
        if !inbox.misshapen.contains(&arrival.worker) {
            inbox.misshapen.push(arrival.worker);
            let path = self.path.join(name(arrival.worker));
            (self.say)(&format!("{}: ignored results of the wrong shape", path.display()));
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
        // No sign and no leading zeros.
        (path.file_name()?.to_str()? == name(number)).then_some(number)
    };
    let paths = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    paths.filter_map(|path| Some((number(&path)?, path))).collect()
}

fn io_error(path: &Path, error: io::Error) -> FolderError {
    FolderError::Io { path: path.to_owned(), error }
}

/// Checks that no file in the folder belongs to other work.
fn check(folder: &Path, digest: &Digest) -> Result<(), FolderError> {
    for (_, path) in workers(folder) {
        // Unreadable and foreign files are reported later.
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

/// Opens the worker's own file. A file that is not a journal is replaced.
fn own_journal(path: &Path, worker: u32, digest: Digest, say: &dyn Fn(&str)) -> Result<Journal, FolderError> {
    let failed = |e| match e {
        JournalError::Other(difference) => FolderError::Other { path: path.to_owned(), difference },
        JournalError::InUse => FolderError::InUse { path: path.to_owned(), worker, by: who(path, worker, &digest) },
        JournalError::NotAJournal => io_error(path, io::Error::other("is not a worker's file")),
        JournalError::Io(error) => io_error(path, error),
    };
    match Journal::open(path, digest) {
        Err(JournalError::NotAJournal) => {
            let aside = path.with_extension("strange");
            std::fs::rename(path, &aside).map_err(|error| io_error(path, error))?;
            say(&format!("{}: is not a worker's file; renamed to {}", path.display(), aside.display()));
            Journal::open(path, digest).map_err(failed)
        }
        opened => opened.map_err(failed),
    }
}

/// The writer of a file, as text.
fn who(path: &Path, worker: u32, digest: &Digest) -> String {
    let mut reader = Reader::new(path.to_owned(), worker);
    reader.read(digest, &mut |_, _| ());
    reader.host.map(|host| format!(", on host {host}")).unwrap_or_default()
}
