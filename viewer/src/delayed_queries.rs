//! Coherent hierarchical culling whose answers come some frames late to the processor, and in time to the device.
//!
//! Based on: Bittner, Wimmer, Piringer, Purgathofer, *Coherent hierarchical culling: hardware occlusion queries made useful*, 2004.
//! Deviation: queries are chosen as there, without waiting for answers. The device turns an answer into an indirect draw of the same frame
//! ([`crate::draw::queries`]), so an object that comes into sight is drawn in that frame, and the processor never stalls. The processor reads
//! answers a frame or two later and chooses its next queries by them. Late answers cost triangles, and no pixels.

use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::mask::Mask;
use enfilade::runtime::Camera;
use glam::Vec3;

/// Nodes with more triangles than this are never asked about as a whole: one that comes into sight would be drawn as a whole once.
/// Higher: fewer questions in dense scenes. Lower: less is drawn in frames in which much comes into sight.
const LARGEST: u64 = 20_000;
/// Nodes with fewer triangles than this are asked about as one. Higher: fewer questions. Lower: less is drawn.
const SMALLEST: u64 = 400;
/// A visible node is queried again after this many frames. Higher: fewer queries. Lower: hidden nodes are dropped sooner.
const AGAIN: u64 = 8;
/// Boxes grow by this share of their distance from the eye and of their size: more than what rounding to `f32` on the way to the screen
/// can move them. Smaller: boxes that are flush with what is in them lose a pixel.
const SLACK: f32 = 1e-4;

/// A question: would anything in this box show?
#[derive(Clone, Copy, Debug)]
pub struct Question {
    /// The node that it is about.
    pub node: u32,
    /// Corner with the least coordinates, metres relative to the origin.
    pub least: Vec3,
    /// With the greatest.
    pub most: Vec3,
}

/// State of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    shows: bool,
    /// An answer has come since it is asked about.
    answered: bool,
    /// The last frame that came to it.
    visited: u64,
}

/// State of one camera from frame to frame, and the plan of the last frame.
pub struct DelayedQueries {
    tree: Hierarchy,
    mask: Mask,
    states: Vec<State>,
    frame: u64,
    /// Certainly drawn.
    pub sure: Vec<ObjectId>,
    /// Asked in this frame.
    pub questions: Vec<Question>,
    /// Drawn if the question with this number says so.
    pub conditional: Vec<(u32, ObjectId)>,
}

impl DelayedQueries {
    /// Makes a tree of a file's objects.
    pub fn new(file: &PvsFile) -> Self {
        let boxes: Vec<Aabb> =
            file.objects.iter().map(|o| Aabb { min: o.bounds[0].as_dvec3(), max: o.bounds[1].as_dvec3() }).collect();
        let triangles: Vec<u32> = file.objects.iter().map(|o| o.triangles).collect();
        let tree = Hierarchy::of_boxes(&boxes, &triangles, &HierarchyOptions { least_triangles: SMALLEST });
        Self {
            mask: Mask::new(&tree),
            states: vec![State::default(); tree.nodes().len()],
            tree,
            frame: 1,
            sure: Vec::new(),
            questions: Vec::new(),
            conditional: Vec::new(),
        }
    }

    /// Chooses queries for `objects`, `most` at most; the rest is drawn.
    pub fn plan(&mut self, camera: &Camera, objects: &[ObjectId], most: usize) {
        self.frame += 1;
        self.mask.set(&self.tree, objects);
        self.sure.clear();
        self.questions.clear();
        self.conditional.clear();
        if !self.tree.nodes().is_empty() {
            self.visit(0, camera, most);
        }
    }

    /// Takes in what was answered to questions of an earlier frame.
    pub fn learn(&mut self, answers: impl Iterator<Item = (u32, bool)>) {
        for (node, shows) in answers {
            let state = &mut self.states[node as usize];
            (state.shows, state.answered) = (shows, true);
        }
    }

    /// Whether anything below may show, as far as is known.
    fn visit(&mut self, node: u32, camera: &Camera, most: usize) -> bool {
        if !self.mask.has_below(node) {
            return false;
        }
        let (bounds, is_leaf) = {
            let node = &self.tree.nodes()[node as usize];
            (self.boxed(node.bounds.corners().map(|p| p.as_vec3()), camera), node.is_leaf())
        };
        let state = &mut self.states[node as usize];
        let goes_on = state.visited + 1 == self.frame;
        let was_shown = state.shows && goes_on;
        state.visited = self.frame;
        let room = self.questions.len() < most;
        let reaches_eye = camera.eye.cmpge(bounds.0).all() && camera.eye.cmple(bounds.1).all();
        let is_large = !is_leaf && self.tree.nodes()[node as usize].triangles > LARGEST;
        if was_shown || reaches_eye || is_large || !room {
            if is_leaf {
                state.shows = true;
                let again = (self.frame + u64::from(node)).is_multiple_of(AGAIN) && !reaches_eye && room;
                let objects = self.tree.objects(node).iter().copied().filter(|o| self.mask.has(*o));
                self.sure.extend(objects);
                if again {
                    self.questions.push(Question { node, least: bounds.0, most: bounds.1 });
                }
                return true;
            }
            let mut any = false;
            for child in self.tree.nodes()[node as usize].children() {
                any |= self.visit(child, camera, most);
            }
            self.states[node as usize].shows = any;
            return any;
        }
        // It was hidden, or out of sight: the device decides.
        state.shows = false;
        state.answered &= goes_on;
        // Nodes above stay open until it is known.
        let may_show = !state.answered;
        let question = self.questions.len() as u32;
        self.questions.push(Question { node, least: bounds.0, most: bounds.1 });
        let objects = self.tree.objects(node).iter().filter(|o| self.mask.has(**o));
        self.conditional.extend(objects.map(|&o| (question, o)));
        may_show
    }

    /// The box around some corners, grown.
    fn boxed(&self, corners: [Vec3; 8], camera: &Camera) -> (Vec3, Vec3) {
        let (least, most) = corners.iter().fold((corners[0], corners[0]), |(a, b), p| (a.min(*p), b.max(*p)));
        let distance = (camera.eye - (least + most) * 0.5).length();
        // An eye within reach of the near plane is inside.
        let slack = SLACK * (distance + (most - least).length()) + 4.0 * crate::draw::pipelines::NEAR;
        (least - slack, most + slack)
    }
}
