//! What is visible from a point, exactly: an independent judge of everything that culls.
//!
//! Based on: Chandak, Antani, Taylor, Manocha, *FastV: from-point visibility culling on complex models*, 2009 (four-sided
//! frusta through a hierarchy from near to far, blocked by what covers them, split where nothing does). Deviations: a beam
//! is blocked by any triangles that cover it together, connected or not; and a beam that few triangles are left in isn't
//! split until they cover it, but decided: what nearer triangles leave of each triangle's picture is worked out as convex
//! polygons. So silhouettes take no fine beams.
//!
//! The answer has two parts. A triangle is *visible* if there is a direction in which it is met and nothing is nearer: a
//! [`Witness`]. It is *undecided* if beams couldn't be split enough, or if rounding would decide. **All others are hidden**,
//! by this understanding:
//!
//! * Opaque triangles hide what is strictly behind them; see-through ones ([`Object::opaque`](enfilade::types::scene::Object::opaque)) hide
//!   nothing. Both sides of a triangle are seen. Of triangles in one place each is visible.
//! * A triangle that is seen edge-on hides nothing. It is undecided unless it is hidden.
//! * An opening that rounding of `f64` can't tell from none (about 1e-13 radians) may be taken for closed. Wider ones are kept open:
//!   a slit of 0.1 mm at 100 m is 1e-6 radians.
//!
//! No pixels and no samples are used but for witnesses.

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

/// Most splits of a beam: at the last it is a millionth of a radian wide.
pub const MOST_SPLITS: u32 = 20;

/// A triangle, and where to look to see it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Witness {
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// From the eye to it, of length 1.
    pub direction: DVec3,
}

/// What is visible from a point.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seen {
    /// Triangles that are visible, ascending.
    pub visible: Vec<Witness>,
    /// Triangles of which it isn't known, ascending.
    pub undecided: Vec<u32>,
}

impl Seen {
    /// Every triangle that may be visible, ascending.
    pub fn triangles(&self) -> Vec<u32> {
        let mut all: Vec<u32> = self.visible.iter().map(|w| w.triangle).chain(self.undecided.iter().copied()).collect();
        all.sort_unstable();
        all
    }

    /// Every object that may be visible, ascending. `scene` is the one that was looked at.
    pub fn objects(&self, scene: &Scene) -> Vec<ObjectId> {
        let mut all: Vec<ObjectId> = self.triangles().into_iter().map(|t| scene.object_of(t as usize)).collect();
        all.dedup();
        all
    }
}

/// A scene made ready for the judge.
pub struct ExactScene(Tree);

impl ExactScene {
    /// Builds the hierarchy.
    pub fn new(scene: &Scene) -> Self {
        Self(Tree::new(scene))
    }
}

/// Says what is visible; scratch memory of one thread.
pub struct Judge<'s>(Beams<'s>);

impl<'s> Judge<'s> {
    /// For one thread.
    pub fn new(scene: &'s ExactScene) -> Self {
        Self(Beams::new(&scene.0))
    }

    /// What is visible from `eye`, in the scene's coordinates, in all directions. Beams are split `splits` times at most
    /// (those above [`MOST_SPLITS`] don't count): with more, less is undecided, and nothing comes to the set. An eye that
    /// isn't finite sees nothing.
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

    /// What is visible from `eye` within a pyramid: where `|x.p| <= w.p` and `|y.p| <= w.p` for a point `p` relative to the
    /// eye, as the rows `[x, y, w]` of a perspective projection have it. They must be linearly independent. Otherwise as
    /// [`Self::around`].
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
