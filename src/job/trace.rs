//! What took how long, item by item.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// A table on the disk: `map,item,worker,seconds,stage`, a line for each item that this worker worked out. A line without an
/// item has the seconds between this map and the one before, when nothing was shared; the last such line, those after the
/// last map.
pub struct Trace {
    worker: u32,
    lines: Mutex<Lines>,
}

struct Lines {
    out: BufWriter<File>,
    stage: String,
    /// The last map, and when it ended.
    map: Option<u32>,
    end: Instant,
    /// What went wrong first.
    fault: Option<io::Error>,
}

impl Trace {
    /// Begins a table.
    ///
    /// # Errors
    ///
    /// The system's.
    pub fn create(path: &Path, worker: u32) -> io::Result<Self> {
        let mut out = BufWriter::new(File::create(path)?);
        writeln!(out, "map,item,worker,seconds,stage")?;
        let lines = Lines { out, stage: String::new(), map: None, end: Instant::now(), fault: None };
        Ok(Self { worker, lines: Mutex::new(lines) })
    }

    /// Names what is done now.
    pub(super) fn stage(&self, stage: &str) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.stage != stage {
            // Commas part columns.
            lines.stage = stage.replace(',', " ");
        }
    }

    /// A map begins.
    pub(super) fn begin(&self, map: u32) {
        self.line(map, None, None);
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).map = Some(map);
    }

    /// An item was worked out, which was begun then.
    pub(super) fn item(&self, map: u32, item: usize, since: Instant) {
        self.line(map, Some(item), Some(since));
    }

    /// A map has ended.
    pub(super) fn end(&self) {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).end = Instant::now();
    }

    fn line(&self, map: u32, item: Option<usize>, since: Option<Instant>) {
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let seconds = since.unwrap_or(lines.end).elapsed().as_secs_f64();
        let item = item.map(|item| item.to_string()).unwrap_or_default();
        let text = format!("{map},{item},{},{seconds:.6},{}", self.worker, lines.stage);
        if lines.fault.is_none() {
            lines.fault = writeln!(lines.out, "{text}").err();
        }
    }

    /// All is done: writes what is left of it.
    ///
    /// # Errors
    ///
    /// The first fault of the disk.
    pub fn close(self) -> io::Result<()> {
        let last = self.lines.lock().unwrap_or_else(PoisonError::into_inner).map;
        self.line(last.map_or(0, |map| map + 1), None, None);
        let Lines { mut out, fault, .. } = self.lines.into_inner().unwrap_or_else(PoisonError::into_inner);
        fault.map_or_else(|| out.flush(), Err)
    }
}
