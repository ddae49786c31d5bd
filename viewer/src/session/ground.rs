//! Tiles of the ground, shown: a panel with what they cost and how fine they are, boxes around those that are drawn and that are missing.

use super::Session;
use crate::draw::ground::Terrain;
use crate::draw::lines::{Overlay, Tint};
use crate::ground::Land;
use crate::settings::Range;
use crate::ui::graphs::number;
use enfilade_terrain::{GroundScratch, Limit, Patch};
use glam::{DVec3, Vec3};

/// Pixels that a tile may be wrong: less is finer than a picture, more is seen to change.
const PIXELS: Range = Range { least: 0.25, usual: 1.0, most: 16.0, is_factor: true };
/// Triangles of a picture: fewer are no ground, more are slow without need.
const TRIANGLES: Range = Range { least: 5e3, usual: 5e4, most: 5e5, is_factor: true };
/// Where its panel is, points from the middle of the left side.
const PANEL: [f32; 2] = [8.0, 40.0];
/// Of boxes of tiles that are drawn, and of those that are wanted and not there.
const DRAWN: Tint = [255, 255, 255, 90];
const MISSING: Tint = [230, 40, 40, 255];
/// Most boxes of each kind.
const MOST: usize = 2000;

impl Session<'_> {
    /// Shows tiles, or no longer.
    pub(super) fn toggle_ground(&mut self) {
        match &mut self.stage.terrain {
            Some(terrain) => terrain.land.shows_tiles ^= true,
            None => self.tell("no ground: start the viewer with --ground X.ground".to_owned()),
        }
    }

    /// Whether tiles are shown.
    pub(super) fn shows_tiles(&self) -> bool {
        self.stage.terrain.as_ref().is_some_and(|terrain| terrain.land.shows_tiles)
    }

    /// Boxes of tiles.
    pub(super) fn lay_tiles_over(&self, overlay: &mut Overlay) {
        let Some(terrain) = self.stage.terrain.as_ref().filter(|terrain| terrain.land.shows_tiles) else { return };
        let (land, origin) = (&terrain.land, self.building.file.origin);
        let mut wanted = GroundScratch::default();
        land.select_wanted(self.size, &terrain.shown, &mut wanted);
        let missing = wanted.patches().iter().filter(|patch| land.ground.slot(patch.tile).is_none());
        missing.take(MOST).for_each(|patch| boxed(overlay, land, patch, origin, MISSING));
        terrain.shown.patches().iter().take(MOST).for_each(|patch| boxed(overlay, land, patch, origin, DRAWN));
    }

    /// The ground, in a line of the counters.
    pub(super) fn say_ground(&self) -> Option<String> {
        let terrain = self.stage.terrain.as_ref()?;
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

/// The panel.
pub(super) fn show(ui: &mut egui::Ui, terrain: &mut Terrain) {
    let window = egui::Window::new("Ground").id(egui::Id::unique("ground")).anchor(egui::Align2::LEFT_CENTER, PANEL);
    window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
        limit(ui, &mut terrain.land.limit);
        let (shown, ground) = (&terrain.shown, &terrain.land.ground);
        let (patches, loading) = (shown.patches().len(), shown.loading);
        let hits = if loading.wanted == 0 { 1.0 } else { f64::from(loading.present) / f64::from(loading.wanted) };
        ui.label(format!("{patches} tiles, {} triangles", number(shown.triangles() as f64)));
        ui.label(format!("{:.2} pixels wrong at most", shown.scratch.worst()));
        ui.label(format!("{} of {} wanted tiles there ({:.0} %)", loading.present, loading.wanted, hits * 1e2));
        ui.label(format!("{} loaded, {} under way", loading.loaded, loading.under_way));
        if let Some(fault) = ground.faults().last() {
            ui.label(fault.to_string());
        }
        ui.small("White: drawn. Red: wanted and not there. Blue to red: fine to coarse.");
    });
}

/// How fine it is: by pixels or by triangles.
fn limit(ui: &mut egui::Ui, limit: &mut Limit) {
    let by_triangles = matches!(limit, Limit::Triangles(_));
    ui.horizontal(|ui| {
        if ui.selectable_label(!by_triangles, "Pixels").clicked() && by_triangles {
            *limit = Limit::Pixels(PIXELS.usual);
        }
        if ui.selectable_label(by_triangles, "Triangles").clicked() && !by_triangles {
            *limit = Limit::Triangles(TRIANGLES.usual as u32);
        }
    });
    let (range, mut value) = match *limit {
        Limit::Pixels(pixels) | Limit::Distance(pixels) => (PIXELS, pixels),
        Limit::Triangles(triangles) => (TRIANGLES, f64::from(triangles)),
    };
    let slider = egui::Slider::new(&mut value, range.least..=range.most).logarithmic(true).max_decimals(2);
    if ui.add(slider).changed() {
        let value = range.clamp(value);
        *limit = if by_triangles { Limit::Triangles(value as u32) } else { Limit::Pixels(value) };
    }
}
