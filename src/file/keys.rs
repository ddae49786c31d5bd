//! Names of portals that outlive a bake.

use super::PvsFile;
use crate::math::sorting;
use glam::Vec3;
use std::cmp::Ordering;
use std::collections::HashSet;

impl PvsFile {
    /// A key for each portal, each different: the author's id (a GlobalId, the name of a node or of an entity); of a portal without one, the
    /// names of its cells, as in `hall | stairs`. Where several portals would have the same key, those after the first, by their place, end
    /// in ` #2` and so on. A bake of the same model gives the same keys, whatever the numbers of its portals.
    pub fn portal_keys(&self) -> Vec<String> {
        let name = |cell: usize| self.cells[cell].source.as_ref().unwrap_or(&self.cells[cell].name);
        let keyed: Vec<(String, Vec3)> = self
            .portals
            .iter()
            .map(|portal| {
                let of_cells = || {
                    let [a, b] = portal.cells.map(|cell| name(cell.index()));
                    format!("{} | {}", a.min(b), a.max(b))
                };
                let middle = portal.winding.iter().sum::<Vec3>() / portal.winding.len().max(1) as f32;
                (portal.source.clone().unwrap_or_else(of_cells), middle)
            })
            .collect();
        let mut by_key: Vec<u32> = (0..keyed.len() as u32).collect();
        sorting::sort(&mut by_key, &mut Vec::new(), &|a, b| {
            let ((a, at), (b, bt)) = (&keyed[a as usize], &keyed[b as usize]);
            let by_place = || (0..3).map(|k| at[k].total_cmp(&bt[k])).find(|order| order.is_ne());
            a.cmp(b).then_with(|| by_place().unwrap_or(Ordering::Equal)).is_lt()
        });
        let mut taken: HashSet<String> = keyed.iter().map(|(key, _)| key.clone()).collect();
        let mut keys = vec![String::new(); keyed.len()];
        for same in by_key.chunk_by(|&a, &b| keyed[a as usize].0 == keyed[b as usize].0) {
            let mut number = 1;
            for (n, &portal) in same.iter().enumerate() {
                let (key, _) = &keyed[portal as usize];
                let mut own = key.clone();
                while n > 0 && !taken.insert(own.clone()) {
                    number += 1;
                    own = format!("{key} #{number}");
                }
                keys[portal as usize] = own;
            }
        }
        keys
    }
}
