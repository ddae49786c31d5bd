//! The second pass over the scene: what the device decides by occlusion queries or by the depth pyramid.

use super::certain::{begin_scene, draw_decided, draw_tubes};
use super::frame::{FrameContext, Passes, Timed};
use super::full::Full;
use wgpu::CommandEncoder;

/// Records the questions and the pass that draws by their answers.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if !frame.is_decided_by_device() {
        return;
    }
    let smooth = passes.full.as_ref().filter(|_| frame.is_full).and_then(Full::smooth);
    let depth = smooth.map_or((&frame.targets.depth, false), |smooth| (&smooth.depth, true));
    match &mut passes.hiz {
        Some(hiz) if frame.is_by_pyramid() => hiz.choose_rest(frame.gpu, depth, commands),
        _ => passes.queries.record(frame, depth, commands),
    }
    let (full, hiz) = (passes.full(frame), passes.hiz(frame));
    let draws = hiz.map_or(&passes.queries.draws, |hiz| &hiz.passes[1]);
    let mut pass = begin_scene(frame, full, None, passes.stamps(frame, Timed::Decided), commands);
    draw_decided(frame, full, draws, &mut pass);
    if hiz.is_some() {
        draw_tubes(frame, full, &mut pass);
    }
}
