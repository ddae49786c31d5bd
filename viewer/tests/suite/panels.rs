//! Panels without a device or a window: a click on what they show gives the right command.

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use enfilade_viewer::commands::{Command, TABLE};
use enfilade_viewer::keymap::{Bound, KeyMap, all};
use enfilade_viewer::looks::Detail;
use enfilade_viewer::session::section::Cut;
use enfilade_viewer::settings::Preferences;
use enfilade_viewer::ui::rebind::Rebind;
use enfilade_viewer::ui::welcome::{Chosen, Welcome};
use enfilade_viewer::ui::{hud, preferences, rebind, section, toolbar};
use std::cell::RefCell;
use std::path::PathBuf;

/// Vertical opening angle, radians: of whole degrees, as the slider shows them.
const FOV: f64 = std::f64::consts::FRAC_PI_2;

/// What a panel gives after a click on each of some labels.
fn clicked<T>(labels: &[&str], panel: impl Fn(&mut egui::Ui) -> Vec<T>) -> Vec<T> {
    let given = RefCell::new(Vec::new());
    // High enough for the list of all keys. The number fields of sliders have no name of their own.
    let builder = Harness::builder().with_size([640.0, 1600.0]).with_accessibility_check(false);
    let mut harness = builder.build_ui(|ui| given.borrow_mut().extend(panel(ui)));
    harness.run();
    for label in labels {
        harness.get_by_label(label).click();
        harness.run();
    }
    drop(harness);
    given.into_inner()
}

#[test]
fn every_action_has_a_button_that_does_it() {
    let keys = KeyMap::default();
    for entry in &TABLE {
        let given = clicked(&[entry.label], |ui| toolbar::open(ui, &keys, &|_| false).into_iter().collect());
        assert_eq!(given, [Command::Act(entry.action)], "{}", entry.label);
    }
    let menu = clicked(&["Menu"], |ui| toolbar::closed(ui, &keys).into_iter().collect());
    assert_eq!(menu, [Command::Act(enfilade_viewer::commands::Action::Menu)]);
}

#[test]
fn settings_give_a_command_for_what_changes_and_none_for_the_rest() {
    let (keys, waiting) = (KeyMap::default(), Rebind::default());
    let usual = Preferences::default();
    let panel = |ui: &mut egui::Ui| preferences::show(ui, &usual, FOV, Detail::Full, (&keys, &waiting));
    assert_eq!(clicked(&[], panel), []);
    assert_eq!(clicked(&["smooth"], panel), [Command::SetDetail(Detail::Smooth)]);
    let inverted = Preferences { inverted: true, ..usual };
    assert_eq!(clicked(&["up and down inverted"], panel), [Command::SetPreferences(inverted)]);
    let fast = Preferences { speed: 3.0, ..usual };
    let changed = |ui: &mut egui::Ui| preferences::show(ui, &fast, FOV, Detail::Full, (&keys, &waiting));
    let reset = clicked(&["Defaults"], changed);
    assert!(
        matches!(reset[..], [Command::SetPreferences(first), Command::SetFieldOfView(_)] if first == usual),
        "{reset:?}"
    );
}

#[test]
fn a_click_on_a_key_waits_for_another() {
    let (mut keys, waiting) = (KeyMap::default(), Rebind::default());
    let (bound, code, name, _) = all().find(|(.., label)| *label == "Fly").unwrap();
    let panel = |ui: &mut egui::Ui| rebind::show(ui, &keys, &waiting).into_iter().collect();
    assert_eq!(clicked(&["Keys of actions", name], panel), [Command::WaitForKey(bound)]);
    assert!(matches!(bound, Bound::Act(_)));
    keys.give(bound, winit::keyboard::KeyCode::F20).unwrap();
    assert_ne!(keys.key(bound), Some(code));
    let panel = |ui: &mut egui::Ui| rebind::show(ui, &keys, &waiting).into_iter().collect();
    assert_eq!(clicked(&["Keys of actions", "Usual keys"], panel), [Command::UsualKeys]);
}

#[test]
fn a_section_is_turned_and_a_question_is_answered() {
    let cut = Cut::default();
    let panel = |ui: &mut egui::Ui| section::show(ui, &cut, 0.0).into_iter().collect();
    assert_eq!(clicked(&["Facing"], panel), [Command::SetSection(true)]);
    let question = |ui: &mut egui::Ui| hud::question(ui).into_iter().collect();
    let answers = [("Save and quit", Command::SaveAndQuit), ("Quit", Command::Quit), ("Stay", Command::Stay)];
    for (label, command) in answers {
        assert_eq!(clicked(&[label], question), [command], "{label}");
    }
}

#[test]
fn the_start_screen_opens_a_recent_file_or_the_dialog_and_no_missing_file() {
    let (there, gone) = (PathBuf::from("/houses/there.glb"), PathBuf::from("/houses/gone.glb"));
    let recent = vec![(there.clone(), true), (gone, false)];
    let welcome = Welcome { recent, line: Some("bad.pvs: no pvs file".into()) };
    let panel = |ui: &mut egui::Ui| welcome.show(ui, &["pvs", "glb"]).into_iter().collect();
    assert_eq!(clicked(&["there.glb"], panel), [Chosen::File(there)]);
    assert_eq!(clicked(&["Open…"], panel), [Chosen::Dialog]);
    for label in ["gone.glb (missing)", "bad.pvs: no pvs file", "This build reads pvs, glb."] {
        assert_eq!(clicked(&[label], panel), [], "{label}");
    }
}
