//! A hierarchy of boxes: what meets a box, a ray or a point.

use super::geom::Aabb;
#[cfg(feature = "bake")]
use glam::DVec3;

/// Cap of a direction component's inverse: finite, so that no product with 0 is NaN.
#[cfg(feature = "bake")]
const INFINITE: f64 = 1e300;

/// A bounding volume hierarchy, split at the median of the longest axis.
#[derive(Clone, Debug)]
pub struct BoxTree {
    nodes: Vec<Node>,
    items: Vec<u32>,
    boxes: Vec<Aabb>,
}

#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb,
    /// First item of a leaf; the right child of an inner node (its left child comes next).
    first: u32,
    /// Items of a leaf; 0 for an inner node.
    count: u32,
}

const LEAF: usize = 4;

impl BoxTree {
    /// A tree over all boxes, which must be finite.
    #[cfg(feature = "bake")]
    pub fn over(boxes: &[Aabb]) -> Self {
        Self::new(boxes, (0..boxes.len() as u32).collect())
    }

    /// A tree over `items`, indices into `boxes`; all of those must be finite.
    pub fn new(boxes: &[Aabb], items: Vec<u32>) -> Self {
        let mut tree = Self { nodes: Vec::new(), items, boxes: Vec::new() };
        if !tree.items.is_empty() {
            tree.split(boxes, 0, tree.items.len());
        }
        tree.boxes = tree.items.iter().map(|&i| boxes[i as usize]).collect();
        tree
    }

    fn split(&mut self, boxes: &[Aabb], start: usize, end: usize) {
        let bounds = self.items[start..end].iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        let node = self.nodes.len();
        self.nodes.push(Node { bounds, first: start as u32, count: (end - start) as u32 });
        if end - start <= LEAF {
            return;
        }
        let size = Aabb::of(self.items[start..end].iter().map(|&i| boxes[i as usize].centre())).size();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.z >= size.y {
            2
        } else {
            1
        };
        let middle = (start + end) / 2;
        let key = |i: &u32| boxes[*i as usize].centre()[axis];
        self.items[start..end].select_nth_unstable_by(middle - start, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        self.split(boxes, start, middle);
        let right = self.nodes.len() as u32;
        self.split(boxes, middle, end);
        (self.nodes[node].first, self.nodes[node].count) = (right, 0);
    }

    /// Visits the items whose box touches `bounds`.
    pub fn in_box(&self, bounds: &Aabb, visit: &mut impl FnMut(u32)) {
        self.visit(&|b: &Aabb| b.touches(bounds), visit);
    }

    /// Visits the items whose box, grown by `eps` metres, intersects the ray for `0 <= t <= limit`.
    #[cfg(feature = "bake")]
    pub fn on_ray(&self, origin: DVec3, direction: DVec3, limit: f64, eps: f64, visit: &mut impl FnMut(u32)) {
        // A zero component becomes tiny: the ray is then inside its slab everywhere or nowhere.
        let inverse =
            DVec3::from_array(direction.to_array().map(|d| if d.abs() < 1.0 / INFINITE { INFINITE } else { 1.0 / d }));
        let (low, high) = (origin + eps, origin - eps);
        let meets = |b: &Aabb| {
            let (t0, t1) = ((b.min - low) * inverse, (b.max - high) * inverse);
            let (near, far) = (t0.min(t1), t0.max(t1));
            near.x.max(near.y).max(near.z.max(0.0)) <= far.x.min(far.y).min(far.z.min(limit))
        };
        self.visit(&meets, visit);
    }

    /// The minimum of `of_item`, at most `limit`; `of_box` is a lower bound for the items in a box.
    #[cfg(feature = "bake")]
    pub fn least(&self, limit: f64, of_box: &impl Fn(&Aabb) -> f64, of_item: &impl Fn(u32) -> f64) -> f64 {
        let mut best = limit;
        // As in `visit`; the nearer child comes first.
        let mut stack = [(0.0, 0u32); 40];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let (least, index) = stack[depth];
            let node = &self.nodes[index as usize];
            if least >= best {
                continue;
            }
            if node.count == 0 {
                let [left, right] = [index + 1, node.first].map(|i| (of_box(&self.nodes[i as usize].bounds), i));
                let is_left = left.0 <= right.0;
                (stack[depth], stack[depth + 1]) = if is_left { (right, left) } else { (left, right) };
                depth += 2;
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for (item, bounds) in self.items[range.clone()].iter().zip(&self.boxes[range]) {
                if of_box(bounds) < best {
                    best = best.min(of_item(*item));
                }
            }
        }
        best
    }

    fn visit(&self, meets: &impl Fn(&Aabb) -> bool, visit: &mut impl FnMut(u32)) {
        // The tree is balanced, so it has fewer levels than an index has bits, and the stack holds one node a level.
        let mut stack = [0u32; 40];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !meets(&node.bounds) {
                continue;
            }
            if node.count == 0 {
                stack[depth] = node.first;
                stack[depth + 1] = index + 1;
                depth += 2;
                continue;
            }
            let range = node.first as usize..(node.first + node.count) as usize;
            for (item, bounds) in self.items[range.clone()].iter().zip(&self.boxes[range]) {
                if meets(bounds) {
                    visit(*item);
                }
            }
        }
    }
}
