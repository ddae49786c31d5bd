//! Shadow frusta: what a few large occluders near the eye hide, by geometry alone.
//!
//! Based on: Hudson, Manocha, Cohen, Lin, Hoff, Zhang, *Accelerated occlusion culling using shadow frusta*, 1997: each frame
//! some occluders are chosen by the solid angle that they take, about, and a tree is held against the frusta of their
//! shadows, whole subtrees at once. Deviations: candidates come from a tree, those first that may take most, so that no list
//! by place is needed; and an occluder that lies in the shadow of those chosen before is passed over.
//!
//! # Why nothing that shows is dropped
//!
//! The faces of an occluder that the eye is before are a surface with a rim. A box is hidden where it is inside of all
//! planes through the eye and an edge of that rim, and behind all of these faces. The rim goes once around any direction
//! inside of all those planes, or more often, so the surface is met along it or along its opposite; and the surface is
//! before the eye, by each of its planes. What is met is nearer than the box, since the box is behind that face. This asks
//! for no face to be flat nor for the rim to be convex; if they are not, less is hidden.
//!
//! A box is hidden as the eye sees it: where an occluder could reach nearer than the near plane, and so not be drawn, it
//! isn't used.

use super::cones::Cones;
use super::occluders::{Face, Occluders};
use enfilade::ObjectId;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::view::{ALL_PLANES, Frustum, PlaneMask, Side, View};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Most shadows of a frame: a node has a bit for each.
pub const MOST_SHADOWS: usize = 64;

/// Of the distances and sizes that go into a plane or a box, how far a box must be inside of a shadow. Larger: occluders
/// whose edges are short and far away hide nothing. Smaller: roundings, some 2^-50, hide boxes on the rim of a shadow.
const ROUNDING: f64 = 1e-13;

/// A plane that a shadow is on one side of: `normal . p > offset` for a point `p` relative to the eye.
#[derive(Clone, Copy, Debug)]
struct ShadowPlane {
    /// Not longer than 1.
    normal: DVec3,
    /// Metres.
    offset: f64,
}

/// A node of the occluders' tree and the planes of the frustum that it may cross, or an occluder: its turn comes.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Steradians, about; of a node, no occluder below has more.
    angle: f64,
    what: What,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum What {
    Node(u32, PlaneMask),
    Occluder(ObjectId, Shown),
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.angle.total_cmp(&other.angle).then(other.what.cmp(&self.what))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Candidate {}

/// Where a frame is looked from.
#[derive(Clone, Copy, Debug)]
struct Eye {
    frustum: Frustum,
    at: DVec3,
    /// What is nearer to the eye may be cut by the near plane, metres.
    nearest: f64,
}

/// Culls a tree; keeps memory from frame to frame, and nothing else.
#[derive(Clone, Debug)]
pub struct ShadowCuller {
    most: usize,
    /// Of `planes`, those of each shadow.
    shadows: Vec<Range<u32>>,
    planes: Vec<ShadowPlane>,
    cones: Cones,
    candidates: BinaryHeap<Candidate>,
    stack: Vec<(u32, PlaneMask, u64)>,
    objects: Vec<ObjectId>,
}

impl ShadowCuller {
    /// With so many occluders a frame, at most 64.
    pub fn new(most: usize) -> Self {
        Self {
            most: most.min(MOST_SHADOWS),
            shadows: Vec::new(),
            planes: Vec::new(),
            cones: Cones::new(),
            candidates: BinaryHeap::new(),
            stack: Vec::new(),
            objects: Vec::new(),
        }
    }

    /// The objects of a scene's tree that are in the frustum, and that no shadow of one of the scene's occluders hides.
    /// Allocates nothing after the first frame of a scene.
    pub fn cull(&mut self, tree: &Hierarchy, occluders: &Occluders, view: &View) -> &[ObjectId] {
        self.objects.clear();
        self.objects.reserve(tree.object_count());
        self.stack.reserve(tree.nodes().len());
        let eye = Eye { frustum: Frustum::new(view), at: view.eye, nearest: nearest(view) };
        self.choose(occluders, &eye);
        self.walk(tree, &eye);
        &self.objects
    }

    /// How many occluders the last frame chose.
    pub fn shadows(&self) -> usize {
        self.shadows.len()
    }

    /// Casts the shadows of a frame, the one that takes most first.
    fn choose(&mut self, occluders: &Occluders, eye: &Eye) {
        self.shadows.clear();
        self.planes.clear();
        self.cones.clear();
        self.candidates.clear();
        self.shadows.reserve(self.most);
        self.planes.reserve(self.most * occluders.most_planes());
        // Nodes and faces: each once.
        self.candidates.reserve(occluders.tree().nodes().len() + occluders.face_count());
        if occluders.count() > 0 {
            self.candidates.push(Candidate { angle: f64::INFINITY, what: What::Node(0, ALL_PLANES) });
        }
        while self.shadows.len() < self.most
            && let Some(Candidate { what, .. }) = self.candidates.pop()
        {
            match what {
                What::Node(node, mask) => self.open(occluders, node, mask, eye),
                What::Occluder(occluder, _) if self.lit(occluders.bounds(occluder), self.all(), eye).is_none() => {}
                What::Occluder(occluder, shown) => self.cast(occluders, occluder, shown, eye),
            }
        }
    }

    /// Puts what is below a node of the occluders' tree into the queue.
    fn open(&mut self, occluders: &Occluders, node: u32, mask: PlaneMask, eye: &Eye) {
        let tree = occluders.tree();
        let of = &tree.nodes()[node as usize];
        let Side::Crosses(mask) = eye.frustum.side(&of.bounds, mask, 0, &mut 0) else { return };
        if self.lit(&of.bounds, self.all(), eye).is_none() {
            return;
        }
        for node in of.children() {
            // No point of it is nearer, and nothing is seen better than face to face.
            let distance = tree.nodes()[node as usize].bounds.distance(eye.at);
            let angle = occluders.area_below(node) / (distance * distance);
            self.candidates.push(Candidate { angle, what: What::Node(node, mask) });
        }
        let occluders_here = if of.is_leaf() { tree.objects(node) } else { &[] };
        for &occluder in occluders_here {
            let faces = occluders.faces(occluder);
            let (mut fronts, mut angle) = (0, 0.0);
            for (f, face) in (0..).zip(faces) {
                let of_face = angle_of(face, 1.0, eye);
                fronts |= u32::from(of_face > 0.0) << f;
                angle += of_face;
            }
            if fronts != 0 {
                let what = What::Occluder(occluder, Shown { faces: fronts, from_inside: false });
                self.candidates.push(Candidate { angle, what });
                continue;
            }
            // Seen from inside, or from behind: each face by itself.
            for (f, face) in (0..).zip(faces) {
                let angle = angle_of(face, -1.0, eye);
                if angle > 0.0 {
                    let what = What::Occluder(occluder, Shown { faces: 1 << f, from_inside: true });
                    self.candidates.push(Candidate { angle, what });
                }
            }
        }
    }

    /// Makes the planes of an occluder's shadow.
    fn cast(&mut self, occluders: &Occluders, occluder: ObjectId, shown: Shown, eye: &Eye) {
        let faces = occluders.faces(occluder);
        let start = self.planes.len() as u32;
        let sign = if shown.from_inside { -1.0 } else { 1.0 };
        let shown_faces = || (0..faces.len()).filter(|&f| shown.has(f)).map(|f| &faces[f]);
        let rim = shown_faces().flat_map(|face| occluders.edges(face)).filter(|edge| {
            // The edge of one face alone.
            !edge.neighbour.is_some_and(|n| shown.has(n as usize))
        });
        for face in shown_faces() {
            let to_plane = face.point - eye.at;
            let normal = -sign * face.normal;
            let off = if shown.from_inside { face.before } else { face.behind };
            let offset = normal.dot(to_plane) + off + ROUNDING * to_plane.abs().element_sum();
            self.planes.push(ShadowPlane { normal, offset });
        }
        for edge in rim.clone() {
            let [a, b] = edge.ends.map(|p| p - eye.at);
            let normal = b.cross(a) * (sign / (a.length() * b.length()));
            self.planes.push(ShadowPlane { normal, offset: 0.0 });
        }
        self.cones.push(rim.map(|edge| (edge.ends[0] - eye.at).normalize_or_zero()));
        self.shadows.push(start..self.planes.len() as u32);
    }

    /// Takes what is in the frustum and in no shadow.
    fn walk(&mut self, tree: &Hierarchy, eye: &Eye) {
        if !tree.nodes().is_empty() {
            self.stack.push((0, ALL_PLANES, self.all()));
        }
        while let Some((n, mask, shadows)) = self.stack.pop() {
            let node = &tree.nodes()[n as usize];
            let Side::Crosses(mask) = eye.frustum.side(&node.bounds, mask, 0, &mut 0) else { continue };
            let Some(shadows) = self.lit(&node.bounds, shadows, eye) else { continue };
            if node.is_leaf() || (mask == 0 && shadows == 0) {
                self.objects.extend_from_slice(tree.objects(n));
            } else {
                self.stack.extend(node.children().rev().map(|child| (child, mask, shadows)));
            }
        }
    }

    /// All shadows cast so far, as bits.
    fn all(&self) -> u64 {
        if self.shadows.len() == MOST_SHADOWS { !0 } else { (1 << self.shadows.len()) - 1 }
    }

    /// Of some shadows, those that may fall on a part of a box; `None` where one of them hides it.
    fn lit(&self, bounds: &Bounds, shadows: u64, eye: &Eye) -> Option<u64> {
        if shadows == 0 {
            return Some(0);
        }
        let at = bounds.centre - eye.at;
        let error = ROUNDING * (at.abs() + bounds.half).element_sum();
        let met = self.cones.met(bounds, at, shadows);
        let mut left = met.may_hide;
        while left != 0 {
            let Range { start, end } = self.shadows[left.trailing_zeros() as usize];
            left &= left - 1;
            // What is not a number hides nothing.
            let inside = |plane: &ShadowPlane| plane.normal.dot(at) - plane.offset - bounds.reach(plane.normal) > error;
            if self.planes[start as usize..end as usize].iter().all(inside) {
                return None;
            }
        }
        Some(met.touching)
    }
}

/// Faces of an occluder, as bits, that hide what is behind them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Shown {
    faces: u32,
    /// The eye is before no face of the occluder; this one is seen from behind.
    from_inside: bool,
}

impl Shown {
    fn has(&self, face: usize) -> bool {
        self.faces >> face & 1 != 0
    }
}

/// About the solid angle that a face takes, steradians, from before its plane (`sign` 1) or from behind it (-1); 0 where it
/// can't be used.
fn angle_of(face: &Face, sign: f64, eye: &Eye) -> f64 {
    let from_plane = eye.at - face.point;
    let height = sign * face.normal.dot(from_plane);
    let off = if sign > 0.0 { face.before } else { face.behind };
    let sure = height - off - ROUNDING * from_plane.abs().element_sum();
    let distance = eye.at.distance(face.centre);
    if sure > eye.nearest { face.area * height / (distance * distance * distance) } else { 0.0 }
}

/// The greatest distance from the eye, metres, at which something on the screen can be nearer than the near plane.
fn nearest(view: &View) -> f64 {
    let corner = |x: f64, y: f64| {
        let along = (view.w - view.x * x).cross(view.w - view.y * y);
        along.length() / view.w.dot(along).abs()
    };
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, -1.0), corner(1.0, 1.0)];
    view.near * corners.into_iter().fold(1.0, f64::max)
}
