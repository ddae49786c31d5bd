//! What is decided so far: enough to go on from.
//!
//! A state holds what each round found, in order. To go on, the rounds are merged again, which takes next to no time; the
//! searches are what took long.

use super::lines::Walk;
use super::{Level, VisOptions};
use crate::pvs::flow::cells::Found;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

/// What is decided so far, to go on from. Belongs to one level and one set of options, by [`State::matches`].
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct State {
    /// Digest of the level and the options.
    digest: u64,
    /// What each round found, in the order of its tasks.
    rounds: Vec<Vec<Found<Walk>>>,
}

impl State {
    /// Nothing is decided.
    pub(super) fn new(digest: u64) -> Self {
        Self { digest, rounds: Vec::new() }
    }

    /// True where this is a state of that very level and those options: only then may a run go on from it.
    pub fn matches(&self, level: &Level, options: &VisOptions) -> bool {
        self.is_of(Self::digest(level, options))
    }

    /// Number of rounds that are done.
    pub fn rounds(&self) -> usize {
        self.rounds.len()
    }

    pub(super) fn is_of(&self, digest: u64) -> bool {
        self.digest == digest
    }

    pub(super) fn push(&mut self, found: Vec<Found<Walk>>) {
        self.rounds.push(found);
    }

    pub(super) fn round(&self, k: usize) -> Option<&[Found<Walk>]> {
        self.rounds.get(k).map(Vec::as_slice)
    }

    /// Digest of everything that the result depends on.
    pub(super) fn digest(level: &Level, options: &VisOptions) -> u64 {
        let mut hash = Xxh3::new();
        for n in [options.seed, options.steps, options.lines, level.cells as u64, level.portals.len() as u64] {
            hash.update(&n.to_le_bytes());
        }
        for portal in &level.portals {
            hash.update(&(portal.winding.len() as u64).to_le_bytes());
            portal.cells.iter().for_each(|c| hash.update(&c.to_le_bytes()));
            portal.winding.iter().flat_map(|p| p.to_array()).for_each(|x| hash.update(&x.to_bits().to_le_bytes()));
        }
        hash.digest()
    }
}
