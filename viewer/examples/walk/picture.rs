//! A moving picture, small: pictures share a palette by scenes, what stays is left out, and runs are made longer.

use color_quant::NeuQuant;
use std::borrow::Cow;
use std::fs::File;
use std::path::Path;

/// Pictures with one palette.
const SCENE: usize = 12;
/// Colours of a palette; one more means what was there before.
const COLOURS: usize = 63;
/// Colours are learned from one pixel in so many.
const SAMPLE: i32 = 7;
/// A pixel may be off by so much of 255, all three colours together, where that makes a run longer. More: smears are seen.
const OFF: i32 = 18;

/// Its pictures.
pub struct Moving {
    size: [u16; 2],
    /// Of a picture, hundredths of a second.
    delay: u16,
    pictures: Vec<Vec<[u8; 3]>>,
}

/// Colours, and which of them is nearest to each of 32,768.
struct Palette {
    colours: Vec<[u8; 3]>,
    nearest: Vec<u8>,
}

impl Moving {
    /// So many pictures a second.
    pub fn new(size: [u32; 2], a_second: f64) -> Self {
        Self { size: size.map(|s| s as u16), delay: (100.0 / a_second).round() as u16, pictures: Vec::new() }
    }

    /// Adds a picture.
    pub fn add(&mut self, pixels: &[[u8; 3]]) {
        self.pictures.push(pixels.to_vec());
    }

    /// Writes all of them, for ever again.
    pub fn write(&self, to: &Path) -> Result<(), gif::EncodingError> {
        let [width, height] = self.size;
        let mut encoder = gif::Encoder::new(File::create(to)?, width, height, &[])?;
        encoder.set_repeat(gif::Repeat::Infinite)?;
        let mut shown: Vec<[u8; 3]> = Vec::new();
        for scene in self.pictures.chunks(SCENE) {
            let palette = Palette::of(scene);
            let table: Vec<u8> = palette.colours.iter().flatten().copied().chain([0; 3]).collect();
            for picture in scene {
                let buffer = palette.draw(picture, &mut shown);
                encoder.write_frame(&gif::Frame {
                    delay: self.delay,
                    dispose: gif::DisposalMethod::Keep,
                    transparent: Some(palette.colours.len() as u8),
                    width,
                    height,
                    palette: Some(table.clone()),
                    buffer: Cow::Owned(buffer),
                    ..gif::Frame::default()
                })?;
            }
        }
        Ok(())
    }
}

impl Palette {
    fn of(pictures: &[Vec<[u8; 3]>]) -> Self {
        let rgba: Vec<u8> = pictures.iter().flatten().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
        let colours: Vec<[u8; 3]> =
            NeuQuant::new(SAMPLE, COLOURS, &rgba).color_map_rgb().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let nearest = (0..1 << 15).map(|i: u32| {
            let colour = [i >> 10, i >> 5 & 31, i & 31].map(|c| (c * 8 + 4) as u8);
            (0..colours.len()).min_by_key(|&k| apart(colours[k], colour)).unwrap_or(0) as u8
        });
        Self { nearest: nearest.collect(), colours }
    }

    /// Numbers of colours, and of what stays as it is `shown`, which is made what is shown next.
    fn draw(&self, picture: &[[u8; 3]], shown: &mut Vec<[u8; 3]>) -> Vec<u8> {
        let same = self.colours.len() as u8;
        let is_first = shown.is_empty();
        shown.resize(picture.len(), [0; 3]);
        let mut run = same;
        let draw = |(&colour, shown): (&[u8; 3], &mut [u8; 3])| {
            let [r, g, b] = colour.map(|c| usize::from(c >> 3));
            let best = self.nearest[r << 10 | g << 5 | b];
            let limit = apart(self.colours[usize::from(best)], colour) + OFF;
            let goes_on = |number: u8, shown: [u8; 3]| match self.colours.get(usize::from(number)) {
                Some(&of) => apart(of, colour) <= limit,
                None => !is_first && apart(shown, colour) <= limit,
            };
            if !goes_on(run, *shown) {
                run = if goes_on(same, *shown) { same } else { best };
            }
            *shown = self.colours.get(usize::from(run)).copied().unwrap_or(*shown);
            run
        };
        picture.iter().zip(shown).map(draw).collect()
    }
}

fn apart(a: [u8; 3], b: [u8; 3]) -> i32 {
    (0..3).map(|i| i32::from(a[i].abs_diff(b[i]))).sum()
}
