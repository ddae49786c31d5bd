//! The frame loop of an engine that culls with a `.pvs` file: once a frame it asks what can be seen, and draws that and nothing else.
//!
//! ```text
//! cargo run --example wgpu_loop --features gpu -- FILE.pvs MODEL [PICTURE.png]
//! ```
//!
//! It walks through every cell and draws into a texture, so that each frame can be held against one of everything: no pixel may differ. The
//! picture is of the frame that draws the most. What any engine has (a device, a pipeline, the model in one vertex and one index buffer) is
//! in `shared/canvas.rs` and `wgpu_loop/renderer.rs`.

#[path = "shared/canvas.rs"]
mod canvas;
#[path = "shared/command.rs"]
mod command;
#[path = "wgpu_loop/renderer.rs"]
mod renderer;

use canvas::ASPECT;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Mode, View};
use enfilade_formats::import;
use enfilade_measure::walkthrough::tour::tour;
use renderer::Renderer;
use std::path::Path;

/// Walks, and says how much was drawn of all; an error is one line.
pub fn run(pvs: &Path, model: &Path, picture: Option<&Path>) -> Result<String, String> {
    let file = PvsFile::load(pvs).map_err(|e| e.to_string())?;
    let scene = import(model, &file.import.options()).map_err(|e| format!("{}: {e}", model.display()))?;
    if scene.hash() != file.model_hash {
        return Err(format!("{}: not the model of {}", model.display(), pvs.display()));
    }
    let mut view = View::new(&Culler::new(&file));
    let mut renderer = Renderer::new(&scene)?;
    let (path, all) = (tour(&file, 0), scene.triangles.len() as u32);
    let (mut drawn, mut most) = (0, 0);
    for frame in 0..path.frames.len() {
        // Positions are relative to the file's origin. An engine with a matrix: `Camera::from_view_proj`.
        let camera = path.camera(frame, file.origin, ASPECT);
        let mut visible = view.cull(&camera, Mode::PortalsAndPvs);
        let count = visible.stats.triangles;
        // Objects lie in the index buffer in the order of their ids, so neighbours are one draw.
        let culled = renderer.frame(&camera, |pass| {
            visible.runs().iter().for_each(|run| pass.draw_indexed(run.clone(), 0, 0..1));
        })?;
        if culled != renderer.frame(&camera, |pass| pass.draw_indexed(0..3 * all, 0, 0..1))? {
            return Err(format!("frame {frame}: the picture differs from one of everything"));
        }
        if let Some(to) = picture.filter(|_| count > most) {
            culled.save(to).map_err(|e| format!("{}: {e}", to.display()))?;
        }
        (drawn, most) = (drawn + count, most.max(count));
    }
    let (count, mean) = (path.frames.len(), drawn / path.frames.len().max(1) as u64);
    Ok(format!(
        "{count} frames, each as one of everything: {mean} of {all} triangles drawn a frame ({})",
        renderer.canvas.adapter
    ))
}

fn main() {
    command::main("wgpu_loop", "FILE.pvs MODEL", run);
}
