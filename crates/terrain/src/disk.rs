//! Sources of tiles: a file and a thread that reads it, or any other asynchronous source.

use super::error::{GroundError, Part};
use super::format::{Header, Tile};
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::JoinHandle;
use xxhash_rust::xxh3::xxh3_64;

/// Maximum tiles under way.
const UNDER_WAY: usize = 16;

/// An asynchronous source of tiles. No call may block.
pub trait Disk: Send {
    /// Requests a tile; false if no more can be under way.
    fn ask(&mut self, tile: u32) -> bool;
    /// A tile that has arrived; its bytes, as in the file, are copied to `bytes`, which is as long as the longest tile.
    fn take(&mut self, bytes: &mut [u8]) -> Option<(u32, Result<(), GroundError>)>;
}

type Answer = (u32, Vec<u8>, Result<(), GroundError>);

/// A `.ground` file, read by its own thread.
pub(super) struct FileDisk {
    /// Empty buffers for reuse.
    idle: Vec<Vec<u8>>,
    questions: Option<SyncSender<(u32, Vec<u8>)>>,
    answers: Receiver<Answer>,
    thread: Option<JoinHandle<()>>,
}

impl FileDisk {
    /// Starts the thread.
    pub fn new(mut file: impl Read + Seek + Send + 'static, header: &Header, tiles: Arc<[Tile]>) -> std::io::Result<Self> {
        let (questions, asked) = sync_channel::<(u32, Vec<u8>)>(UNDER_WAY);
        let (answer, answers) = sync_channel::<Answer>(UNDER_WAY);
        let idle = vec![vec![0; header.tile_bytes(0)]; UNDER_WAY];
        let header = header.clone();
        let work = move || {
            for (tile, mut bytes) in asked {
                let found = read_tile(&mut file, &header, &tiles, tile, &mut bytes);
                if answer.send((tile, bytes, found)).is_err() {
                    return;
                }
            }
        };
        let thread = std::thread::Builder::new().name("ground".to_owned()).spawn(work)?;
        Ok(Self { idle, questions: Some(questions), answers, thread: Some(thread) })
    }
}

impl Disk for FileDisk {
    fn ask(&mut self, tile: u32) -> bool {
        let Some(bytes) = self.idle.pop() else { return false };
        self.questions.as_ref().is_some_and(|q| q.try_send((tile, bytes)).is_ok())
    }

    fn take(&mut self, bytes: &mut [u8]) -> Option<(u32, Result<(), GroundError>)> {
        match self.answers.try_recv() {
            Ok((tile, read, found)) => {
                bytes.copy_from_slice(&read);
                self.idle.push(read);
                Some((tile, found))
            }
            Err(TryRecvError::Empty | TryRecvError::Disconnected) => None,
        }
    }
}

impl Drop for FileDisk {
    fn drop(&mut self) {
        // The thread ends when the channel is closed.
        self.questions = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Reads a tile into the first part of `bytes`, and checks it.
pub(super) fn read_tile(
    file: &mut (impl Read + Seek),
    header: &Header,
    tiles: &[Tile],
    tile: u32,
    bytes: &mut [u8],
) -> Result<(), GroundError> {
    let bytes = &mut bytes[..header.tile_bytes(tile)];
    let part = Part::Tile(tile);
    file.seek(SeekFrom::Start(header.place(tile)))?;
    file.read_exact(bytes).map_err(|e| GroundError::of(part, e))?;
    if xxh3_64(bytes) == tiles[tile as usize].checksum { Ok(()) } else { Err(GroundError::Checksum(part)) }
}
