//! The plan of a storey as a picture: the SVG of [`crate::plan_file`] painted by the interface's painter.

use crate::draw::frame::{Painter, colour};
use crate::draw::targets::{Canvas, PICTURE};
use crate::plan_file::{INKS, LOOKS, TEXT};
use crate::ui::paint::Egui;
use egui::{Color32, Pos2, Rect, Stroke, pos2};
use enfilade::gpu::Gpu;
use enfilade_measure::walkthrough::picture::Picture;

/// Width of pictures, pixels.
const WIDTH: u32 = 2000;
/// Most pixels of a side: what any device draws on.
const MOST: u32 = 8192;
/// A line of text of some size has its middle so many sizes above its foot.
const MIDDLE: f32 = 0.36;
/// Bold letters are drawn twice, so far from each other, in the units of the SVG.
const BOLD: f32 = 0.35;
/// Frames until the letters of a font are there.
const FRAMES: usize = 2;

/// Paints a plan.
///
/// # Errors
///
/// One line: the device has failed.
pub fn picture(gpu: &Gpu, svg: &str) -> Result<Picture, String> {
    let [width, height] = size(svg).ok_or("no plan")?;
    let scale = WIDTH as f32 / width;
    let size = [WIDTH, ((height * scale).round() as u32).clamp(1, MOST.min(gpu.limits.max_texture_dimension_2d))];
    let (mut egui, canvas) = (Egui::new(gpu, PICTURE), Canvas::new(gpu, size));
    egui.context.set_zoom_factor(scale);
    for _ in 0..FRAMES {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, egui::vec2(width, height)));
        egui.run(egui::RawInput { screen_rect, ..Default::default() }, size, |ui| {
            let layer = egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("plan"));
            paint(&ui.ctx().layer_painter(layer), svg);
        });
    }
    let mut commands = gpu.device.create_command_encoder(&Default::default());
    egui.prepare(gpu, &mut commands);
    let pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[colour(&canvas.view, Some(wgpu::Color::WHITE))],
        ..Default::default()
    });
    egui.paint(pass.forget_lifetime());
    gpu.queue.submit([commands.finish()]);
    canvas.read(gpu).map_err(|e| e.to_string())
}

/// Width and height, in its own units.
fn size(svg: &str) -> Option<[f32; 2]> {
    let view = attribute(svg.split_once("<svg ")?.1, "viewBox")?;
    let numbers: Vec<f32> = view.split(' ').filter_map(|n| n.parse().ok()).collect();
    let &[.., width, height] = &numbers[..] else { return None };
    (width >= 1.0 && height >= 1.0).then_some([width, height])
}

/// Paths and texts in their order, as the plans have them: no other SVG.
fn paint(painter: &egui::Painter, svg: &str) {
    for element in svg.split('<') {
        let (tag, text) = element.split_once('>').unwrap_or((element, ""));
        if tag.starts_with("path ") {
            path(painter, tag);
        } else if tag.starts_with("text ") {
            write(painter, tag, text);
        }
    }
}

fn attribute<'s>(tag: &'s str, name: &str) -> Option<&'s str> {
    let start = tag.find(&format!("{name}=\""))? + name.len() + 2;
    tag[start..].split('"').next()
}

fn rgb([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

fn path(painter: &egui::Painter, tag: &str) {
    let classes: Vec<&str> = attribute(tag, "class").unwrap_or_default().split(' ').collect();
    let lines = lines(attribute(tag, " d").unwrap_or_default());
    let (mut stroke, mut width, mut dashes) = (None, 1.0, None);
    for look in LOOKS.iter().filter(|look| classes.contains(&look.class)) {
        if let Some(fill) = look.fill {
            painter.add(filled(&lines, rgb(fill)));
        }
        stroke = look.stroke.or(stroke);
        width = look.width.unwrap_or(width);
        dashes = look.dashes.or(dashes);
    }
    let Some(stroke) = stroke.map(|colour| Stroke::new(width, rgb(colour))) else { return };
    for line in lines {
        match dashes {
            Some([dash, gap]) => painter.extend(egui::Shape::dashed_line(&line, stroke, dash, gap)),
            None => drop(painter.line(line, stroke)),
        }
    }
}

/// Points of each line of a path of absolute moves and lines; a closed one ends where it began.
fn lines(d: &str) -> Vec<Vec<Pos2>> {
    let mut lines: Vec<Vec<Pos2>> = Vec::new();
    let starts = d.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(i, _)| i);
    let mut at = pos2(0.0, 0.0);
    for start in starts {
        let rest = &d[start + 1..];
        let end = rest.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(rest.len());
        let numbers: Vec<f32> = rest[..end].split_whitespace().filter_map(|n| n.parse().ok()).collect();
        at = match (&d[start..=start], &numbers[..]) {
            ("M" | "L", &[x, y]) => pos2(x, y),
            ("H", &[x]) => pos2(x, at.y),
            ("V", &[y]) => pos2(at.x, y),
            ("Z", []) => lines.last().map_or(at, |line| line[0]),
            _ => continue,
        };
        match lines.last_mut() {
            Some(line) if &d[start..=start] != "M" => line.push(at),
            _ => lines.push(vec![at]),
        }
    }
    lines
}

/// What is inside of rings an odd number of times, in level strips from one corner's height to the next.
fn filled(rings: &[Vec<Pos2>], colour: Color32) -> egui::Mesh {
    let mut heights: Vec<f32> = rings.iter().flatten().map(|p| p.y).collect();
    heights.sort_by(f32::total_cmp);
    heights.dedup();
    let sides: Vec<[Pos2; 2]> = rings.iter().flat_map(|ring| ring.windows(2).map(|side| [side[0], side[1]])).collect();
    let mut mesh = egui::Mesh::default();
    for strip in heights.windows(2) {
        let (top, foot) = (strip[0], strip[1]);
        let reaches = |[a, b]: &&[Pos2; 2]| a.y.min(b.y) <= top && a.y.max(b.y) >= foot;
        let x = |[a, b]: &[Pos2; 2], y: f32| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
        let across = sides.iter().filter(reaches).filter(|[a, b]| a.y != b.y);
        let mut across: Vec<[f32; 2]> = across.map(|side| [x(side, top), x(side, foot)]).collect();
        across.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
        for pair in across.chunks_exact(2) {
            let first = mesh.vertices.len() as u32;
            let corners = [(pair[0][0], top), (pair[1][0], top), (pair[1][1], foot), (pair[0][1], foot)];
            corners.iter().for_each(|&(x, y)| mesh.colored_vertex(pos2(x, y), colour));
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first, first + 2, first + 3);
        }
    }
    mesh
}

fn write(painter: &egui::Painter, tag: &str, text: &str) {
    let number = |name: &str| attribute(tag, name).and_then(|n| n.parse::<f32>().ok());
    let (Some(x), Some(y)) = (number(" x"), number(" y")) else { return };
    let size = attribute(tag, "style").and_then(|s| s.strip_prefix("font-size:")?.strip_suffix("px")?.parse().ok());
    let size: f32 = size.unwrap_or(TEXT);
    let is_name = attribute(tag, "class") == Some("name");
    let (align, ink) = if is_name { (egui::Align2::CENTER_CENTER, INKS[0]) } else { (egui::Align2::LEFT_CENTER, INKS[1]) };
    let text =
        text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&#39;", "'").replace("&amp;", "&");
    let offsets: &[f32] = if is_name { &[-0.5 * BOLD, 0.5 * BOLD] } else { &[0.0] };
    for by in offsets {
        painter.text(pos2(x + by, y - MIDDLE * size), align, &text, egui::FontId::proportional(size), rgb(ink));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_as_they_are_written() {
        let p = |x, y| pos2(x, y);
        assert_eq!(
            lines("M1.0 2.0L3.0 4.0L5.5 -6.0ZM14 9.0V14.0H30V9.0"),
            [
                vec![p(1.0, 2.0), p(3.0, 4.0), p(5.5, -6.0), p(1.0, 2.0)],
                vec![p(14.0, 9.0), p(14.0, 14.0), p(30.0, 14.0), p(30.0, 9.0)]
            ]
        );
        assert_eq!(lines(""), Vec::<Vec<Pos2>>::new());
    }

    #[test]
    fn a_ring_in_a_ring_is_a_hole() {
        let square = |a: f32, b: f32| [(a, a), (b, a), (b, b), (a, b), (a, a)].map(|(x, y)| pos2(x, y)).to_vec();
        let mesh = filled(&[square(0.0, 4.0), square(1.0, 3.0)], Color32::RED);
        let corner = |i: u32| mesh.vertices[i as usize].pos.to_vec2();
        let area = |t: &[u32]| {
            let (u, v) = (corner(t[1]) - corner(t[0]), corner(t[2]) - corner(t[0]));
            0.5 * (u.x * v.y - u.y * v.x).abs()
        };
        assert_eq!(mesh.indices.chunks_exact(3).map(area).sum::<f32>(), 12.0);
    }
}
