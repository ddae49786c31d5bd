//! Sidecar files: read only from the model's folder or below it, unless another folder is allowed.

use super::whole_file;
use std::fs::File;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Search folders of sidecar files.
#[derive(Clone, Copy)]
pub struct Sidecars<'a> {
    /// The model's own folder; `None` if it came from memory.
    pub folder: Option<&'a Path>,
    /// Allowed folder instead of the model's ([`super::ImportOptions::files_under`]).
    pub under: Option<&'a Path>,
}

impl Sidecars<'_> {
    /// Reads the file `name` (as the model spells it, `/` or `\` between folders, from the model's folder on).
    ///
    /// Fails with an error of one line if the model came from memory, if `name` is a URL, if it leads out of the allowed folder, even by a
    /// link, and if it is not a regular file.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        whole_file::read(&self.path(name)?).map_err(|e| refusal(name, e))
    }

    /// Opens the file `name`, to read parts of it.
    ///
    /// Fails as [`Sidecars::read`].
    pub fn open(&self, name: &str) -> Result<File, String> {
        File::open(self.path(name)?).map_err(|e| refusal(name, e))
    }

    /// Whether [`Sidecars::read`] would find content in the file `name`.
    pub fn is_there(&self, name: &str) -> bool {
        self.path(name).is_ok_and(|path| whole_file::holds_something(&path))
    }

    /// Names of the files in the folder `name` (`.` is the model's own) that end in `.` and `ending`, in order. [`Sidecars::read`] takes each with the folder before
    /// it.
    ///
    /// Fails as [`Sidecars::read`], and if it is not a folder.
    pub fn list(&self, name: &str, ending: &str) -> Result<Vec<String>, String> {
        let entries = self.resolved(name)?.read_dir().map_err(|e| refusal(name, e))?;
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|n| Path::new(n).extension().is_some_and(|e| e == ending)).collect();
        names.sort();
        Ok(names)
    }

    fn path(&self, name: &str) -> Result<PathBuf, String> {
        let path = self.resolved(name)?;
        if !path.metadata().map_err(|e| refusal(name, e))?.is_file() {
            return Err(format!("`{name}` is not a regular file"));
        }
        Ok(path)
    }

    /// The path without links, within the allowed folder.
    fn resolved(&self, name: &str) -> Result<PathBuf, String> {
        let Some(folder) = self.folder else {
            return Err(format!("`{name}` is another file, which can't be read: this model didn't come from a folder"));
        };
        // The path of a model in the working folder has no folder.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let refuse = |e: io::Error| refusal(name, e);
        let spelt = match self.under {
            None if name == "." => PathBuf::new(),
            None => relative(name)?,
            Some(_) if name.contains("://") => return Err(url(name)),
            Some(_) => PathBuf::from(name.replace('\\', "/")),
        };
        // An archive may contain links: the resolved path counts.
        let path = folder.join(spelt).canonicalize().map_err(refuse)?;
        if !path.starts_with(self.under.unwrap_or(folder).canonicalize().map_err(refuse)?) {
            return Err(outside(name));
        }
        Ok(path)
    }
}

fn refusal(name: &str, error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => format!("`{name}` is missing: the model refers to it; put it where the model expects it"),
        _ => format!("`{name}`: {error}"),
    }
}

/// The relative path of `name`, if it stays inside the folder.
fn relative(name: &str) -> Result<PathBuf, String> {
    let path: PathBuf = name.replace('\\', "/").split('/').filter(|part| *part != ".").collect();
    let bytes = name.as_bytes();
    let is_drive = bytes.len() > 1 && bytes[0].is_ascii_alphabetic() && bytes[1] == b':';
    let climbs = name.starts_with(['/', '\\']) || path.components().any(|c| !matches!(c, Component::Normal(_)));
    if name.contains("://") {
        Err(url(name))
    } else if climbs || is_drive || path.as_os_str().is_empty() {
        Err(outside(name))
    } else {
        Ok(path)
    }
}

fn url(name: &str) -> String {
    format!("`{name}` is a URL; put the file beside the model")
}

fn outside(name: &str) -> String {
    format!(
        "`{name}` leads out of the model's folder; put the file beside the model, or allow its folder with --files-under"
    )
}

#[cfg(test)]
mod tests {
    use super::relative;
    use std::path::Path;

    #[test]
    fn only_paths_inside_the_folder_are_read() {
        assert_eq!(relative("a.bin").unwrap(), Path::new("a.bin"));
        assert_eq!(relative("./sub\\a.bin").unwrap(), Path::new("sub/a.bin"));
        for bad in
            ["/etc/passwd", "../a.bin", "sub/../../a.bin", "C:\\a.bin", "c:a.bin", "\\\\host\\a", "https://x/a.bin", "", "."]
        {
            assert!(relative(bad).is_err(), "{bad}");
        }
    }
}
