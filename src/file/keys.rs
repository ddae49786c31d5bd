//! Names of portals that outlive a bake.

use super::PvsFile;
use glam::Vec3;
use std::collections::HashSet;

impl PvsFile {
    /// A key for each portal, each different: the author's id (a GlobalId, the name of a node or of an entity); of a portal without one, the
    /// names of its cells, as in `hall | stairs`. Where several portals would have the same key, those after the first, by their place, end
    /// in ` #2` and so on. A bake of the same model gives the same keys, whatever the numbers of its portals.
    pub fn portal_keys(&self) -> Vec<String> {
        let name = |cell: usize| self.cells[cell].source.as_ref().unwrap_or(&self.cells[cell].name);
        let mut keyed: Vec<(String, Vec3, usize)> = (0..)
            .zip(&self.portals)
            .map(|(i, portal)| {
                let of_cells = || {
                    let mut names = portal.cells.map(|cell| name(cell.index()));
                    names.sort();
                    names.map(String::as_str).join(" | ")
                };
                let middle = portal.winding.iter().sum::<Vec3>() / portal.winding.len().max(1) as f32;
                (portal.source.clone().unwrap_or_else(of_cells), middle, i)
            })
            .collect();
        keyed.sort_by(|(a, at, i), (b, bt, j)| {
            let by_place = (0..3).map(|k| at[k].total_cmp(&bt[k])).find(|order| order.is_ne());
            a.cmp(b).then(by_place.unwrap_or(i.cmp(j)))
        });
        let mut taken: HashSet<String> = keyed.iter().map(|(key, ..)| key.clone()).collect();
        let mut keys = vec![String::new(); keyed.len()];
        for same in keyed.chunk_by(|a, b| a.0 == b.0) {
            let mut number = 1;
            for (n, (key, _, portal)) in same.iter().enumerate() {
                let mut own = key.clone();
                while n > 0 && !taken.insert(own.clone()) {
                    number += 1;
                    own = format!("{key} #{number}");
                }
                keys[*portal] = own;
            }
        }
        keys
    }
}
