//! The window onto Enfilade: walk through a building, and see what is not drawn.
//!
//! [`commands`] is the table of all actions. [`session`] is a visit to a building without a window, so that pictures and tests run the same
//! code; [`app`] is the window. [`ui`] has the panels. [`draw::frame`] lists the passes of a frame. [`culling`] decides what they draw.

pub mod app;
pub mod args;
pub mod bench;
pub mod body;
pub mod building;
pub mod collision;
pub mod colours;
pub mod commands;
pub mod culling;
pub mod delayed_queries;
pub mod dialog;
pub mod doors;
pub mod draw;
pub mod elements;
pub mod explain;
pub mod find;
pub mod gamepad;
pub mod go;
pub mod ground;
pub mod headless;
pub mod heat;
pub mod keymap;
pub mod looks;
pub mod measure;
pub mod mode;
pub mod opening;
pub mod output_files;
pub mod overlays;
pub mod people;
pub mod pick;
pub mod plan_file;
pub mod plan_picture;
pub mod profile;
pub mod recording;
pub mod screen;
pub mod session;
pub mod settings;
pub mod start;
pub mod ui;
pub mod units;
pub mod unstuck;

pub mod walker;

use args::Args;

/// Runs the viewer; false where pixels were missed. The error is one line.
///
/// # Errors
///
/// Bad input, or no device.
pub fn run(args: &Args) -> Result<bool, String> {
    let needs_file = args.bench || [&args.shot, &args.path, &args.model].into_iter().any(Option::is_some);
    if needs_file && args.file.is_none() {
        return Err("give a FILE: only a window can do without".to_owned());
    }
    match (&args.shot, args.bench) {
        (Some(to), _) => headless::shot(args, to),
        (None, true) => bench::bench(args),
        (None, false) => app::run(args).map(|()| true),
    }
}
