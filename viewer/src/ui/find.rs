//! Finds rooms, nodes and materials by a part of their names, and tells what was picked.

use crate::building::Building;
use crate::keymap::KeyMap;
use crate::ui::keys::Action;
use crate::units::Units;
use enfilade::scene::Role;
use enfilade::{CellId, ObjectId};

/// Most hits: a longer list is narrowed by another letter.
pub const MOST: usize = 50;
/// Height of the list, points.
const LIST: f32 = 180.0;

/// What has a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum What {
    /// A cell that the author named.
    Room(CellId),
    /// All objects of the node of this one.
    Node(ObjectId),
    /// The material with this number in the scene's trace.
    Material(u32),
}

/// A hit.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Found {
    /// It.
    pub what: What,
    /// Its name.
    pub name: String,
}

/// What has a text in its name, in capitals or not: rooms first, then nodes, then materials that something is made of.
pub fn find(building: &Building, text: &str) -> Vec<Found> {
    let text = text.trim().to_lowercase();
    if text.is_empty() {
        return Vec::new();
    }
    let (file, scene) = (&building.file, &building.scene);
    let is_hit = |name: &str| name.to_lowercase().contains(&text);
    let mut found: Vec<Found> = Vec::new();
    for (i, cell) in file.cells.iter().enumerate().filter(|(_, cell)| cell.source.is_some() && is_hit(&cell.name)) {
        found.push(Found { what: What::Room(CellId(i as u32)), name: cell.name.clone() });
    }
    let mut seen = std::collections::HashSet::new();
    for (i, object) in scene.objects.iter().enumerate().filter(|(_, o)| is_hit(&o.node)) {
        if seen.insert(&object.node) {
            found.push(Found { what: What::Node(ObjectId(i as u32)), name: object.node.clone() });
        }
    }
    let materials = scene.trace.iter().flat_map(|trace| trace.materials.iter().enumerate());
    for (i, material) in materials.filter(|(_, material)| is_hit(&material.name)) {
        let what = What::Material(i as u32);
        if !objects(building, what).is_empty() {
            found.push(Found { what, name: material.name.clone() });
        }
    }
    found.truncate(MOST);
    found
}

/// The objects of a node or of a material.
pub fn objects(building: &Building, what: What) -> Vec<ObjectId> {
    let scene = &building.scene;
    let ids = (0..scene.objects.len() as u32).map(ObjectId);
    match what {
        What::Room(_) => Vec::new(),
        What::Node(first) => ids.filter(|o| scene.objects[o.index()].node == scene.objects[first.index()].node).collect(),
        What::Material(number) => ids.filter(|o| material(building, *o) == Some(number)).collect(),
    }
}

/// The number of an object's material.
fn material(building: &Building, object: ObjectId) -> Option<u32> {
    let trace = building.scene.trace.as_ref()?;
    trace.looks[trace.meshes[object.index()] as usize].material
}

/// What is told of an object in a cell: names and values.
pub fn facts(building: &Building, object: ObjectId, cell: CellId, units: Units) -> Vec<(&'static str, String)> {
    let (scene, home) = (&building.scene, &building.file.cells[cell.index()]);
    let of = &scene.objects[object.index()];
    let role = match of.role {
        Role::Structure => "structure",
        Role::Furnishing => "furnishing",
        Role::Door => "door",
        Role::Window => "window",
        Role::Unknown => "not told",
        Role::Stair => "stair",
    };
    let size = of.bounds.size();
    let named = if home.source.is_some() { format!("{cell} ({})", home.name) } else { cell.to_string() };
    let mut facts = vec![
        ("Node", of.node.clone()),
        ("Object", object.to_string()),
        ("Role", role.to_owned()),
        ("Cell", named),
        ("Triangles", of.triangles.len().to_string()),
        ("Size", size.to_array().map(|side| units.length(side)).join(" x ")),
    ];
    let material = material(building, object).zip(scene.trace.as_ref()).map(|(i, trace)| &trace.materials[i as usize]);
    facts.extend(material.map(|material| ("Material", material.name.clone())));
    facts
}

/// The window to find things in.
#[derive(Default)]
pub struct Find {
    /// Whether it is there.
    pub is_open: bool,
    text: String,
    found: Vec<Found>,
    /// It was opened just now: what is typed goes to it.
    is_new: bool,
}

impl Find {
    /// Opens or shuts it.
    pub fn toggle(&mut self) {
        self.is_open ^= true;
        self.is_new = self.is_open;
    }

    /// Draws it; returns the hit that was clicked.
    pub fn show(&mut self, ui: &mut egui::Ui, building: &Building) -> Option<What> {
        let mut chosen = None;
        let window =
            egui::Window::new("Find").id(egui::Id::unique("find")).default_pos([8.0, 180.0]).open(&mut self.is_open);
        window.resizable(false).show(ui.ctx(), |ui| {
            let hint = "room, node or material";
            let field = ui.add(egui::TextEdit::singleline(&mut self.text).hint_text(hint).desired_width(240.0));
            if std::mem::take(&mut self.is_new) {
                field.request_focus();
            }
            if field.changed() {
                self.found = find(building, &self.text);
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            if let Some(first) = self.found.first().filter(|_| is_entered) {
                chosen = Some(first.what);
            }
            egui::ScrollArea::vertical().max_height(LIST).auto_shrink([false, true]).show(ui, |ui| {
                for found in &self.found {
                    let kind = match found.what {
                        What::Room(cell) => format!("room, cell {cell}"),
                        What::Node(_) => "node".to_owned(),
                        What::Material(_) => "material".to_owned(),
                    };
                    let hit = ui.selectable_label(false, &found.name).on_hover_text(&kind);
                    if hit.clicked() {
                        chosen = Some(found.what);
                    }
                }
            });
            if !self.text.trim().is_empty() {
                match self.found.len() {
                    MOST => ui.small(format!("the first {MOST}")),
                    n => ui.small(format!("{n} found")),
                };
            }
        });
        chosen
    }
}

/// Draws what is told of a picked object.
pub fn tell(ui: &mut egui::Ui, keys: &KeyMap, facts: &[(&'static str, String)]) {
    let window = egui::Window::new("Picked").id(egui::Id::unique("picked")).anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]);
    window.collapsible(false).resizable(false).show(ui.ctx(), |ui| {
        egui::Grid::new("facts").num_columns(2).show(ui, |ui| {
            for (name, value) in facts {
                ui.weak(*name);
                ui.label(value);
                ui.end_row();
            }
        });
        let (hide, only) = (keys.name_of(Action::Hide), keys.name_of(Action::Isolate));
        ui.small(format!("{hide}: hide it. {only}: show only it. Shift+{hide}: show all."));
    });
}
