//! Checks of a command's files before its work: it overwrites no input and no file of another kind, and reports at once what it
//! can't write.

use super::kinds::Kind;
use super::{CliError, at};
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Most names in a message about a folder.
const MOST_NAMES: usize = 6;

/// The files of a command.
#[derive(Default)]
pub struct Files {
    reads: Vec<Read>,
    writes: Vec<Write>,
}

/// A file that is read.
struct Read {
    path: PathBuf,
    /// For files, not folders: the extensions.
    named: Option<Vec<&'static str>>,
}

/// A file or a folder to write to.
struct Write {
    path: PathBuf,
    target: Target,
    /// The file is an input; a backup is kept.
    in_place: bool,
}

/// What is written.
enum Target {
    /// A file of this kind.
    File(Kind),
    /// Files of a folder, beside what it has.
    Filled,
    /// A whole folder. One that is there is replaced, unless there is a reason not to.
    Folder(fn(&Path) -> Option<String>),
}

impl Files {
    /// No files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds an input file with one of these extensions.
    pub fn reads(mut self, path: &Path, extensions: &[&'static str]) -> Self {
        self.reads.push(Read { path: path.to_owned(), named: Some(extensions.to_vec()) });
        self
    }

    /// Adds input files or folders, if given.
    pub fn reads_too<'p>(mut self, paths: impl IntoIterator<Item = &'p PathBuf>) -> Self {
        self.reads.extend(paths.into_iter().map(|path| Read { path: path.clone(), named: None }));
        self
    }

    /// Adds a model and the files beside it.
    pub fn model(self, path: &Path) -> Self {
        let beside = ["roles.json", "prt"].map(|extension| path.with_extension(extension));
        self.reads(path, &enfilade_formats::extensions().collect::<Vec<_>>()).reads_too(&beside)
    }

    /// Adds a model or a level and the files beside it.
    pub fn model_or_level(self, path: &Path, more: &[&'static str]) -> Self {
        let levels = ["prt", "bsp"];
        let models = enfilade_formats::extensions().filter(|extension| !levels.contains(extension));
        let all: Vec<&str> = models.chain(levels).chain(more.iter().copied()).collect();
        self.reads(path, &all).reads_too(&["roles.json", "prt"].map(|extension| path.with_extension(extension)))
    }

    /// Adds an output file, if given.
    pub fn writes<'p>(mut self, path: impl Into<Option<&'p PathBuf>>, kind: Kind) -> Self {
        let path = path.into().cloned();
        self.writes.extend(path.map(|path| Write { path, target: Target::File(kind), in_place: false }));
        self
    }

    /// Adds an input that is written back, with a backup.
    pub fn writes_back(mut self, path: &Path, kind: Kind) -> Self {
        self.writes.push(Write { path: path.to_owned(), target: Target::File(kind), in_place: true });
        self
    }

    /// Adds an output folder, if given.
    pub fn fills<'p>(mut self, folder: impl Into<Option<&'p PathBuf>>) -> Self {
        let folder = folder.into().cloned();
        self.writes.extend(folder.map(|path| Write { path, target: Target::Filled, in_place: false }));
        self
    }

    /// Adds an output folder that is written as a whole. `refusal`: why the one that is there is not replaced.
    pub fn replaces(mut self, folder: &Path, refusal: fn(&Path) -> Option<String>) -> Self {
        self.writes.push(Write { path: folder.to_owned(), target: Target::Folder(refusal), in_place: false });
        self
    }

    /// Whether a path is among the files.
    #[cfg(test)]
    pub fn name(&self, path: &Path) -> bool {
        self.reads.iter().any(|read| read.path == path) || self.writes.iter().any(|write| write.path == path)
    }

    /// Refuses outputs that would destroy a file or can't be written. Changes nothing.
    pub fn check(&self) -> Result<(), CliError> {
        self.reads.iter().try_for_each(Read::check)?;
        let inputs: Vec<(&Path, Identity)> =
            self.reads.iter().filter_map(|read| Some((&*read.path, Identity::of(&read.path)?))).collect();
        let mut outputs: Vec<(&Path, Identity)> = Vec::new();
        for write in &self.writes {
            let path = &*write.path;
            let Some(identity) = Identity::of(path) else { continue };
            let is_same = |(_, other): &&(&Path, Identity)| *other == identity;
            if let Some((input, _)) = inputs.iter().find(is_same).filter(|_| !write.in_place) {
                let same = if *input == path { String::new() } else { format!(", as {}", input.display()) };
                return Err(at(path, format!("is an input{same}, and would be overwritten; give the output another name")));
            }
            if let Some((other, _)) = outputs.iter().find(is_same) {
                return Err(at(path, format!("would be written twice, also as {}; give two names", other.display())));
            }
            outputs.push((path, identity));
        }
        self.writes.iter().try_for_each(|write| self.check_inputs_outside(write))?;
        let mut folders = Vec::new();
        self.writes.iter().try_for_each(|write| write.check(&mut folders))
    }

    /// Refuses a folder that would be replaced with an input in it.
    fn check_inputs_outside(&self, write: &Write) -> Result<(), CliError> {
        let Target::Folder(_) = write.target else { return Ok(()) };
        let Ok(folder) = fs::canonicalize(&write.path) else { return Ok(()) };
        let is_in = |read: &&Read| fs::canonicalize(&read.path).is_ok_and(|path| path.starts_with(&folder));
        match self.reads.iter().find(is_in) {
            Some(read) => {
                let input = read.path.display();
                Err(at(
                    &write.path,
                    format!("has an input, {input}, which would be overwritten; give the output another name"),
                ))
            }
            None => Ok(()),
        }
    }
}

impl Read {
    /// Refuses a folder in place of a file.
    fn check(&self) -> Result<(), CliError> {
        let Some(extensions) = self.named.as_ref().filter(|_| self.path.is_dir()) else { return Ok(()) };
        let is_named = |name: &String| {
            let extension = Path::new(name).extension().map(|e| e.to_ascii_lowercase());
            extension.is_some_and(|e| extensions.iter().any(|of| e == **of))
        };
        let entries = fs::read_dir(&self.path).map_err(|e| at(&self.path, e))?.flatten();
        let mut names: Vec<String> =
            entries.map(|e| e.file_name().to_string_lossy().into_owned()).filter(is_named).collect();
        names.sort();
        if names.is_empty() {
            let kinds: Vec<String> = extensions.iter().map(|e| format!(".{e}")).collect();
            return Err(at(&self.path, format!("is a folder without a file of these types: {}", kinds.join(", "))));
        }
        let more = if names.len() > MOST_NAMES { format!(" and {} more", names.len() - MOST_NAMES) } else { String::new() };
        names.truncate(MOST_NAMES);
        Err(at(&self.path, format!("is a folder; give a file in it: {}{more}", names.join(", "))))
    }
}

impl Write {
    /// Refuses a path that can't be written or holds another kind of file. `folders`: known to be writable.
    fn check(&self, folders: &mut Vec<PathBuf>) -> Result<(), CliError> {
        let kind = match self.target {
            Target::File(kind) => kind,
            Target::Filled => return check_filled(&self.path, folders),
            Target::Folder(refusal) => {
                if let Some(reason) = refusal(&self.path) {
                    return Err(at(&self.path, reason));
                }
                let target = fs::canonicalize(&self.path).unwrap_or_else(|_| self.path.clone());
                return check_folder(&self.path, folder_of(&target), folders);
            }
        };
        // A link stays; its target is replaced.
        let target = fs::canonicalize(&self.path).unwrap_or_else(|_| self.path.clone());
        match fs::metadata(&target) {
            Ok(about) if about.is_dir() => return Err(at(&self.path, "is a folder; give the name of a file")),
            // A pipe, a device.
            Ok(about) if !about.is_file() => return Ok(()),
            Ok(about) => check_replaced(&self.path, &about, kind)?,
            Err(_) => (),
        }
        check_folder(&self.path, folder_of(&target), folders)
    }
}

/// Refuses a file that is protected or of another kind.
fn check_replaced(path: &Path, about: &fs::Metadata, kind: Kind) -> Result<(), CliError> {
    let protected = || at(path, "is write-protected, so it isn't replaced; give another name");
    if about.permissions().readonly() {
        return Err(protected());
    }
    match OpenOptions::new().write(true).open(path) {
        Err(e) if e.kind() == io::ErrorKind::PermissionDenied => return Err(protected()),
        opened => opened.map(drop).map_err(|e| at(path, e))?,
    }
    match kind.may_replace(path).map_err(|e| at(path, e))? {
        true => Ok(()),
        false => {
            let remedy = if kind == Kind::State { "move it" } else { "give another name" };
            Err(at(path, format!("is not a {}, so it isn't replaced; {remedy}", kind.name())))
        }
    }
}

/// Refuses a folder that can't be made or written to.
fn check_filled(folder: &Path, folders: &mut Vec<PathBuf>) -> Result<(), CliError> {
    let there = folder.ancestors().find(|f| !f.as_os_str().is_empty() && fs::symlink_metadata(f).is_ok());
    check_folder(folder, there.unwrap_or(Path::new(".")), folders)
}

/// Refuses a folder that can't be written to.
fn check_folder(path: &Path, folder: &Path, folders: &mut Vec<PathBuf>) -> Result<(), CliError> {
    if folders.iter().any(|known| known == folder) {
        return Ok(());
    }
    match fs::metadata(folder) {
        Ok(about) if about.is_dir() => (),
        Ok(_) => return Err(at(folder, "is not a folder")),
        Err(_) => return Err(at(folder, "there is no such folder")),
    }
    // Only a trial is certain: root may ignore permissions, and a disk may be read-only.
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.subsec_nanos());
    let trial = folder.join(format!(".enfilade.{}.{now}.tmp", std::process::id()));
    let made = OpenOptions::new().write(true).create_new(true).open(&trial);
    if let Err(e) = made.and_then(|file| {
        drop(file);
        fs::remove_file(&trial)
    }) {
        return Err(at(path, format!("can't be written: {e}")));
    }
    folders.push(folder.to_owned());
    Ok(())
}

/// The folder of a file.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Identity of a file under any of its names.
#[derive(PartialEq, Eq)]
enum Identity {
    /// Device and number.
    #[cfg(unix)]
    Inode(u64, u64),
    /// The path without links.
    Path(PathBuf),
}

impl Identity {
    /// `None` for a pipe, a device or a folder.
    fn of(path: &Path) -> Option<Self> {
        match fs::metadata(path) {
            Ok(about) if !about.is_file() => None,
            #[cfg(unix)]
            Ok(about) => {
                use std::os::unix::fs::MetadataExt;
                Some(Self::Inode(about.dev(), about.ino()))
            }
            #[cfg(not(unix))]
            Ok(_) => fs::canonicalize(path).ok().map(Self::Path),
            Err(_) => {
                let folder = fs::canonicalize(folder_of(path)).unwrap_or_else(|_| folder_of(path).to_owned());
                Some(Self::Path(folder.join(path.file_name()?)))
            }
        }
    }
}
