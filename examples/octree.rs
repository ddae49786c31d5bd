//! An application's own tree: an octree that keeps each object in the smallest cube that holds it, given to CHC++ beside the library's.
//!
//!     cargo run --release --example octree -- data/buildings/office.glb
//!
//! Says how many nodes both trees have, and how many objects and queries a turn around the model takes with each. Both draw all that shows.

use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions, Tree};
use enfilade::occlusion::view::{Frustum, View};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use glam::DVec3;
use std::error::Error;

/// Cubes are divided down to this level.
const DEEPEST: u32 = 8;
/// Frames of a turn.
const FRAMES: usize = 60;

/// A cube, the objects that fit into it and into none of its octants, and its octants.
struct Cube {
    bounds: Aabb,
    objects: Vec<ObjectId>,
    octants: [Option<usize>; 8],
}

/// The application's tree.
pub struct Octree {
    cubes: Vec<Cube>,
}

impl Octree {
    /// Over objects of which the boxes are known.
    pub fn new(boxes: &[Aabb]) -> Self {
        let all = boxes.iter().fold(Aabb::EMPTY, |all, b| all.union(*b));
        let half = DVec3::splat(all.size().max_element() * 0.5);
        let mut tree = Self { cubes: Vec::new() };
        tree.add(Aabb { min: all.centre() - half, max: all.centre() + half });
        for (object, b) in boxes.iter().enumerate() {
            let mut at = 0;
            for _ in 0..DEEPEST {
                let middle = tree.cubes[at].bounds.centre();
                let [low, high] = [b.min.cmpge(middle).bitmask(), b.max.cmpgt(middle).bitmask()];
                if low != high {
                    break;
                }
                at = tree.octant(at, high as usize);
            }
            tree.cubes[at].objects.push(ObjectId(object as u32));
        }
        tree
    }

    fn add(&mut self, bounds: Aabb) -> usize {
        self.cubes.push(Cube { bounds, objects: Vec::new(), octants: [None; 8] });
        self.cubes.len() - 1
    }

    /// An octant by the sides of the middle that it is on, which is made if there is none.
    fn octant(&mut self, cube: usize, side: usize) -> usize {
        self.cubes[cube].octants[side].unwrap_or_else(|| {
            let Aabb { min, max } = self.cubes[cube].bounds;
            let (middle, far) = ((min + max) * 0.5, |axis: usize| side >> axis & 1 == 1);
            let pick =
                |near: DVec3, other: DVec3| DVec3::from_array([0, 1, 2].map(|k| if far(k) { other[k] } else { near[k] }));
            let octant = self.add(Aabb { min: pick(min, middle), max: pick(middle, max) });
            self.cubes[cube].octants[side] = Some(octant);
            octant
        })
    }
}

impl Tree for Octree {
    type Node = usize;

    fn root(&self) -> Option<usize> {
        (!self.cubes.is_empty()).then_some(0)
    }

    fn bounds(&self, cube: usize) -> Bounds {
        self.cubes[cube].bounds.into()
    }

    fn children(&self, cube: usize, out: &mut Vec<usize>) {
        out.extend(self.cubes[cube].octants.iter().flatten());
    }

    fn objects(&self, cube: usize, out: &mut Vec<ObjectId>) {
        out.extend(&self.cubes[cube].objects);
    }
}

/// Means of the objects drawn and of the queries asked on a turn around the model.
fn turn(scene: &Scene, tree: &Hierarchy) -> [f64; 2] {
    let (mut oracle, mut culler) = (DepthBuffer::new(scene, 640, 360), ChcPlus::new(ChcPlusOptions::default()));
    let all = scene.objects.iter().fold(Aabb::EMPTY, |all, o| all.union(o.bounds));
    let mut sums = [0.0; 2];
    for frame in 0..FRAMES {
        let angle = frame as f64 / FRAMES as f64 * std::f64::consts::TAU;
        let eye = all.centre() + DVec3::new(angle.cos(), 0.5, angle.sin()) * all.diagonal();
        let view = View::look_at(eye, all.centre(), 60f64.to_radians(), 16.0 / 9.0, 0.05);
        oracle.begin(&view);
        sums[0] += culler.cull(tree, &Frustum::new(&view), &mut oracle).len() as f64;
        sums[1] += culler.stats().queries as f64;
    }
    sums.map(|sum| sum / FRAMES as f64)
}

fn main() -> Result<(), Box<dyn Error>> {
    let model = std::env::args().nth(1).ok_or("give a model, as data/buildings/office.glb")?;
    let scene = import(model.as_ref(), &ImportOptions::default())?;
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let bounds: Vec<Bounds> = boxes.iter().map(|&b| b.into()).collect();
    let triangles: Vec<u32> = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
    let (octree, faults) = Hierarchy::of_tree(&Octree::new(&boxes), &bounds, &triangles);
    faults.iter().for_each(|fault| println!("{fault}"));
    let binary = Hierarchy::build(&scene, &HierarchyOptions::default());
    println!("{} objects, {} triangles", boxes.len(), scene.triangles.len());
    for (name, tree) in [("octree", octree), ("binary", binary)] {
        let [objects, queries] = turn(&scene, &tree);
        println!("{name}: {} nodes; {objects:.1} objects drawn and {queries:.1} queries a frame", tree.nodes().len());
    }
    Ok(())
}
