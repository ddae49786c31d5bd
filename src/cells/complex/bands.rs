//! The storeys of a tall building as bands, each with its own plan.
//!
//! One plan for all storeys has a line for every wall of every storey, so crossings grow with the square of the number of storeys. A band
//! is the space between two levels; its plan has only its own lines. Between two bands, each pair of overlapping triangles gives a face
//! ([`super::faces`]). Low buildings have one band.

use super::facets::Facets;
use super::to_plan;
use crate::cells::scale::HumanScale;
use crate::math::geom::{Plane, area, clip};
use crate::math::parallel;
use crate::math::tolerance::Tolerance;
use glam::{DVec2, DVec3};

/// Fewer storeys share one plan, unless it has more than `MANY_LINES` lines. Fewer lines: unnecessary pieces from cuts at levels. More:
/// crossings between storeys dominate the time.
const LEAST_STOREYS: usize = 5;
const MANY_LINES: usize = 24_000;
/// Levels within this distance of the previous one share its band, metres.
const LEAST_STOREY: f64 = 2.0;

/// A cut of a column.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Cut {
    /// The lower rim of the domain.
    Bottom,
    /// A sheet of [`Facets::sheets`].
    Sheet(u32),
    /// A storey's level without a sheet, by its index.
    Level(u32),
    /// The upper rim of the domain.
    Top,
}

/// The space between two levels, or the whole domain.
#[derive(Clone, Debug)]
pub struct Band {
    /// Bottom and top, metres.
    pub heights: [f64; 2],
    /// The cuts at bottom and top.
    pub rims: [Cut; 2],
    /// Triangles on walls that reach into it, indices of [`Facets::wall_facets`], ascending.
    pub wall_facets: Vec<u32>,
    /// Triangles on sheets that touch it, indices of [`Facets::sheet_facets`], ascending.
    pub sheet_facets: Vec<u32>,
    /// The lines of its plan.
    pub segments: Vec<(DVec2, DVec2)>,
}

impl Band {
    /// True if the next band shares a rim.
    pub fn goes_on(&self, rim: usize) -> bool {
        matches!(self.rims[rim], Cut::Level(_))
    }
}

/// The bands between two heights, from below. `levels` ascend; the first and the last are the model's bottom and top. `scale` as for
/// [`super::facets::facets`].
pub fn bands(
    facets: &Facets,
    levels: &[f64],
    heights: [f64; 2],
    Tolerance { coplanar, seal, .. }: Tolerance,
    human: HumanScale,
    scale: f64,
) -> Vec<Band> {
    let rims = rims(levels, heights, LEAST_STOREY * human.metre);
    let segments = facets.walls.iter().flat_map(|w| w.spans.iter().map(|&(u0, u1)| (w.at(u0), w.at(u1))));
    let segments: Vec<_> = segments.chain(facets.sheets.iter().flat_map(|s| s.outline.iter().copied())).collect();
    if rims.len() == 2 || rims.len() <= LEAST_STOREYS && segments.len() <= MANY_LINES {
        let all = |n: usize| (0..n as u32).collect();
        let (wall_facets, sheet_facets) = (all(facets.wall_facets.len()), all(facets.sheet_facets.len()));
        return vec![Band { heights, rims: [Cut::Bottom, Cut::Top], wall_facets, sheet_facets, segments }];
    }
    let mut bands: Vec<Band> = (rims.windows(2))
        .map(|w| Band {
            heights: [w[0].0, w[1].0],
            rims: [w[0].1, w[1].1],
            wall_facets: Vec::new(),
            sheet_facets: Vec::new(),
            segments: Vec::new(),
        })
        .collect();
    // The bands that overlap a range of heights, grown by `by`.
    let met = |ys: [f64; 3], by: f64| {
        let (low, high) = (ys[0].min(ys[1]).min(ys[2]) - by, ys[0].max(ys[1]).max(ys[2]) + by);
        let first = rims[1..rims.len() - 1].partition_point(|r| r.0 < low);
        let end = rims[1..rims.len() - 1].partition_point(|r| r.0 <= high) + 1;
        first..end.max(first)
    };
    for (i, f) in facets.wall_facets.iter().enumerate() {
        for band in met(f.corners.map(|p| p.y), -coplanar) {
            bands[band].wall_facets.push(i as u32);
        }
    }
    for (i, f) in facets.sheet_facets.iter().enumerate() {
        for band in met(f.corners.map(|p| p.y), coplanar) {
            bands[band].sheet_facets.push(i as u32);
        }
    }
    for sheet in &facets.sheets {
        for &(a, b) in &sheet.outline {
            let (ya, yb) = (sheet.height(a), sheet.height(b));
            for band in met([ya, yb, yb], coplanar) {
                bands[band].segments.push((a, b));
            }
        }
    }
    parallel::for_each_mut(&mut bands, |_, band| {
        let outlines = std::mem::take(&mut band.segments);
        band.segments = spans(facets, band, seal, human.least_wall() * scale);
        band.segments.extend(outlines);
        band.segments.extend(crossings(facets, band, coplanar));
    });
    bands
}

/// The spans of each wall with enough area within the band, as in [`super::facets::Wall::spans`].
fn spans(facets: &Facets, band: &Band, seal: f64, least: f64) -> Vec<(DVec2, DVec2)> {
    let within = [Plane { n: DVec3::Y, d: band.heights[1] }, Plane { n: -DVec3::Y, d: -band.heights[0] }];
    let mut out = Vec::new();
    for members in
        band.wall_facets.chunk_by(|&a, &b| facets.wall_facets[a as usize].owner == facets.wall_facets[b as usize].owner)
    {
        let wall = &facets.walls[facets.wall_facets[members[0] as usize].owner as usize];
        let along = wall.along();
        let mut parts: Vec<(f64, f64, f64)> = (members.iter())
            .map(|&f| within.iter().fold(facets.wall_facets[f as usize].corners.to_vec(), |w, plane| clip(&w, plane, 0.0)))
            .filter(|part| part.len() >= 3)
            .map(|part| {
                let u = part.iter().map(|&p| along.dot(to_plan(p)));
                let (u0, u1) = u.fold((f64::INFINITY, f64::NEG_INFINITY), |r, u| (r.0.min(u), r.1.max(u)));
                (u0, u1, area(&part))
            })
            .collect();
        parts.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut i = 0;
        while i < parts.len() {
            let (from, mut to, mut whole) = (parts[i].0, parts[i].1, 0.0);
            while i < parts.len() && parts[i].0 <= to + 2.0 * seal {
                to = to.max(parts[i].1);
                whole += parts[i].2;
                i += 1;
            }
            if whole >= least {
                out.push((wall.at(from), wall.at(to)));
            }
        }
    }
    out
}

/// Lines where sloping sheets cross the band's rims: no column may have a sheet on both sides of a rim.
fn crossings(facets: &Facets, band: &Band, coplanar: f64) -> Vec<(DVec2, DVec2)> {
    let mut out = Vec::new();
    for facet in band.sheet_facets.iter().map(|&f| &facets.sheet_facets[f as usize]) {
        if facets.sheets[facet.owner as usize].outline.is_empty() {
            continue;
        }
        for rim in (0..2).filter(|&rim| band.goes_on(rim)) {
            let over = facet.corners.map(|p| p.y - band.heights[rim]);
            if over.iter().all(|&d| d <= coplanar) || over.iter().all(|&d| d >= -coplanar) {
                continue;
            }
            let mut ends = [(0, 1), (1, 2), (2, 0)].into_iter().filter(|&(i, j)| (over[i] < 0.0) != (over[j] < 0.0));
            let cross =
                |(i, j): (usize, usize)| to_plan(facet.corners[i].lerp(facet.corners[j], over[i] / (over[i] - over[j])));
            if let (Some(a), Some(b)) = (ends.next(), ends.next()) {
                out.push((cross(a), cross(b)));
            }
        }
    }
    out
}

/// Where bands begin and end, with levels at least `least` metres apart.
fn rims(levels: &[f64], heights: [f64; 2], least: f64) -> Vec<(f64, Cut)> {
    let mut rims = vec![(heights[0], Cut::Bottom)];
    for (l, &level) in levels.iter().enumerate().take(levels.len().saturating_sub(1)).skip(1) {
        if level - rims[rims.len() - 1].0 >= least {
            rims.push((level, Cut::Level(l as u32)));
        }
    }
    rims.push((heights[1], Cut::Top));
    rims
}
