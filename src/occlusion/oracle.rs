//! The question that occlusion culling asks: would this box show, drawn now?
//!
//! Based on: the occlusion queries of graphics processors as Bittner et al. (2004) use them: issued in one place, answered later. Answers
//! are yes or no.

use super::bounds::Bounds;
use super::view::View;
use crate::ObjectId;

/// Names a question from its issue to its answer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct QueryId(pub u32);

/// Draws a frame, and says on the way what would be hidden.
///
/// Each frame begins with [`begin`](Self::begin); then a culler issues queries and draws. Every query is answered within the frame.
pub trait OcclusionOracle {
    /// Begins a frame: clears depth, sets the camera.
    fn begin(&mut self, view: &View);

    /// Asks whether a part of any of the boxes could show before what has been drawn so far.
    fn issue(&mut self, boxes: &[Bounds]) -> QueryId;

    /// The answer: `Some(false)` only where no part of any of the boxes has a pixel; `None` while it isn't known. To be asked again then,
    /// until it is; not to be asked after that.
    fn poll(&mut self, query: QueryId) -> Option<bool>;

    /// Draws an object: what is issued after this may be hidden by it.
    fn draw(&mut self, object: ObjectId);

    /// Whether every answer is there as soon as its question is issued. Then what showed is asked about before it is drawn, and not drawn
    /// meanwhile.
    fn answers_at_once(&self) -> bool {
        false
    }
}

impl<O: OcclusionOracle + ?Sized> OcclusionOracle for &mut O {
    fn begin(&mut self, view: &View) {
        (**self).begin(view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        (**self).issue(boxes)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        (**self).poll(query)
    }

    fn draw(&mut self, object: ObjectId) {
        (**self).draw(object);
    }

    fn answers_at_once(&self) -> bool {
        (**self).answers_at_once()
    }
}
