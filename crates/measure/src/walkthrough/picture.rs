//! A picture in memory: pixels, lines, polygons, text, PNG.

use font8x8::{BASIC_FONTS, UnicodeFonts};
use glam::DVec2;
use std::io::Write;
use std::path::Path;

/// Red, green, blue, as in sRGB.
pub type Colour = [u8; 3];

/// Width and height of a character at scale 1, pixels.
pub const CHARACTER: usize = 8;

/// A picture, row by row from the top.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Picture {
    /// A picture of one colour.
    pub fn new(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, height, pixels: vec![colour; width * height] }
    }

    /// Width, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Every pixel.
    pub fn pixels(&self) -> &[Colour] {
        &self.pixels
    }

    /// Every pixel, to write.
    pub fn pixels_mut(&mut self) -> &mut [Colour] {
        &mut self.pixels
    }

    /// Blends `colour` over a pixel with `opacity` (0 to 1); ignores pixels outside the picture.
    pub fn blend(&mut self, x: i64, y: i64, colour: Colour, opacity: f32) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            *pixel = mix(*pixel, colour, opacity);
        }
    }

    /// Fills a rectangle of pixels.
    pub fn fill(&mut self, x: i64, y: i64, width: i64, height: i64, colour: Colour, opacity: f32) {
        for row in y.max(0)..(y + height).min(self.height as i64) {
            for column in x.max(0)..(x + width).min(self.width as i64) {
                self.blend(column, row, colour, opacity);
            }
        }
    }

    /// The outline of a rectangle of pixels, one pixel wide.
    pub fn frame(&mut self, x: i64, y: i64, width: i64, height: i64, colour: Colour, opacity: f32) {
        self.fill(x, y, width, 1, colour, opacity);
        self.fill(x, y + height - 1, width, 1, colour, opacity);
        self.fill(x, y + 1, 1, height - 2, colour, opacity);
        self.fill(x + width - 1, y + 1, 1, height - 2, colour, opacity);
    }

    /// A line `thickness` pixels wide.
    pub fn line(&mut self, a: DVec2, b: DVec2, thickness: f64, colour: Colour) {
        let along = (b - a).normalize_or_zero();
        let half = thickness * 0.5;
        let low = (a.min(b) - half - 1.0).floor().max(DVec2::ZERO);
        let high = (a.max(b) + half + 1.0).ceil().min(DVec2::new(self.width as f64, self.height as f64));
        for y in low.y as i64..high.y as i64 {
            for x in low.x as i64..high.x as i64 {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - a;
                let nearest = along * p.dot(along).clamp(0.0, (b - a).length());
                // A ramp of one pixel at the edge makes the line smooth.
                let cover = (half + 0.5 - (p - nearest).length()).clamp(0.0, 1.0);
                self.blend(x, y, colour, cover as f32);
            }
        }
    }

    /// Fills the pixels whose centres are inside a polygon by the even-odd rule.
    pub fn polygon(&mut self, corners: &[DVec2], colour: Colour, opacity: f32) {
        let low = corners.iter().fold(f64::INFINITY, |v, p| v.min(p.y)).max(0.0);
        let high = corners.iter().fold(f64::NEG_INFINITY, |v, p| v.max(p.y)).min(self.height as f64);
        let mut crossings: Vec<f64> = Vec::new();
        for y in low.floor() as i64..high.ceil() as i64 {
            let middle = y as f64 + 0.5;
            crossings.clear();
            for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                if (a.y <= middle) != (b.y <= middle) {
                    crossings.push(a.x + (b.x - a.x) * (middle - a.y) / (b.y - a.y));
                }
            }
            crossings.sort_by(f64::total_cmp);
            for span in crossings.chunks_exact(2) {
                let from = (span[0] - 0.5).ceil().max(0.0) as i64;
                let to = (span[1] - 0.5).ceil().min(self.width as f64) as i64;
                for x in from..to {
                    self.blend(x, y, colour, opacity);
                }
            }
        }
    }

    /// Text in an 8 x 8 font, `scale` pixels a dot; unknown characters stay blank.
    pub fn text(&mut self, x: i64, y: i64, scale: usize, text: &str, colour: Colour) {
        let size = scale as i64;
        for (i, c) in text.chars().enumerate() {
            let left = x + (i * CHARACTER * scale) as i64;
            for (row, bits) in BASIC_FONTS.get(c).unwrap_or_default().into_iter().enumerate() {
                for column in (0..CHARACTER).filter(|&column| bits >> column & 1 != 0) {
                    self.fill(left + column as i64 * size, y + row as i64 * size, size, size, colour, 1.0);
                }
            }
        }
    }

    /// Lays another picture over this one.
    pub fn paste(&mut self, x: i64, y: i64, other: &Self, opacity: f32) {
        for (i, &colour) in other.pixels.iter().enumerate() {
            self.blend(x + (i % other.width) as i64, y + (i / other.width) as i64, colour, opacity);
        }
    }

    /// Writes it as PNG.
    pub fn write_png(&self, to: impl Write) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(to, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())
    }

    /// Writes it to a PNG file.
    pub fn save(&self, path: &Path) -> std::io::Result<()> {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        self.write_png(&mut file)?;
        file.flush()
    }
}

/// `a` with `opacity` of `b` over it.
pub fn mix(a: Colour, b: Colour, opacity: f32) -> Colour {
    [0, 1, 2].map(|i| (f32::from(a[i]) + (f32::from(b[i]) - f32::from(a[i])) * opacity).round() as u8)
}

/// A colour from hue (turns), saturation and value (0 to 1).
pub fn hsv(hue: f32, saturation: f32, value: f32) -> Colour {
    [5.0, 3.0, 1.0].map(|n| {
        let k = (n + hue.rem_euclid(1.0) * 6.0) % 6.0;
        ((value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)) * 255.0).round() as u8
    })
}

/// A hue for the `i`-th of many things: consecutive numbers get distant hues.
pub fn hue(i: usize) -> f32 {
    super::golden_turn(i) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_drawn_is_where_it_should_be_and_nothing_is_drawn_outside() {
        let mut picture = Picture::new(20, 10, [0; 3]);
        let square = [(2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)].map(|(x, y)| DVec2::new(x, y));
        picture.polygon(&square, [255; 3], 1.0);
        let lit = |p: &Picture| p.pixels().iter().filter(|&&c| c != [0; 3]).count();
        assert_eq!(lit(&picture), 16);
        assert_eq!((picture.pixels()[2 * 20 + 2], picture.pixels()[6 * 20 + 6]), ([255; 3], [0; 3]));
        picture.frame(10, 1, 4, 3, [9; 3], 1.0);
        assert_eq!(lit(&picture), 16 + 10);
        picture.line(DVec2::new(-5.0, -5.0), DVec2::new(-1.0, -9.0), 1.0, [255; 3]);
        picture.text(18, 8, 1, "W", [255; 3]);
        picture.polygon(&square.map(|p| p + 100.0), [255; 3], 1.0);
    }

    #[test]
    fn a_png_reads_back() {
        let mut picture = Picture::new(7, 5, [10, 20, 30]);
        picture.blend(3, 2, [200, 100, 50], 1.0);
        let mut bytes = Vec::new();
        picture.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut back = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut back).unwrap();
        assert_eq!(back, picture.pixels().as_flattened());
    }

    #[test]
    fn hues_are_those_of_the_colour_wheel() {
        assert_eq!(
            [hsv(0.0, 1.0, 1.0), hsv(1.0 / 3.0, 1.0, 1.0), hsv(0.5, 1.0, 1.0)],
            [[255, 0, 0], [0, 255, 0], [0, 255, 255]]
        );
        assert_eq!(hsv(0.7, 0.0, 0.5), [128; 3]);
    }
}
