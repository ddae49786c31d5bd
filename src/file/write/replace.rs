//! Writes files to disk atomically.

use crate::file::{FileError, PvsFile};
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

impl PvsFile {
    /// Writes the file atomically (see [`replace_file`]).
    pub fn save(&self, path: &Path) -> Result<(), FileError> {
        let bytes = self.write();
        Ok(replace_file(path, |out| out.write_all(&bytes))?)
    }
}

/// Writes a file atomically: to a temporary file beside it, which replaces it once everything is on the disk. On an error, the previous
/// file is untouched and no other file remains. If the target is not a regular file (a pipe, a device), it is written directly.
pub fn replace_file(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    replace_file_by(path, |file| {
        let mut out = BufWriter::new(file);
        fill(&mut out)?;
        out.flush()
    })
}

/// The same for a writer that seeks; it is not buffered.
pub fn replace_file_by(path: &Path, fill: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    // A link is kept: its target is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let before = fs::metadata(&target).ok();
    if before.as_ref().is_some_and(|m| !m.is_file()) {
        // Fails for a directory.
        let mut out = OpenOptions::new().write(true).open(&target)?;
        return fill(&mut out);
    }
    let name = target.file_name().ok_or_else(|| io::Error::other("not the name of a file"))?;
    let mut temporary = name.to_owned();
    temporary.push(format!(".{}.pvs.tmp", number()));
    let temporary = target.with_file_name(temporary);
    let file = OpenOptions::new().write(true).create_new(true).open(&temporary)?;
    // Locked, so that no other process takes it for the remains of a killed run. Without file locks, its age decides.
    let _ = file.try_lock();
    sweep(&target, name);
    let written = fill_and_sync(file, before, fill).and_then(|()| fs::rename(&temporary, &target));
    if written.is_err() {
        // The caller gets the first error.
        let _ = fs::remove_file(&temporary);
        return written;
    }
    // The name is on the disk only once its directory is; if that cannot be synced, the file is still complete.
    if let Some(directory) = target.parent().and_then(|d| File::open(d).ok()) {
        let _ = directory.sync_all();
    }
    Ok(())
}

/// A number that no other writer should have, because process ids on two machines, or in two containers, may be equal.
fn number() -> u32 {
    let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.subsec_nanos());
    std::process::id().rotate_left(16) ^ nanoseconds
}

/// Least age of temporary files of killed runs.
const STALE: Duration = Duration::from_secs(60);

/// Removes temporary files of killed runs that wrote the same file.
fn sweep(target: &Path, name: &OsStr) {
    let folder = target.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = name.to_string_lossy();
    let of =
        |file: &str| -> Option<u32> { file.strip_prefix(&*name)?.strip_prefix('.')?.strip_suffix(".pvs.tmp")?.parse().ok() };
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_str().and_then(of).is_none() {
            continue;
        }
        let is_old = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
        if is_old().is_none_or(|age| age < STALE) {
            continue;
        }
        // Without a lock, its writer is gone.
        if File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn fill_and_sync(
    mut file: File,
    before: Option<fs::Metadata>,
    fill: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    fill(&mut file)?;
    if let Some(before) = before {
        file.set_permissions(before.permissions())?;
    }
    file.sync_all()
}
