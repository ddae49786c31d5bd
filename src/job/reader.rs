//! Another worker's file, read while it grows.

use super::block::{HEAD, Head, Key, read_block, read_head};
use super::digest::Digest;
use super::host::Host;
use std::fs::File;
use std::io::{self, BufReader, Seek, SeekFrom};
use std::path::PathBuf;

/// The key of a worker's host entry.
pub(super) const WHO: Key = (u32::MAX, 0);

/// Reads new results of a file.
pub(super) struct Reader {
    pub path: PathBuf,
    pub worker: u32,
    /// Its writer, if stated.
    pub host: Option<Host>,
    /// End of the last complete block; 0 before the head.
    end: u64,
    /// Its length at the last incomplete block at `end`.
    stuck: Option<u64>,
    is_told: bool,
}

impl Reader {
    pub fn new(path: PathBuf, worker: u32) -> Self {
        Self { path, worker, host: None, end: 0, stuck: None, is_told: false }
    }

    /// Passes all new results to `take`; returns a fault of the file, once. A missing file has no results.
    pub fn read(&mut self, digest: &Digest, take: &mut dyn FnMut(Key, Vec<u8>)) -> Option<String> {
        let said = self.read_on(digest, take).unwrap_or_else(|e| match e.kind() {
            io::ErrorKind::NotFound => None,
            _ => Some(e.to_string()),
        })?;
        (!std::mem::replace(&mut self.is_told, true)).then(|| format!("{}: {said}", self.path.display()))
    }

    fn read_on(&mut self, digest: &Digest, take: &mut dyn FnMut(Key, Vec<u8>)) -> io::Result<Option<String>> {
        // Reopened each time: on a network drive, only that makes others' writes visible.
        let mut file = File::open(&self.path)?;
        let length = file.metadata()?.len();
        if length < self.end {
            // The file was restarted.
            self.end = 0;
        }
        if self.end == 0 {
            match read_head(&mut file)? {
                Head::Whole(found) => {
                    if let Some(difference) = digest.difference(&found) {
                        return Ok(Some(format!("belongs {difference}, and is ignored")));
                    }
                }
                Head::Cut => return Ok(None),
                Head::Strange => return Ok(Some("is not a worker's file, and is ignored".into())),
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
        // A block being written is complete at the next read, or the file is longer.
        let cut = length - self.end;
        let is_stuck = cut > 0 && self.stuck == Some(length);
        self.stuck = (cut > 0).then_some(length);
        Ok(is_stuck.then(|| format!("is incomplete: its last {cut} bytes are ignored")))
    }
}
