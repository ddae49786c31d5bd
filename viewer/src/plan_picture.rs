//! The plan of a storey as a picture: its SVG, rendered with the font of the interface.

use enfilade_measure::walkthrough::picture::Picture;
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::fontdb::Source;
use resvg::usvg::{Options, Tree};
use std::sync::Arc;

/// Width of pictures, pixels.
const WIDTH: f32 = 2000.0;
/// Pixels of a side at most.
const MOST: f32 = 8192.0;
/// Family of the font that the interface shows text in.
const FONT: &str = "Ubuntu";

/// Renders a plan.
///
/// # Errors
///
/// One line: it is no SVG.
pub fn picture(svg: &str) -> Result<Picture, String> {
    let mut options = Options { font_family: FONT.to_owned(), ..Options::default() };
    let fonts = Arc::make_mut(&mut options.fontdb);
    for font in egui::FontDefinitions::default().font_data.values() {
        fonts.load_font_source(Source::Binary(font.font.clone()));
    }
    fonts.set_sans_serif_family(FONT);
    let tree = Tree::from_str(svg, &options).map_err(|e| e.to_string())?;
    let scale = WIDTH / tree.size().width();
    let height = (tree.size().height() * scale).round().clamp(1.0, MOST);
    let mut pixels = Pixmap::new(WIDTH as u32, height as u32).ok_or("no plan")?;
    pixels.fill(Color::WHITE);
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
    let mut picture = Picture::new(WIDTH as usize, height as usize, [255; 3]);
    for (to, from) in picture.pixels_mut().iter_mut().zip(pixels.pixels()) {
        *to = [from.red(), from.green(), from.blue()];
    }
    Ok(picture)
}
