//! Collision: triangles in a grid over the plan, searched around a point or along a ray.

use enfilade::ObjectId;
use enfilade::scene::Scene;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Side of a square of the grid, metres. Larger: more triangles are looked at. Smaller: large ones are in many squares.
const SQUARE: f64 = 1.0;
/// Most squares along a side: sparse cities get larger ones.
const MOST: f64 = 512.0;
/// Lengths (metres) and areas (square metres) below this have no direction.
const LEAST: f64 = 1e-9;
/// Along edges, so much of a triangle's side counts as inside. Less: rays pass where two triangles meet.
const EDGE: f64 = 1e-9;
/// Faces nearer together than this, metres, are one surface, and it shows the side that one of them shows.
const SAME: f64 = 1e-5;

/// A triangle that is looked at.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Corners, metres relative to the origin.
    pub corners: [DVec3; 3],
    /// Whose it is.
    pub object: ObjectId,
}

/// Of no object.
pub const NOBODY: ObjectId = ObjectId(u32::MAX);

impl Face {
    /// Its height over a point of the plan (x, z); `None` beside it, and where it is upright.
    pub fn height_at(&self, p: DVec2) -> Option<f64> {
        let [a, b, c] = self.corners;
        let (u, v, w) = (b.xz() - a.xz(), c.xz() - a.xz(), p - a.xz());
        let area = u.perp_dot(v);
        if area.abs() < LEAST {
            return None;
        }
        let (s, t) = (w.perp_dot(v) / area, u.perp_dot(w) / area);
        (s >= -EDGE && t >= -EDGE && s + t <= 1.0 + EDGE).then_some(a.y + s * (b.y - a.y) + t * (c.y - a.y))
    }

    /// Its point that is nearest to `p`.
    pub fn closest(&self, p: DVec3) -> DVec3 {
        let ([a, b, c], n) = (self.corners, self.normal());
        let inside = [[a, b], [b, c], [c, a]].iter().all(|[from, to]| (*to - *from).cross(p - *from).dot(n) >= 0.0);
        if inside && n.length_squared() > 0.0 {
            return p - n * (n.dot(p - a) / n.length_squared());
        }
        let on_edge = |from: DVec3, to: DVec3| {
            let along = to - from;
            from + along * ((p - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
        };
        let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
        edges.into_iter().min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p))).unwrap_or(a)
    }

    /// Whether any of it may be over the square of `reach` around a point, between two heights.
    fn is_near(&self, p: DVec3, reach: f64, [low, high]: [f64; 2]) -> bool {
        let [a, b, c] = self.corners;
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        flat(p).cmpge(flat(least) - reach).all()
            && flat(p).cmple(flat(most) + reach).all()
            && least.y <= high
            && most.y >= low
    }

    /// Twice its area times the unit vector that points out of its front.
    pub fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Where a ray meets it, from either side (Moeller, Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997).
    pub fn meets(&self, from: DVec3, along: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners;
        let (u, v, w) = (b - a, c - a, from - a);
        let (across, side) = (along.cross(v), w.cross(u));
        let det = u.dot(across);
        let (s, t) = (w.dot(across) / det, along.dot(side) / det);
        let is_met = det != 0.0 && s >= -EDGE && t >= -EDGE && s + t <= 1.0 + EDGE;
        is_met.then_some(v.dot(side) / det).filter(|t| *t > 0.0)
    }
}

/// The first surface on a ray.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    /// How far along, metres.
    pub t: f64,
    /// Whose face it is.
    pub object: ObjectId,
    /// Whether the face shows its front. From within a solid thing, all faces show their backs.
    pub front: bool,
}

/// Triangles by the squares of the plan that they are over.
pub struct Solid<'s> {
    scene: &'s Scene,
    min: DVec2,
    square: f64,
    across: [usize; 2],
    /// Where each square's triangles start.
    starts: Vec<u32>,
    triangles: Vec<u32>,
    /// By triangle: its least and greatest height, rounded outwards, so that most are passed over without a look at their corners.
    heights: Vec<[f32; 2]>,
    /// By triangle: whose it is.
    owners: Vec<ObjectId>,
    /// Other triangles, such as shut doors.
    more: Vec<Face>,
}

impl<'s> Solid<'s> {
    /// Sorts a scene's triangles in.
    pub fn new(scene: &'s Scene) -> Self {
        Self::without(scene, &|_| false)
    }

    /// Sorts in those that aren't left out.
    pub fn without(scene: &'s Scene, is_left: &dyn Fn(usize) -> bool) -> Self {
        let bounds = scene.bounds();
        let (min, size) = (flat(bounds.min), flat(bounds.max) - flat(bounds.min));
        let square = (size.max_element() / MOST).max(SQUARE);
        let across = size.to_array().map(|s| (s / square).floor().max(0.0) as usize + 1);
        let objects = (0..).map(ObjectId).zip(&scene.objects);
        let owners = objects.flat_map(|(id, object)| object.triangles.clone().map(move |_| id)).collect();
        let heights = (0..scene.triangles.len()).map(|t| {
            let [a, b, c] = scene.corners(t).map(|p| p.y);
            [(a.min(b).min(c) as f32).next_down(), (a.max(b).max(c) as f32).next_up()]
        });
        let (heights, starts) = (heights.collect(), vec![0; across[0] * across[1] + 1]);
        let mut solid =
            Self { scene, min, square, across, starts, triangles: Vec::new(), heights, owners, more: Vec::new() };
        // Counted first, then put in their places.
        let sorted = || (0..scene.triangles.len()).filter(|&t| !is_left(t));
        for triangle in sorted() {
            solid.each_square(solid.range(triangle), |squares, s| squares[s + 1] += 1);
        }
        for s in 1..solid.starts.len() {
            solid.starts[s] += solid.starts[s - 1];
        }
        let mut next = solid.starts.clone();
        let mut triangles = vec![0; solid.starts.last().map_or(0, |&n| n as usize)];
        for triangle in sorted() {
            let [low, high] = solid.range(triangle);
            for z in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let at = &mut next[z * across[0] + x];
                    triangles[*at as usize] = triangle as u32;
                    *at += 1;
                }
            }
        }
        solid.triangles = triangles;
        solid
    }

    /// Replaces the other triangles; they belong to no object.
    pub fn put_in_the_way(&mut self, triangles: &[[DVec3; 3]]) {
        self.more = triangles.iter().map(|&corners| Face { corners, object: NOBODY }).collect();
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Looks at every triangle over a square around a point that reaches between two heights, some of them more than once. Returns how
    /// many there were at any height: what it cost.
    pub fn near(&self, p: DVec3, reach: f64, [low, high]: [f64; 2], mut look: impl FnMut(Face)) -> usize {
        let [from, to] = [-reach, reach].map(|r| self.square_of(flat(p) + r));
        let mut all = self.more.len();
        self.more.iter().filter(|face| face.is_near(p, reach, [low, high])).for_each(|face| look(*face));
        for z in from[1]..=to[1] {
            for x in from[0]..=to[0] {
                let over = self.over([x, z]);
                all += over.len();
                over.iter().filter(|&&t| self.reaches(t, low, high)).for_each(|&t| look(self.face(t)));
            }
        }
        all
    }

    /// The first surface on a ray of those that are not passed, within `limit` metres, and the cost; `along` is a unit vector.
    pub fn first(&self, from: DVec3, along: DVec3, limit: f64, passes: &dyn Fn(ObjectId) -> bool) -> (Option<Touch>, usize) {
        let (start, way) = (flat(from), flat(along));
        let Some([mut near, far]) = self.crossing(start, way, limit) else { return (None, 0) };
        let (mut best, mut all): (Option<Touch>, _) = (None, 0);
        let mut square = self.square_of(start + way * near);
        loop {
            // 1. Where the ray leaves this square.
            let side = |i: usize| {
                let edge = self.min[i] + self.square * (square[i] + usize::from(way[i] > 0.0)) as f64;
                if way[i] == 0.0 { f64::INFINITY } else { (edge - start[i]) / way[i] }
            };
            let sides = [side(0), side(1)];
            let leaves = sides[0].min(sides[1]).min(far).max(near);
            // 2. What it meets of what is over the square.
            let ends = [near, leaves].map(|t| from.y + along.y * t);
            let (low, high) = (ends[0].min(ends[1]) - SAME, ends[0].max(ends[1]) + SAME);
            let over = self.over(square);
            all += over.len();
            for &triangle in over.iter().filter(|&&t| self.reaches(t, low, high)) {
                let face = self.face(triangle);
                let Some(t) = face.meets(from, along).filter(|t| *t <= limit) else { continue };
                let front = face.normal().dot(along) < 0.0;
                let is_nearer = best.is_none_or(|b| t < b.t - SAME);
                let shows_front = best.is_some_and(|b| t <= b.t + SAME && front && !b.front);
                if (is_nearer || shows_front) && !passes(face.object) {
                    best = Some(Touch { t, object: face.object, front });
                }
            }
            if leaves >= far || best.is_some_and(|b| b.t <= leaves) {
                return (best, all);
            }
            // 3. The next square.
            near = leaves;
            let i = usize::from(sides[1] < sides[0]);
            match square[i].checked_add_signed(if way[i] > 0.0 { 1 } else { -1 }) {
                Some(next) if next < self.across[i] => square[i] = next,
                _ => return (best, all),
            }
        }
    }

    /// Where a ray of the plan enters and leaves the grid; `None` where it passes by.
    fn crossing(&self, start: DVec2, way: DVec2, limit: f64) -> Option<[f64; 2]> {
        let (mut near, mut far) = (0.0f64, limit);
        for i in 0..2 {
            let ends = [self.min[i], self.min[i] + self.square * self.across[i] as f64];
            if way[i] == 0.0 {
                let is_within = ends[0] <= start[i] && start[i] <= ends[1];
                far = if is_within { far } else { f64::NEG_INFINITY };
            } else {
                let [a, b] = ends.map(|end| (end - start[i]) / way[i]);
                (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
            }
        }
        (near <= far).then_some([near, far])
    }

    fn over(&self, [x, z]: [usize; 2]) -> &[u32] {
        let square = z * self.across[0] + x;
        &self.triangles[self.starts[square] as usize..self.starts[square + 1] as usize]
    }

    fn reaches(&self, triangle: u32, low: f64, high: f64) -> bool {
        let [least, greatest] = self.heights[triangle as usize].map(f64::from);
        least <= high && greatest >= low
    }

    fn face(&self, triangle: u32) -> Face {
        Face { corners: self.scene.corners(triangle as usize), object: self.owners[triangle as usize] }
    }

    fn each_square(&mut self, [low, high]: [[usize; 2]; 2], mut tell: impl FnMut(&mut [u32], usize)) {
        for z in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                tell(&mut self.starts, z * self.across[0] + x);
            }
        }
    }

    fn range(&self, triangle: usize) -> [[usize; 2]; 2] {
        let [a, b, c] = self.scene.corners(triangle).map(flat);
        [self.square_of(a.min(b).min(c)), self.square_of(a.max(b).max(c))]
    }

    fn square_of(&self, p: DVec2) -> [usize; 2] {
        let at = ((p - self.min) / self.square).to_array();
        // Points beside the grid belong to its rim.
        [0, 1].map(|i| (at[i].max(0.0) as usize).min(self.across[i] - 1))
    }
}

fn flat(p: DVec3) -> DVec2 {
    DVec2::new(p.x, p.z)
}
