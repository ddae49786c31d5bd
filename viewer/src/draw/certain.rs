//! The first pass over the scene: what is certain to be drawn, and in `hiz` what showed in the frame before.

use super::draws::Draws;
use super::frame::{FrameContext, Passes, Timed};
use super::full::Full;
use super::pass::begin;
use wgpu::{CommandEncoder, RenderPass};

/// Clears the picture.
const SKY: wgpu::Color = wgpu::Color { r: 0.80, g: 0.87, b: 0.94, a: 1.0 };

/// Records the pass.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if let (Some(hiz), true) = (&mut passes.hiz, frame.is_by_pyramid()) {
        hiz.choose(frame.gpu, &frame.camera, frame.targets.size, !frame.is_new, commands);
    }
    let (full, hiz) = (passes.full(frame), passes.hiz(frame));
    let mut pass = begin_scene(frame, full, Some(SKY), passes.stamps(frame, Timed::Certain), commands);
    let (eye, lists) = (frame.eye, frame.lists);
    match full {
        Some(full) => full.draw(&mut pass, eye, &lists.draws, (frame.leaves, &lists.leaves)),
        None => {
            frame.pipelines.bind(&mut pass, eye);
            frame.pipelines.colours.draw_listed(&mut pass, &lists.draws);
            frame.leaves.draw(&mut pass, eye, &frame.pipelines.colours, &lists.leaves);
        }
    }
    if let Some(hiz) = hiz {
        draw_decided(frame, full, &hiz.passes[0], &mut pass);
    }
    if let Some(terrain) = frame.terrain {
        terrain.draw(&mut pass, full.and_then(Full::smooth).is_some());
    }
    // Thin tubes are blended: after everything behind them.
    if hiz.is_none() || !frame.is_new {
        draw_tubes(frame, full, &mut pass);
    }
}

/// A pass over the scene, with several samples a pixel if the frame has them.
pub fn begin_scene<'e>(
    frame: &FrameContext<'_>,
    full: Option<&Full>,
    clear: Option<wgpu::Color>,
    stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
    commands: &'e mut CommandEncoder,
) -> RenderPass<'e> {
    match full.and_then(Full::smooth) {
        Some(smooth) => smooth.begin(commands, clear, None, stamps),
        None => begin(commands, frame.picture, &frame.targets.depth, clear, stamps),
    }
}

/// Draws what the device decided to draw.
pub fn draw_decided(frame: &FrameContext<'_>, full: Option<&Full>, draws: &Draws, pass: &mut RenderPass<'_>) {
    match full {
        Some(full) => full.draw_decided(pass, frame.eye, draws),
        None => {
            frame.pipelines.bind(pass, frame.eye);
            frame.pipelines.colours.draw_listed(pass, draws);
        }
    }
}

/// Draws the tubes of the frame.
pub fn draw_tubes(frame: &FrameContext<'_>, full: Option<&Full>, pass: &mut RenderPass<'_>) {
    match (frame.tubes, full) {
        (Some(tubes), Some(full)) => full.draw_tubes(pass, frame.eye, &tubes.drawn, full.smooth().is_some()),
        (Some(tubes), None) => tubes.draw(pass, frame.eye, &tubes.drawn),
        (None, _) => {}
    }
}
