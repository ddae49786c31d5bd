//! The file that a run leaves behind when it is cut off.
//!
//! A head: magic, and the digest of all that the work depends on. Then blocks, appended as results come in: length (`u32`), checksum
//! (XXH3), and so many bytes of results with their numbers, in postcard's encoding, compressed with zstd. All numbers are
//! little-endian. A block that isn't whole, as a killed run may leave one, ends the journal; what came after it is worked out again.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

const MAGIC: &[u8; 8] = b"EnfWork\n";
const HEAD: usize = 24;
/// A block is written when it is so large, bytes, or so old: what a killed run loses at most, beside what is under way.
const LARGE: usize = 4 << 20;
const OLD: Duration = Duration::from_secs(1);
/// Bytes of the program that are read at once.
const BUFFER: usize = 1 << 18;
/// No block unpacks to more than this, bytes: a file's word isn't taken for more.
const MOST: u64 = 1 << 32;

/// Why a journal can't be had.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum JournalError {
    /// The system's word.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Another run has it open.
    #[error("another run that writes the same output is under way")]
    InUse,
    /// It begins otherwise.
    #[error("is no state of an interrupted run")]
    NotAJournal,
    /// It belongs to other work.
    #[error("belongs to another input, to other options or to another build of this program")]
    Other,
}

/// Which map, and which of its items.
type Key = (u32, u32);

/// Results of work, on the disk. While it is open nobody else can open it.
pub struct Journal {
    path: PathBuf,
    /// Results of runs before that nobody has asked for yet.
    before: Mutex<HashMap<Key, Box<[u8]>>>,
    out: Mutex<Out>,
    resumed: bool,
}

struct Out {
    file: File,
    /// Where the last whole block ends.
    end: u64,
    block: Block,
    bytes: usize,
    since: Instant,
    /// Why nothing more is written.
    fault: Option<io::Error>,
}

#[derive(Default, Serialize, Deserialize)]
struct Block(Vec<(Key, Vec<u8>)>);

/// A digest of work that differs from build to build of this program: another one may work otherwise.
pub fn of_this_build(digest: u128) -> u128 {
    let mut hash = Xxh3::new();
    hash.update(&digest.to_le_bytes());
    hash.update(env!("CARGO_PKG_VERSION").as_bytes());
    // Where the program can't read itself, its version must do.
    if let Ok(program) = std::env::current_exe().and_then(File::open) {
        // As far as it can be read; a buffer at a time, because a small level takes less memory than the program.
        let mut program = BufReader::with_capacity(BUFFER, program);
        while let Ok(read @ [_, ..]) = program.fill_buf() {
            let length = read.len();
            hash.update(read);
            program.consume(length);
        }
    }
    hash.digest128()
}

impl Journal {
    /// Opens the journal of the work with this digest, or begins one.
    ///
    /// # Errors
    ///
    /// [`JournalError`]; the file is as it was.
    pub fn open(path: &Path, digest: u128) -> Result<Self, JournalError> {
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse),
            // Where files can't be locked, nobody is kept away.
            Err(TryLockError::Error(_)) | Ok(()) => (),
        }
        let length = file.metadata()?.len();
        let mut head = Vec::new();
        (&file).take(HEAD as u64).read_to_end(&mut head)?;
        let wanted = [MAGIC.as_slice(), &digest.to_le_bytes()].concat();
        let mut before = HashMap::new();
        let mut end = HEAD as u64;
        if head.len() == HEAD {
            if head != wanted {
                return Err(if head.starts_with(MAGIC) { JournalError::Other } else { JournalError::NotAJournal });
            }
            let mut input = BufReader::new(&file);
            while let Some((block, size)) = block(&mut input, length - end)? {
                end += size;
                before.extend(block.0.into_iter().map(|(key, bytes)| (key, bytes.into_boxed_slice())));
            }
        } else if !head.starts_with(&MAGIC[..head.len().min(MAGIC.len())]) {
            return Err(JournalError::NotAJournal);
        } else {
            file.seek(SeekFrom::Start(0))?;
            file.write_all(&wanted)?;
        }
        file.set_len(end)?;
        file.seek(SeekFrom::Start(end))?;
        let resumed = !before.is_empty();
        let out = Out { file, end, block: Block::default(), bytes: 0, since: Instant::now(), fault: None };
        Ok(Self { path: path.to_owned(), before: Mutex::new(before), out: Mutex::new(out), resumed })
    }

    /// True where it held results when it was opened.
    pub fn is_resumed(&self) -> bool {
        self.resumed
    }

    /// The result of an item, where it is there. A result of another type counts as none.
    pub(super) fn take<R: DeserializeOwned>(&self, key: Key) -> Option<R> {
        let bytes = self.before.lock().ok()?.remove(&key)?;
        postcard::from_bytes(&bytes).ok()
    }

    /// Keeps a result. After a fault of the disk nothing more is kept.
    pub(super) fn keep(&self, key: Key, result: &impl Serialize) {
        let Ok(bytes) = postcard::to_allocvec(result) else { return };
        let Ok(mut out) = self.out.lock() else { return };
        if out.fault.is_some() {
            return;
        }
        out.bytes += bytes.len() + size_of::<Key>();
        out.block.0.push((key, bytes));
        if out.bytes >= LARGE || out.since.elapsed() >= OLD {
            out.write();
        }
    }

    /// Writes what there is, and says what went wrong so far.
    ///
    /// # Errors
    ///
    /// The first fault of the disk: what came after it is not in the journal.
    pub fn flush(&self) -> io::Result<()> {
        let Ok(mut out) = self.out.lock() else { return Ok(()) };
        if out.fault.is_none() && !out.block.0.is_empty() {
            out.write();
        }
        out.fault.take().map_or(Ok(()), Err)
    }

    /// Removes the file: the work is done.
    ///
    /// # Errors
    ///
    /// The system's.
    pub fn remove(self) -> io::Result<()> {
        drop(self.out);
        std::fs::remove_file(self.path)
    }
}

impl Out {
    /// Appends the block. What a full disk took of it is cut off again.
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

fn packed(block: &Block) -> io::Result<Vec<u8>> {
    let payload = zstd::encode_all(postcard::to_allocvec(block).map_err(io::Error::other)?.as_slice(), 1)?;
    let length = u32::try_from(payload.len()).map_err(io::Error::other)?;
    Ok([length.to_le_bytes().as_slice(), &xxh3_64(&payload).to_le_bytes(), &payload].concat())
}

/// The next block and its size in the file, of which `left` bytes are left; `None` at the end, and where it isn't whole.
fn block(input: &mut impl Read, left: u64) -> io::Result<Option<(Block, u64)>> {
    let mut head = [0; 12];
    if left < head.len() as u64 {
        return Ok(None);
    }
    input.read_exact(&mut head)?;
    let (length, sum) = head.split_at(4);
    let length = u64::from(u32::from_le_bytes(length.try_into().unwrap_or_default()));
    if length > left - head.len() as u64 {
        return Ok(None);
    }
    let mut payload = Vec::new();
    input.take(length).read_to_end(&mut payload)?;
    if xxh3_64(&payload).to_le_bytes() != sum {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let unpacked = zstd::Decoder::new(payload.as_slice()).and_then(|decoder| decoder.take(MOST).read_to_end(&mut bytes));
    let block = unpacked.ok().and_then(|_| postcard::from_bytes(&bytes).ok());
    Ok(block.map(|block| (block, head.len() as u64 + length)))
}
