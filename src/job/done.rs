//! The mark that shared work is done.

use super::digest::Digest;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use xxhash_rust::xxh3::Xxh3;

/// Name of its file.
pub(super) const NAME: &str = "done";
const TITLE: &str = "enfilade: done";
/// Largest size of a mark, bytes.
const MOST: u64 = 4096;

/// The first writer of the output, and its checksum.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Done {
    pub digest: Digest,
    pub sum: u128,
    pub by: String,
}

impl Done {
    /// The mark in a folder; `None` if there is none, or it is invalid.
    pub fn read(folder: &Path) -> Option<Self> {
        let mut text = String::new();
        File::open(folder.join(NAME)).ok()?.take(MOST).read_to_string(&mut text).ok()?;
        let mut lines = text.strip_prefix(TITLE)?.strip_prefix('\n')?.lines();
        let mut value = |name: &str| lines.next()?.strip_prefix(name)?.strip_prefix(' ').map(str::to_owned);
        let mut number = |name| u128::from_str_radix(&value(name)?, 16).ok();
        let digest = Digest { input: number("input")?, options: number("options")?, build: number("build")? };
        let sum = number("output")?;
        Some(Self { digest, sum, by: value("by")? })
    }

    /// Writes it atomically; `worker` makes the temporary name unique.
    pub fn write(&self, folder: &Path, worker: u32) -> io::Result<()> {
        let Self { digest: Digest { input, options, build }, sum, by } = self;
        let text = format!("{TITLE}\ninput {input:x}\noptions {options:x}\nbuild {build:x}\noutput {sum:x}\nby {by}\n");
        let temporary = folder.join(format!("{NAME}-{worker}.tmp"));
        std::fs::write(&temporary, text)?;
        std::fs::rename(&temporary, folder.join(NAME))
    }
}

/// The checksum of concatenated files (XXH3, 128 bits).
pub(super) fn sum(files: &[PathBuf]) -> io::Result<u128> {
    let mut hash = Xxh3::new();
    let mut buffer = vec![0; 1 << 16];
    for path in files {
        let mut file = File::open(path)?;
        loop {
            let read = file.read(&mut buffer)?;
            if read == 0 {
                break;
            }
            hash.update(&buffer[..read]);
        }
    }
    Ok(hash.digest128())
}
