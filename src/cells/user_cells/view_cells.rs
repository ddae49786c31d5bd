//! View cells: regions with rows of their own besides the cells, such as camera volumes (`--view-cells`, docs/cli.md).
//!
//! They may cross cells and overlap each other, and do not affect portals.

use crate::cells::Piece;
use crate::cells::user_cells::cells_file::{GivenError, GivenPiece, Reader};
use crate::scene::Scene;
pub use crate::types::view_cell_name::ViewCellName;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;

/// A region for a camera.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ViewCell {
    /// The author's id, unique.
    pub id: ViewCellName,
    /// Bounded convex pieces, relative to the scene's origin; they may overlap.
    pub pieces: Vec<Piece>,
}

#[derive(Deserialize)]
struct GivenFile {
    cells: Vec<GivenView>,
}

#[derive(Deserialize)]
struct GivenView {
    id: ViewCellName,
    pieces: Option<Vec<GivenPiece>>,
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
}

/// Reads view cells in the model's own coordinates (metres, +Y up).
pub fn read_view_cells(json: &str, scene: &Scene) -> Result<Vec<ViewCell>, GivenError> {
    let file: GivenFile = serde_json::from_str(json)?;
    if file.cells.is_empty() {
        return Err(GivenError::at("cells".into(), "none; give one view cell at least"));
    }
    let (reader, mut ids) = (Reader::new(scene), HashSet::new());
    let mut read = |(i, cell): (usize, GivenView)| {
        let field = format!("cells[{i}]");
        let id = cell.id;
        if !ids.insert(id.clone()) {
            return Err(GivenError::at(format!("{field}.id"), format!("{id} is a duplicate; ids must be unique")));
        }
        let pieces = reader.pieces(field.clone(), cell.pieces, cell.min, cell.max)?;
        if let Some(k) = pieces.iter().position(|p| !(p.bounds.min.is_finite() && p.bounds.max.is_finite())) {
            let what = "is unbounded; close it with planes";
            return Err(GivenError::at(format!("{field}.pieces[{k}]"), what));
        }
        Ok(ViewCell { id, pieces })
    };
    file.cells.into_iter().enumerate().map(&mut read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};
    use glam::DVec3;

    /// One triangle near (1000, 0, 0).
    fn scene() -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let positions = [[995., 0., -5.], [1005., 0., -5.], [1005., 3., 5.]].map(DVec3::from_array).to_vec();
        let (node, role, triangles) = ("floor".into(), Role::Unknown, vec![[0, 1, 2]]);
        builder.add(Mesh { node, role, opaque: true, positions, triangles }).expect("a good mesh");
        builder.finish("test").expect("a triangle")
    }

    #[test]
    fn boxes_and_pieces_become_relative_to_the_origin() {
        let json = r#"{"cells": [{"id": 7, "min": [1000, 0, 0], "max": [1001, 1, 1]}, {"id": "cam", "name": "not asked for",
            "pieces": [{"planes": [[2, 0, 0, 2002], [-1, 0, 0, -1000], [0, 1, 0, 1], [0, -1, 0, 0], [0, 0, 1, 1], [0, 0, -1, 0]]},
                       {"min": [1000, 0, 0], "max": [1002, 1, 1]}]}]}"#;
        let scene = scene();
        let views = read_view_cells(json, &scene).unwrap();
        assert_eq!(
            views.iter().map(|v| (v.id.clone(), v.pieces.len())).collect::<Vec<_>>(),
            [(7.into(), 1), ("cam".into(), 2)]
        );
        for piece in [&views[0].pieces[0], &views[1].pieces[0]] {
            assert_eq!(piece.bounds.min, DVec3::new(1000., 0., 0.) - scene.origin);
            assert_eq!(piece.bounds.size(), DVec3::ONE);
        }
    }

    #[test]
    fn what_breaks_a_rule_is_refused_with_its_place() {
        let refuse = |json: &str, expected: &str| {
            let message = read_view_cells(json, &scene()).expect_err(expected).to_string();
            assert!(message.contains(expected) && !message.contains('\n'), "{message} / {expected}");
        };
        let cells = |cells: &str, expected: &str| refuse(&format!("{{\"cells\": [{cells}]}}"), expected);
        refuse("{", "line 1 column 1");
        refuse("{}", "missing field `cells`");
        cells("", "cells: none; give one view cell at least");
        cells(r#"{"id": "a"}"#, "cells[0]: give either planes, or min and max");
        cells(r#"{"id": -1, "min": [0, 0, 0], "max": [1, 1, 1]}"#, "line 1");
        cells(r#"{"id": "a", "min": [0, 0, 0], "max": [1, 1, 1], "pieces": []}"#, "cells[0]: both pieces and a box");
        cells(r#"{"id": "a", "pieces": []}"#, "cells[0].pieces: none; give one piece at least");
        cells(r#"{"id": "a", "min": [0, 0, 0], "max": [1, 0, 1]}"#, "cells[0]: no volume");
        cells(r#"{"id": "a", "min": [0, 0, 0], "max": [1e300, 1, 1]}"#, "cells[0].max: coordinates beyond 1e12 m");
        cells(r#"{"id": "a", "pieces": [{"planes": [[0, 0, 0, 1]]}]}"#, "cells[0].pieces[0].planes[0]: no plane");
        cells(r#"{"id": "a", "pieces": [{"planes": [[1, 0, 0, 1]]}]}"#, "cells[0].pieces[0]: is unbounded");
        let one = r#"{"id": "1", "min": [0, 0, 0], "max": [1, 1, 1]}"#;
        cells(&format!("{one}, {one}"), "cells[1].id: \"1\" is a duplicate");
        // A number and a name of the same digits are different ids.
        let both = format!("{{\"cells\": [{one}, {}]}}", one.replace("\"1\"", "1"));
        assert_eq!(read_view_cells(&both, &scene()).unwrap().len(), 2);
    }
}
