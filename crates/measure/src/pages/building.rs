//! The report of a building as a page and as tables: four numbers, plans, the most expensive rooms and doors. Bounds and error
//! against run time are folded away.
//!
//! This module escapes all text; callers pass plain text. Times appear in three sections only: error against run time, tubes and
//! stages. All else has the same bytes for the same building and seed.

mod against_time;
mod certainty;

use super::curves::Curve;
use super::dearest;
use super::html::{Remark, escape, folded, number, page, share, thousands};
use super::matrix::figure;
use super::plans::Plans;
use super::splits::Splits;
use super::storeys::{Storey, along_a_walk, is_named, on, storeys};
use super::tubes::TubesFound;
use super::undecided::{Pairs, of_cell};
use enfilade::file::{PvsFile, PvsSummary};
use enfilade::scene::Scene;
use enfilade::types::expected::ExpectedDraw;
use enfilade::types::portal::{PortalCost, PortalKind};
use enfilade::{BitMatrix, CellId};
use serde::Serialize;
use std::fmt::Write;

/// Cells in each list of the least certain.
const WORST: usize = 10;
/// Notes shown; further ones are folded away.
const NOTES: usize = 12;
/// Storeys drawn; the report only counts further ones.
const MOST_PLANS: usize = 24;
/// Time and memory of a stage.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Stage {
    /// Its name.
    #[serde(rename = "stage")]
    pub name: String,
    /// Wall clock.
    pub seconds: f64,
    /// Peak memory until it ended, MiB, if the system reports it.
    pub peak_rss_mb: Option<f64>,
}

/// All data of the page.
#[derive(Clone, Copy, Debug)]
pub struct BuildingReport<'a> {
    /// The name of the model's file.
    pub building: &'a str,
    /// The command that makes this page again.
    pub command: &'a str,
    /// Seed of every random choice.
    pub seed: u64,
    /// The model.
    pub scene: &'a Scene,
    /// The bake, both bounds kept.
    pub file: &'a PvsFile,
    /// Its rows in numbers.
    pub pvs: &'a PvsSummary,
    /// Expected savings of culling; `None` without objects.
    pub expected: Option<ExpectedDraw>,
    /// Error against run time, one curve a strategy.
    pub curves: &'a [Curve],
    /// Errors of drawn tubes, if there are tubes.
    pub tubes: Option<&'a TubesFound>,
    /// How view cells were split, if they were chosen by cost.
    pub splits: Option<&'a Splits>,
    /// Number of views drawn for the test.
    pub views: usize,
    /// Pixels of these views whose object is not in the file's rows.
    pub missed_pixels: u64,
    /// Costs of portals, highest first.
    pub portal_costs: &'a [PortalCost],
    /// Undecided pairs and the reasons.
    pub hardest: &'a [Remark],
    /// In starting order.
    pub stages: &'a [Stage],
    /// Threads.
    pub threads: usize,
}

impl BuildingReport<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let storeys = storeys(self.file);
        let mut body = String::new();
        self.head(&mut body);
        self.plans(&storeys, &mut body);
        body.push_str(&dearest::html(self.file, &storeys, self.portal_costs));
        if !self.file.notes.is_empty() {
            body.push_str("<h2>Notes</h2>\n");
            list(&self.file.notes, &mut body);
        }
        body.extend(self.splits.map(Splits::html));
        body.extend(self.tubes.map(TubesFound::html));
        let mut fold = |title: &str, part: &dyn Fn(&mut String)| {
            let mut text = String::new();
            part(&mut text);
            body.push_str(&if text.is_empty() { text } else { folded(title, &text) });
        };
        fold("How sure the rows are", &|out| self.certified(out));
        fold("Error against run time", &|out| self.against_time(out));
        fold("Visibility matrix", &|out| self.matrix(&storeys, out));
        fold("The least certain rooms", &|out| self.worst(&storeys, out));
        fold("The hardest pairs", &|out| self.pairs(out));
        fold("Left out", &|out| list(&self.file.left_out, out));
        fold("Repairs", &|out| list(&self.repairs(), out));
        fold("Time and memory", &|out| self.stages(out));
        fold("How to reproduce", &|out| self.end(out));
        page(&format!("Visibility of {}", self.building), &body)
    }

    /// The curves as a table: a line a point.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "strategy,cpu_seconds,rays,lower_pairs,upper_pairs,false_pixels_mean,false_pixels_p95,false_pixels_max\n",
        );
        for (curve, p) in self.curves.iter().flat_map(|c| c.points.iter().map(move |p| (c, p))) {
            let upper = p.upper_pairs.map_or(String::new(), |u| u.to_string());
            let [mean, p95, max] = p.false_pixels;
            let _ = writeln!(
                out,
                "{},{:.3},{},{},{upper},{mean},{p95},{max}",
                curve.strategy, p.cpu_seconds, p.rays, p.lower_pairs
            );
        }
        out
    }

    /// The table of cells, one line a cell. `storey` counts from 0, the lowest; open cells have none.
    pub fn cells_csv(&self) -> String {
        let mut out = String::from("cell,name,open,storey,portals,lower_pairs,upper_pairs,undecided_pairs\n");
        let storeys = storeys(self.file);
        for (c, cell) in self.file.cells.iter().enumerate() {
            let id = CellId(c as u32);
            let storey = on(&storeys, id).map_or(String::new(), |s| s.to_string());
            let Pairs { lower, upper, .. } = of_cell(self.file, id);
            let portals = self.portals_of(id);
            // A quoted field of one line, as in RFC 4180.
            let name = cell.name.replace('"', "\"\"").split_whitespace().collect::<Vec<_>>().join(" ");
            let _ =
                writeln!(out, "{c},\"{name}\",{},{storey},{portals},{lower},{upper},{}", u8::from(cell.open), upper - lower);
        }
        out
    }

    fn portals_of(&self, cell: CellId) -> usize {
        self.file.portals.iter().filter(|p| p.cells.contains(&cell)).count()
    }

    fn count(&self, kind: PortalKind) -> usize {
        self.file.portals.iter().filter(|p| p.kind == kind).count()
    }

    fn head(&self, out: &mut String) {
        let file = self.file;
        let open = file.cells.iter().filter(|c| c.open).count();
        let _ = writeln!(
            out,
            "<h1>Visibility of {}</h1>\n<p class=\"soft\">{}, {} triangles in {} objects; {} cells ({open} open), {} portals, by {}: {}.</p>",
            escape(self.building),
            escape(&self.scene.source.format),
            number(self.scene.triangles.len() as u64),
            number(file.objects.len() as u64),
            number(file.cells.len() as u64),
            number(file.portals.len() as u64),
            strategy(file),
            escape(&file.reason),
        );
        let mut tiles: Vec<Tile> = Vec::new();
        let mut tile = |name, value, note| tiles.push((name, value, note));
        tile("Rooms", thousands((file.cells.len() - open) as u64), "closed cells".to_owned());
        let [doors, windows, openings] =
            [PortalKind::Door, PortalKind::Window, PortalKind::Opening].map(|kind| self.count(kind) as u64);
        let others = format!("portals in doors; {} in windows, {} in openings", thousands(windows), thousands(openings));
        tile("Doors", thousands(doors), others);
        let (drawn, of) = match &self.expected {
            Some(expected) => {
                (format!("{:.0} %", 100.0 * expected.both), "of the triangles in the frustum, on a walk through every cell")
            }
            None => ("none".to_owned(), "there is nothing to draw"),
        };
        tile("Drawn", drawn, of.to_owned());
        let (missed, of) = match self.views {
            0 => ("not counted".to_owned(), "there are no views".to_owned()),
            views => {
                let views = thousands(views as u64);
                let of = format!(
                    "in {views} views of 96 &times; 54 pixels, compared with pictures of the whole model; includes pixels seen through cracks"
                );
                (thousands(self.missed_pixels), of)
            }
        };
        tile("Pixels missed", missed, of);
        out.push_str(&cards(&tiles));
    }

    fn plans(&self, storeys: &[Storey], out: &mut String) {
        if storeys.is_empty() {
            return;
        }
        out.push_str("<h2>Plans</h2>\n<p class=\"soft\">Small numbers are portal numbers.</p>\n<ul class=\"legend\">");
        for (class, name) in [("door", "door"), ("window", "window"), ("opening", "opening")] {
            let _ = write!(
                out,
                "<li><svg viewBox=\"0 0 32 12\" aria-hidden=\"true\"><path class=\"portal {class}\" d=\"M1 6H31\"/></svg>{name}</li>"
            );
        }
        out.push_str(
            "<li><svg viewBox=\"0 0 32 12\" aria-hidden=\"true\"><path class=\"portal opening lying\" d=\"M1 6H31\"/></svg>to another \
             storey</li><li><svg viewBox=\"0 0 32 12\" aria-hidden=\"true\"><path class=\"wall\" d=\"M1 6H31\"/></svg>the \
             model's section</li></ul>\n",
        );
        let plans = Plans::new(self.file, self.scene, storeys).with_numbers();
        let note = |cell: CellId| {
            let name = &self.file.cells[cell.index()].name;
            let named = if is_named(name, cell) { format!(" ({name})") } else { String::new() };
            let p = of_cell(self.file, cell);
            format!(
                "cell {cell}{named}: {} portals; {} objects witnessed, {} undecided, {} proven hidden",
                self.portals_of(cell),
                p.lower,
                p.undecided(),
                p.total - p.upper
            )
        };
        for (k, storey) in storeys.iter().enumerate().take(MOST_PLANS) {
            let count = storey.cells.len();
            let title = format!("Storey {k}");
            let _ = writeln!(
                out,
                "<figure>\n<figcaption><strong>{title}</strong>, floor at {:.2} m, cut {:.2} m above it, {count} {}</figcaption>\n<div class=\"scroll\">{}</div>\n\
                 </figure>",
                storey.floor + self.file.origin.y,
                storey.cut,
                if count == 1 { "cell" } else { "cells" },
                plans.svg(storey, &title, &note)
            );
        }
        if storeys.len() > MOST_PLANS {
            let _ = writeln!(out, "<p>{} more storeys are in the table of cells.</p>", storeys.len() - MOST_PLANS);
        }
    }

    fn matrix(&self, storeys: &[Storey], out: &mut String) {
        let Some(bounds) = &self.file.bounds else { return };
        let order = along_a_walk(self.file, storeys);
        let sorted = |m: &BitMatrix| {
            let mut sorted = BitMatrix::new(m.rows(), m.columns());
            for (r, a) in order.iter().enumerate() {
                for (c, b) in order.iter().enumerate() {
                    if m.get(a.index(), b.index()) {
                        sorted.set(r, c);
                    }
                }
            }
            sorted
        };
        let order = "cells: first open ones, then by storey from the lowest, each along a walk through its portals";
        out.push_str(&figure(&sorted(&bounds.cells_lower), &sorted(&bounds.cells_upper), order));
    }

    fn worst(&self, storeys: &[Storey], out: &mut String) {
        let mut cells: Vec<(CellId, Pairs)> =
            (0..self.file.cells.len() as u32).map(CellId).map(|c| (c, of_cell(self.file, c))).collect();
        let mut table = |caption: &str, by: fn(&Pairs) -> u64| {
            cells.sort_by_key(|(c, p)| (std::cmp::Reverse(by(p)), *c));
            let _ = writeln!(
                out,
                "<div class=\"scroll\"><table><caption>{caption}</caption><thead><tr><th>cell</th><th class=\"text\">name</th><th>storey</th>\
                 <th>portals</th><th>witnessed</th><th>not proven hidden</th><th>undecided</th><th>gap</th></tr></thead>\n<tbody>"
            );
            for (c, p) in cells.iter().filter(|(_, p)| by(p) > 0).take(WORST) {
                let cell = &self.file.cells[c.index()];
                let storey =
                    on(storeys, *c).map_or(if cell.open { "open".to_owned() } else { String::new() }, |s| s.to_string());
                let _ = writeln!(
                    out,
                    "<tr><td>{c}</td><td class=\"text\">{}</td><td>{storey}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                    if is_named(&cell.name, *c) { escape(&cell.name) } else { String::new() },
                    self.portals_of(*c),
                    thousands(p.lower),
                    thousands(p.upper),
                    thousands(p.undecided()),
                    share(p.gap())
                );
            }
            out.push_str("</tbody></table></div>\n");
        };
        table("Most pairs undecided", Pairs::undecided);
        table("Most pairs not proven hidden (least culled)", |p| p.upper);
    }

    fn pairs(&self, out: &mut String) {
        if self.hardest.is_empty() {
            out.push_str("<p>None: each pair has a witness, or is proven hidden.</p>\n");
            return;
        }
        out.push_str(
            "<p>The largest undecided objects of the cells with most undecided pairs, with the text of <code>enfilade why</code>.</p>\n\
             <div class=\"scroll\"><table><thead><tr><th>cell, object</th><th class=\"text\">why</th></tr></thead>\n<tbody>\n",
        );
        for remark in self.hardest {
            let _ =
                writeln!(out, "<tr><td>{}</td><td class=\"text\">{}</td></tr>", escape(&remark.about), escape(&remark.text));
        }
        out.push_str("</tbody></table></div>\n");
    }

    fn repairs(&self) -> Vec<String> {
        let repairs = self.file.repairs.iter().map(|r| {
            let ([a, b], at) = (r.cells, r.at + self.file.origin);
            format!("a hole between cells {a} and {b} at ({:.2}, {:.2}, {:.2}) m, mended with a portal", at.x, at.y, at.z)
        });
        repairs.collect()
    }

    fn stages(&self, out: &mut String) {
        out.push_str(
            "<div class=\"scroll\"><table><thead><tr><th>stage</th><th>seconds</th><th>peak memory by then, MiB</th>\
             </tr></thead>\n<tbody>\n",
        );
        for s in self.stages {
            let memory = s.peak_rss_mb.map_or(String::new(), |mb| format!("{mb:.0}"));
            let _ = writeln!(out, "<tr><td>{}</td><td>{:.2}</td><td>{memory}</td></tr>", escape(&s.name), s.seconds);
        }
        let threads = if self.threads == 1 { "1 thread".to_owned() } else { format!("{} threads", self.threads) };
        let _ = writeln!(out, "</tbody></table></div>\n<p class=\"soft\">Wall clock, {threads}.</p>");
    }

    fn end(&self, out: &mut String) {
        let _ = writeln!(
            out,
            "<p><code>{}</code></p>\n<p class=\"soft\">Everything but times and memory is the same on every run and for every \
             number of threads.</p>",
            escape(self.command)
        );
    }
}

/// A number with its name and a note.
type Tile = (&'static str, String, String);

/// Numbers side by side.
fn cards(tiles: &[Tile]) -> String {
    let card = |(name, value, note): &Tile| format!("<div>{name}<b>{value}</b><span class=\"soft\">{note}</span></div>");
    format!("<div class=\"tiles wide\">{}</div>\n", tiles.iter().map(card).collect::<String>())
}

/// A list; only the first lines are not folded away.
fn list(lines: &[String], out: &mut String) {
    let items = |lines: &[String]| lines.iter().map(|l| format!("<li>{}</li>\n", escape(l))).collect::<String>();
    let (shown, more) = lines.split_at(lines.len().min(NOTES));
    if !shown.is_empty() {
        let _ = writeln!(out, "<ul>\n{}</ul>", items(shown));
    }
    if !more.is_empty() {
        let _ = writeln!(out, "<details><summary>and {} more</summary><ul>\n{}</ul></details>", more.len(), items(more));
    }
}

fn strategy(file: &PvsFile) -> String {
    format!("{:?}", file.strategy).to_lowercase()
}
