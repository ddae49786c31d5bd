//! Splits a mesh into clusters of neighbouring triangles, by halving along the longest axis of the triangles' middles.

use super::Mesh;
use crate::geom::Aabb;
use glam::DVec3;

/// Lists of triangle numbers, each of at most `limit`, every triangle in exactly one; in a fixed order.
pub(super) fn clusters(mesh: &Mesh, limit: u32) -> Vec<Vec<u32>> {
    let middles: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|t| t.iter().map(|&i| mesh.positions[i as usize]).sum::<DVec3>() / 3.0)
        .collect();
    let mut out = Vec::new();
    let mut stack = vec![(0..mesh.triangles.len() as u32).collect::<Vec<_>>()];
    while let Some(mut part) = stack.pop() {
        if part.len() <= limit.max(1) as usize {
            part.sort_unstable();
            out.push(part);
            continue;
        }
        let size = Aabb::of(part.iter().map(|&t| middles[t as usize])).size();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.z >= size.y {
            2
        } else {
            1
        };
        part.sort_by(|&a, &b| {
            middles[a as usize][axis]
                .total_cmp(&middles[b as usize][axis])
                .then(a.cmp(&b))
        });
        let upper = part.split_off(part.len() / 2);
        stack.push(upper);
        stack.push(part);
    }
    out
}
