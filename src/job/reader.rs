//! Another worker's file, read while it grows.

use super::block::{HEAD, Head, Key, read_block, read_head};
use super::digest::Digest;
use super::host::Host;
use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};
use std::path::PathBuf;

/// The key under which a worker says who it is.
pub(super) const WHO: Key = (u32::MAX, 0);

/// Reads what is new in a file.
pub(super) struct Reader {
    pub path: PathBuf,
    pub worker: u32,
    /// Who writes it, if it says so.
    pub host: Option<Host>,
    /// Where the last whole block ends; 0 before the head.
    end: u64,
    /// Its length when there was no whole block at `end`.
    stuck: Option<u64>,
    is_told: bool,
}

impl Reader {
    pub fn new(path: PathBuf, worker: u32) -> Self {
        Self { path, worker, host: None, end: 0, stuck: None, is_told: false }
    }

    /// Gives all results that are new; returns what is wrong with the file, once. A file that isn't there has none.
    pub fn read(&mut self, digest: &Digest, take: &mut dyn FnMut(Key, Vec<u8>)) -> Option<String> {
        let said = self.read_on(digest, take).unwrap_or_else(|e| match e.kind() {
            io::ErrorKind::NotFound => None,
            _ => Some(e.to_string()),
        })?;
        (!std::mem::replace(&mut self.is_told, true)).then(|| format!("{}: {said}", self.path.display()))
    }

    fn read_on(&mut self, digest: &Digest, take: &mut dyn FnMut(Key, Vec<u8>)) -> io::Result<Option<String>> {
        // Opened anew each time: on a network's disk that is what asks for what others have written.
        let mut file = File::open(&self.path)?;
        let length = file.metadata()?.len();
        if length < self.end {
            // It was begun anew.
            self.end = 0;
        }
        if self.end == 0 {
            match read_head(&mut file)? {
                Head::Whole(found) => {
                    if let Some(difference) = digest.difference(&found) {
                        return Ok(Some(format!("belongs {difference}, and counts for nothing")));
                    }
                }
                Head::Cut => return Ok(None),
                Head::Strange => return Ok(Some("is no worker's file, and counts for nothing".into())),
            }
            self.end = HEAD as u64;
        }
        if length == self.end {
            self.stuck = None;
            return Ok(None);
        }
        file.seek(SeekFrom::Start(self.end))?;
        let mut input = BufReader::new(file);
        while let Some((block, size)) = read_block(&mut input, length - self.end)? {
            self.end += size;
            for (key, bytes) in block.0 {
                if key == WHO {
                    self.host = postcard::from_bytes(&bytes).ok();
                } else {
                    take(key, bytes);
                }
            }
        }
        // What is being written is whole when it is looked at again, or the file is longer.
        let cut = length - self.end;
        let is_stuck = cut > 0 && self.stuck == Some(length);
        self.stuck = (cut > 0).then_some(length);
        Ok(is_stuck.then(|| format!("is not whole: its last {cut} bytes count for nothing")))
    }
}
