//! Smooths the boundaries of regions: one portal crosses a doorway in a thick wall, instead of a zigzag.
//!
//! The watershed of [`crate::cells::plan::rooms`] ends on edges of the plan's triangulation, which zigzag in the reveal of a door or
//! window. Here pieces change regions while that lowers the open area between regions; edges off the walls weigh a little more.
//!
//! Based on: Besag, *On the statistical analysis of dirty pictures*, 1986 (iterated conditional modes of a Potts energy). Deviations:
//! pieces also move in pairs; and each region keeps a share of its volume, or a small room behind a wide opening would vanish.

use crate::cells::complex::faces::{Face, Surface};
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::Labels;
use std::collections::VecDeque;

/// Lowers the open area between regions; `fixed` pieces keep their region.
pub(in crate::cells) fn smooth(faces: &[Face], volumes: &[f64], fixed: &[bool], options: &PlanOptions, labels: &mut Labels) {
    let (of_piece, regions) = (&mut labels.of_piece, labels.regions.len());
    let mut contacts: Vec<Vec<(u32, f64)>> = vec![Vec::new(); of_piece.len()];
    for f in
        faces.iter().filter(|f| f.open_area > 0.0 && of_piece[f.a as usize].is_some() && of_piece[f.b as usize].is_some())
    {
        let cost = f.open_area * if matches!(f.surface, Surface::Edge { .. }) { options.off_wall } else { 1.0 };
        contacts[f.a as usize].push((f.b, cost));
        contacts[f.b as usize].push((f.a, cost));
    }
    let mut spare = vec![0.0f64; regions];
    for (p, region) in of_piece.iter().enumerate() {
        if let Some(r) = region {
            spare[*r as usize] += volumes[p] * (1.0 - options.kept);
        }
    }
    let mut queued = vec![true; of_piece.len()];
    let mut queue: VecDeque<u32> = (0..of_piece.len() as u32).collect();
    let mut shares: Vec<(u32, f64)> = Vec::new();
    while let Some(p) = queue.pop_front() {
        queued[p as usize] = false;
        let Some(from) = of_piece[p as usize].filter(|_| !fixed[p as usize]) else { continue };
        let alike = contacts[p as usize].iter().filter(|(q, _)| of_piece[*q as usize] == Some(from) && !fixed[*q as usize]);
        let partner = alike.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|c| c.0);
        // A quad in a reveal is two triangles, and neither gains alone.
        let pair = partner.map(|q| [p, q]);
        for moved in [&[p][..], pair.as_ref().map_or(&[], |pair| &pair[..])] {
            let volume: f64 = moved.iter().map(|&m| volumes[m as usize]).sum();
            if moved.is_empty() || volume > spare[from as usize] {
                continue;
            }
            shares.clear();
            for &(other, cost) in moved.iter().flat_map(|&m| &contacts[m as usize]).filter(|c| !moved.contains(&c.0)) {
                let Some(region) = of_piece[other as usize] else { continue };
                match shares.iter_mut().find(|s| s.0 == region) {
                    Some(share) => share.1 += cost,
                    None => shares.push((region, cost)),
                }
            }
            let here = shares.iter().find(|s| s.0 == from).map_or(0.0, |s| s.1);
            let best = shares.iter().filter(|s| s.0 != from).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            // A gain within rounding would oscillate.
            if let Some(&(to, there)) = best
                && there > here * (1.0 + options.rounding)
            {
                spare[from as usize] -= volume;
                spare[to as usize] += volume;
                for &m in moved {
                    of_piece[m as usize] = Some(to);
                    for &(other, _) in &contacts[m as usize] {
                        if !std::mem::replace(&mut queued[other as usize], true) {
                            queue.push_back(other);
                        }
                    }
                }
                break;
            }
        }
    }
}
