//! The most expensive rooms and portals of a building, as a section of a page: where triangles can be saved.

use super::html::{escape, percent, thousands};
use super::storeys::{Storey, is_named, on};
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::types::portal::{PortalCost, PortalKind};
use std::cmp::Reverse;
use std::fmt::Write;

/// Rows of each table.
const DEAREST: usize = 10;

/// Triangles and objects in the row of a cell.
pub fn row_of(file: &PvsFile, cell: CellId) -> [u64; 2] {
    let rows = file.object_rows.as_ref();
    let kept = file.objects.iter().enumerate().filter(|(o, _)| rows.is_none_or(|rows| rows.get(cell.index(), *o)));
    kept.fold([0, 0], |[triangles, objects], (_, object)| [triangles + u64::from(object.triangles), objects + 1])
}

/// The section. `costs`: the most expensive portal first.
pub(super) fn html(file: &PvsFile, storeys: &[Storey], costs: &[PortalCost]) -> String {
    let mut out = String::from("<h2>The most expensive rooms and doors</h2>\n");
    rooms(file, storeys, &mut out);
    portals(file, costs, &mut out);
    out
}

/// A cell's number, with its name if it has one.
fn label(file: &PvsFile, cell: CellId) -> String {
    let name = &file.cells[cell.index()].name;
    if is_named(name, cell) { format!("{cell} {}", escape(name)) } else { cell.to_string() }
}

fn rooms(file: &PvsFile, storeys: &[Storey], out: &mut String) {
    let closed = (0..).map(CellId).zip(&file.cells).filter(|(_, cell)| !cell.open).map(|(id, _)| id);
    let mut rooms: Vec<(CellId, [u64; 2])> = closed.map(|id| (id, row_of(file, id))).collect();
    rooms.sort_by_key(|(id, [triangles, _])| (Reverse(*triangles), *id));
    if rooms.is_empty() {
        return;
    }
    let all = file.objects.iter().map(|o| u64::from(o.triangles)).sum();
    out.push_str(
        "<p>A room's row holds everything possibly visible from it. Check long rows first: a screen, a bend in a \
         passage or smaller objects make them shorter.</p>\n<div class=\"scroll\"><table><caption>Rooms with most triangles in their row</caption><thead><tr>\
         <th>room</th><th>storey</th><th>triangles</th><th>of the model</th><th>objects</th></tr></thead>\n<tbody>\n",
    );
    for (id, [triangles, objects]) in rooms.into_iter().take(DEAREST) {
        let _ = writeln!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            label(file, id),
            on(storeys, id).map_or(String::new(), |s| s.to_string()),
            thousands(triangles),
            percent(triangles, all),
            thousands(objects)
        );
    }
    out.push_str("</tbody></table></div>\n");
}

fn portals(file: &PvsFile, costs: &[PortalCost], out: &mut String) {
    if costs.is_empty() {
        return;
    }
    out.push_str(
        "<p>The cost of a portal is the mean number of triangles saved per frame by shutting it, on a walk through every cell. \
         The plan shows its number.</p>\n<div class=\"scroll\"><table><caption>Most expensive doors and other \
         portals</caption><thead><tr><th>portal</th><th class=\"text\">kind</th><th class=\"text\">between</th><th>triangles a frame</th></tr>\
         </thead>\n<tbody>\n",
    );
    for PortalCost { portal, triangles } in costs.iter().take(DEAREST) {
        let of = &file.portals[portal.index()];
        let kind = match of.kind {
            PortalKind::Door => "door",
            PortalKind::Window => "window",
            PortalKind::Opening => "opening",
        };
        let [a, b] = of.cells.map(|cell| label(file, cell));
        let triangles = thousands(triangles.round() as u64);
        let _ = writeln!(
            out,
            "<tr><td>{portal}</td><td class=\"text\">{kind}</td><td class=\"text\">{a} and {b}</td><td>{triangles}</td></tr>"
        );
    }
    out.push_str("</tbody></table></div>\n");
}
