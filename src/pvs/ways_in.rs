//! Rows of portals that lead in from outside, for modules that are joined at run time: what each shows of what is behind it, from anywhere
//! before it, by flow, within the row of the outside.

use super::beyond::{Beyond, Source};
use super::{Pvs, PvsOptions};
use crate::cells::Portal;
use crate::file::FileWaysIn;
use crate::job::{Job, Stopped};
use crate::scene::Scene;
use crate::{BitMatrix, CellId, DirectedPortal};

/// The rows of some directed portals, ascending.
///
/// # Errors
///
/// If it was stopped.
pub(crate) fn rows(
    scene: &Scene,
    pvs: &Pvs,
    portals: Vec<DirectedPortal>,
    options: &PvsOptions,
    work: &Job<'_>,
) -> Result<FileWaysIn, Stopped> {
    let (graph, beyond) = (&pvs.graph, Beyond::new(scene, pvs, options));
    let none = vec![0; scene.objects.len().div_ceil(64)];
    let mut cells = BitMatrix::new(portals.len(), graph.cells.len());
    let mut objects = BitMatrix::new(portals.len(), scene.objects.len());
    for (row, &way_in) in portals.iter().enumerate() {
        work.tell("ways in", row as f64 / portals.len() as f64);
        let portal = graph.portals[way_in.portal().index()].clone();
        let inwards = if way_in.side() == 0 { portal } else { portal.turned() };
        let way = Portal { cells: [CellId(graph.cells.len() as u32), graph.target(way_in)], ..inwards };
        let source = Source { ways: &[way], touching: &none, known: &none, without: Some(way_in.portal()) };
        let seen = beyond.see(&source, work)?;
        let before = graph.source(way_in).index();
        let and = |out: &mut [u64], seen: &[u64], all: &[u64]| {
            out.iter_mut().zip(seen.iter().zip(all)).for_each(|(out, (seen, all))| *out = seen & all);
        };
        and(cells.row_mut(row), &seen.cells, pvs.cells_upper.row(before));
        and(objects.row_mut(row), &seen.objects, pvs.objects_upper.row(before));
    }
    Ok(FileWaysIn { portals, cells, objects })
}
