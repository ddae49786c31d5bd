//! Exact visibility from a point: an independent judge of every culler.
//!
//! Based on: Chandak, Antani, Taylor, Manocha, *FastV: from-point visibility culling on complex models*, 2009 (four-sided frusta
//! through a hierarchy from near to far, blocked by triangles that cover them, split otherwise). Deviations: any triangles that
//! together cover a beam block it, connected or not. A beam with few triangles is decided without further splits: nearer
//! triangles are subtracted from each triangle's picture, as convex polygons. So silhouettes need no fine beams.
//!
//! The answer has two parts. A triangle is *visible* if there is a direction in which it is met and nothing is nearer: a
//! [`Witness`]. It is *undecided* if beams could not be split enough, or if rounding would decide. **All others are hidden**,
//! under these rules:
//!
//! * Opaque triangles hide everything strictly behind them; see-through ones
//!   ([`Object::opaque`](enfilade::types::scene::Object::opaque)) hide nothing. Triangles have two sides. Coincident triangles
//!   are all visible.
//! * A triangle that is seen edge-on hides nothing. It is hidden or undecided.
//! * An opening that rounding of `f64` hides (about 1e-13 radians) may count as closed. Wider ones stay open: a slit of 0.1 mm at
//!   100 m is 1e-6 radians.
//!
//! Pixels and samples serve for witnesses only.

mod beam;
mod clip;
mod frame;
mod tree;

use beam::Beams;
use enfilade::ObjectId;
use enfilade::types::scene::Scene;
use frame::Frame;
use glam::{DMat3, DVec3};
use tree::Tree;

/// Maximum splits of a beam: the smallest is a millionth of a radian wide.
pub const MOST_SPLITS: u32 = 20;

/// A visible triangle, and a direction in which it is seen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Witness {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// From the eye to it, of length 1.
    pub direction: DVec3,
}

/// Visible and undecided triangles from a point.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seen {
    /// Visible triangles, ascending.
    pub visible: Vec<Witness>,
    /// Undecided triangles, ascending.
    pub undecided: Vec<u32>,
}

impl Seen {
    /// Every triangle that may be visible, ascending.
    pub fn triangles(&self) -> Vec<u32> {
        let mut all: Vec<u32> = self.visible.iter().map(|w| w.triangle).chain(self.undecided.iter().copied()).collect();
        all.sort_unstable();
        all
    }

    /// Every object that may be visible, ascending. `scene` is the judged scene.
    pub fn objects(&self, scene: &Scene) -> Vec<ObjectId> {
        let mut all: Vec<ObjectId> = self.triangles().into_iter().map(|t| scene.object_of(t as usize)).collect();
        all.dedup();
        all
    }
}

/// A scene prepared for the judge.
pub struct ExactScene(Tree);

impl ExactScene {
    /// Builds the hierarchy.
    pub fn new(scene: &Scene) -> Self {
        Self(Tree::new(scene))
    }
}

/// Computes visible triangles; scratch memory of one thread.
pub struct Judge<'s>(Beams<'s>);

impl<'s> Judge<'s> {
    /// A judge for one thread.
    pub fn new(scene: &'s ExactScene) -> Self {
        Self(Beams::new(&scene.0))
    }

    /// Visible triangles from `eye`, in the scene's coordinates, in all directions. Beams are split at most `splits` times, and
    /// never more than [`MOST_SPLITS`]. More splits leave fewer undecided and add none. An eye that is not finite sees nothing.
    pub fn around(&mut self, eye: DVec3, splits: u32) -> Seen {
        let faces = DMat3::IDENTITY.to_cols_array_2d().map(DVec3::from_array);
        for k in 0..3 {
            for side in [1.0, -1.0] {
                let rows = [faces[(k + 1) % 3], faces[(k + 2) % 3], faces[k] * side];
                self.look(eye, rows, splits);
            }
        }
        self.0.seen()
    }

    /// Visible triangles from `eye` within a pyramid: `|x.p| <= w.p` and `|y.p| <= w.p` for a point `p` relative to the eye. The
    /// rows `[x, y, w]` are those of a perspective projection and must be linearly independent. Otherwise as [`Self::around`].
    pub fn through(&mut self, eye: DVec3, rows: [DVec3; 3], splits: u32) -> Seen {
        self.look(eye, rows, splits);
        self.0.seen()
    }

    fn look(&mut self, eye: DVec3, rows: [DVec3; 3], splits: u32) {
        if eye.is_finite() {
            self.0.look(Frame::new(eye, rows), splits.min(MOST_SPLITS));
        }
    }
}
