//! The screen-space error of tiles, in pixels.
//!
//! Lindstrom et al., 1996, and the thesis with these tiles divide an error by the distance of the eye. Off the middle of the
//! screen, the same error takes up to `1 / cos²` as many pixels, so that is no bound. This is one: a sample `p` drawn at `p + d
//! u` moves by `d (X·u - x W·u) / W·(p + d u)` on the screen, where `X` and `W` are rows of the camera and `x` is the projection
//! of `p`. The numerator is greatest in a corner of the window, the denominator least at the nearest point of the box.

use enfilade::runtime::{Camera, Rect};
use glam::{DVec2, DVec3};

/// An axis-aligned box relative to the eye, metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Box3 {
    pub low: DVec3,
    pub high: DVec3,
}

impl Box3 {
    /// The least value of `n . p`.
    fn least(&self, n: DVec3) -> f64 {
        DVec3::select(n.cmpgt(DVec3::ZERO), self.low, self.high).dot(n)
    }

    /// The greatest value of `n . p`.
    fn greatest(&self, n: DVec3) -> f64 {
        DVec3::select(n.cmpgt(DVec3::ZERO), self.high, self.low).dot(n)
    }

    /// Metres from the eye, 0 inside.
    fn distance(&self) -> f64 {
        self.low.max(-self.high).max(DVec3::ZERO).length()
    }

    /// The smallest sphere around it: centre, radius.
    fn sphere(&self) -> (DVec3, f64) {
        ((self.low + self.high) / 2.0, (self.high - self.low).length() / 2.0)
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|k| {
            let pick = |bit: usize| k & bit != 0;
            DVec3::new(
                if pick(1) { self.high.x } else { self.low.x },
                if pick(2) { self.high.y } else { self.low.y },
                if pick(4) { self.high.z } else { self.low.z },
            )
        })
    }
}

/// A window of the screen, and how it magnifies errors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// Rows of the camera.
    x: DVec3,
    y: DVec3,
    w: DVec3,
    /// Inside is `n . p >= 0`.
    planes: [DVec3; 5],
    window: [DVec2; 2],
    /// Pixels of half the screen.
    half: DVec2,
    /// From normalised device coordinates to directions.
    unproject: glam::DMat3,
    whole: Spread,
    /// Pixels per metre at a distance of a metre in the middle of the screen.
    focal: f64,
}

/// How a part of the screen magnifies errors.
#[derive(Clone, Copy, Debug)]
struct Spread {
    /// Greatest number of pixels of a vertical metre at depth 1.
    upright: f64,
    /// Greatest number of pixels of a metre in any direction at depth 1.
    any: f64,
    /// Greatest ratio of distance from the eye to depth.
    slant: f64,
}

/// The measure that decides which tiles are divided.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Measure {
    /// The bound of this file.
    Bound,
    /// Lindstrom's: error over distance.
    Distance,
}

impl Lens {
    /// A window of a screen of `size` pixels.
    pub fn new(camera: &Camera, size: [u32; 2], window: Rect) -> Self {
        let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3());
        let window = [window.min.as_dvec2(), window.max.as_dvec2()];
        let half = DVec2::new(f64::from(size[0]), f64::from(size[1])) / 2.0;
        let planes = [x - window[0].x * w, window[1].x * w - x, y - window[0].y * w, window[1].y * w - y, w];
        let focal = half.y * y.length() / w.length();
        let whole = Spread { upright: 0.0, any: 0.0, slant: 1.0 };
        let mut lens = Self { x, y, w, planes, window, half, unproject: camera.unproject(), whole, focal };
        lens.whole = lens.spread(window);
        lens
    }

    /// Whether a box may show; conservative.
    pub fn sees(&self, of: &Box3) -> bool {
        self.planes.iter().all(|&n| of.greatest(n) >= 0.0)
    }

    /// Whether all of a box is in the window.
    pub fn holds(&self, of: &Box3) -> bool {
        self.planes.iter().all(|&n| of.least(n) >= 0.0)
    }

    /// As [`Self::sees`], for the sphere around the box, which shows more often.
    pub fn sees_sphere(&self, of: &Box3) -> bool {
        let (middle, radius) = of.sphere();
        self.planes.iter().all(|n| n.dot(middle) >= -radius * n.length())
    }

    /// Error of a tile in a box, pixels, from a vertical error and one in any direction (metres). 0 if both are 0; infinite if
    /// the box reaches the eye. Above `enough`, if the box is before the eye, only its own part of the screen counts.
    pub fn pixels(&self, of: &Box3, [error, rim]: [f64; 2], measure: Measure, enough: f64) -> f64 {
        if error == 0.0 && rim == 0.0 {
            return 0.0;
        }
        if measure == Measure::Distance {
            return self.focal * error.max(rim) / of.distance();
        }
        let nearest = of.least(self.w);
        let within = |spread: &Spread| {
            let depth = nearest.max(of.distance() / spread.slant);
            let after = |moved: f64| nearest.max(depth - moved).max(0.0);
            let part =
                |moved: f64, pixels: f64, rate: f64| if moved == 0.0 { 0.0 } else { moved * pixels / after(moved * rate) };
            part(error, spread.upright, self.w.y.abs()).max(part(rim, spread.any, self.w.length()))
        };
        let pixels = within(&self.whole);
        if pixels <= enough || nearest <= 0.0 {
            return pixels;
        }
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for p in of.corners() {
            let at = DVec2::new(self.x.dot(p), self.y.dot(p)) / self.w.dot(p);
            (low, high) = (low.min(at), high.max(at));
        }
        let part = [low.max(self.window[0]), high.min(self.window[1])];
        if part[0].cmple(part[1]).all() { pixels.min(within(&self.spread(part))) } else { pixels }
    }

    /// The greatest values over a part of the screen; all three are convex, and so greatest in a corner.
    fn spread(&self, [low, high]: [DVec2; 2]) -> Spread {
        let mut spread = Spread { upright: 0.0, any: 0.0, slant: 0.0 };
        for at in [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)] {
            let (across, up) = (self.half.x * (self.x - at.x * self.w), self.half.y * (self.y - at.y * self.w));
            spread.upright = spread.upright.max(across.y.hypot(up.y));
            spread.any = spread.any.max(across.length().hypot(up.length()));
            spread.slant = spread.slant.max((self.unproject * at.extend(1.0)).length());
        }
        spread
    }
}
