//! How sure the rows are: numbers, and the pairs that are undecided.

use super::{BuildingReport, Tile, cards};
use crate::pages::html::{number, percent, share, thousands};
use crate::pages::undecided::{Pairs, closed_and_open, kinds};
use enfilade::file::CONFIDENCE;
use std::fmt::Write;

impl BuildingReport<'_> {
    /// The certified gap, the confidence bound and the size of rows.
    fn sure_tiles(&self) -> Vec<Tile> {
        let mut tiles: Vec<Tile> = Vec::new();
        let mut tile = |name, value, note| tiles.push((name, value, note));
        let [closed, opened] = closed_and_open(self.file);
        let all = closed.with(opened);
        tile(
            "Certified gap, closed cells",
            share(closed.gap()),
            format!(
                "{} of {} pairs not proven hidden are undecided",
                thousands(closed.undecided()),
                thousands(closed.upper)
            ),
        );
        if opened.cells > 0 {
            let note = format!(
                "{} of {} pairs not proven hidden are undecided",
                thousands(opened.undecided()),
                thousands(opened.upper)
            );
            tile("Certified gap, open cells", share(opened.gap()), note);
        }
        tile(
            "Proven hidden",
            percent(all.total - all.upper, all.total),
            format!("of {} cell-object pairs", number(all.total)),
        );
        if let Some(unseen) = &self.file.unseen {
            let worst = unseen.cells.iter().zip(&self.file.cells).filter(|(_, cell)| !cell.open).map(|(&bound, _)| bound);
            tile(
                "Unseen, at most",
                share(unseen.mean),
                format!(
                    "mean solid angle without a witness, as part of the sphere; {} in the worst closed cell; each with {} confidence",
                    share(f64::from(worst.reduce(f32::max).unwrap_or_default())),
                    share(CONFIDENCE)
                ),
            );
        }
        tile(
            "Bits a pair",
            format!("{:.3}", self.pvs.bits_per_pair),
            format!("in the file's rows; zero-order entropy {:.3}", self.pvs.entropy_bits_per_pair),
        );
        tiles
    }

    pub(super) fn certified(&self, out: &mut String) {
        let (file, promise) = (self.file, self.file.guarantee.in_words());
        let _ = writeln!(
            out,
            "<p>Rows are {promise}. The clearance from all surfaces is {:.3} mm; openings narrower than {:.3} mm may be sealed. Seed {}.</p>",
            1e3 * file.clearance(),
            1e3 * file.smallest_hole,
            self.seed,
        );
        out.push_str(&cards(&self.sure_tiles()));
        out.push_str(
            "<p>A pair of a cell and an object is <em>witnessed</em> if an unobstructed segment between them is kept as proof. \
             It is <em>hidden</em> if portals or triangles provably block every segment. All other pairs are undecided: they are the \
             certified error.</p>\n<div class=\"scroll\"><table><thead><tr><th></th><th>cells</th><th>pairs</th>\
             <th>witnessed</th><th>not proven hidden</th><th>undecided</th><th>gap</th></tr></thead>\n<tbody>\n",
        );
        self.pairs_table(out);
        self.open_questions(out);
    }

    /// Pairs by kind of cell.
    fn pairs_table(&self, out: &mut String) {
        let [closed, open] = closed_and_open(self.file);
        let mut row = |name: &str, p: Pairs| {
            let _ = writeln!(
                out,
                "<tr><td>{name}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                thousands(p.cells),
                number(p.total),
                number(p.lower),
                number(p.upper),
                number(p.undecided()),
                share(p.gap())
            );
        };
        row("closed cells, objects", closed);
        if open.cells > 0 {
            row("open cells, objects", open);
            row("all cells, objects", closed.with(open));
        }
        let cells = self.file.cells.len() as u64;
        let counts = &self.file.pairs;
        row("all cells, cells", Pairs { cells, total: cells * cells, lower: counts.cell_lower, upper: counts.cell_upper });
        out.push_str("</tbody></table></div>\n");
    }

    /// Undecided pairs, and whatever else the bake was not sure of.
    fn open_questions(&self, out: &mut String) {
        let [closed, open] = closed_and_open(self.file);
        if closed.with(open).undecided() > 0 {
            out.push_str("<p>Undecided pairs:</p>\n<ul>\n");
            for (what, pairs) in kinds(self.file).into_iter().filter(|k| k.1 > 0) {
                let _ = writeln!(out, "<li>{} {what}</li>", thousands(pairs));
            }
            out.push_str("</ul>\n");
        }
        let stats = &self.file.stats;
        for (count, what) in [
            (stats.flow_over_budget, "searches ran out of steps; their undecided objects stay in the rows"),
            (stats.kept_unproven, "pairs were hit only by rays within the clearance of a surface, and count as visible"),
            (
                stats.left_out_unproven,
                "pairs were hit only by rays within the clearance of a surface; the rows omit them, since they would cost 1 % or more",
            ),
            (
                stats.contradictions,
                "pairs hidden by portal flow were proven visible, and are kept: please report this fault",
            ),
        ] {
            if count > 0 {
                let _ = writeln!(out, "<p>{} {what}.</p>", thousands(count));
            }
        }
    }
}
