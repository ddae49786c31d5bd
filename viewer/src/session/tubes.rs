//! Tubes: sides as colours with lines at sections, and settings that are kept.

use super::Session;
use crate::draw::tubes::TubeRenderer;
use crate::settings::{OfTubes, Settings};

impl Session<'_> {
    /// Shows sides of tubes, or no longer.
    pub(super) fn toggle_tubes(&mut self) {
        match &mut self.renderer.tubes {
            Some(tubes) => tubes.look.shows_sides ^= true,
            None => {
                self.tell("no tubes: pipes of IFC become tubes, and lines with a radius of GeoJSON, OBJ or glTF".to_owned())
            }
        }
    }

    /// Draws tubes as they were drawn last.
    pub(super) fn apply_tubes(&mut self, kept: OfTubes) {
        self.renderer.tubes.iter_mut().for_each(|tubes| tubes.set(Some(kept.tube_pixels), kept.thin_tubes));
    }

    /// How tubes are drawn, to be kept; where there are none, as it was.
    pub(super) fn kept_tubes(&self, settings: &Settings) -> OfTubes {
        self.renderer.tubes.as_ref().map_or(settings.tubes, |tubes| {
            let look = tubes.look;
            OfTubes { tube_pixels: look.limit, thin_tubes: (look.thin != tubes.usual).then_some(look.thin) }
        })
    }

    /// Whether sides are shown.
    pub fn shows_sides(&self) -> bool {
        self.renderer.tubes.as_ref().is_some_and(|tubes| tubes.look.shows_sides)
    }

    /// Tubes, in a line of the counters.
    pub(super) fn say_tubes(&self) -> Option<String> {
        self.renderer.tubes.as_ref().map(TubeRenderer::say_drawn)
    }
}
