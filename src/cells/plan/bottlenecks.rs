//! Bottlenecks: width and height of the openings between pieces.
//!
//! The width is the [clearance](super::clearance) of the opening in plan. The height goes from floor to ceiling, through open cuts. An
//! opening nearly as wide and as high as the regions on both sides does not separate them; a doorway is narrower, a window is lower, and a
//! slit under a roof is as wide as the room and lower.

use crate::cells::complex::arrange::Plan;
use crate::cells::complex::assemble::Complex;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::coverage::Open;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::complex::facets::Facets;
use crate::cells::complex::polygon::points;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::clearance::{Clearance, extent, without_ends};
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::Input;
use crate::math::parallel;
use glam::DVec2;
use std::collections::{BTreeMap, HashMap};

/// The runs of each column: maximal open stacks of pieces from floor to ceiling.
pub(in crate::cells) struct Runs {
    /// The lowest piece of each piece's run.
    pub of_piece: Vec<u32>,
    /// Height of each piece's run, metres.
    pub heights: Vec<f64>,
    /// Height of the floor under the run of each piece, metres.
    pub floors: Vec<f64>,
}

impl Runs {
    /// Runs end at closed cuts and at storeys' levels.
    pub(in crate::cells) fn new(input: &Input<'_>) -> Self {
        let Complex { columns, faces, .. } = input.complex;
        let open = |f: &Face| f.open_area > input.options.most * f.area;
        let mut runs = DisjointSets::new(columns.pieces());
        for f in faces.iter().filter(|f| matches!(f.surface, Surface::Cut(Cut::Sheet(_))) && open(f)) {
            runs.join(f.a, f.b);
        }
        let mut sums = vec![0.0; columns.pieces()];
        for p in 0..columns.pieces() as u32 {
            let (floor, ceiling) = columns.heights(p);
            sums[runs.find(p) as usize] += (0..3).map(|i| ceiling[i] - floor[i]).sum::<f64>() / 3.0;
        }
        let of_piece: Vec<u32> = (0..columns.pieces() as u32).map(|p| runs.find(p)).collect();
        let heights = of_piece.iter().map(|&r| sums[r as usize]).collect();
        let floors = of_piece.iter().map(|&r| columns.heights(r).0.iter().sum::<f64>() / 3.0).collect();
        Self { of_piece, heights, floors }
    }
}

/// An opening between two pieces.
#[derive(Clone, Copy, Debug)]
pub(in crate::cells) struct Bottleneck {
    /// Width of the whole opening, metres; 0: never a reason to merge.
    pub width: f64,
    /// Height, metres; infinite for openings in floors.
    pub height: f64,
    /// Whether a wall or lintel covers part of the face.
    pub framed: bool,
    /// Whether a door leaf or a pane fills it: rooms end there, at any width.
    pub leaf: bool,
    /// Whether it leads onto a ledge too high to step on: a plenum is as high as the opening over the wall of a room without a ceiling, and
    /// yet is no part of that room.
    pub ledge: bool,
}

/// The least width of an opening that does not separate a region of width `narrower`; metres.
pub(in crate::cells) fn least_width(width: f64, narrower: f64, input: &Input<'_>) -> f64 {
    let options = input.options;
    let wide_as_a_door = width >= input.human.metres(options.widest_door);
    if wide_as_a_door { options.wide_passage * narrower } else { options.wide_opening * narrower }
}

/// True if a door leaf or a pane fills the open part of a face.
pub(in crate::cells) fn is_filled(f: &Face, options: &PlanOptions) -> bool {
    f.leaves > options.most * f.open_area
}

/// Ends of a vertical face in plan.
pub(in crate::cells) fn ends(f: &Face, plan: &Plan, facets: &Facets) -> Option<(DVec2, DVec2)> {
    let (lo, hi) = extent(&f.polygon);
    match f.surface {
        Surface::Wall(w) => Some((facets.walls[w as usize].at(lo.x), facets.walls[w as usize].at(hi.x))),
        Surface::Edge { triangle, edge } => {
            let t = plan.triangles[triangle as usize];
            let [a, b] = [t[edge as usize], t[(edge as usize + 1) % 3]].map(|i| plan.points[i as usize]);
            let along = (b - a).normalize_or_zero();
            Some((a + along * lo.x, a + along * hi.x))
        }
        Surface::Cut(_) => None,
    }
}

/// The box around the largest open part of a face.
fn open_extent(f: &Face) -> (DVec2, DVec2) {
    match &f.open {
        Open::Whole => extent(&f.polygon),
        Open::Parts(parts) => {
            let boxes = parts.iter().filter_map(|s| s.first()).map(|outer| extent(&points(outer)));
            let size = |e: &(DVec2, DVec2)| (e.1 - e.0).x * (e.1 - e.0).y;
            boxes.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or((DVec2::ZERO, DVec2::ZERO))
        }
    }
}

/// The bottleneck of each face. All open faces between two runs are one opening, across cuts; openings that touch along one wall are one
/// opening. A frameless opening is as wide as the space around its centre, however short its edge of the triangulation, except in torn
/// columns, where an open face may really be a vault.
pub(in crate::cells) fn bottlenecks(input: &Input<'_>, clearance: &Clearance, runs: &Runs) -> Vec<Bottleneck> {
    let faces = input.complex.faces;
    let extents: Vec<(DVec2, DVec2)> = faces.iter().map(open_extent).collect();
    let mut found: Vec<Bottleneck> =
        faces.iter().zip(&extents).map(|(f, extent)| of_face(f, *extent, input, runs)).collect();
    join_stacked(input, runs, &extents, &mut found);
    join_along_walls(input, &extents, &mut found);
    widen(input, clearance, &mut found);
    found
}

/// The opening of one face by itself.
fn of_face(f: &Face, (lo, hi): (DVec2, DVec2), input: &Input<'_>, runs: &Runs) -> Bottleneck {
    let (options, human) = (input.options, input.human);
    let (framed, leaf) = (f.open_area < options.all * f.area, is_filled(f, options));
    if let Surface::Cut(cut) = f.surface {
        let open = matches!(cut, Cut::Sheet(_)) && f.open_area > options.open_floor * f.area;
        let width = if open { f.open_area.sqrt() } else { 0.0 };
        return Bottleneck { width, height: f64::INFINITY, framed, leaf, ledge: false };
    }
    // Sloped faces have their mean height.
    let width = hi.x - lo.x;
    let height = if width > 0.0 { (f.open_area / width).min(hi.y - lo.y) } else { 0.0 };
    let [a, b] = [f.a as usize, f.b as usize];
    let step = (runs.floors[a] - runs.floors[b]).abs();
    let upper = if runs.floors[a] > runs.floors[b] { a } else { b };
    let ledge = step > human.metres(options.ledge) && runs.heights[upper] < human.metres(options.standing);
    Bottleneck { width, height, framed, leaf, ledge }
}

/// Joins stacked openings between the same two runs: their heights add up.
fn join_stacked(input: &Input<'_>, runs: &Runs, extents: &[(DVec2, DVec2)], found: &mut [Bottleneck]) {
    let Complex { columns, faces, .. } = input.complex;
    let slack = input.options.touching * input.seal;
    let upright = |f: &Face| !matches!(f.surface, Surface::Cut(_));
    let mut stacks: HashMap<(u32, u32, u32, u32), Vec<usize>> = HashMap::new();
    for (i, f) in faces.iter().enumerate().filter(|(_, f)| upright(f) && f.open_area > 0.0) {
        let column = |p: u32| columns.of_piece(p).0 as u32;
        let key = (column(f.a), column(f.b), runs.of_piece[f.a as usize], runs.of_piece[f.b as usize]);
        stacks.entry(key).or_default().push(i);
    }
    for mut stack in stacks.into_values().filter(|s| s.len() > 1) {
        stack.sort_by(|&i, &j| extents[i].0.y.total_cmp(&extents[j].0.y).then(i.cmp(&j)));
        for part in stack.chunk_by(|&below, &above| extents[above].0.y <= extents[below].1.y + slack) {
            let height = part.iter().map(|&i| found[i].height).sum();
            part.iter().for_each(|&i| found[i].height = height);
        }
    }
}

/// Joins adjacent openings along one wall: their width is that from end to end.
fn join_along_walls(input: &Input<'_>, extents: &[(DVec2, DVec2)], found: &mut [Bottleneck]) {
    let mut by_wall: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, f) in input.complex.faces.iter().enumerate() {
        if let (Surface::Wall(w), true) = (f.surface, f.open_area > 0.0) {
            by_wall.entry(w).or_default().push(i);
        }
    }
    let slack = input.options.touching * input.seal;
    for (_, mut list) in by_wall {
        list.sort_by(|&a, &b| extents[a].0.x.total_cmp(&extents[b].0.x).then(a.cmp(&b)));
        let mut groups = DisjointSets::new(list.len());
        let mut active: Vec<usize> = Vec::new();
        for k in 0..list.len() {
            let (lo, hi) = extents[list[k]];
            active.retain(|&j| extents[list[j]].1.x >= lo.x - slack);
            for &j in &active {
                let (l, h) = extents[list[j]];
                let shared = h.y.min(hi.y) - l.y.max(lo.y);
                let alike = shared > input.options.most * (h.y - l.y).max(hi.y - lo.y);
                if alike && found[list[j]].leaf == found[list[k]].leaf {
                    groups.join(j as u32, k as u32);
                }
            }
            active.push(k);
        }
        let mut whole: HashMap<u32, (f64, f64, bool)> = HashMap::new();
        for (k, &i) in list.iter().enumerate() {
            let (lo, hi) = extents[i];
            let entry = whole.entry(groups.find(k as u32)).or_insert((lo.x, hi.x, false));
            *entry = (entry.0.min(lo.x), entry.1.max(hi.x), entry.2 || found[i].framed);
        }
        for (k, &i) in list.iter().enumerate() {
            let (low, high, framed) = whole[&groups.find(k as u32)];
            found[i] = Bottleneck { width: high - low, framed, ..found[i] };
        }
    }
}

/// Sets the width of frameless openings to that of the space around them.
fn widen(input: &Input<'_>, clearance: &Clearance, found: &mut [Bottleneck]) {
    let Complex { plan, columns, facets, faces, .. } = input.complex;
    let whole = |piece: u32| !columns.torn[columns.of_piece(piece).0];
    parallel::for_each_mut(found, |i, bottleneck| {
        let f = &faces[i];
        if bottleneck.framed || f.open_area <= 0.0 || !whole(f.a) || !whole(f.b) {
            return;
        }
        let (lo, hi) = extent(&f.polygon);
        let (low, high) = without_ends(lo.y, hi.y, input.options);
        if let Some((a, b)) = ends(f, plan, facets) {
            for q in input.options.measured_at.map(|t| a.lerp(b, t)) {
                bottleneck.width = bottleneck.width.max(2.0 * clearance.at(q, low, high));
            }
        }
    });
}
