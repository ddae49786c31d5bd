//! Portal files (`.prt`) of level compilers: the portals between clusters, and the cluster of each leaf.
//!
//! Dialects of a text format, a record per line:
//!
//! ```text
//! PRT1      clusters, portals; then the portals. Every leaf is a cluster (Quake, Quake 2, Source).
//! PRT2      leaves, clusters, portals; the portals; then for each cluster its leaves, ended by -1.
//! PRT1-AM   clusters, portals, leaves; the portals; then for each leaf its cluster.
//! Quake 3   PRT1, clusters, portals, faces; the portals, with a field `hint` before the points; then faces:
//!           points cluster (x y z) ...
//! Half-Life clusters, portals, without a magic; for each cluster the number of its leaves, which follow one another; the
//!           portals. Its vis takes the numbers of leaves out.
//! portal    points a b (x y z) (x y z) ...      counter-clockwise seen from b
//! ```
//!
//! The reader is strict: it checks each count, index and number, allocates nothing for unchecked counts, and reports the first
//! fault with its line and field. No limit silently changes the data.

mod fault;

use crate::{FARTHEST, Level, LevelPortal, MOST_CLUSTERS};
use enfilade::math::geom::newell;
pub use fault::{PrtError, PrtFault};
use glam::DVec3;
use std::fmt;
use std::str::Lines;

/// Least ratio of a winding's area to its circumscribed square; below it the normal is rounding.
const ROUNDING: f64 = 1e-12;

/// Greatest distance of corners from their portal's plane, and outside of each other's edges, in the level's units. Tools that
/// round to three decimals stay below a tenth of it; compilers that write full doubles are at 1e-12. Larger: passing a portal
/// becomes ambiguous. Smaller: rounded files are refused.
pub const FLATNESS: f64 = 0.01;
/// Maximum corners of a portal.
pub const MOST_POINTS: usize = 1024;
/// Maximum leaves of a Half-Life level, whose nodes name them with 16 bits.
const MOST_LEAVES: u64 = 1 << 15;
/// Maximum clusters without portals; a level has a few of them, a false header any number.
pub const MOST_ISOLATED: u64 = 1024;

/// Grammar of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Dialect {
    /// `PRT1`: leaves are clusters (Quake's tools; those of Quake 2 call them clusters).
    Prt1,
    /// `PRT2`: leaves listed by cluster.
    Prt2,
    /// `PRT1-AM`: a cluster for each leaf.
    Prt1Am,
    /// `PRT1` with hints and faces: Quake 3.
    Quake3,
    /// Without a magic, with the number of each cluster's leaves: Half-Life.
    HalfLife,
    /// Likewise, without those numbers: Half-Life, after its vis.
    HalfLifeBare,
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Prt1 => "PRT1",
            Self::Prt2 => "PRT2",
            Self::Prt1Am => "PRT1-AM",
            Self::Quake3 => "PRT1 of Quake 3",
            Self::HalfLife => "Half-Life",
            Self::HalfLifeBare => "Half-Life without leaves",
        })
    }
}

/// A portal file.
#[derive(Clone, PartialEq, Debug)]
pub struct Prt {
    /// Its grammar.
    pub dialect: Dialect,
    /// Clusters and portals; a cluster is a cell.
    pub level: Level,
    /// The cluster that each leaf lies in. [`Dialect::HalfLifeBare`] has lost it: a leaf for each cluster.
    pub leaves: Vec<u32>,
}

/// Characters that editors add at the beginning or the end of a text.
const UNSEEN: [(char, &str); 3] = [('\u{feff}', "a byte-order mark"), ('\u{1a}', "Ctrl-Z"), ('\0', "a zero byte")];

/// Reads a portal file.
///
/// # Errors
///
/// The first fault, with its line and field.
pub fn read_prt(bytes: &[u8]) -> Result<Prt, PrtError> {
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        PrtError { line, field: "text".into(), fault: PrtFault::NotText }
    })?;
    for (character, name) in UNSEEN {
        if let Some(at) = text.find(character) {
            let line = 1 + text[..at].bytes().filter(|&b| b == b'\n').count();
            return Err(PrtError { line, field: "text".into(), fault: PrtFault::Unseen { character, name } });
        }
    }
    let mut reader = Reader { lines: text.lines(), line: 0, decimals: 0 };

    // 1. The grammar and the counts of the header.
    let head = reader.head()?;
    let Head { dialect, clusters, clusters_line, .. } = head;

    // 2. Portals and the clusters that they name.
    let mut portals = Vec::new();
    for _ in 0..head.portals {
        portals.push(reader.portal(clusters, dialect == Dialect::Quake3)?);
    }
    let mut named: Vec<u32> = portals.iter().flat_map(|p: &LevelPortal| p.cells).collect();
    named.sort_unstable();
    named.dedup();
    let named = named.len() as u64;
    if clusters > named + MOST_ISOLATED {
        let fault = PrtFault::Isolated { clusters, named };
        return Err(PrtError { line: clusters_line, field: "clusters".into(), fault });
    }

    // 3. The cluster of each leaf, and the faces, which are not needed.
    let leaves = match dialect {
        Dialect::Prt1 | Dialect::Quake3 | Dialect::HalfLifeBare => (0..clusters as u32).collect(),
        Dialect::Prt2 => reader.leaves_by_cluster(clusters, head.leaves)?,
        Dialect::Prt1Am => reader.cluster_by_leaf(clusters, head.leaves)?,
        Dialect::HalfLife => head.of_leaves,
    };
    for _ in 0..head.faces {
        reader.face(clusters)?;
    }
    reader.end()?;
    let mut rounding = reader.rounding();
    if dialect == Dialect::Quake3 {
        // Its compiler works in single precision, which leaves fewer digits than it prints.
        let corners = portals.iter().flat_map(|p| &p.winding);
        let farthest = corners.map(|p| p.abs().max_element()).fold(0.0, f64::max);
        rounding = rounding.max(0.5 * f64::from(f32::EPSILON) * farthest);
    }
    Ok(Prt { dialect, level: Level { cells: clusters as usize, portals, rounding }, leaves })
}

/// What stands before the portals.
struct Head {
    dialect: Dialect,
    clusters: u64,
    /// The line of that number.
    clusters_line: usize,
    portals: u64,
    leaves: u64,
    faces: u64,
    /// The cluster of each leaf ([`Dialect::HalfLife`]).
    of_leaves: Vec<u32>,
}

/// Lines, without blank ones.
#[derive(Clone)]
struct Reader<'t> {
    lines: Lines<'t>,
    /// Of the last line read; one past the last line at the end.
    line: usize,
    /// Greatest number of decimals in a coordinate.
    decimals: usize,
}

impl<'t> Reader<'t> {
    fn next(&mut self) -> Option<Fields<'t>> {
        loop {
            self.line += 1;
            let text = self.lines.next()?;
            if !text.trim().is_empty() {
                return Some(Fields { line: self.line, rest: text });
            }
        }
    }

    fn expect(&mut self, field: &str) -> Result<Fields<'t>, PrtError> {
        self.next().ok_or_else(|| PrtError { line: self.line, field: field.into(), fault: PrtFault::Missing })
    }

    fn head(&mut self) -> Result<Head, PrtError> {
        let begin = self.clone();
        let mut fields = self.expect("magic")?;
        let mut head = Head {
            dialect: Dialect::Prt1,
            clusters: 0,
            clusters_line: 0,
            portals: 0,
            leaves: 0,
            faces: 0,
            of_leaves: Vec::new(),
        };
        head.dialect = match fields.next() {
            Some("PRT1") => Dialect::Prt1,
            Some("PRT2") => Dialect::Prt2,
            Some("PRT1-AM") => Dialect::Prt1Am,
            // A number: Half-Life's files begin with that of clusters.
            Some(n) if n.parse::<u32>().is_ok() => Dialect::HalfLifeBare,
            other => {
                let begin: String = other.unwrap_or_default().chars().take(16).collect();
                return Err(fields.error("magic", PrtFault::NotPrt(begin)));
            }
        };
        if head.dialect == Dialect::HalfLifeBare {
            *self = begin
        } else {
            fields.end("magic")?
        }
        if head.dialect == Dialect::Prt2 {
            head.leaves = self.count("leaves", u64::from(u32::MAX))?;
        }
        head.clusters = self.count("clusters", MOST_CLUSTERS)?;
        head.clusters_line = self.line;
        head.portals = self.count("portals", u64::from(u32::MAX / 2))?;
        match head.dialect {
            // Without clusters there can be no leaves.
            Dialect::Prt1Am => {
                head.leaves = self.count("leaves", if head.clusters > 0 { u64::from(u32::MAX) } else { 0 })?
            }
            Dialect::Prt1 if self.is_number_next() => {
                head.dialect = Dialect::Quake3;
                head.faces = self.count("faces", u64::from(u32::MAX))?;
            }
            Dialect::HalfLifeBare if self.is_number_next() => {
                head.dialect = Dialect::HalfLife;
                for cluster in 0..head.clusters as u32 {
                    let more =
                        self.count(&format!("leaves of cluster {cluster}"), MOST_LEAVES - head.of_leaves.len() as u64)?;
                    head.of_leaves.extend(std::iter::repeat_n(cluster, more as usize));
                }
            }
            _ => {}
        }
        Ok(head)
    }

    /// Whether the next line is one number.
    fn is_number_next(&self) -> bool {
        self.clone().next().is_some_and(|mut fields| {
            fields.next().is_some_and(|field| field.parse::<u32>().is_ok()) && fields.next().is_none()
        })
    }

    /// A line with one count.
    fn count(&mut self, field: &str, most: u64) -> Result<u64, PrtError> {
        let mut fields = self.expect(field)?;
        let count = fields.whole(field, 0, most)?;
        fields.end(field)?;
        Ok(count)
    }

    fn portal(&mut self, clusters: u64, with_hint: bool) -> Result<LevelPortal, PrtError> {
        let mut fields = self.expect("portal")?;
        let points = fields.whole("points", 3, MOST_POINTS as u64)?;
        let most = clusters.saturating_sub(1);
        let a = fields.whole("first cluster", 0, most)? as u32;
        let b = fields.whole("second cluster", 0, most)? as u32;
        if a == b {
            return Err(fields.error("second cluster", PrtFault::SameCluster(a)));
        }
        if with_hint {
            fields.whole("hint", 0, 1)?;
        }
        let winding = fields.points(points, &mut self.decimals)?;
        sound(&winding).map_err(|fault| fields.error("winding", fault))?;
        Ok(LevelPortal { cells: [a, b], winding })
    }

    /// A solid polygon on a cluster's border.
    fn face(&mut self, clusters: u64) -> Result<(), PrtError> {
        let mut fields = self.expect("face")?;
        let points = fields.whole("points", 3, MOST_POINTS as u64)?;
        fields.whole("cluster", 0, clusters.saturating_sub(1))?;
        fields.points(points, &mut 0).map(drop)
    }

    /// A line per cluster: its leaves, ended by -1.
    fn leaves_by_cluster(&mut self, clusters: u64, leaves: u64) -> Result<Vec<u32>, PrtError> {
        let mut listed = Vec::new();
        for cluster in 0..clusters as u32 {
            let field = format!("leaves of cluster {cluster}");
            let mut fields = self.expect(&field)?;
            while !fields.ends_with_minus_one() {
                listed.push((fields.whole(&field, 0, leaves.saturating_sub(1))? as u32, cluster, self.line));
            }
            fields.end(&field)?;
        }
        // Each once, so sorted they are 0, 1, 2, ...
        listed.sort_unstable();
        if let Some(twice) = listed.windows(2).find(|w| w[0].0 == w[1].0) {
            let (leaf, cluster, line) = twice[1];
            return Err(PrtError { line, field: format!("leaves of cluster {cluster}"), fault: PrtFault::LeafTwice(leaf) });
        }
        let found = listed.len() as u64;
        if found != leaves {
            return Err(PrtError { line: 2, field: "leaves".into(), fault: PrtFault::Leaves { promised: leaves, found } });
        }
        Ok(listed.into_iter().map(|(_, cluster, _)| cluster).collect())
    }

    /// A line per leaf.
    fn cluster_by_leaf(&mut self, clusters: u64, leaves: u64) -> Result<Vec<u32>, PrtError> {
        let mut list = Vec::new();
        for leaf in 0..leaves {
            let field = format!("cluster of leaf {leaf}");
            let mut fields = self.expect(&field)?;
            list.push(fields.whole(&field, 0, clusters.saturating_sub(1))? as u32);
            fields.end(&field)?;
        }
        Ok(list)
    }

    /// Half a unit of the coordinates' last decimal; 0 if they have enough decimals to count as exact.
    fn rounding(&self) -> f64 {
        if self.decimals > MOST_DECIMALS { 0.0 } else { 0.5 * 10f64.powi(-(self.decimals as i32)) }
    }

    fn end(&mut self) -> Result<(), PrtError> {
        match self.next() {
            Some(mut fields) => fields.end("end of file"),
            None => Ok(()),
        }
    }
}

/// Coordinates with more decimals count as exact doubles.
const MOST_DECIMALS: usize = 9;

/// Decimals of a number; above the maximum if it has an exponent.
fn decimals_of(text: &str) -> usize {
    match text.split_once('.') {
        _ if text.contains(['e', 'E']) => MOST_DECIMALS + 1,
        Some((_, decimals)) => decimals.len(),
        None => 0,
    }
}

/// The fields of a line, separated by blanks; brackets are fields.
struct Fields<'t> {
    line: usize,
    rest: &'t str,
}

impl<'t> Fields<'t> {
    fn next(&mut self) -> Option<&'t str> {
        let text = self.rest.trim_start();
        let end = match text.chars().next()? {
            '(' | ')' => 1,
            _ => text.find(|c: char| c.is_whitespace() || c == '(' || c == ')').unwrap_or(text.len()),
        };
        let (field, rest) = text.split_at(end);
        self.rest = rest;
        Some(field)
    }

    fn error(&self, field: &str, fault: PrtFault) -> PrtError {
        PrtError { line: self.line, field: field.into(), fault }
    }

    fn expect(&mut self, field: &str) -> Result<&'t str, PrtError> {
        self.next().ok_or_else(|| self.error(field, PrtFault::Missing))
    }

    fn unexpected(&self, field: &str, found: &str, expect: &'static str) -> PrtError {
        self.error(field, PrtFault::Unexpected(found.chars().take(32).collect(), expect))
    }

    fn whole(&mut self, field: &str, least: u64, most: u64) -> Result<u64, PrtError> {
        let text = self.expect(field)?;
        let value: i64 = text.parse().map_err(|_| self.unexpected(field, text, "a whole number"))?;
        match u64::try_from(value) {
            Ok(n) if (least..=most).contains(&n) => Ok(n),
            _ => Err(self.error(field, PrtFault::OutOfRange { value, least, most })),
        }
    }

    /// Reads -1 if it comes next.
    fn ends_with_minus_one(&mut self) -> bool {
        let before = self.rest;
        let found = self.next() == Some("-1");
        if !found {
            self.rest = before;
        }
        found
    }

    /// The points at the end of a line.
    fn points(&mut self, count: u64, decimals: &mut usize) -> Result<Vec<DVec3>, PrtError> {
        let points = (1..=count).map(|k| self.point(k, decimals)).collect::<Result<Vec<_>, _>>()?;
        self.end("after the last point")?;
        Ok(points)
    }

    /// `(x y z)`.
    fn point(&mut self, number: u64, decimals: &mut usize) -> Result<DVec3, PrtError> {
        let name = format!("point {number}");
        self.bracket(&name, "(", "'('")?;
        let mut p = [0.0; 3];
        for (value, axis) in p.iter_mut().zip(["x", "y", "z"]) {
            let field = format!("{name} {axis}");
            let text = self.expect(&field)?;
            let number: f64 = text.parse().map_err(|_| self.unexpected(&field, text, "a number"))?;
            if !(-FARTHEST..=FARTHEST).contains(&number) {
                return Err(self.error(&field, PrtFault::Coordinate(text.chars().take(32).collect())));
            }
            *value = number;
            *decimals = (*decimals).max(decimals_of(text));
        }
        self.bracket(&name, ")", "')'")?;
        Ok(DVec3::from_array(p))
    }

    fn bracket(&mut self, field: &str, bracket: &str, expect: &'static str) -> Result<(), PrtError> {
        match self.expect(field)? {
            found if found == bracket => Ok(()),
            found => Err(self.unexpected(field, found, expect)),
        }
    }

    fn end(&mut self, field: &str) -> Result<(), PrtError> {
        match self.next() {
            Some(more) => Err(self.error(field, PrtFault::Trailing(more.chars().take(32).collect()))),
            None => Ok(()),
        }
    }
}

/// Checks that a winding has an area, is flat and convex.
fn sound(winding: &[DVec3]) -> Result<(), PrtFault> {
    let middle = enfilade::math::geom::middle(winding);
    let around: Vec<DVec3> = winding.iter().map(|&p| p - middle).collect();
    let normal = newell(&around);
    let reach = around.iter().map(|p| p.length()).fold(0.0, f64::max);
    // Below this the normal is rounding.
    if normal.length() <= reach * reach * ROUNDING {
        return Err(PrtFault::NoArea);
    }
    let normal = normal.normalize();
    let off = around.iter().map(|p| normal.dot(*p).abs()).fold(0.0, f64::max);
    if off > FLATNESS {
        return Err(PrtFault::NotPlanar(off));
    }
    // Every point is on the inner side of every edge: convex and winding once.
    for (&a, &b) in around.iter().zip(around.iter().cycle().skip(1)) {
        let Some(inwards) = normal.cross(b - a).try_normalize() else { continue };
        let outside = around.iter().map(|p| inwards.dot(a - *p)).fold(0.0, f64::max);
        if outside > FLATNESS {
            return Err(PrtFault::NotConvex(outside));
        }
    }
    Ok(())
}
