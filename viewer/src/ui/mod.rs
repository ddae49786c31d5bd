//! The interface: panels over the picture, by egui. A panel takes what it shows by shared reference and returns commands; it keeps only the state
//! of its own widgets. Nothing here knows of a window, so pictures without one have panels, too.

pub mod find;
pub mod graphs;
pub mod ground;
pub mod hud;
pub mod keys;
pub mod labels;
pub mod legend;
pub mod matrix;
pub mod plan;
pub mod preferences;
pub mod profile;
pub mod rebind;
pub mod section;
pub mod toolbar;
pub mod tubes;
pub mod welcome;

use crate::building::Building;
use crate::colours::Tints;
use crate::commands::{Command, Entry};
use crate::culling::Decision;
use crate::draw::ground::Terrain;
use crate::draw::tubes::TubeRenderer;
use crate::elements::Sheet;
use crate::explain::Explanation;
use crate::keymap::KeyMap;
use crate::measure::Label;
use crate::opening::Share;
use crate::profile::Profile;
use crate::session::section::Cut;
use crate::session::view::ViewSettings;
use crate::settings::Preferences;
use enfilade::CellId;

/// State of widgets: how far the plan is zoomed, and the text to find.
pub struct Panels {
    /// The plan.
    pub plan: plan::Plan,
    /// The visibility matrix.
    pub matrix: matrix::Matrix,
    /// Graphs of the last frames.
    pub graphs: graphs::Graphs,
    /// The window to find things in.
    pub find: find::Find,
    /// The action whose key is being changed.
    pub rebind: rebind::Rebind,
}

impl Panels {
    /// For a building.
    pub fn new(building: &Building) -> Self {
        Self {
            plan: plan::Plan::new(&building.file),
            matrix: matrix::Matrix::new(&building.file),
            graphs: Default::default(),
            find: Default::default(),
            rebind: Default::default(),
        }
    }
}

/// The data of all panels.
pub struct PanelData<'a> {
    /// The building.
    pub building: &'a Building,
    /// View settings.
    pub view: &'a ViewSettings,
    /// Preferences of the person.
    pub preferences: &'a Preferences,
    /// Keys.
    pub keys: &'a KeyMap,
    /// Whether the culling is frozen.
    pub is_frozen: bool,
    /// Whether an action is on.
    pub is_on: &'a dyn Fn(&Entry) -> bool,
    /// Counters.
    pub counters: &'a [String],
    /// Counters of the right half.
    pub counters_beside: Option<&'a [String]>,
    /// Labels of the scene.
    pub labels: &'a [Label],
    /// The decision of the culling.
    pub decision: Option<&'a Decision>,
    /// Triangles and pixels by kind.
    pub kinds: Option<([u64; 3], [u64; 3])>,
    /// The last profile, and the frame of it where the walker is.
    pub profile: Option<(&'a Profile<'a>, Option<usize>)>,
    /// The panel of the profile is open.
    pub shows_profile: bool,
    /// Progress of the bake.
    pub opening: Option<&'a Share>,
    /// The visit, on the plan.
    pub visit: plan::Visit<'a>,
    /// The cell of the eye.
    pub home: Option<CellId>,
    /// The pair that was asked about.
    pub pair: Option<[CellId; 2]>,
    /// The section, if there is one.
    pub section: Option<&'a Cut>,
    /// The ground, if its tiles are shown.
    pub terrain: Option<&'a Terrain>,
    /// Tubes, if their sides are shown.
    pub tubes: Option<&'a TubeRenderer>,
    /// A line at the bottom.
    pub note: Option<&'a str>,
    /// Facts of what was picked or found.
    pub facts: &'a [(&'static str, String)],
    /// Its sets of properties.
    pub sheets: &'a [Sheet],
    /// The answer to `why`.
    pub why: Option<&'a Explanation>,
}

/// Draws all panels. Returns what a person asked for.
pub fn show(ui: &mut egui::Ui, shown: &PanelData<'_>, panels: &mut Panels) -> Vec<Command> {
    over_the_scene(ui, shown);
    let mut commands: Vec<Command> = Vec::new();
    commands.extend(explain_culling(ui, shown));
    let PanelData { view, keys, building, .. } = shown;
    if view.menu {
        commands.extend(toolbar::open(ui, keys, shown.is_on));
    } else if view.hud {
        commands.extend(toolbar::closed(ui, keys));
    }
    shown.opening.iter().for_each(|share| hud::meanwhile(ui, share));
    if view.layers.plan {
        commands.extend(panels.plan.show(ui, &building.file, &shown.visit));
    }
    if view.layers.matrix {
        commands.extend(panels.matrix.show(ui, &building.file, shown.home, shown.pair));
    }
    if view.layers.graphs {
        panels.graphs.show(ui);
    }
    if view.keys {
        keys::show(ui, keys);
    }
    if view.preferences {
        let keys = (shown.keys, &panels.rebind);
        commands.extend(preferences::show(ui, shown.preferences, view.fov_y, view.detail, keys));
    }
    commands.extend(shown.section.and_then(|cut| section::show(ui, cut, building.file.origin.y)));
    commands.extend(shown.terrain.and_then(|terrain| ground::show(ui, terrain)));
    commands.extend(shown.tubes.and_then(|tubes| tubes::show(ui, tubes, building.scene.tubes.sections.len())));
    shown.note.iter().for_each(|line| hud::note(ui, line));
    if view.question {
        commands.extend(hud::question(ui));
    }
    commands.extend(panels.find.show(ui, building));
    find::facts(ui, keys, shown.facts, shown.sheets);
    commands.extend(shown.why.and_then(|answer| hud::why(ui, answer)));
    commands
}

/// Labels on the scene, and counters.
fn over_the_scene(ui: &mut egui::Ui, shown: &PanelData<'_>) {
    let view = shown.view;
    labels::show(ui, shown.labels, 1.0 / shown.preferences.text);
    if view.layers.rectangles && !shown.is_frozen {
        labels::rectangles(ui, shown.decision);
    }
    if view.crosshair {
        labels::crosshair(ui);
    }
    if view.hud {
        hud::show(ui, shown.counters, false);
        shown.counters_beside.iter().for_each(|lines| hud::show(ui, lines, true));
    }
}

/// Legends of colours, and the profile.
fn explain_culling(ui: &mut egui::Ui, shown: &PanelData<'_>) -> Option<Command> {
    if let (Tints::Waste, Some((triangles, pixels))) = (shown.view.tints, shown.kinds) {
        legend::kinds(ui, triangles, pixels);
    }
    let (made, here) = shown.profile?;
    legend::profile(ui, made, shown.view.tints);
    if shown.shows_profile { profile::show(ui, made, here) } else { None }
}
