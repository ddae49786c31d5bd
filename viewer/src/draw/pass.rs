//! Render passes of the viewer: over a picture with depth, or over a picture alone.

use wgpu::{Color, CommandEncoder, LoadOp, Operations, RenderPass, RenderPassColorAttachment, StoreOp, TextureView};

/// A pass over a picture and a depth; with `clear`, both are cleared.
pub fn begin<'e>(
    commands: &'e mut CommandEncoder,
    picture: &TextureView,
    depth: &TextureView,
    clear: Option<Color>,
    stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> RenderPass<'e> {
    begin_resolved(commands, (picture, None), depth, clear, stamps)
}

/// The same; the samples of the picture are averaged into `to`.
pub fn begin_resolved<'e>(
    commands: &'e mut CommandEncoder,
    (picture, to): (&TextureView, Option<&TextureView>),
    depth: &TextureView,
    clear: Option<Color>,
    stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> RenderPass<'e> {
    commands.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(RenderPassColorAttachment { resolve_target: to, ..attachment(picture, clear) })],
        depth_stencil_attachment: Some(depth_attachment(depth, clear.map(|_| 0.0))),
        timestamp_writes: stamps,
        ..Default::default()
    })
}

/// A pass over a picture without depth.
pub fn begin_flat<'e>(commands: &'e mut CommandEncoder, picture: &TextureView, clear: Option<Color>) -> RenderPass<'e> {
    commands.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment(picture, clear))],
        ..Default::default()
    })
}

/// Depth that is tested and written; `clear`: what it begins with.
pub fn depth_attachment(view: &TextureView, clear: Option<f32>) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let load = clear.map_or(LoadOp::Load, LoadOp::Clear);
    let depth_ops = Some(Operations { load, store: StoreOp::Store });
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}

fn attachment(view: &TextureView, clear: Option<Color>) -> RenderPassColorAttachment<'_> {
    let load = clear.map_or(LoadOp::Load, LoadOp::Clear);
    let ops = Operations { load, store: StoreOp::Store };
    RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
}
