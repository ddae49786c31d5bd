//! Tubes: sides as colours with lines at sections, and settings that are kept.

use super::Session;
use crate::draw::tubes::Pipes;
use crate::settings::{OfTubes, Settings};

impl Session<'_> {
    /// Shows sides of tubes, or no longer.
    pub(super) fn toggle_tubes(&mut self) {
        match &mut self.renderer.pipes {
            Some(pipes) => pipes.look.shows_sides ^= true,
            None => self.tell(
                "no tubes: they come with pipes of IFC, and with lines of GeoJSON, OBJ or glTF that have a radius"
                    .to_owned(),
            ),
        }
    }

    /// Draws tubes as they were drawn last.
    pub(super) fn apply_tubes(&mut self, kept: OfTubes) {
        self.renderer.pipes.iter_mut().for_each(|pipes| pipes.set(Some(kept.tube_pixels), kept.thin_tubes));
    }

    /// How tubes are drawn, to be kept; where there are none, as it was.
    pub(super) fn kept_tubes(&self, settings: &Settings) -> OfTubes {
        self.renderer.pipes.as_ref().map_or(settings.tubes, |pipes| {
            let look = pipes.look;
            OfTubes { tube_pixels: look.limit, thin_tubes: (look.thin != pipes.usual).then_some(look.thin) }
        })
    }

    /// Whether sides are shown.
    pub fn shows_sides(&self) -> bool {
        self.renderer.pipes.as_ref().is_some_and(|pipes| pipes.look.shows_sides)
    }

    /// Tubes, in a line of the counters.
    pub(super) fn say_tubes(&self) -> Option<String> {
        self.renderer.pipes.as_ref().map(Pipes::say_drawn)
    }
}
