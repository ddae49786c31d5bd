//! An open landscape as a portal file: hills under a flat sky, cut into columns of air of very different sizes.
//!
//! Columns are the leaves of a tree of random cuts, as a level's are. The ground of a column is level, so two columns share one portal: from
//! the higher of their grounds to the sky. Hills that reach the sky are solid. Everything in front of the hills sees everything over many
//! chains of portals, which makes such levels the most expensive ones for `vis`.

use super::GenerateError;
use enfilade::math::random::Prng;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Allowed clusters of a landscape; some of them lie within hills and are left out.
pub const LANDSCAPE_CLUSTERS: std::ops::RangeInclusive<usize> = 2..=100_000;

/// Side of the square, units; corners are whole numbers.
const SIDE: i32 = 1 << 15;
/// Height of the highest hill, and of the sky, units. A higher sky: all columns see each other. A lower one: valleys are closed.
const TOP: f64 = 4096.0;
const SKY: i32 = 2456;
/// Hills, and their radii as fractions of the side.
const HILLS: usize = 40;
const RADII: [f64; 2] = [1.0 / 30.0, 1.0 / 8.0];
/// Heights and cuts are multiples of this, units.
const STEP: i32 = 8;

/// A portal file, and what it holds.
#[derive(Clone, PartialEq, Debug)]
pub struct Landscape {
    /// The file: dialect PRT1.
    pub prt: String,
    /// Clusters.
    pub clusters: usize,
    /// Portals.
    pub portals: usize,
}

/// A column: from `min` to `max` in x and y, units, and the height of its ground.
struct Column {
    min: [i32; 2],
    max: [i32; 2],
    ground: i32,
}

/// Makes a landscape of about `clusters` clusters.
///
/// # Errors
///
/// A number out of range.
pub fn landscape(clusters: usize, seed: u64) -> Result<Landscape, GenerateError> {
    if !LANDSCAPE_CLUSTERS.contains(&clusters) {
        return Err(GenerateError::Clusters { clusters });
    }
    let mut random = Prng::new(seed, 0);
    let mut columns = Vec::new();
    cut([0; 2], [SIDE; 2], clusters, &mut random, &mut columns);
    raise(&mut columns, &mut random);
    columns.retain(|column| column.ground < SKY);
    let mut portals = String::new();
    let count = [0, 1].map(|axis| write_portals(&columns, axis, &mut portals)).iter().sum();
    let prt = format!("PRT1\n{}\n{count}\n{portals}", columns.len());
    Ok(Landscape { prt, clusters: columns.len(), portals: count })
}

/// Cuts a rectangle into `count` columns, across its longer side.
fn cut(min: [i32; 2], max: [i32; 2], count: usize, random: &mut Prng, columns: &mut Vec<Column>) {
    let axis = usize::from(max[1] - min[1] > max[0] - min[0]);
    let room = (max[axis] - min[axis]) / STEP;
    if count == 1 || room < 2 {
        columns.push(Column { min, max, ground: 0 });
        return;
    }
    let below = ((count as f64 * random.range(0.35, 0.65)) as usize).clamp(1, count - 1);
    let share = (below as f64 / count as f64 + random.range(-0.1, 0.1)).clamp(0.2, 0.8);
    let at = min[axis] + STEP * ((f64::from(room) * share) as i32).clamp(1, room - 1);
    let (mut end, mut start) = (max, min);
    (end[axis], start[axis]) = (at, at);
    cut(min, end, below, random, columns);
    cut(start, max, count - below, random, columns);
}

/// Puts columns on hills: bells `(1 - r²)²` of random places, radii and heights.
fn raise(columns: &mut [Column], random: &mut Prng) {
    let side = f64::from(SIDE);
    let hills: Vec<[f64; 4]> = (0..HILLS)
        .map(|_| {
            let radius = 2.0 * side * random.range(RADII[0], RADII[1]);
            [random.range(0.0, side), random.range(0.0, side), radius, random.range(0.3, 1.0)]
        })
        .collect();
    let height = |column: &Column| -> f64 {
        let [x, y] = [0, 1].map(|axis| f64::from(column.min[axis] + column.max[axis]) / 2.0);
        let bell = |&[u, v, radius, height]: &[f64; 4]| {
            let near = (1.0 - ((x - u) * (x - u) + (y - v) * (y - v)) / (radius * radius)).max(0.0);
            height * near * near
        };
        hills.iter().map(bell).sum()
    };
    let top = columns.iter().map(height).fold(f64::MIN_POSITIVE, f64::max);
    for column in columns {
        column.ground = STEP * (height(column) / top * TOP / f64::from(STEP)) as i32;
    }
}

/// Writes the portals between columns that touch across one axis. Returns their number.
fn write_portals(columns: &[Column], axis: usize, out: &mut String) -> usize {
    let across = 1 - axis;
    let mut behind: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    for (i, column) in columns.iter().enumerate() {
        behind.entry(column.min[axis]).or_default().push(i);
    }
    let mut count = 0;
    for (i, a) in columns.iter().enumerate() {
        for &j in behind.get(&a.max[axis]).into_iter().flatten() {
            let b = &columns[j];
            let (from, to) = (a.min[across].max(b.min[across]), a.max[across].min(b.max[across]));
            if from >= to {
                continue;
            }
            let low = a.ground.max(b.ground);
            // Counter-clockwise seen from the second column.
            let mut corners = [(from, low), (to, low), (to, SKY), (from, SKY)];
            if axis == 1 {
                corners.reverse();
            }
            _ = write!(out, "4 {i} {j}");
            for (along, z) in corners {
                let mut p = [a.max[axis]; 2];
                p[across] = along;
                _ = write!(out, " ({} {} {z} )", p[0], p[1]);
            }
            out.push('\n');
            count += 1;
        }
    }
    count
}
