//! Pairs that hang on the last digit of a level's file: corners are written with few decimals, or come from planes in single precision, so
//! that a line which only just passes may not pass where the compiler had them.

use super::{Level, Vis, plane};
use enfilade::BitMatrix;
use enfilade::math::geom::{Plane, clip};
use enfilade::math::parallel;
use enfilade::pvs::flow::exact::{Answer, ask};
use glam::DVec3;

/// A file whose numbers are rounded more coarsely has whole numbers, which say nothing of their digits.
const COARSE: f64 = 0.05;
/// Corners of full doubles are off their planes by less than this fraction of the level's size.
const EXACT: f64 = 1e-12;

/// How far corners may lie from where the compiler had them: half of the last decimal, and no less than they are off their planes.
fn doubt(level: &Level) -> f64 {
    let off = |winding: &[DVec3]| {
        let plane = plane(winding);
        winding.iter().map(|p| plane.distance(*p).abs()).fold(0.0, f64::max)
    };
    let farthest = level.portals.iter().map(|p| off(&p.winding)).fold(0.0, f64::max);
    if level.rounding < COARSE { farthest.max(level.rounding) } else { farthest }
}

/// The witnessed pairs, the smaller cell first and ascending, for which no line is known that passes every portal at least as far from its
/// edges as the file's digits may be wrong. Each is in `vis.lower`.
pub fn pairs_on_digits(level: &Level, vis: &Vis) -> Vec<[u32; 2]> {
    let doubt = doubt(level);
    let bounds = enfilade::math::geom::Aabb::of(level.portals.iter().flat_map(|p| p.winding.iter().copied()));
    if doubt <= EXACT * bounds.diagonal() {
        return Vec::new();
    }
    // 1. Pairs along stretches of lines that pass far enough from edges, and neighbours through portals that are wide enough.
    let mut firm = BitMatrix::new(level.cells, level.cells);
    let mut set = |a: u32, b: u32| {
        firm.set(a as usize, b as usize);
        firm.set(b as usize, a as usize);
    };
    for portal in &level.portals {
        if !inset(&portal.winding, doubt).is_empty() {
            set(portal.cells[0], portal.cells[1]);
        }
    }
    for line in &vis.lines {
        let cells = line.cells_along(level);
        let mut begin = 0;
        for (k, &portal) in line.portals.iter().enumerate() {
            if passes_by(&[line.from, line.to], &level.winding(portal), doubt) {
                cells[begin..=k].iter().for_each(|&a| set(a, cells[k + 1]));
            } else {
                begin = k + 1;
            }
        }
    }

    // 2. The others: another line through the same portals may keep the distance.
    let mut open: Vec<[u32; 2]> = Vec::new();
    for a in 0..level.cells {
        open.extend(vis.lower.ones(a).filter(|&b| b > a && !firm.get(a, b)).map(|b| [a as u32, b as u32]));
    }
    let chains = chains(level, vis, &open);
    let hangs = parallel::map(&chains, |chain| {
        let narrowed: Vec<Vec<DVec3>> = chain.iter().map(|&p| inset(&level.winding(p), doubt)).collect();
        chain.is_empty() || narrowed.iter().any(Vec::is_empty) || !matches!(ask(&narrowed), Answer::Line(_))
    });
    open.into_iter().zip(hangs).filter(|(_, hangs)| *hangs).map(|(pair, _)| pair).collect()
}

/// The portals between each of some pairs along the first line that joins it; none for neighbours.
fn chains(level: &Level, vis: &Vis, pairs: &[[u32; 2]]) -> Vec<Vec<u32>> {
    let mut chains = vec![Vec::new(); pairs.len()];
    let mut wanted = BitMatrix::new(level.cells, level.cells);
    for [a, b] in pairs.iter().map(|pair| pair.map(|cell| cell as usize)) {
        wanted.set(a, b);
        wanted.set(b, a);
    }
    for line in &vis.lines {
        let cells = line.cells_along(level);
        for (i, &a) in cells.iter().enumerate() {
            for (k, &b) in cells.iter().enumerate().skip(i + 1) {
                if wanted.get(a as usize, b as usize)
                    && let Ok(found) = pairs.binary_search(&[a.min(b), a.max(b)])
                    && chains[found].is_empty()
                {
                    chains[found] = line.portals[i..k].to_vec();
                }
            }
        }
    }
    chains
}

/// Whether a line passes a winding at least `distance` from the line of each edge.
fn passes_by([from, to]: &[DVec3; 2], winding: &[DVec3], distance: f64) -> bool {
    let along = *to - *from;
    winding.iter().zip(winding.iter().cycle().skip(1)).all(|(&a, &b)| {
        let across = (b - a).cross(along);
        // Of a line along an edge, the distance to its corner.
        match across.try_normalize() {
            Some(n) => (a - *from).dot(n) >= distance,
            None => (a - *from).reject_from(along).length() >= distance,
        }
    })
}

/// A winding whose edges are moved inwards; empty if nothing is left.
fn inset(winding: &[DVec3], by: f64) -> Vec<DVec3> {
    let own = plane(winding);
    let mut left = winding.to_vec();
    for (&a, &b) in winding.iter().zip(winding.iter().cycle().skip(1)) {
        if let Some(outwards) = (b - a).cross(own.n).try_normalize() {
            let edge = Plane::through(a, outwards);
            left = clip(&left, &Plane { d: edge.d - by, ..edge }, 0.0);
        }
    }
    left
}
