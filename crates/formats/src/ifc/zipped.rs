//! IFC in a zip archive (`.ifczip`), as defined by buildingSMART: it holds one `.ifc` file.

use enfilade::scene::{ImportError, Place};
use std::io::{Cursor, Read};
use zip::ZipArchive;

/// Greatest ratio of expansion; IFC text usually shrinks to a tenth or a fifth.
const MOST_GROWTH: u64 = 200;

/// The bytes of the first `.ifc` file in an archive.
pub(super) fn unzipped(bytes: &[u8]) -> Result<Vec<u8>, ImportError> {
    let broken = |what: String| ImportError::malformed(Place::File, what);
    let damaged = |e: zip::result::ZipError| broken(format!("not a zip archive: {e}"));
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    for i in 0..archive.len() {
        let file = archive.by_index(i).map_err(damaged)?;
        let is_ifc = file.name().is_ok_and(|name| name.to_ascii_lowercase().ends_with(".ifc"));
        if !is_ifc || !file.is_file() {
            continue;
        }
        let most = MOST_GROWTH.saturating_mul(bytes.len() as u64);
        let mut out = Vec::new();
        file.take(most + 1).read_to_end(&mut out).map_err(|e| broken(format!("a damaged archive: {e}")))?;
        return if out.len() as u64 > most {
            Err(broken(format!("its .ifc file is more than {MOST_GROWTH} times larger than the archive")))
        } else {
            Ok(out)
        };
    }
    Err(broken("no .ifc file in the archive".into()))
}
