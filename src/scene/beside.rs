//! Files that a model names: read only from the folder that the model lies in, or below it.

use std::io;
use std::path::{Component, Path, PathBuf};

/// Reads the file `name` (as the model spells it, `/` or `\` between folders) beside the model.
///
/// Fails with one clear line where `folder` is `None` (the model came from memory), where `name` is a URL, an absolute path or
/// climbs out of the folder, be it by a link, and where it isn't a regular file.
pub(super) fn read_beside(folder: Option<&Path>, name: &str) -> Result<Vec<u8>, String> {
    let Some(folder) = folder else {
        return Err(format!("`{name}` is another file, and this model was not read from a folder"));
    };
    // A model in the working folder has no folder in its name.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let refuse = |e: io::Error| format!("`{name}`: {e}");
    // An archive may bring links: where they lead counts.
    let path = folder.join(relative(name)?).canonicalize().map_err(refuse)?;
    if !path.starts_with(folder.canonicalize().map_err(refuse)?) {
        return Err(outside(name));
    }
    if !path.metadata().map_err(refuse)?.is_file() {
        return Err(format!("`{name}` is not a regular file"));
    }
    std::fs::read(&path).map_err(refuse)
}

/// The relative path that `name` spells, if it stays inside the folder.
fn relative(name: &str) -> Result<PathBuf, String> {
    let path: PathBuf = name.replace('\\', "/").split('/').filter(|part| *part != ".").collect();
    let bytes = name.as_bytes();
    let is_drive = bytes.len() > 1 && bytes[0].is_ascii_alphabetic() && bytes[1] == b':';
    let climbs = name.starts_with(['/', '\\']) || path.components().any(|c| !matches!(c, Component::Normal(_)));
    if name.contains("://") {
        Err(format!("`{name}` is a URL; put the file beside the model"))
    } else if climbs || is_drive || path.as_os_str().is_empty() {
        Err(outside(name))
    } else {
        Ok(path)
    }
}

fn outside(name: &str) -> String {
    format!("`{name}` leads out of the model's folder; put the file beside the model")
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
