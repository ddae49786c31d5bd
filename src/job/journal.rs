//! The journal: results of an interrupted run on disk.

use super::block::{Block, HEAD, Head, Key, head, packed, read_block, read_head};
use super::digest::{Difference, Digest};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A block is written at this size, bytes, or age: the most that a killed run loses, besides work in progress.
const LARGE: usize = 4 << 20;
const OLD: Duration = Duration::from_secs(1);

/// Errors of a journal.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A system error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Another run has it open.
    #[error("another run with the same output is in progress")]
    InUse,
    /// The file is not a journal.
    #[error("is not the state of an interrupted run")]
    NotAJournal,
    /// It belongs to other work.
    #[error("belongs {0}")]
    Other(Difference),
}

/// Results of work on disk. While it is open, no other process can open it.
pub struct Journal {
    path: PathBuf,
    /// Results of previous runs that are not used yet.
    before: Mutex<HashMap<Key, Box<[u8]>>>,
    out: Mutex<Out>,
    resumed: bool,
    cut: u64,
}

struct Out {
    file: File,
    /// End of the last complete block.
    end: u64,
    block: Block,
    bytes: usize,
    since: Instant,
    /// Largest age of a block.
    old: Duration,
    /// The error after which nothing more is written.
    fault: Option<io::Error>,
}

impl Journal {
    /// Opens the journal of the work with this digest, or creates one.
    ///
    /// # Errors
    ///
    /// [`JournalError`]; then the file is unchanged.
    pub fn open(path: &Path, digest: Digest) -> Result<Self, JournalError> {
        Self::open_or_drop(path, digest, false)
    }

    /// Creates a journal of the work with this digest; the previous content of the file is dropped.
    ///
    /// # Errors
    ///
    /// [`JournalError`], but never [`JournalError::Other`]; then the file is unchanged.
    pub fn fresh(path: &Path, digest: Digest) -> Result<Self, JournalError> {
        Self::open_or_drop(path, digest, true)
    }

    fn open_or_drop(path: &Path, digest: Digest, drops: bool) -> Result<Self, JournalError> {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse),
            // Without file locks, other processes are not excluded.
            Err(TryLockError::Error(_)) | Ok(()) => (),
        }
        let length = file.metadata()?.len();
        let mut before = HashMap::new();
        let mut end = HEAD as u64;
        match read_head(&mut &file)? {
            Head::Whole(found) if !drops => {
                if let Some(difference) = digest.difference(&found) {
                    return Err(JournalError::Other(difference));
                }
                let mut input = BufReader::new(&file);
                while let Some((block, size)) = read_block(&mut input, length - end)? {
                    end += size;
                    before.extend(block.0.into_iter().map(|(key, bytes)| (key, bytes.into_boxed_slice())));
                }
            }
            Head::Whole(_) | Head::Cut => {
                file.seek(SeekFrom::Start(0))?;
                file.write_all(&head(&digest))?;
            }
            Head::Strange => return Err(JournalError::NotAJournal),
        }
        file.set_len(end)?;
        file.seek(SeekFrom::Start(end))?;
        let resumed = !before.is_empty();
        let out = Out { file, end, block: Block::default(), bytes: 0, since: Instant::now(), old: OLD, fault: None };
        let cut = length.saturating_sub(end);
        Ok(Self { path: path.to_owned(), before: Mutex::new(before), out: Mutex::new(out), resumed, cut })
    }

    /// Sets the largest age of a block.
    pub(super) fn written_every(self, old: Duration) -> Self {
        if let Ok(mut out) = self.out.lock() {
            out.old = old;
        }
        self
    }

    /// True if it had results when it was opened.
    pub fn is_resumed(&self) -> bool {
        self.resumed
    }

    /// True if it has no result of this or a previous run.
    pub fn is_empty(&self) -> bool {
        self.out.lock().is_ok_and(|out| out.end == HEAD as u64 && out.block.0.is_empty())
    }

    /// Bytes of an incomplete block at its end, removed when it was opened.
    pub(super) fn cut(&self) -> u64 {
        self.cut
    }

    /// The results of previous runs.
    pub(super) fn take_all(&self) -> HashMap<Key, Box<[u8]>> {
        self.before.lock().map(|mut before| std::mem::take(&mut *before)).unwrap_or_default()
    }

    /// The result of an item, if there is one. A result of another type counts as none.
    pub(super) fn take<R: DeserializeOwned>(&self, key: Key) -> Option<R> {
        let bytes = self.before.lock().ok()?.remove(&key)?;
        postcard::from_bytes(&bytes).ok()
    }

    /// Stores a result. After a disk error, nothing more is stored.
    pub(super) fn keep(&self, key: Key, result: &impl Serialize) {
        let Ok(bytes) = postcard::to_allocvec(result) else { return };
        let Ok(mut out) = self.out.lock() else { return };
        if out.fault.is_some() {
            return;
        }
        out.bytes += bytes.len() + size_of::<Key>();
        out.block.0.push((key, bytes));
        if out.bytes >= LARGE || out.since.elapsed() >= out.old {
            out.write();
        }
    }

    /// Writes pending results, and returns the first error so far.
    ///
    /// # Errors
    ///
    /// The first disk error: later results are not in the journal.
    pub fn flush(&self) -> io::Result<()> {
        let Ok(mut out) = self.out.lock() else { return Ok(()) };
        if out.fault.is_none() && !out.block.0.is_empty() {
            out.write();
        }
        out.fault.take().map_or(Ok(()), Err)
    }

    /// Removes the file, if the work is done or not worth keeping.
    ///
    /// # Errors
    ///
    /// A system error.
    pub fn remove(&self) -> io::Result<()> {
        std::fs::remove_file(&self.path)
    }
}

impl Out {
    /// Appends the block. A part written to a full disk is truncated again.
    fn write(&mut self) {
        let block = std::mem::take(&mut self.block);
        let written = packed(&block).and_then(|bytes| self.file.write_all(&bytes).map(|()| bytes.len() as u64));
        match written {
            Ok(size) => self.end += size,
            Err(e) => {
                let _ = self.file.set_len(self.end);
                self.fault = Some(e);
            }
        }
        (self.bytes, self.since) = (0, Instant::now());
    }
}
