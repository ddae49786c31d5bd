//! The kinds of files that commands write, and how to recognise each by its first bytes.

use enfilade::file::MAGIC;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// A kind of file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// `.pvs`.
    Pvs,
    /// Binary glTF.
    Glb,
    /// Lines of `check --leak`.
    Leaks,
    /// The way out of a map that leaks.
    Points,
    /// Rows as text.
    Rows,
    /// A game's level.
    Bsp,
    /// A level's portals.
    Prt,
    /// `.ground`.
    Ground,
    /// GeoTIFF.
    Tiff,
    /// A picture.
    Png,
    /// The page of `report`.
    Page,
    /// A table of `report`.
    Table,
    /// The state of an interrupted run.
    State,
    /// JSON.
    Json,
}

/// Bytes at a file's start that are read to find its kind.
const HEAD: u64 = 4096;
/// Start of each table of a report.
const TABLES: [&str; 6] =
    ["strategy,cpu_", "cell,name,", "view_cells,bytes,", "limit_px,segments,", "above_m,limit,", "method,stage,"];

/// All kinds.
const ALL: [Kind; 14] = [
    Kind::Pvs,
    Kind::Glb,
    Kind::Leaks,
    Kind::Points,
    Kind::Rows,
    Kind::Bsp,
    Kind::Prt,
    Kind::Ground,
    Kind::Tiff,
    Kind::Png,
    Kind::Page,
    Kind::Table,
    Kind::State,
    Kind::Json,
];
/// Start of other common files.
const OTHERS: [&[u8]; 7] = [b"PK\x03\x04", b"\x1F\x8B", b"ISO-10303-21", b"ply", b"solid ", b"<", b"%PDF"];

impl Kind {
    /// In words, after "is not a".
    pub fn name(self) -> &'static str {
        match self {
            Self::Pvs => ".pvs file",
            Self::Glb => "binary glTF",
            Self::Leaks => "file of leaks (OBJ)",
            Self::Points => "file of points",
            Self::Rows => "text of rows",
            Self::Bsp => ".bsp level",
            Self::Prt => "portal file",
            Self::Ground => ".ground file",
            Self::Tiff => "TIFF",
            Self::Png => "PNG picture",
            Self::Page => "page of a report",
            Self::Table => "table of a report",
            Self::State => "state of an interrupted run",
            Self::Json => "JSON file",
        }
    }

    /// Whether a file of this kind may replace the file at `path`: it is empty or of this kind, or it has an extension that only
    /// Enfilade uses and isn't recognised as another kind.
    pub fn may_replace(self, path: &Path) -> io::Result<bool> {
        let mut head = Vec::new();
        File::open(path)?.take(HEAD).read_to_end(&mut head)?;
        let ours = match self {
            Self::Pvs => Some("pvs"),
            Self::Ground => Some("ground"),
            _ => None,
        };
        let is_named = ours.is_some_and(|ours| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ours)));
        let is_other = || ALL.iter().any(|kind| kind.begins(&head)) || OTHERS.iter().any(|other| head.starts_with(other));
        Ok(head.is_empty() || self.begins(&head) || is_named && !is_other())
    }

    fn begins(self, head: &[u8]) -> bool {
        let starts = |magics: &[&[u8]]| magics.iter().any(|magic| head.starts_with(magic));
        // The last character may be cut off.
        let text = match std::str::from_utf8(head) {
            Ok(text) => text,
            Err(e) if e.error_len().is_none() => std::str::from_utf8(&head[..e.valid_up_to()]).unwrap_or_default(),
            Err(_) => "",
        };
        let line = text.lines().find(|line| !line.trim().is_empty() && !line.starts_with('#')).unwrap_or_default();
        let mut words = line.split_whitespace();
        match self {
            Self::Pvs => starts(&[&MAGIC]),
            Self::Glb => starts(&[b"glTF"]),
            Self::Bsp => enfilade_levels::bsp::is_level(head),
            Self::Prt => starts(&[b"PRT1", b"PRT2"]),
            Self::Ground => starts(&[b"\x89GRN\r\n\x1a\n"]),
            Self::Tiff => starts(&[b"II\x2a\0", b"MM\0\x2a", b"II\x2b\0", b"MM\0\x2b"]),
            Self::Png => starts(&[b"\x89PNG\r\n\x1a\n"]),
            // A killed run may have written less.
            Self::State => starts(&[b"EnfWork\n"]) || b"EnfWork\n".starts_with(head),
            Self::Leaks => line.starts_with("o leak_"),
            Self::Points => line.split_whitespace().count() == 3 && words.all(|word| word.parse::<f64>().is_ok()),
            Self::Rows => {
                let is_row = |row: &str, count: &str| {
                    row.parse::<u32>().is_ok() && count.strip_suffix(':').is_some_and(|count| count.parse::<u32>().is_ok())
                };
                matches!((words.next(), words.next()), (Some(row), Some(count)) if is_row(row, count))
            }
            Self::Page => text.contains("<meta name=\"generator\" content=\"enfilade "),
            Self::Table => TABLES.iter().any(|table| line.starts_with(table)),
            Self::Json => line.trim_start().starts_with(['{', '[']),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_from_all_others() {
        let samples: [(Kind, &[u8]); ALL.len()] = [
            (Kind::Pvs, &MAGIC),
            (Kind::Glb, b"glTF\x02\0\0\0"),
            (Kind::Leaks, b"o leak_0\nv 0 0 0\n"),
            (Kind::Points, b"1.5 -2 3e4\n1 2 3\n"),
            (Kind::Rows, b"0 3: 0 1 2\n"),
            (Kind::Bsp, b"VBSP\x14\0\0\0"),
            (Kind::Prt, b"PRT1\n4\n3\n"),
            (Kind::Ground, b"\x89GRN\r\n\x1a\n\x01"),
            (Kind::Tiff, b"II\x2a\0\x08"),
            (Kind::Png, b"\x89PNG\r\n\x1a\n\0"),
            (Kind::Page, b"<!DOCTYPE html>\n<meta name=\"generator\" content=\"enfilade 0.1.0\">"),
            (Kind::Table, b"view_cells,bytes,triangles\n"),
            (Kind::State, b"EnfWork\n\0\0"),
            (Kind::Json, b"{\"name\":\"path\"}"),
        ];
        assert_eq!(samples.map(|(kind, _)| kind), ALL);
        for kind in ALL {
            for (of, sample) in samples {
                assert_eq!(kind.begins(sample), kind == of, "{of:?} as {kind:?}");
            }
            for strange in [
                &b"my own text"[..],
                b"# a model\nv 0 0 0\n",
                b"newmtl a\n",
                b"a,b\n1,2\n",
                b"\xff\xfe\0",
                b"1 2\n",
                b"\0\0",
            ] {
                assert!(!kind.begins(strange), "{strange:?} as {kind:?}");
            }
        }
    }
}
