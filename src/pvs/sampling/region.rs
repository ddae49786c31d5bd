//! Uniform random points of a union of convex pieces.

use super::sampler::Random;
use crate::cells::Piece;
use crate::math::geom::{self, Aabb};
use crate::pvs::facets::facets;
use glam::DVec3;

/// Pieces as tetrahedra; overlapping pieces multiply the density.
pub(in crate::pvs) struct Region {
    tetrahedra: Vec<[DVec3; 4]>,
    /// Cumulative volume, cubic metres.
    volumes: Vec<f64>,
}

impl Region {
    /// The pieces clipped to `within`.
    pub fn new(pieces: &[Piece], within: Aabb) -> Self {
        let mut region = Self { tetrahedra: Vec::new(), volumes: Vec::new() };
        let mut sum = 0.0;
        for piece in pieces {
            let facets = facets(piece, within);
            let corners: Vec<DVec3> = facets.iter().flatten().copied().collect();
            if corners.len() < 4 {
                continue;
            }
            let apex = geom::middle(&corners);
            for facet in &facets {
                for k in 2..facet.len() {
                    let [a, b, c] = [facet[0], facet[k - 1], facet[k]];
                    let volume = (b - a).cross(c - a).dot(a - apex).abs() / 6.0;
                    if volume > 0.0 {
                        sum += volume;
                        region.tetrahedra.push([apex, a, b, c]);
                        region.volumes.push(sum);
                    }
                }
            }
        }
        region
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        self.volumes.last().copied().unwrap_or(0.0)
    }

    /// A uniform random point; `None` if the region is empty. (Rocchini, Cignoni, *Generating random points in a tetrahedron*, 2000.)
    pub fn draw(&self, random: &mut Random) -> Option<DVec3> {
        let at = random.unit() * self.volume();
        let i = self.volumes.partition_point(|&v| v <= at).min(self.volumes.len().checked_sub(1)?);
        let [o, a, b, c] = self.tetrahedra[i];
        let (mut s, mut t, mut u) = (random.unit(), random.unit(), random.unit());
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        if t + u > 1.0 {
            (t, u) = (1.0 - u, 1.0 - s - t);
        } else if s + t + u > 1.0 {
            (s, u) = (1.0 - t - u, s + t + u - 1.0);
        }
        Some(o + (a - o) * s + (b - o) * t + (c - o) * u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geom::Plane;

    #[test]
    fn points_are_as_dense_everywhere() {
        // A wedge below x + y = 1 of the unit square, height 1, and a box of volume 1.5 that extends beyond the clip box.
        let plane = |x: f64, y: f64, z: f64, d: f64| Plane {
            n: DVec3::new(x, y, z).normalize(),
            d: d / DVec3::new(x, y, z).length(),
        };
        let below =
            [plane(-1.0, 0.0, 0.0, 0.0), plane(0.0, -1.0, 0.0, 0.0), plane(0.0, 0.0, -1.0, 0.0), plane(0.0, 0.0, 1.0, 1.0)];
        let wedge = Piece { planes: below.into_iter().chain([plane(1.0, 1.0, 0.0, 1.0)]).collect(), bounds: Aabb::EMPTY };
        let beyond = [
            plane(-1.0, 0.0, 0.0, -2.0),
            plane(0.0, -1.0, 0.0, 0.0),
            plane(0.0, 1.0, 0.0, 1.0),
            plane(0.0, 0.0, -1.0, 0.0),
            plane(0.0, 0.0, 1.0, 1.0),
        ];
        let long = Piece { planes: beyond.to_vec(), bounds: Aabb::EMPTY };
        let within = Aabb { min: DVec3::splat(-9.0), max: DVec3::new(3.5, 9.0, 9.0) };
        let region = Region::new(&[wedge, long], within);
        assert!((region.volume() - 2.0).abs() < 1e-9, "{}", region.volume());
        let (mut random, n) = (Random::new(1), 100_000);
        let (mut in_wedge, mut low, mut corner) = (0, 0, 0);
        for _ in 0..n {
            let p = region.draw(&mut random).unwrap();
            let wedge = p.x < 1.5;
            assert!(p.min_element() >= -1e-12 && p.y <= 1.0 && p.z <= 1.0);
            assert!(if wedge { p.x + p.y <= 1.0 + 1e-12 } else { (2.0..=3.5).contains(&p.x) });
            in_wedge += u32::from(wedge);
            low += u32::from(p.z < 0.25);
            corner += u32::from(wedge && p.x < 0.5 && p.y < 0.5);
        }
        // Five standard deviations of a share of 100,000 are below 0.8 %.
        let share = |count: u32| f64::from(count) / f64::from(n);
        assert!((share(in_wedge) - 0.25).abs() < 0.008, "{}", share(in_wedge));
        assert!((share(low) - 0.25).abs() < 0.008, "{}", share(low));
        assert!((share(corner) - 0.125).abs() < 0.006, "{}", share(corner));
    }

    #[test]
    fn nothing_has_no_points() {
        assert!(Region::new(&[], Aabb { min: DVec3::ZERO, max: DVec3::ONE }).draw(&mut Random::new(1)).is_none());
    }
}
