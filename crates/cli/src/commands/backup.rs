//! Backup copies of files that are written in place.

use super::{CliError, at};
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Copies a file that is about to be replaced with `bytes`, and returns the copy's name: `FILE.old`, or `FILE.old.2` and so on if
/// older copies exist. Makes no copy if the bytes are the same.
pub fn backed_up(path: &Path, bytes: &[u8]) -> Result<Option<PathBuf>, CliError> {
    let before = fs::read(path).map_err(|e| at(path, e))?;
    if before == bytes {
        return Ok(None);
    }
    for number in 1u32.. {
        let mut name = path.as_os_str().to_owned();
        name.push(if number == 1 { ".old".to_owned() } else { format!(".old.{number}") });
        let backup = PathBuf::from(name);
        match File::create_new(&backup) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => (),
            Err(e) => return Err(at(&backup, e)),
            Ok(mut file) => {
                if let Err(e) = file.write_all(&before).and_then(|()| file.sync_all()) {
                    // An incomplete copy is no backup.
                    let _ = fs::remove_file(&backup);
                    return Err(at(&backup, e));
                }
                return Ok(Some(backup));
            }
        }
    }
    Err(at(path, "has too many backups; delete some"))
}
