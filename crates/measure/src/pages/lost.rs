//! The pairs that another tool's rows lack, as a page: which clusters, along which lines, and where to stand to see the hole.
//!
//! This module escapes all text; callers pass plain text.

use super::html::{counts_table, escape, number, page, thousands};
use std::fmt::Write;

/// Most lines of a table.
const MOST: usize = 1000;

/// A pair that the rows lack.
#[derive(Clone, PartialEq, Debug)]
pub struct LostPair {
    /// The cluster that sees, and the one that it sees.
    pub cells: [u32; 2],
    /// The points at the line's ends.
    pub ends: [String; 2],
    /// Numbers of the portals along the line.
    pub portals: String,
    /// The command that puts a player there.
    pub setpos: String,
    /// The line passes only if the last digits of the level's file are right.
    pub is_on_digits: bool,
}

/// All data of the page.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LostPage<'a> {
    /// The name of the level's file.
    pub level: &'a str,
    /// The name of the file with the other rows.
    pub rows: &'a str,
    /// Lines of the table: description and number of pairs.
    pub counts: &'a [(String, u64)],
    /// A cluster, its lost pairs, its pairs that are hidden; the worst first.
    pub clusters: &'a [[u64; 3]],
    /// The lost pairs, those of the worst cluster first.
    pub pairs: &'a [LostPair],
}

impl LostPage<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let [level, rows] = [self.level, self.rows].map(escape);
        let mut body = format!("<h1>What the rows of {rows} lack in {level}</h1>\n");
        counts_table(&mut body, self.counts);
        self.clusters(&mut body);
        self.pairs(&mut body);
        page(&format!("Lost pairs of {}", self.level), &body)
    }

    fn clusters(&self, out: &mut String) {
        out.push_str("<h2>By cluster</h2>\n");
        if self.clusters.is_empty() {
            out.push_str("<p>None has a fault in its row.</p>\n");
            return;
        }
        out.push_str(
            "<p>Players see a hole in the world where a pair is lost. A pair that is shown though hidden costs time in each \
             frame.</p>\n<div class=\"scroll\"><table><thead><tr><th>cluster</th><th>lost pairs</th><th>shown though hidden</th>\
             </tr></thead>\n<tbody>\n",
        );
        for [cluster, lost, hidden] in self.clusters.iter().take(MOST) {
            let _ = writeln!(out, "<tr><td>{cluster}</td><td>{}</td><td>{}</td></tr>", number(*lost), number(*hidden));
        }
        end_table(out, self.clusters.len());
    }

    fn pairs(&self, out: &mut String) {
        out.push_str("<h2>Lost pairs</h2>\n");
        if self.pairs.is_empty() {
            out.push_str("<p>None: each pair that a line proves visible is in the rows.</p>\n");
            return;
        }
        out.push_str(
            "<p>A straight line joins the two clusters through these portals. The command puts your eye at its beginning, and \
             you look along it; in games that place your feet instead, go down by the height of the eye. Fly (noclip).</p>\n\
             <div class=\"scroll\"><table><thead><tr><th>clusters</th><th>portals</th><th>from</th><th>to</th>\
             <th class=\"text\">stand and look</th><th class=\"text\">note</th></tr></thead>\n<tbody>\n",
        );
        for LostPair { cells: [a, b], ends: [from, to], portals, setpos, is_on_digits } in self.pairs.iter().take(MOST) {
            let [from, to, portals, setpos] = [from, to, portals, setpos].map(|text| escape(text));
            let note = if *is_on_digits { "only if the last digits of the file are right" } else { "" };
            let _ = writeln!(
                out,
                "<tr><td>{a} {b}</td><td>{portals}</td><td>{from}</td><td>{to}</td><td class=\"text\"><code>{setpos}</code></td>\
                 <td class=\"text\">{note}</td></tr>"
            );
        }
        end_table(out, self.pairs.len());
    }
}

fn end_table(out: &mut String, lines: usize) {
    out.push_str("</tbody></table></div>\n");
    if lines > MOST {
        let _ = writeln!(out, "<p>and {} more: --json has all</p>", thousands((lines - MOST) as u64));
    }
}
