//! Files that a person asks for: pictures and paths, beside the model, numbered, and never over another file.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Where files go, and what their names begin with.
#[derive(Clone, PartialEq, Debug)]
pub struct OutputFiles {
    /// The first one that can be written is taken.
    folders: Vec<PathBuf>,
    name: String,
}

impl OutputFiles {
    /// Beside a file and with its name; in the current folder where that can't be written.
    pub fn beside(file: &Path) -> Self {
        let name = file.file_stem().map_or("picture".into(), |stem| stem.to_string_lossy().into_owned());
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        Self { folders: vec![folder, PathBuf::new()], name }
    }

    /// In the current folder.
    pub fn here(name: &str) -> Self {
        Self { folders: vec![PathBuf::new()], name: name.to_owned() }
    }

    /// Writes `NAME-1.END`, or with the next number that is free. Returns where it is.
    ///
    /// # Errors
    ///
    /// One line: no folder can be written.
    pub fn save(&self, end: &str, write: &dyn Fn(&mut dyn Write) -> std::io::Result<()>) -> Result<PathBuf, String> {
        let mut failed = String::new();
        for folder in &self.folders {
            let mut paths = (1u32..).map(|number| folder.join(format!("{}-{number}.{end}", self.name)));
            // A file that another process has just written is not replaced either.
            let made = paths.find_map(|path| match File::create_new(&path) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => None,
                made => Some((path, made)),
            });
            let Some((path, made)) = made else { continue };
            let written = made.and_then(|file| {
                let mut to = BufWriter::new(file);
                let written = write(&mut to).and_then(|()| to.flush());
                if written.is_err() {
                    // Half a file is none.
                    let _ = std::fs::remove_file(&path);
                }
                written
            });
            match written {
                Ok(()) => return Ok(path),
                Err(e) => failed = format!("{}: {e}", path.display()),
            }
        }
        Err(failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("enfilade_kept_{name}_{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn the_next_free_number_is_taken() {
        let folder = folder("numbers");
        std::fs::write(folder.join("house-2.png"), "old").unwrap();
        let kept = OutputFiles::beside(&folder.join("house.glb"));
        let save = || kept.save("png", &|to| to.write_all(b"new")).unwrap();
        assert_eq!([save(), save()], [folder.join("house-1.png"), folder.join("house-3.png")]);
        assert_eq!(std::fs::read(folder.join("house-2.png")).unwrap(), b"old");
        assert_eq!(std::fs::read(folder.join("house-3.png")).unwrap(), b"new");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_passed_over() {
        let folder = folder("folders");
        let kept = OutputFiles { folders: vec![folder.join("none"), folder.clone()], name: "house".into() };
        assert_eq!(kept.save("png", &|to| to.write_all(b"x")).unwrap(), folder.join("house-1.png"));
        // A failed write leaves nothing, and is one line.
        let line = kept.save("png", &|_| Err(std::io::Error::other("full"))).unwrap_err();
        assert!(line.contains("house-2.png: full") && line.lines().count() == 1, "{line}");
        assert!(!folder.join("house-2.png").exists());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
