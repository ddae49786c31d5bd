//! What a client loads and evicts at once.

use crate::ObjectId;

/// A chunk: an index into a client's list of them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(transparent)]
pub struct ChunkId(pub u32);

impl ChunkId {
    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The chunks of a building's objects.
#[derive(Clone, Debug)]
pub struct Chunks {
    /// By object.
    pub(super) of: Vec<ChunkId>,
    /// By chunk.
    pub(super) bytes: Vec<u64>,
}

impl Chunks {
    /// A chunk for each object, with the object's number and its size in memory, bytes.
    pub fn of_one(bytes: Vec<u64>) -> Self {
        Self { of: (0..bytes.len() as u32).map(ChunkId).collect(), bytes }
    }

    /// The chunk of each object, and the size in memory of each chunk, bytes. `None`: an object's chunk is not there.
    pub fn new(of: Vec<ChunkId>, bytes: Vec<u64>) -> Option<Self> {
        of.iter().all(|chunk| chunk.index() < bytes.len()).then_some(Self { of, bytes })
    }

    /// The chunk of an object.
    #[inline]
    pub(super) fn of(&self, object: ObjectId) -> ChunkId {
        self.of[object.index()]
    }
}
