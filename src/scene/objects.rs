//! Splits large objects of a scene.

use super::cluster::{Soup, clusters};
use super::{Object, Scene};
use crate::ObjectId;
use crate::math::geom::Aabb;
use std::collections::HashMap;
use std::ops::Range;

/// The scene with objects of at most `limit` triangles each (1 or more): larger ones, and scattered ones, are split into clusters that are
/// often visible together. Parts of tubes stay unchanged. Importing with a limit gives the same scene as importing without and splitting
/// then; splitting twice may not.
pub fn split_objects(scene: Scene, limit: u32) -> Scene {
    let mut split = Scene { positions: Vec::with_capacity(scene.positions.len()), ..scene };
    let (positions, triangles, objects) =
        (scene.positions, std::mem::take(&mut split.triangles), std::mem::take(&mut split.objects));
    let (mut meshes, mut numbers) = (Vec::new(), Vec::new());
    // The parts of each object.
    let mut parts_of: Vec<Range<u32>> = Vec::with_capacity(objects.len());
    split.triangles.reserve_exact(triangles.len());
    for (o, object) in objects.into_iter().enumerate() {
        let range = object.triangles.start as usize..object.triangles.end as usize;
        let soup = Soup { positions: &positions, triangles: &triangles[range] };
        let parts =
            if object.is_tube() { vec![(0..object.triangles.len() as u32).collect()] } else { clusters(soup, limit) };
        let first = split.objects.len() as u32;
        if let Some(trace) = &split.trace {
            meshes.extend(parts.iter().map(|_| trace.meshes[o]));
            numbers.extend(parts.iter().flatten().map(|&t| trace.triangles[(object.triangles.start + t) as usize]));
        }
        for part in parts {
            let start = split.triangles.len() as u32;
            let mut bounds = Aabb::EMPTY;
            let mut moved = HashMap::with_capacity(part.len());
            for t in part {
                split.triangles.push(soup.triangles[t as usize].map(|i| {
                    *moved.entry(i).or_insert_with(|| {
                        let p = positions[i as usize];
                        bounds = bounds.with(p);
                        split.positions.push(p);
                        split.positions.len() as u32 - 1
                    })
                }));
            }
            let triangles = start..split.triangles.len() as u32;
            split.objects.push(Object {
                node: object.node.clone(),
                triangles,
                segments: object.segments.clone(),
                bounds,
                ..object
            });
        }
        parts_of.push(first..split.objects.len() as u32);
    }
    for group in &mut split.together {
        *group = group.iter().flat_map(|o| parts_of[o.index()].clone()).map(ObjectId).collect();
    }
    if let Some(trace) = &mut split.trace {
        (trace.meshes, trace.triangles) = (meshes, numbers);
    }
    split
}
