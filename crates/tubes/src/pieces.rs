//! Tubes cut into pieces for culling.

use super::section::{Section, Tangent};
use super::tube::{Tube, Tubes};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Longest piece, metres, if sections allow. Longer: a pipe is visible from all the rooms it passes. Shorter: more objects.
const LONGEST: f64 = 50.0;
/// Share of that length that rounding may add.
const ROUNDING: f64 = 1e-3;
/// Most sections added to a straight part. More: an endless line fills the memory.
const MOST_CUTS: f64 = 64.0;

impl Tubes {
    /// The same tubes, with more sections on straight parts that are longer than a piece.
    pub fn divided(&self) -> Self {
        let mut all = Self::default();
        for tube in &self.tubes {
            let sections = self.of(tube);
            let start = all.sections.len() as u32;
            for (k, section) in sections.iter().enumerate() {
                all.sections.push(*section);
                let next = sections.get(k + 1).or(if tube.closed { sections.first() } else { None });
                if let Some(next) = next {
                    all.divide(section, next);
                }
            }
            all.tubes.push(Tube { sections: start..all.sections.len() as u32, ..tube.clone() });
        }
        all
    }

    /// Adds sections to a straight part.
    fn divide(&mut self, from: &Section, to: &Section) {
        let [a, b] = [from, to].map(place);
        let count = (a.distance(b) / (LONGEST * (1.0 + ROUNDING))).ceil().min(MOST_CUTS);
        if from.tangent() == Tangent::After {
            let at = |k: u32| a.lerp(b, f64::from(k) / count).as_vec3().to_array();
            let cut = |k| Section::new(at(k), from.radius(), Tangent::After, from.roll());
            self.sections.extend((1..count as u32).map(cut));
        }
    }

    /// Segments of each piece, in order: a part of a tube, or several short tubes, with at most `most` segments (1 or more).
    pub fn pieces(&self, most: u32) -> Vec<Range<u32>> {
        let mut pieces: Vec<Range<u32>> = Vec::new();
        let mut room = Room { segments: 0, metres: 0.0 };
        for tube in &self.tubes {
            let (sections, segments, first) = (self.of(tube), tube.segments(), tube.sections.start);
            let at = |i: u32| place(&sections[(i - first) as usize % sections.len()]);
            let one = |i: u32| Room { segments: 1, metres: at(i).distance(at(i + 1)) };
            let whole = segments.clone().map(one).fold(Room { segments: 0, metres: 0.0 }, |a, b| Room {
                segments: a.segments + b.segments,
                metres: a.metres + b.metres,
            });
            // A tube that fits is not cut.
            let mut begins = !room.holds(&whole);
            for i in segments {
                let next = one(i);
                if begins || !room.holds(&next) {
                    room = Room { segments: most, metres: LONGEST * (1.0 + 2.0 * ROUNDING) };
                    pieces.push(i..i);
                    begins = false;
                }
                room = Room { segments: room.segments - 1, metres: room.metres - next.metres };
                pieces.last_mut().into_iter().for_each(|piece| piece.end = i + 1);
            }
        }
        pieces
    }
}

/// Segments and length of a piece, or those left.
struct Room {
    segments: u32,
    metres: f64,
}

impl Room {
    fn holds(&self, other: &Self) -> bool {
        other.segments <= self.segments && other.metres <= self.metres
    }
}

fn place(section: &Section) -> DVec3 {
    Vec3::from(section.place).as_dvec3()
}
