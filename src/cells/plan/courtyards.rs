//! Courtyards: parts of the outside that the building separates from each other.
//!
//! A window onto one courtyard shows that courtyard and no other. But if the outside is one cell, windows of all courtyards lead into the
//! same cell, and windows that face each other seem visible from each other, whatever wings are between. So the space between wings, within
//! the hull of all rooms in plan and below their height, gets cells of its own.

use crate::cells::complex::assemble::{Complex, has_portal};
use crate::cells::complex::faces::Face;
use crate::cells::complex::polygon::convex_hull;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::space::{Input, Labels, Region};
use glam::DVec2;
use std::collections::{BTreeMap, BTreeSet};

/// Gives courtyards cells of their own if there are two or more: one alone needs no separation.
pub(in crate::cells) fn part_courtyards(input: &Input<'_>, labels: &mut Labels) {
    let Complex { plan, columns, faces, .. } = input.complex;
    let Some(outside) = labels.regions.iter().position(|r| r.outside).map(|r| r as u32) else { return };
    let label = |piece: u32| labels.of_piece[piece as usize];
    let corners = |piece: u32| plan.triangles[columns.of_piece(piece).0].map(|i| plan.points[i as usize]);

    // 1. The hull of all rooms in plan, and the heights of rooms with windows.
    let open = |f: &&Face| f.open_area > 0.0;
    let looks_out = |f: &Face| match (label(f.a), label(f.b)) {
        (Some(a), Some(b)) if a == outside && b != outside => Some((f.a, f.b, b)),
        (Some(a), Some(b)) if b == outside && a != outside => Some((f.b, f.a, a)),
        _ => None,
    };
    let windows: Vec<(u32, u32, u32)> =
        faces.iter().filter(open).filter(|f| has_portal(f, input.seal)).filter_map(looks_out).collect();
    let indoors = (0..columns.pieces() as u32).filter(|&p| label(p).is_some_and(|l| l != outside));
    let hull = convex_hull(indoors.flat_map(corners).collect());
    let mut tops: Vec<f64> = windows.iter().map(|&(_, inner, _)| mean(columns.heights(inner).1)).collect();
    tops.sort_by(f64::total_cmp);
    if hull.len() < 3 || tops.is_empty() {
        return;
    }

    // 2. The outside within the hull, and its connected components.
    let within = |piece: u32| {
        let middle = corners(piece).iter().sum::<DVec2>() / 3.0;
        (0..hull.len()).all(|i| (hull[(i + 1) % hull.len()] - hull[i]).perp_dot(middle - hull[i]) > 0.0)
    };
    // Pieces at the rim continue into the outside.
    let rim = input.complex.at_rim();
    let is_among = |p: u32| label(p) == Some(outside) && !rim[p as usize] && within(p);
    let among: Vec<bool> = (0..columns.pieces() as u32).map(is_among).collect();
    let courtyards_below = |top: f64| {
        let is_low = |p: u32| {
            let (floor, ceiling) = columns.heights(p);
            among[p as usize] && 0.5 * (mean(floor) + mean(ceiling)) < top
        };
        let mut parts = DisjointSets::new(columns.pieces());
        for f in faces.iter().filter(open).filter(|f| is_low(f.a) && is_low(f.b)) {
            parts.join(f.a, f.b);
        }
        let mut rooms: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        for &(outer, _, room) in windows.iter().filter(|w| is_low(w.0)) {
            rooms.entry(parts.find(outer)).or_default().insert(room);
        }
        rooms.retain(|_, rooms| rooms.len() >= input.options.courtyard_rooms);
        let of_piece: Vec<Option<u32>> = (0..columns.pieces() as u32)
            .map(|p| Some(parts.find(p)).filter(|part| is_low(p) && rooms.contains_key(part)))
            .collect();
        (rooms.len(), of_piece)
    };
    let at = |share: &f64| tops[((tops.len() - 1) as f64 * share) as usize];
    let tried = input.options.courtyard_tops.iter().map(|share| courtyards_below(at(share)));
    let Some((count, of_piece)) = tried.reduce(|best, other| if other.0 > best.0 { other } else { best }) else { return };

    // 3. Numbers in the order of the first piece.
    if count >= 2 {
        number(of_piece, labels);
    }
}

fn mean(heights: [f64; 3]) -> f64 {
    heights.iter().sum::<f64>() / 3.0
}

/// Gives courtyards numbers, in the order of the first piece; `of_piece` has any number of each.
fn number(of_piece: Vec<Option<u32>>, labels: &mut Labels) {
    let mut number: BTreeMap<u32, u32> = BTreeMap::new();
    for (piece, part) in of_piece.into_iter().enumerate() {
        let Some(part) = part else { continue };
        let next = labels.regions.len() as u32;
        let id = *number.entry(part).or_insert(next);
        if id == next {
            labels.regions.push(Region { room: None, outside: false, courtyard: true });
        }
        labels.of_piece[piece] = Some(id);
    }
}
