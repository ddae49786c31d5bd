//! A map of the parts of the screen on which something may be drawn: who reaches another part shows, and needn't be asked about.

use enfilade::ObjectId;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::view::View;
use enfilade::scene::Scene;
use glam::DVec3;

/// Edge of a part, pixels. Smaller: more is spared, and more is marked.
const PART: f64 = 16.0;
/// Queries that the map answers have numbers from here on.
const SPARED: u32 = 1 << 31;

/// The map, from frame to frame.
pub struct Occupancy {
    /// By object.
    boxes: Vec<Bounds>,
    parts: [usize; 2],
    occupied: Vec<bool>,
}

/// Of a frame: the map before an oracle.
pub struct Before<'m, O> {
    map: &'m mut Occupancy,
    oracle: O,
    view: View,
    spared: u64,
}

impl Occupancy {
    pub fn new(scene: &Scene, size: [usize; 2]) -> Self {
        let parts = size.map(|s| (s as f64 / PART).ceil() as usize);
        let boxes = scene.objects.iter().map(|o| Bounds::from(o.bounds)).collect();
        Self { boxes, parts, occupied: vec![false; parts[0] * parts[1]] }
    }

    pub fn before<O>(&mut self, oracle: O, view: &View) -> Before<'_, O> {
        self.occupied.fill(false);
        Before { map: self, oracle, view: *view, spared: 0 }
    }

    /// The parts that the rectangle around a box touches, first and last in each direction; `None`: none. `near`: it reaches the near plane.
    fn parts(&self, view: &View, bounds: &Bounds) -> Result<Option<[[usize; 2]; 2]>, Near> {
        let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in 0..8 {
            let sign = |k: u32| if corner >> k & 1 == 0 { -1.0 } else { 1.0 };
            let half = bounds.half * DVec3::new(sign(0), sign(1), sign(2));
            let at = bounds.centre + bounds.axes[0] * half.x + bounds.axes[1] * half.y + bounds.axes[2] * half.z - view.eye;
            let w = view.w.dot(at);
            if w < view.near {
                return Err(Near);
            }
            for (k, at) in [0.5 + 0.5 * view.x.dot(at) / w, 0.5 - 0.5 * view.y.dot(at) / w].into_iter().enumerate() {
                least[k] = least[k].min(at);
                most[k] = most[k].max(at);
            }
        }
        if (0..2).any(|k| most[k] < 0.0 || least[k] > 1.0) {
            return Ok(None);
        }
        let part = |k: usize, at: f64| ((at * self.parts[k] as f64).max(0.0) as usize).min(self.parts[k] - 1);
        Ok(Some([0, 1].map(|k| [part(k, least[k]), part(k, most[k])])))
    }
}

/// Nearer than the near plane.
struct Near;

impl<O> Before<'_, O> {
    /// Questions that the map has answered.
    pub fn spared(&self) -> u64 {
        self.spared
    }

    fn reaches_free(&self, bounds: &Bounds) -> bool {
        let Ok(Some([across, down])) = self.map.parts(&self.view, bounds) else { return false };
        // Only parts inside of the rectangle, so that the box reaches most of them.
        let inside = |[first, last]: [usize; 2]| first + 1..last;
        inside(down).any(|y| inside(across).any(|x| !self.map.occupied[y * self.map.parts[0] + x]))
    }
}

impl<O: OcclusionOracle> OcclusionOracle for Before<'_, O> {
    fn begin(&mut self, view: &View) {
        self.view = *view;
        self.map.occupied.fill(false);
        self.oracle.begin(view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        if boxes.iter().any(|b| self.reaches_free(b)) {
            self.spared += 1;
            return QueryId(SPARED);
        }
        self.oracle.issue(boxes)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        if query.0 == SPARED { Some(true) } else { self.oracle.poll(query) }
    }

    fn draw(&mut self, object: ObjectId) {
        let [across, down] = match self.map.parts(&self.view, &self.map.boxes[object.index()]) {
            Ok(Some(parts)) => parts,
            Ok(None) => [[1, 0]; 2],
            Err(Near) => self.map.parts.map(|parts| [0, parts - 1]),
        };
        for y in down[0]..=down[1] {
            let start = y * self.map.parts[0];
            self.map.occupied[start..][across[0]..across[1] + 1].fill(true);
        }
        self.oracle.draw(object);
    }
}
