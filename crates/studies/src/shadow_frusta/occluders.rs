//! Occluders of a scene: what of its surfaces is flat or convex and large, found once.
//!
//! Based on: Hudson, Manocha, Cohen, Lin, Hoff, Zhang, *Accelerated occlusion culling using shadow frusta*, 1997, who keep
//! candidates by place and have convex objects for occluders. Deviations: models have few of these, so occluders are made of
//! triangles: coplanar ones are merged to convex polygons, and polygons of an object that meet as sides of a convex solid do
//! are one occluder, closed or not. And nothing need be flat or convex to the last bit: how far a face is off its plane is
//! measured, and counts.

use super::{patches, polygons};
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::scene::{Object, Scene};
use glam::DVec3;
use std::ops::Range;

/// How many occluders of a scene are kept, the largest. More: millions of bricks take memory, and hide nothing. Fewer:
/// cities lack some.
const MOST: usize = 1 << 16;

/// A face of an occluder: a polygon, nearly flat and nearly convex.
#[derive(Clone, PartialEq, Debug)]
pub struct Face {
    /// Unit vector out of the occluder.
    pub normal: DVec3,
    /// Its plane goes through here.
    pub point: DVec3,
    /// How far before the plane any corner of the occluder is, metres, 0 or more.
    pub before: f64,
    /// How far behind the plane its own corners are, metres, 0 or more.
    pub behind: f64,
    /// Square metres.
    pub area: f64,
    pub centre: DVec3,
    /// Of [`Occluders::edges`].
    pub edges: Range<u32>,
}

/// An edge of a face; the edges of a face run counter-clockwise, seen from outside.
#[derive(Clone, PartialEq, Debug)]
pub struct Edge {
    pub ends: [DVec3; 2],
    /// Which face of the same occluder has this edge the other way round.
    pub neighbour: Option<u32>,
}

/// A surface of opaque triangles.
#[derive(Clone, PartialEq, Debug)]
struct Occluder {
    /// Of [`Occluders::faces`].
    faces: Range<u32>,
    bounds: Bounds,
}

/// The occluders of a scene, in a tree.
#[derive(Clone, PartialEq, Debug)]
pub struct Occluders {
    all: Vec<Occluder>,
    faces: Vec<Face>,
    edges: Vec<Edge>,
    /// Its objects are occluders.
    tree: Hierarchy,
    /// By node: the most area, square metres, that an occluder below has.
    areas: Vec<f64>,
    most_planes: usize,
}

impl Occluders {
    /// Finds those of a scene: of what is opaque, and no tube, whose triangles hide more than it does.
    pub fn find(scene: &Scene) -> Self {
        let coplanar = scene.tolerance().coplanar;
        let occludes = |object: &Object| object.opaque && !object.is_tube();
        let of = |object| patches::patches(&polygons::polygons(scene, object, coplanar), coplanar);
        let mut patches: Vec<patches::Patch> = scene.objects.iter().filter(|o| occludes(o)).flat_map(of).collect();
        patches.sort_by(|a, b| b.area.total_cmp(&a.area));
        patches.truncate(MOST);
        let boxes: Vec<Aabb> = patches.iter().map(|p| p.bounds).collect();
        let tree = Hierarchy::of_boxes(&boxes, &vec![1; boxes.len()], &HierarchyOptions::default());
        let most = |n: usize| tree.objects(n as u32).iter().map(|o| patches[o.index()].area).fold(0.0, f64::max);
        let areas = (0..tree.nodes().len()).map(most).collect();
        let mut new = Self { all: Vec::new(), faces: Vec::new(), edges: Vec::new(), tree, areas, most_planes: 0 };
        patches.into_iter().for_each(|patch| new.add(patch));
        new
    }

    fn add(&mut self, patch: patches::Patch) {
        let (first, mut planes) = (self.faces.len() as u32, patch.faces.len());
        for (mut face, edges) in patch.faces {
            planes += edges.len();
            let start = self.edges.len() as u32;
            self.edges.extend(edges);
            face.edges = start..self.edges.len() as u32;
            self.faces.push(face);
        }
        self.most_planes = self.most_planes.max(planes);
        self.all.push(Occluder { faces: first..self.faces.len() as u32, bounds: patch.bounds.into() });
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// How many faces they have.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Those of one occluder.
    pub fn faces(&self, occluder: ObjectId) -> &[Face] {
        let Range { start, end } = self.all[occluder.index()].faces;
        &self.faces[start as usize..end as usize]
    }

    /// The sides of a face.
    pub fn edges(&self, face: &Face) -> &[Edge] {
        &self.edges[face.edges.start as usize..face.edges.end as usize]
    }

    /// The box around an occluder.
    pub fn bounds(&self, occluder: ObjectId) -> &Bounds {
        &self.all[occluder.index()].bounds
    }

    /// The tree that chooses among them.
    pub fn tree(&self) -> &Hierarchy {
        &self.tree
    }

    /// The most area that an occluder below a node has, square metres.
    pub fn area_below(&self, node: u32) -> f64 {
        self.areas[node as usize]
    }

    /// Planes that the shadow of any one has at most.
    pub fn most_planes(&self) -> usize {
        self.most_planes
    }
}
