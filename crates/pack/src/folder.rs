//! Writes a folder in one step: beside its place, then renamed. A folder is replaced only if all that is in it was packed.

use crate::gzip::gunzip;
use crate::manifest::{MANIFEST, Manifest, is_within};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A file of a folder.
pub struct Packed {
    /// Name below the folder, with `/` between parts.
    pub name: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// The files of a page in a folder: `index.html`, and what lies beside it.
///
/// # Errors
///
/// If the folder can't be read, has no `index.html`, or has what a packed folder can't: other folders, or names of more than letters, digits, `-`, `_`
/// and `.`.
pub fn page(folder: &Path) -> io::Result<Vec<Packed>> {
    let mut page = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if !path.is_file() || !is_within(&name) || name == MANIFEST {
            return Err(io::Error::other(format!(
                "has {name}, which is no file of a page; give a folder of index.html and the files beside it"
            )));
        }
        page.push(Packed { bytes: fs::read(&path)?, name });
    }
    page.sort_unstable_by(|a, b| a.name.cmp(&b.name));
    match page.iter().any(|file| file.name == "index.html") {
        true => Ok(page),
        false => Err(io::Error::other("is no page: it has no index.html; build it as web/README.md says")),
    }
}

/// Most bytes of a manifest's text: more than the names of the files of a folder are.
const MOST_TEXT: u64 = 1 << 30;

/// Why a folder is not replaced; `None` if it may be, or if there is none.
pub fn refusal(folder: &Path) -> Option<String> {
    if fs::symlink_metadata(folder).is_err() {
        return None;
    }
    let is_ours = || -> Option<Manifest> {
        let text = gunzip(&fs::read(folder.join(MANIFEST)).ok()?, MOST_TEXT).ok()?;
        Manifest::read(std::str::from_utf8(&text).ok()?).ok()
    };
    let Some(manifest) = is_ours() else {
        return Some("is not a folder that pack wrote, so it isn't replaced; give another name".to_owned());
    };
    let mut names: Vec<&str> = manifest.files().map(|entry| entry.file.as_str()).collect();
    names.push(MANIFEST);
    names.sort_unstable();
    let of_another = match other(folder, "", &names) {
        Ok(other) => other?,
        Err(e) => return Some(e.to_string()),
    };
    Some(format!("has {of_another}, which pack did not write, so it isn't replaced; move that file"))
}

/// The name of a file or of an empty folder that is not among the sorted names.
fn other(folder: &Path, before: &str, names: &[&str]) -> io::Result<Option<String>> {
    let mut entries: Vec<fs::DirEntry> = fs::read_dir(folder)?.collect::<io::Result<_>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = format!("{before}{}", entry.file_name().to_string_lossy());
        let below = format!("{name}/");
        let found = match entry.file_type()?.is_dir() && names.iter().any(|known| known.starts_with(&below)) {
            true => other(&entry.path(), &below, names)?,
            false => names.binary_search(&name.as_str()).is_err().then_some(name),
        };
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

/// Writes a folder of these files. If there is one, it is replaced; see [`refusal`]. On an error it stays as it was.
///
/// # Errors
///
/// If the disk says so.
pub fn write(folder: &Path, files: &[Packed]) -> io::Result<()> {
    // A link stays; what it leads to is replaced.
    let target = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    let new = beside(&target, "new")?;
    let written = fill(&new, files).and_then(|()| put(&new, &target));
    if written.is_err() {
        // The caller gets the first error.
        let _ = fs::remove_dir_all(&new);
    }
    written
}

/// A hidden name beside a folder, which no other process uses.
fn beside(target: &Path, what: &str) -> io::Result<PathBuf> {
    let name = target.file_name().ok_or_else(|| io::Error::other("not the name of a folder"))?.to_string_lossy();
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.subsec_nanos());
    Ok(target.with_file_name(format!(".{name}.{}.{now}.{what}", std::process::id())))
}

fn fill(folder: &Path, files: &[Packed]) -> io::Result<()> {
    fs::create_dir(folder)?;
    for Packed { name, bytes } in files {
        let path = folder.join(name);
        path.parent().map_or(Ok(()), fs::create_dir_all)?;
        let mut file = File::create_new(path)?;
        file.write_all(bytes)?;
        file.sync_all()?;
    }
    Ok(())
}

/// Puts a folder in place of another.
fn put(new: &Path, target: &Path) -> io::Result<()> {
    if fs::symlink_metadata(target).is_err() {
        return fs::rename(new, target);
    }
    let old = beside(target, "old")?;
    fs::rename(target, &old)?;
    if let Err(e) = fs::rename(new, target) {
        fs::rename(&old, target)?;
        return Err(e);
    }
    fs::remove_dir_all(old)
}
