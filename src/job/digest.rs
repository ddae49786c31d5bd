//! Digests of all inputs of the work: equal digests mean equal results.

use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};
use std::fs::File;
use std::io::{BufRead, BufReader};
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// Size of the buffer to read the program, bytes.
const BUFFER: usize = 1 << 18;

/// Digests (XXH3, 128 bits) of all inputs of results.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Digest {
    /// The model or level.
    pub input: u128,
    /// The options.
    pub options: u128,
    /// The program; 0 if the build does not matter.
    pub build: u128,
}

/// The differences of two digests; at least one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Difference {
    /// The model or level.
    pub input: bool,
    /// The options.
    pub options: bool,
    /// The program.
    pub build: bool,
}

impl Digest {
    /// Bytes of [`Digest::to_bytes`].
    pub(super) const BYTES: usize = 48;

    /// The same work by this build of the program, because another build may compute other results.
    pub fn of_this_build(self) -> Self {
        let mut hash = Xxh3::new();
        hash.update(env!("CARGO_PKG_VERSION").as_bytes());
        // If the program cannot read itself, only its version counts.
        if let Ok(program) = std::env::current_exe().and_then(File::open) {
            // A buffer at a time, because a small level takes less memory than the program.
            let mut program = BufReader::with_capacity(BUFFER, program);
            while let Ok(read @ [_, ..]) = program.fill_buf() {
                let length = read.len();
                hash.update(read);
                program.consume(length);
            }
        }
        Self { build: hash.digest128(), ..self }
    }

    /// The three digests, little-endian, concatenated.
    pub fn to_bytes(self) -> Vec<u8> {
        [self.input, self.options, self.build].into_iter().flat_map(u128::to_le_bytes).collect()
    }

    /// What it is of, and how it is done: the input's digest, and one of options and program.
    pub fn of_and_how(self) -> [u128; 2] {
        [self.input, xxh3_128(&self.to_bytes()[16..])]
    }

    pub(super) fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let mut numbers = bytes.chunks_exact(16).map(|b| u128::from_le_bytes(b.try_into().unwrap_or_default()));
        let mut next = || numbers.next().unwrap_or_default();
        Self { input: next(), options: next(), build: next() }
    }

    /// The differences to another digest; `None` if they are equal.
    pub fn difference(&self, other: &Self) -> Option<Difference> {
        let Self { input, options, build } = other;
        let found =
            Difference { input: self.input != *input, options: self.options != *options, build: self.build != *build };
        (self != other).then_some(found)
    }
}

impl Display for Difference {
    fn fmt(&self, out: &mut Formatter<'_>) -> std::fmt::Result {
        let words = [
            (self.input, "to another input"),
            (self.options, "to other options"),
            (self.build, "to another build of this program"),
        ];
        let differ: Vec<&str> = words.into_iter().filter_map(|(differs, words)| differs.then_some(words)).collect();
        out.write_str(&differ.join(" and "))
    }
}
