//! What a person bumps into: triangles in a grid over the plan.

use enfilade::ObjectId;
use enfilade::scene::Scene;
use glam::{DVec2, DVec3};

/// Side of a square of the grid, metres. Larger: more triangles are looked at. Smaller: large ones are in many squares.
const SQUARE: f64 = 1.0;
/// Most squares along a side: sparse cities get larger ones.
const MOST: f64 = 512.0;

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
    /// Whether any of it may be over the square of `reach` around a point.
    fn reaches(&self, p: DVec3, reach: f64) -> bool {
        let [low, high] = [f64::min, f64::max].map(|of| {
            let [a, b, c] = self.corners.map(flat);
            DVec2::new(of(of(a.x, b.x), c.x), of(of(a.y, b.y), c.y))
        });
        flat(p).cmpge(low - reach).all() && flat(p).cmple(high + reach).all()
    }
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
    /// What stands there besides, such as doors that are shut.
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
        let mut solid = Self {
            scene,
            min,
            square,
            across,
            starts: vec![0; across[0] * across[1] + 1],
            triangles: Vec::new(),
            more: Vec::new(),
        };
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

    /// Puts other triangles in the way, in place of those that were; they are nobody's.
    pub fn put_in_the_way(&mut self, triangles: &[[DVec3; 3]]) {
        self.more = triangles.iter().map(|&corners| Face { corners, object: NOBODY }).collect();
    }

    /// Looks at every triangle over a square around a point, some of them more than once.
    pub fn near(&self, p: DVec3, reach: f64, mut look: impl FnMut(Face)) {
        self.more.iter().filter(|face| face.reaches(p, reach)).for_each(|face| look(*face));
        let [low, high] = [-reach, reach].map(|r| self.square_of(flat(p) + r));
        for z in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let square = z * self.across[0] + x;
                for &triangle in &self.triangles[self.starts[square] as usize..self.starts[square + 1] as usize] {
                    let object = self.scene.object_of(triangle as usize);
                    look(Face { corners: self.scene.corners(triangle as usize), object });
                }
            }
        }
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
        // What isn't over the grid is over its rim.
        [0, 1].map(|i| (at[i].max(0.0) as usize).min(self.across[i] - 1))
    }
}

fn flat(p: DVec3) -> DVec2 {
    DVec2::new(p.x, p.z)
}
