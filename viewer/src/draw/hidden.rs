//! What is left out of pictures by hand. It hides nothing from the alarm: what shows only because a thing in front was taken away by hand isn't
//! missed, so the alarm takes that thing as drawn.

use super::frame::FrameContext;
use super::leaves::{Drawn, Leaves};
use super::mesh::{Mesh, Runs};
use crate::doors::Doors;
use enfilade::ObjectId;

/// Things that are left out, and the rest.
#[derive(Default)]
pub struct Hidden {
    /// Whether there is any.
    pub is_any: bool,
    /// All that is drawn.
    pub shown: Runs,
    /// All leaves that are drawn.
    pub shown_leaves: Drawn,
    runs: Runs,
    leaves: Drawn,
}

impl Hidden {
    /// Leaves out the objects for which `is_hidden`, with the leaves of doors that are all of such objects; and, of doors without
    /// leaves in the model, where `and_made`.
    pub fn new(
        mesh: &mut Mesh,
        leaves: &mut Leaves,
        doors: &Doors,
        is_transparent: &[bool],
        is_hidden: Vec<bool>,
        and_made: bool,
    ) -> Self {
        let mut hidden = Self { is_any: and_made || is_hidden.contains(&true), ..Self::default() };
        let objects = || (0..is_hidden.len() as u32).map(ObjectId);
        let is_door_hidden = |i: &usize| {
            let mut of = doors.doors[*i].objects().peekable();
            if of.peek().is_none() { and_made } else { of.all(|o| is_hidden[o.index()]) }
        };
        let all: Vec<usize> = (0..doors.doors.len()).collect();
        // 1. What is left out, while nothing is.
        mesh.is_hidden.clear();
        leaves.is_hidden.clear();
        let out: Vec<ObjectId> = objects().filter(|o| is_hidden[o.index()]).collect();
        hidden.runs.set(mesh, &out, is_transparent, None);
        leaves.list(&all.iter().copied().filter(is_door_hidden).collect::<Vec<_>>(), &mut hidden.leaves);
        // 2. The rest.
        leaves.is_hidden = all.iter().map(is_door_hidden).collect();
        let every: Vec<ObjectId> = objects().collect();
        mesh.is_hidden = is_hidden;
        hidden.shown.set(mesh, &every, is_transparent, None);
        leaves.list(&all, &mut hidden.shown_leaves);
        hidden
    }

    /// Draws the depth of what is left out, for the alarm.
    pub fn stand_in(&self, frame: &FrameContext<'_>, commands: &mut wgpu::CommandEncoder) {
        let FrameContext { pipelines, eye, .. } = frame;
        let mut pass = frame.targets.adds_depth(commands);
        pipelines.bind(&mut pass, eye);
        pipelines.items.draw(&mut pass, &self.runs.solid, &self.runs.transparent);
        frame.leaves.draw(&mut pass, eye, &pipelines.items, &self.leaves);
    }
}
