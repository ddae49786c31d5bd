//! Rows as text: a line per cell, `c n: id id id ...`, with `c` among the ids, ids ascending.

use enfilade::BitMatrix;
use std::io::{self, Write};

/// The fault and its place.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("line {line}, {field}: {fault}")]
pub struct RowsError {
    /// Line of the file, from 1.
    pub line: usize,
    /// `cell`, `number of ids`, `id 7`, ...
    pub field: String,
    /// The fault.
    pub fault: RowsFault,
}

/// Faults of rows.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowsFault {
    /// Bytes that are not UTF-8.
    #[error("not text")]
    NotText,
    /// Too few or too many lines.
    #[error("{found} lines, but the level has {cells} cells; the rows belong to another level")]
    Lines {
        /// Lines in the file.
        found: usize,
        /// Cells of the level.
        cells: usize,
    },
    /// A missing `:` or number.
    #[error("missing")]
    Missing,
    /// Not a whole number.
    #[error("'{0}' is not a whole number")]
    NotANumber(String),
    /// Lines are in order, from 0.
    #[error("{found} instead of {due}")]
    Order {
        /// The number found.
        found: u32,
        /// The expected number.
        due: u32,
    },
    /// An id without a cell.
    #[error("{0} is not a cell")]
    NoSuchCell(u32),
    /// Ids ascend.
    #[error("{0} is not above the id before it")]
    NotAscending(u32),
    /// The number before the `:` is wrong.
    #[error("{promised} ids are announced, {found} follow")]
    Count {
        /// The number before the `:`.
        promised: u32,
        /// Ids after it.
        found: u32,
    },
    /// A cell always sees itself.
    #[error("cell {0} is not in its own row")]
    NotItself(u32),
}

/// Writes square rows.
///
/// # Errors
///
/// Errors of writing to `out`.
pub fn write_rows(rows: &BitMatrix, out: &mut dyn Write) -> io::Result<()> {
    (0..rows.rows()).try_for_each(|row| write_row(row, rows.count_row(row) as usize, rows.ones(row), out))
}

/// Writes square rows given as ascending lists of ids.
///
/// # Errors
///
/// Errors of writing to `out`.
pub fn write_lists(rows: &[Vec<u32>], out: &mut dyn Write) -> io::Result<()> {
    let ids = |row: &[u32]| row.iter().map(|&id| id as usize).collect::<Vec<_>>();
    rows.iter().enumerate().try_for_each(|(i, row)| write_row(i, row.len(), ids(row).into_iter(), out))
}

fn write_row(row: usize, count: usize, ids: impl Iterator<Item = usize>, out: &mut dyn Write) -> io::Result<()> {
    use std::fmt::Write;
    let mut line = String::new();
    let _ = write!(line, "{row} {count}:");
    for id in ids {
        let _ = write!(line, " {id}");
    }
    line.push('\n');
    out.write_all(line.as_bytes())
}

/// Reads the rows of a level with `cells` cells; blank lines at the end are allowed.
///
/// # Errors
///
/// The first fault, with its line and field. Memory is only allocated once the file has a line for every cell.
pub fn read_rows(bytes: &[u8], cells: usize) -> Result<BitMatrix, RowsError> {
    let at = |line: usize, field: &str, fault: RowsFault| RowsError { line, field: field.into(), fault };
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        at(line, "text", RowsFault::NotText)
    })?;
    let text = text.trim_end();
    let found = text.lines().count();
    if found != cells {
        return Err(at(found.min(cells) + 1, "cell", RowsFault::Lines { found, cells }));
    }
    let mut rows = BitMatrix::new(cells, cells);
    for (row, line) in text.lines().enumerate() {
        read_row(line, row, &mut rows).map_err(|(field, fault)| at(row + 1, &field, fault))?;
    }
    Ok(rows)
}

fn read_row(line: &str, row: usize, rows: &mut BitMatrix) -> Result<(), (String, RowsFault)> {
    let whole = |text: Option<&str>, field: &str| {
        let text = text.ok_or_else(|| (field.to_owned(), RowsFault::Missing))?;
        let not = || (field.to_owned(), RowsFault::NotANumber(text.chars().take(32).collect()));
        text.parse::<u32>().map_err(|_| not())
    };
    let (head, ids) = line.split_once(':').ok_or_else(|| ("':'".to_owned(), RowsFault::Missing))?;
    let mut head = head.split_ascii_whitespace();
    let cell = whole(head.next(), "cell")?;
    if cell as usize != row {
        return Err(("cell".into(), RowsFault::Order { found: cell, due: row as u32 }));
    }
    let promised = whole(head.next(), "number of ids")?;
    if let Some(more) = head.next() {
        return Err(("number of ids".into(), RowsFault::NotANumber(more.chars().take(32).collect())));
    }
    let (mut found, mut last) = (0, None);
    for id in ids.split_ascii_whitespace() {
        found += 1;
        let field = || format!("id {found}");
        let id = whole(Some(id), &field())?;
        if id as usize >= rows.columns() {
            return Err((field(), RowsFault::NoSuchCell(id)));
        }
        if last.is_some_and(|last| last >= id) {
            return Err((field(), RowsFault::NotAscending(id)));
        }
        last = Some(id);
        rows.set(row, id as usize);
    }
    if found != promised {
        return Err(("number of ids".into(), RowsFault::Count { promised, found }));
    }
    if !rows.get(row, row) {
        return Err(("ids".into(), RowsFault::NotItself(cell)));
    }
    Ok(())
}
