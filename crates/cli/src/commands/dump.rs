//! `enfilade dump`.

use super::files::Files;
use super::{CliError, Outcome};
use enfilade::BitMatrix;
use enfilade::file::{FileCell, FileObject, FilePortal, FileViewCell, PvsFile};
use glam::{DVec3, Vec3, Vec4};
use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::json;
use std::io::{self, BufWriter, Write};
use std::path::PathBuf;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The .pvs file.
    file: PathBuf,
    /// Only these rows.
    #[arg(long, value_enum)]
    rows: Option<Rows>,
    /// JSON on stdout, keys as in docs/cli.md.
    #[arg(long)]
    json: bool,
}

/// Which rows.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Rows {
    /// Cells seen from each cell.
    Cells,
    /// Objects seen from each cell.
    Objects,
    /// Objects seen from each view cell.
    ViewCells,
}

impl Args {
    /// Input files.
    pub fn files(&self) -> Files {
        Files::new().reads(&self.file, &["pvs"])
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let file = PvsFile::load(&args.file)?;
    let mut out = BufWriter::new(io::stdout().lock());
    let written = if args.json { json(&file, args.rows, &mut out) } else { text(&file, args.rows, &mut out) };
    match written.and_then(|()| out.flush()) {
        // The reader has closed the pipe.
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(CliError(format!("stdout: {e}"))),
        _ => Ok(Outcome::Done),
    }
}

/// A half-space in the model's own coordinates, in `f64` without rounding.
fn plane(origin: DVec3, plane: &Vec4) -> [f64; 4] {
    let n = plane.truncate().as_dvec3();
    [n.x, n.y, n.z, f64::from(plane.w) + n.dot(origin)]
}

/// Corners in the model's own coordinates.
fn corners(origin: DVec3, winding: &[Vec3]) -> Vec<[f64; 3]> {
    winding.iter().map(|p| (p.as_dvec3() + origin).to_array()).collect()
}

fn text(file: &PvsFile, rows: Option<Rows>, out: &mut impl Write) -> io::Result<()> {
    if rows.is_none() {
        for (i, c) in file.cells.iter().enumerate() {
            let open = if c.open { ", open" } else { "" };
            writeln!(out, "cell {i} {:?}: {} pieces{open}", c.name, c.pieces.len())?;
        }
        for (i, (p, key)) in file.portals.iter().zip(file.portal_keys()).enumerate() {
            let corners = p.winding.len();
            writeln!(out, "portal {i} {key:?}: {} - {}, {corners} corners, {:?}", p.cells[0], p.cells[1], p.kind)?;
        }
        for (i, o) in file.objects.iter().enumerate() {
            writeln!(out, "object {i} {:?}: {} triangles", o.node, o.triangles)?;
        }
        for (i, v) in file.views.cells.iter().enumerate() {
            writeln!(out, "view cell {i} {}: {} pieces", v.id, v.pieces.len())?;
        }
    }
    for (which, what) in [(Rows::Cells, "cells"), (Rows::Objects, "objects"), (Rows::ViewCells, "view cells")] {
        if rows.is_some_and(|only| only != which)
            || (rows.is_none() && which == Rows::ViewCells && file.views.cells.is_empty())
        {
            continue;
        }
        if rows.is_none() {
            writeln!(out, "rows of {what}")?;
        }
        let matrix = Matrix::shipped(file, which);
        for row in 0..matrix.rows {
            write!(out, "{row} {}:", matrix.ids(row).count())?;
            for id in matrix.ids(row) {
                write!(out, " {id}")?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

/// A matrix; `None` stands for one with every bit set.
#[derive(Clone, Copy)]
struct Matrix<'f> {
    matrix: Option<&'f BitMatrix>,
    rows: usize,
    columns: usize,
}

impl<'f> Matrix<'f> {
    fn shipped(file: &'f PvsFile, which: Rows) -> Self {
        let (matrix, rows, columns) = match which {
            Rows::Cells => (file.cell_rows.as_ref(), file.cells.len(), file.cells.len()),
            Rows::Objects => (file.object_rows.as_ref(), file.cells.len(), file.objects.len()),
            Rows::ViewCells => (file.views.rows.as_ref(), file.views.cells.len(), file.objects.len()),
        };
        Self { matrix, rows, columns }
    }

    fn of(matrix: &'f BitMatrix) -> Self {
        Self { matrix: Some(matrix), rows: matrix.rows(), columns: matrix.columns() }
    }

    /// Ascending ids in a row.
    fn ids(self, row: usize) -> impl Iterator<Item = usize> + 'f {
        let all = if self.matrix.is_none() { 0..self.columns } else { 0..0 };
        self.matrix.into_iter().flat_map(move |m| m.ones(row)).chain(all)
    }
}

/// Lists of ids, written one by one: the text of a large file is never in memory.
impl Serialize for Matrix<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq((0..self.rows).map(|row| Ids(*self, row)))
    }
}

struct Ids<'f>(Matrix<'f>, usize);

impl Serialize for Ids<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(self.0.ids(self.1))
    }
}

/// `cells`, `objects` and, if present, `view_cells`, or only one of them.
struct Sides<'f> {
    cells: Option<Matrix<'f>>,
    objects: Option<Matrix<'f>>,
    view_cells: Option<Matrix<'f>>,
    only: Option<Rows>,
}

impl Serialize for Sides<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        let mut map = s.serialize_map(None)?;
        let all = [
            (Rows::Cells, "cells", self.cells),
            (Rows::Objects, "objects", self.objects),
            (Rows::ViewCells, "view_cells", self.view_cells),
        ];
        for (which, key, matrix) in all {
            if let Some(matrix) = matrix.filter(|_| self.only.is_none_or(|only| only == which)) {
                map.serialize_entry(key, &matrix)?;
            }
        }
        map.end()
    }
}

/// A list whose elements are converted to JSON one at a time.
struct Each<'f, T, F>(&'f [T], F);

impl<T, F: Fn(usize, &T) -> serde_json::Value> Serialize for Each<'_, T, F> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(self.0.iter().enumerate().map(|(i, x)| (self.1)(i, x)))
    }
}

/// The JSON document.
struct Document<'f> {
    file: &'f PvsFile,
    only: Option<Rows>,
}

impl Serialize for Document<'_> {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        let Self { file, only } = *self;
        let origin = file.origin;
        let piece = |planes: &Vec<Vec4>| json!({ "planes": planes.iter().map(|p| plane(origin, p)).collect::<Vec<_>>() });
        let pieces = |pieces: &[Vec<Vec4>]| pieces.iter().map(piece).collect::<Vec<_>>();
        let cell = |i: usize, c: &FileCell| json!({ "id": i, "open": c.open, "name": c.name, "source": c.source, "pieces": pieces(&c.pieces) });
        let view_cell = |_: usize, v: &FileViewCell| json!({ "id": v.id, "pieces": pieces(&v.pieces) });
        let keys = file.portal_keys();
        let portal = |i: usize, p: &FilePortal| {
            let winding = corners(origin, &p.winding);
            json!({ "id": i, "key": keys[i], "cells": p.cells, "plane": plane(origin, &p.plane), "winding": winding, "kind": p.kind, "state": p.state, "source": p.source })
        };
        let object = |i: usize, o: &FileObject| json!({ "id": i, "node": o.node, "triangles": o.triangles });
        let has_views = !file.views.cells.is_empty();
        let shipped = |which| Some(Matrix::shipped(file, which));
        let (cells, objects, view_cells) =
            (shipped(Rows::Cells), shipped(Rows::Objects), shipped(Rows::ViewCells).filter(|_| has_views));

        let mut map = s.serialize_map(None)?;
        map.serialize_entry("cells", &Each(&file.cells, cell))?;
        map.serialize_entry("portals", &Each(&file.portals, portal))?;
        map.serialize_entry("strategy", &file.strategy)?;
        map.serialize_entry("smallest_hole", &file.smallest_hole)?;
        if !file.closed_holes.is_empty() {
            let hole = |_: usize, hole: &Vec<Vec3>| json!(corners(origin, hole));
            map.serialize_entry("closed_holes", &Each(&file.closed_holes, hole))?;
        }
        map.serialize_entry("objects", &Each(&file.objects, object))?;
        if has_views {
            map.serialize_entry("view_cells", &Each(&file.views.cells, view_cell))?;
        }
        map.serialize_entry("rows", &Sides { cells, objects, view_cells, only })?;
        let (bounds, views) = (file.bounds.as_ref(), file.views.bounds.as_ref());
        if bounds.is_some() || views.is_some() {
            let lower = Sides {
                cells: bounds.map(|b| Matrix::of(&b.cells_lower)),
                objects: bounds.map(|b| Matrix::of(&b.objects_lower)),
                view_cells: views.map(|b| Matrix::of(&b.lower)),
                only,
            };
            let upper = Sides {
                cells: bounds.map(|b| Matrix::of(&b.cells_upper)),
                objects: bounds.map(|b| Matrix::of(&b.objects_upper)),
                view_cells: views.map(|b| Matrix::of(&b.upper)),
                only,
            };
            map.serialize_entry("bounds", &LowerUpper { lower, upper })?;
        }
        if !file.repairs.is_empty() {
            let repair = |_: usize, r: &enfilade::pvs::Repair| json!({ "cells": r.cells, "at": (r.at + origin).to_array(), "segment": r.segment.map(|p| (p + origin).to_array()) });
            map.serialize_entry("repairs", &Each(&file.repairs, repair))?;
        }
        map.end()
    }
}

#[derive(serde::Serialize)]
struct LowerUpper<'f> {
    lower: Sides<'f>,
    upper: Sides<'f>,
}

fn json(file: &PvsFile, only: Option<Rows>, out: &mut impl Write) -> io::Result<()> {
    serde_json::to_writer(&mut *out, &Document { file, only })?;
    writeln!(out)
}
