//! Boundaries of regions drawn tight: a doorway in a thick wall is crossed by one portal and not by a zigzag.
//!
//! The watershed of [`super::rooms`] ends on edges of the plan's triangulation, and in the reveal of a door or window those run
//! to and fro. Here pieces change sides while that lowers the open area between regions, edges off the walls counting a little
//! more than those on them.
//!
//! Based on: Besag, *On the statistical analysis of dirty pictures*, 1986 (iterated conditional modes of a Potts energy). Deviates:
//! no region gives away more than a share of its volume, or a small room behind a wide opening would be eaten up.

use super::complex::faces::{Face, Surface};

/// A region keeps this share of its volume.
const KEPT: f64 = 0.7;
/// How much more a square metre of boundary costs that lies on no wall, sheet or level. At 1 boundaries wander off the walls
/// where that saves a hair of area; well above, they stay in the zigzag of the reveal's corners.
const OFF_WALL: f64 = 1.25;

/// Lowers the open area between the regions `of_piece`; pieces that are `fixed` stay where they are.
pub(super) fn smooth(faces: &[Face], volumes: &[f64], fixed: &[bool], of_piece: &mut [Option<u32>], regions: usize) {
    let mut contacts: Vec<Vec<(u32, f64)>> = vec![Vec::new(); of_piece.len()];
    for f in
        faces.iter().filter(|f| f.open_area > 0.0 && of_piece[f.a as usize].is_some() && of_piece[f.b as usize].is_some())
    {
        let cost = f.open_area * if matches!(f.surface, Surface::Edge { .. }) { OFF_WALL } else { 1.0 };
        contacts[f.a as usize].push((f.b, cost));
        contacts[f.b as usize].push((f.a, cost));
    }
    let mut spare = vec![0.0f64; regions];
    for (p, region) in of_piece.iter().enumerate() {
        if let Some(r) = region {
            spare[*r as usize] += volumes[p] * (1.0 - KEPT);
        }
    }
    let mut queued = vec![true; of_piece.len()];
    let mut queue: std::collections::VecDeque<u32> = (0..of_piece.len() as u32).collect();
    while let Some(p) = queue.pop_front() {
        let piece = p as usize;
        queued[piece] = false;
        let Some(from) = of_piece[piece] else { continue };
        if fixed[piece] || volumes[piece] > spare[from as usize] {
            continue;
        }
        let mut shares: Vec<(u32, f64)> = Vec::new();
        for &(other, cost) in &contacts[piece] {
            let Some(region) = of_piece[other as usize] else { continue };
            match shares.iter_mut().find(|s| s.0 == region) {
                Some(share) => share.1 += cost,
                None => shares.push((region, cost)),
            }
        }
        let here = shares.iter().find(|s| s.0 == from).map_or(0.0, |s| s.1);
        let best = shares.iter().filter(|s| s.0 != from).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        // A gain that rounding could make would go to and fro.
        if let Some(&(to, there)) = best
            && there > here * (1.0 + 1e-9)
        {
            of_piece[piece] = Some(to);
            spare[from as usize] -= volumes[piece];
            spare[to as usize] += volumes[piece];
            for &(other, _) in &contacts[piece] {
                if !std::mem::replace(&mut queued[other as usize], true) {
                    queue.push_back(other);
                }
            }
        }
    }
}
