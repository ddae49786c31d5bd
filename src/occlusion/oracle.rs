//! Occlusion queries: whether a box would be visible if it were drawn now.
//!
//! Based on: the occlusion queries of graphics processors as Bittner et al. (2004) use them: issued first, answered later. Answers are yes
//! or no.

use super::bounds::Bounds;
use super::view::View;
use crate::ObjectId;

/// Identifies a query from its issue to its answer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct QueryId(pub u32);

/// Draws a frame, and answers occlusion queries during it.
///
/// Each frame begins with [`begin`](Self::begin); then a culler issues queries and draws. Every query is answered within the frame.
pub trait OcclusionOracle {
    /// Begins a frame: clears depth, sets the camera.
    fn begin(&mut self, view: &View);

    /// Issues a query: whether a part of any of the boxes would be visible over the objects drawn so far.
    fn issue(&mut self, boxes: &[Bounds]) -> QueryId;

    /// The answer: `Some(false)` only if no part of any of the boxes has a pixel; `None` while it is pending. Call it again until there is
    /// an answer, and not afterwards.
    fn poll(&mut self, query: QueryId) -> Option<bool>;

    /// Draws an object, which may hide the boxes of later queries.
    fn draw(&mut self, object: ObjectId);

    /// Whether every query is answered immediately. Then visible nodes are queried before they are drawn.
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
