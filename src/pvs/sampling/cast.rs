//! Proofs from a visibility cube: a few pixels of each visible object are traced as lines.
//!
//! A cube covers hundreds of thousands of directions for the price of some thousand rays, but only up to the first triangle and without a
//! witness's clearance. So it chooses the lines, and the lines give proofs, in both directions.

use super::sampler::{Random, Sampler, Site};
use super::source::Part;
use super::witness::{Found, Line, Witnessed};
use crate::PortalId;
use crate::job::Stopped;
use crate::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster};
use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Pixels along a face's edge. More: more small objects per cube, fewer cubes in the same time; a cube with a quarter of the pixels takes
/// two thirds of the time.
const SIZE: u32 = 128;
/// Cost of a cube with its lines, in rays of equal time.
pub(super) const COST: u64 = 1_500;
/// Lines through pixels of one object: if it is new for an adjacent cell; otherwise, for the cells farther along.
const LINES: [usize; 2] = [4, 1];

/// Most lines from a cube.
const MOST_LINES: usize = 384;

/// Objects visible from a site, ascending, with their solid angles (fractions of the sphere). Usually two bytes per object: the difference
/// to the previous number, seven bits per byte and the lowest first, and its [`level`]. This is most of a journal, and of the memory of
/// cubes.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Seen(Vec<u8>);

/// A solid angle from 2^-31 to 2, rounded to an eighth of its power of two: an error of at most 6 %.
fn level(solid: f32) -> u8 {
    let rounded = solid.to_bits().saturating_add(1 << (LEVEL_BITS - 1)) >> LEVEL_BITS;
    rounded.saturating_sub(LEVEL_ZERO).min(255) as u8
}

/// The solid angle of a level.
fn of_level(level: u8) -> f32 {
    f32::from_bits((LEVEL_ZERO + u32::from(level)) << LEVEL_BITS)
}

/// Bits of an `f32` dropped by levels, and the remaining bits of the least level: 2^-31 and an eighth more.
const LEVEL_BITS: u32 = 20;
const LEVEL_ZERO: u32 = (127 - 31) * 8 + 1;

impl FromIterator<(u32, f32)> for Seen {
    /// From objects in ascending order.
    fn from_iter<I: IntoIterator<Item = (u32, f32)>>(objects: I) -> Self {
        let (mut last, mut bytes) = (0, Vec::new());
        for (object, solid) in objects {
            let mut gap = object - std::mem::replace(&mut last, object);
            while gap >= 0x80 {
                bytes.push(gap as u8 | 0x80);
                gap >>= 7;
            }
            bytes.extend([gap as u8, level(solid)]);
        }
        bytes.shrink_to_fit();
        Self(bytes)
    }
}

impl Seen {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The objects, ascending, with their solid angles.
    pub fn objects(&self) -> impl Iterator<Item = (u32, f32)> {
        let (mut bytes, mut last) = (self.0.iter(), 0u32);
        std::iter::from_fn(move || {
            let (mut gap, mut shift) = (0u32, 0);
            loop {
                let byte = *bytes.next()?;
                // A damaged journal may have any content.
                gap |= u32::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
                if byte < 0x80 {
                    break;
                }
                shift += 7;
            }
            last = last.wrapping_add(gap);
            Some((last, of_level(*bytes.next()?)))
        })
    }
}

/// A cube to render.
pub(super) struct Stand {
    /// Seed of its random numbers.
    pub seed: u64,
    /// Its place.
    pub site: Site,
    /// Whether it returns all visible objects.
    pub tells: bool,
}

/// Renders cubes and proves what they show.
pub(super) struct Caster<'a> {
    sampler: &'a Sampler<'a>,
    cubes: &'a CubeScene,
    /// Object of each triangle.
    owners: Vec<u32>,
    /// Fraction of the sphere of each pixel of a face.
    solid: Vec<f32>,
}

impl<'a> Caster<'a> {
    /// For a scene's cubes.
    pub fn new(sampler: &'a Sampler<'a>, cubes: &'a CubeScene) -> Self {
        let scene = sampler.prover.rays.scene();
        let flat = CubeView::new(DVec3::ZERO, SIZE);
        let mut owners = vec![0; scene.triangles.len()];
        for (i, object) in (0u32..).zip(&scene.objects) {
            owners[object.triangles.start as usize..object.triangles.end as usize].fill(i);
        }
        let solid = (0..flat.pixels() / 6).map(|p| flat.solid_angle(p) as f32).collect();
        Self { sampler, cubes, owners, solid }
    }

    /// Renders cubes in order. For those that `tells`: the visible objects, and the solid angle (fraction of the sphere) of the objects
    /// that are new for the adjacent cells, the mean of two cells.
    pub fn cast(&self, stands: &[Stand], lower: &mut Witnessed, part: &Part<'_>) -> Result<Vec<(Seen, f64)>, Stopped> {
        let known = &*lower;
        let cast = |eyes: &mut Eyes<'_>, stand: &Stand| eyes.cube(self, stand, known);
        let done = |cubes: usize| part.tell(cubes as f64 / stands.len() as f64);
        let results: Vec<((Seen, f64), Found)> = part.work.map_with(stands, || Eyes::new(self), cast, done)?;
        let merged = results.into_iter().map(|(seen, found)| {
            lower.merge(found);
            seen
        });
        Ok(merged.collect())
    }
}

/// Scratch memory of a thread.
struct Eyes<'a> {
    engine: Raster<'a>,
    cube: Cube,
    /// Pixels of each object in this cube.
    objects: Vec<Shown>,
    touched: Vec<u32>,
    line: Line,
    crossings: Vec<(f64, PortalId)>,
}

/// One object: its solid angle (fraction of the sphere), its number of pixels, and a sample of them.
#[derive(Clone, Copy, Default)]
struct Shown {
    solid: f32,
    pixels: u32,
    some: [u32; LINES[0]],
}

impl<'a> Eyes<'a> {
    fn new(caster: &Caster<'a>) -> Self {
        let objects = vec![Shown::default(); caster.sampler.prover.rays.scene().objects.len()];
        let (cube, touched, line, crossings) = Default::default();
        Self { engine: Raster::new(caster.cubes), cube, objects, touched, line, crossings }
    }

    /// Counts a run of pixels of one object.
    fn show(&mut self, object: u32, first: usize, count: usize, solid: f32, random: &mut Random) {
        let shown = &mut self.objects[object as usize];
        if shown.pixels == 0 {
            self.touched.push(object);
        }
        shown.solid += solid;
        let before = shown.pixels as usize;
        shown.pixels += count as u32;
        // Reservoir sampling by whole runs (Vitter, *Random sampling with a reservoir*, 1985).
        let few = shown.some.len();
        if before < few {
            (before..few.min(before + count)).for_each(|place| shown.some[place] = (first + place - before) as u32);
        }
        let draw = random.bits();
        let place = ((draw >> 32) as usize * (before + count)) >> 32;
        if before >= few && place < few * count {
            shown.some[place % few] = (first + ((draw as u32 as usize * count) >> 32)) as u32;
        }
    }

    /// One cube: visible objects, and proofs.
    fn cube(&mut self, caster: &Caster<'_>, stand: &Stand, known: &Witnessed) -> ((Seen, f64), Found) {
        let (sampler, site) = (caster.sampler, stand.site);
        let mut random = Random::new(stand.seed);
        // Random rotation, so that pixels of neighbouring cubes do not coincide.
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, random.unit() * TAU, random.unit() * TAU, random.unit() * TAU);
        let view = CubeView { eye: site.at, frame: DMat3::from_quat(turn), size: SIZE };
        self.engine.cube(&view, &mut self.cube);
        let face = caster.solid.len();
        let cube = std::mem::take(&mut self.cube);
        let mut first = 0;
        for run in cube.triangles.chunk_by(|a, b| a == b) {
            let from = first;
            first += run.len();
            if run[0] != NONE {
                // A run across two faces is rare; pixel weights are about equal there.
                let solid = (from..first).map(|pixel| caster.solid[pixel % face]).sum();
                self.show(caster.owners[run[0] as usize], from, run.len(), solid, &mut random);
            }
        }
        for clear in &cube.see_through {
            let pixel = clear.pixel as usize;
            self.show(caster.owners[clear.triangle as usize], pixel, 1, caster.solid[pixel % face], &mut random);
        }
        self.cube = cube;
        self.touched.sort_unstable();
        let mut found = Found::default();
        found.rays = COST;
        let mut lines = MOST_LINES;
        let mut fresh = 0.0;
        let mut seen = Vec::new();
        for object in std::mem::take(&mut self.touched) {
            let Shown { solid, pixels, some } = std::mem::take(&mut self.objects[object as usize]);
            if stand.tells {
                seen.push((object, solid));
            }
            let unknown = site.cells.iter().filter(|c| !known.objects.get(c.index(), object as usize)).count();
            fresh += 0.5 * unknown as f64 * f64::from(solid);
            let wanted = LINES[usize::from(unknown == 0)].min(pixels as usize).min(lines);
            lines -= wanted;
            for &pixel in &some[..wanted] {
                self.line.direction = view.direction(pixel as usize).normalize();
                sampler.trace(site, &mut self.line, &mut self.crossings);
                sampler.prover.line(&self.line, known, &mut found);
            }
        }
        ((seen.into_iter().collect(), fresh), found.close())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_seen_comes_back_to_an_eighth_of_its_size() {
        let objects = [(0, 1.0), (1, 0.3), (127, 1e-5), (255, 0.0), (70_000, 1.0 / 98_304.0), (u32::MAX, 0.75)];
        let seen: Seen = objects.into_iter().collect();
        let back: Vec<(u32, f32)> = seen.objects().collect();
        assert_eq!(back.len(), objects.len());
        for ((object, solid), (same, near)) in objects.into_iter().zip(back) {
            assert_eq!(object, same);
            assert!((near - solid).abs() <= solid / 16.0 + 1e-9, "{solid} came back as {near}");
        }
        // Gaps of 0, 1, 126, 128, 69,745 and the rest.
        assert_eq!(seen.0.len(), 6 + 1 + 1 + 1 + 2 + 3 + 5);
    }

    #[test]
    fn any_bytes_are_read() {
        for bytes in [vec![0xff; 40], vec![0x80, 0x80], vec![5], vec![0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0, 9, 1, 1]] {
            assert!(Seen(bytes).objects().count() <= 2);
        }
    }
}
