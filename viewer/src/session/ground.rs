//! Tiles of the ground: boxes around those that are drawn and those that are missing.

use super::Session;
use crate::draw::lines::{Overlay, Tint};
use crate::ground::Land;
use crate::units::number;
use enfilade_terrain::{GroundScratch, Patch};
use glam::{DVec3, Vec3};

/// Of boxes of tiles that are drawn, and of those that are wanted and not there.
const DRAWN: Tint = [255, 255, 255, 90];
const MISSING: Tint = [230, 40, 40, 255];
/// Most boxes of each kind.
const MOST: usize = 2000;

impl Session<'_> {
    /// Shows tiles, or no longer.
    pub(super) fn toggle_ground(&mut self) {
        match &mut self.renderer.terrain {
            Some(terrain) => terrain.land.shows_tiles ^= true,
            None => self.tell("no ground: start the viewer with --ground X.ground".to_owned()),
        }
    }

    /// Whether tiles are shown.
    pub fn shows_tiles(&self) -> bool {
        self.renderer.terrain.as_ref().is_some_and(|terrain| terrain.land.shows_tiles)
    }

    /// Boxes of tiles.
    pub(super) fn lay_tiles_over(&self, overlay: &mut Overlay) {
        let Some(terrain) = self.renderer.terrain.as_ref().filter(|terrain| terrain.land.shows_tiles) else { return };
        let (land, origin) = (&terrain.land, self.document.building.file.origin);
        let mut wanted = GroundScratch::default();
        land.select_wanted(self.size(), &terrain.shown, &mut wanted);
        let missing = wanted.patches().iter().filter(|patch| land.ground.slot(patch.tile).is_none());
        missing.take(MOST).for_each(|patch| boxed(overlay, land, patch, origin, MISSING));
        terrain.shown.patches().iter().take(MOST).for_each(|patch| boxed(overlay, land, patch, origin, DRAWN));
    }

    /// The ground, in a line of the counters.
    pub(super) fn say_ground(&self) -> Option<String> {
        let terrain = self.renderer.terrain.as_ref()?;
        let shown = &terrain.shown;
        let (tiles, triangles) = (shown.patches().len(), number(shown.triangles() as f64));
        Some(format!("ground: {tiles} tiles, {triangles} triangles, hides {} objects", shown.objects))
    }
}

/// The edges of a tile's box.
fn boxed(overlay: &mut Overlay, land: &Land, patch: &Patch, origin: DVec3, tint: Tint) {
    let (header, tile) = (land.ground.header(), &land.ground.tiles()[patch.tile as usize]);
    let (grid, last) = (&header.grid, header.grid.side() - 1);
    let [west, north] = header.plan(grid.column(patch.key, 0), grid.row(patch.key, 0));
    let [east, south] = header.plan(grid.column(patch.key, last), grid.row(patch.key, last));
    let corner = |i: usize| -> Vec3 {
        let pick = |bit: usize, least: f64, most: f64| if i & bit == 0 { least } else { most };
        let p = DVec3::new(pick(1, west, east), pick(2, f64::from(tile.low), f64::from(tile.high)), pick(4, north, south));
        land.to_building(p, origin)
    };
    for i in 0..8 {
        [1, 2, 4].into_iter().filter(|bit| i & bit == 0).for_each(|bit| overlay.line(corner(i), corner(i | bit), tint));
    }
}
