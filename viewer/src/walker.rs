//! A person: walks, climbs stairs, falls, and doesn't go through walls; or flies.
//!
//! A person is spheres one above the other, from the height of a step up, that are pushed out of triangles sideways; what is lower than a
//! step is stepped on. So stairs need no names, and furniture is in the way.

use crate::body::{DEEPEST, EYE, STEP, TALL};
use crate::collision::Solid;
use crate::unstuck;
use enfilade::ObjectId;
use enfilade::runtime::Camera;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// The body touches a face, and isn't in it, to this depth, metres.
const TOUCH: f64 = 1e-6;

/// A face pushes sideways if so much of its push is level; less is a slope to walk on.
const UPHILL: f64 = 0.3;
/// Lengths (metres) and areas (square metres) below this have no direction.
const LEAST: f64 = 1e-9;

/// Half of how broad a person is, metres: a door of 0.6 m is wide enough.
const RADIUS: f64 = 0.24;
/// Extra room of a place that a stuck walker is moved to, metres: no face around it pushes.
const ROOM: f64 = 0.01;
/// Heights of the spheres' middles above the floor, metres.
const SPHERES: [f64; 3] = [STEP + RADIUS, 1.05, 1.45];
/// Metres a second, walking and flying; a second squared, falling.
const WALK: f64 = 2.4;
const FLY: f64 = 6.0;
const GRAVITY: f64 = 9.81;
/// How fast a step is climbed, metres a second.
const CLIMB: f64 = 3.0;
/// Longest way between two looks for walls, metres: less than [`RADIUS`].
const STRIDE: f64 = 0.1;
/// Who stands nearer to where they stood, metres, and looks along nearly the same line, radians, hasn't gone anywhere. Less: being pushed out
/// of a wall is a walk.
const GONE: f64 = 0.3;
/// Up and down, no farther than this, radians.
const STEEPEST: f64 = 1.55;

/// Input of a person.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct MoveInput {
    /// To the right, up and forward, -1 to 1 each.
    pub to: DVec3,
    /// Faster.
    pub hurry: bool,
}

/// Where a person is, and looks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Walker {
    /// The eye, metres relative to the origin.
    pub eye: DVec3,
    /// Radians from -Z to the right.
    pub yaw: f64,
    /// Radians up.
    pub pitch: f64,
    /// Through walls, without weight.
    pub flies: bool,
    /// Times the usual.
    pub speed: f64,
    falling: f64,
    /// It has walked from here before, so it is not stuck: no walk leads into a solid.
    walked: bool,
}

impl Walker {
    /// At `eye`, looking along a direction.
    pub fn new(eye: DVec3, along: DVec3, flies: bool) -> Self {
        let along = along.normalize_or(DVec3::NEG_Z);
        let (yaw, pitch) = (along.x.atan2(-along.z), along.y.asin());
        Self { eye, yaw, pitch: pitch.clamp(-STEEPEST, STEEPEST), flies, speed: 1.0, falling: 0.0, walked: false }
    }

    /// Whether the walker has moved or turned since `before`; a fall to the floor does not count.
    pub fn has_gone_from(&self, before: &Self) -> bool {
        let turned = (self.yaw - before.yaw).abs().max((self.pitch - before.pitch).abs());
        self.eye.xz().distance(before.eye.xz()) > GONE || turned > GONE
    }

    /// Turns by radians: to the right, and up.
    pub fn turn(&mut self, right: f64, up: f64) {
        self.yaw = (self.yaw + right).rem_euclid(std::f64::consts::TAU);
        self.pitch = (self.pitch + up).clamp(-STEEPEST, STEEPEST);
    }

    /// Where it looks.
    pub fn forward(&self) -> DVec3 {
        let (sin, cos) = self.yaw.sin_cos();
        DVec3::new(sin * self.pitch.cos(), self.pitch.sin(), -cos * self.pitch.cos())
    }

    /// How fast it goes, without hurry.
    pub fn metres_a_second(&self) -> f64 {
        self.speed * if self.flies { FLY } else { WALK }
    }

    /// Its camera; `fov_y` in radians, `aspect` is width over height.
    pub fn camera(&self, fov_y: f64, aspect: f64) -> Camera {
        Camera::look_at(self.eye, self.eye + self.forward(), fov_y, aspect)
    }

    /// Goes on for `seconds`. `passes`: whether an object is gone through; `ground`: the height of the ground over a point's plan.
    pub fn go(
        &mut self,
        seconds: f64,
        wants: &MoveInput,
        solid: &Solid<'_>,
        passes: &dyn Fn(ObjectId) -> bool,
        ground: &dyn Fn(DVec3) -> Option<f64>,
    ) {
        let far = self.metres_a_second() * if wants.hurry { 3.0 } else { 1.0 } * seconds;
        let (sin, cos) = self.yaw.sin_cos();
        let (right, level) = (DVec3::new(cos, 0.0, sin), DVec3::new(sin, 0.0, -cos));
        if self.flies {
            let way = right * wants.to.x + DVec3::Y * wants.to.y + self.forward() * wants.to.z;
            self.eye += way.clamp_length_max(1.0) * far;
            (self.falling, self.walked) = (0.0, false);
            return;
        }
        // 1. The first step leads out of a solid.
        if (wants.to.x, wants.to.z) != (0.0, 0.0) && !std::mem::replace(&mut self.walked, true) {
            self.eye = unstuck::way_out(solid, self.eye, RADIUS + ROOM, passes).unwrap_or(self.eye);
        }
        // 2. Sideways, and out of walls, in strides.
        let way = (right * wants.to.x + level * wants.to.z).clamp_length_max(1.0) * far;
        let strides = (way.length() / STRIDE).ceil().max(1.0);
        for _ in 0..strides as usize {
            self.eye += way / strides;
            self.push_out(solid, passes);
        }
        // 3. Up and down.
        let feet = self.eye.y - EYE;
        let floor = self.floor_or_ground(solid, passes, ground);
        match floor {
            Some(floor) if floor >= feet => {
                self.eye.y += (floor - feet).min(CLIMB * seconds);
                self.falling = 0.0;
            }
            // Down a step without a jump.
            Some(floor) if self.falling == 0.0 && feet - floor <= STEP => self.eye.y -= (feet - floor).min(CLIMB * seconds),
            Some(floor) => {
                self.falling += GRAVITY * seconds;
                let fall = self.falling * seconds;
                if feet - floor <= fall {
                    self.falling = 0.0;
                }
                self.eye.y -= fall.min(feet - floor);
            }
            None => self.falling = 0.0,
        }
    }

    /// A floor, or the ground where that is higher. Ground above the walker is ignored: a cellar is below it.
    fn floor_or_ground(
        &self,
        solid: &Solid<'_>,
        passes: &dyn Fn(ObjectId) -> bool,
        ground: &dyn Fn(DVec3) -> Option<f64>,
    ) -> Option<f64> {
        let (floor, ground) = (self.floor(solid, passes), ground(self.eye));
        match (floor, ground) {
            (Some(floor), Some(ground)) if ground - (self.eye.y - EYE) < TALL => Some(floor.max(ground)),
            (None, ground) => ground,
            (floor, _) => floor,
        }
    }

    /// The highest surface below that is no higher than a step.
    fn floor(&self, solid: &Solid<'_>, passes: &dyn Fn(ObjectId) -> bool) -> Option<f64> {
        let feet = self.eye.y - EYE;
        let mut best: Option<f64> = None;
        solid.near(self.eye, 0.0, [feet - DEEPEST, feet + STEP], |face| {
            let y = face.height_at(self.eye.xz());
            let Some(y) = y.filter(|y| *y <= feet + STEP && *y >= feet - DEEPEST) else { return };
            if best.is_none_or(|best| y > best) && !passes(face.object) {
                best = Some(y);
            }
        });
        best
    }

    /// Out of what the spheres are in, sideways.
    fn push_out(&mut self, solid: &Solid<'_>, passes: &dyn Fn(ObjectId) -> bool) {
        // A corner of walls takes a push from each.
        for _ in 0..3 {
            let (feet, mut push, mut deepest) = (self.eye.y - EYE, DVec2::ZERO, 0.0);
            let heights = [feet + SPHERES[0] - RADIUS, feet + SPHERES[2] + RADIUS];
            solid.near(self.eye, RADIUS, heights, |face| {
                for height in SPHERES {
                    let middle = self.eye.with_y(feet + height);
                    let away = middle - face.closest(middle);
                    let depth = RADIUS - away.length();
                    let side = away.xz();
                    // A face straight above or below does not push sideways.
                    if depth > deepest
                        && side.length() > UPHILL * away.length()
                        && side.length() > LEAST
                        && !passes(face.object)
                    {
                        (deepest, push) = (depth, side.normalize() * depth);
                    }
                }
            });
            if deepest <= TOUCH {
                return;
            }
            self.eye += DVec3::new(push.x, 0.0, push.y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};

    const COUNTER: (DVec3, DVec3) = (DVec3::new(3.0, 0.0, 2.0), DVec3::new(3.7, 0.9, 4.5));
    const CUPBOARD: (DVec3, DVec3) = (DVec3::new(4.0, 0.0, -2.0), DVec3::new(4.7, 2.2, -1.0));
    const ROCK: (DVec3, DVec3) = (DVec3::new(-4.0, 0.0, 1.8), DVec3::new(-1.0, 2.5, 4.6));

    /// A floor of 10 by 10 m, a wall at x = 2 with a counter and a cupboard behind it, a rock, stairs of five steps of 0.18 m from z = -2
    /// on, up to a landing.
    fn scene() -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut boxed = |min: DVec3, max: DVec3| {
            let corners: Vec<DVec3> = (0..8)
                .map(|i| DVec3::from_array([0, 1, 2].map(|k| if i >> k & 1 == 0 { min[k] } else { max[k] })))
                .collect();
            let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            let triangles: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
            let mesh = Mesh { node: "box".into(), role: Role::Structure, opaque: true, positions: corners, triangles };
            builder.add(mesh).expect("a box is a mesh");
        };
        boxed(DVec3::new(-5.0, -0.1, -5.0), DVec3::new(5.0, 0.0, 5.0));
        boxed(DVec3::new(2.0, 0.0, -5.0), DVec3::new(2.2, 3.0, 5.0));
        boxed(COUNTER.0, COUNTER.1);
        boxed(CUPBOARD.0, CUPBOARD.1);
        boxed(ROCK.0, ROCK.1);
        for step in 0..5 {
            let near = -2.0 - 0.3 * f64::from(step);
            boxed(DVec3::new(-4.0, 0.0, -5.0), DVec3::new(-2.0, 0.18 * f64::from(step + 1), near));
        }
        builder.finish("room").expect("a scene")
    }

    fn walk(from: DVec3, to: DVec3, seconds: f64) -> (Walker, DVec3) {
        let scene = scene();
        let solid = Solid::new(&scene);
        let mut walker = Walker::new(from - scene.origin, DVec3::NEG_Z, false);
        for _ in 0..(seconds * 60.0) as usize {
            walker.go(1.0 / 60.0, &MoveInput { to, hurry: false }, &solid, &|_| false, &|_| None);
        }
        (walker, walker.eye + scene.origin)
    }

    #[test]
    fn a_wall_stops_a_person_one_radius_before_it() {
        let (_, at) = walk(DVec3::new(0.0, EYE, 1.0), DVec3::X, 3.0);
        assert!((at.x - (2.0 - RADIUS)).abs() < 0.01 && (at.y - EYE).abs() < 1e-6, "{at}");
        // Along it, nothing does.
        let (_, at) = walk(DVec3::new(1.5, EYE, 1.0), DVec3::new(1.0, 0.0, 1.0), 1.0);
        assert!((at.x - (2.0 - RADIUS)).abs() < 0.01 && at.z < -0.4, "{at}");
    }

    #[test]
    fn stairs_lead_up_and_down() {
        let (walker, at) = walk(DVec3::new(-3.0, EYE, 0.0), DVec3::Z, 1.8);
        assert!((at.y - EYE - 0.9).abs() < 0.02, "five steps of 0.18 m: {at}");
        let scene = scene();
        let (solid, mut walker) = (Solid::new(&scene), walker);
        for _ in 0..150 {
            walker.go(1.0 / 60.0, &MoveInput { to: DVec3::NEG_Z, hurry: false }, &solid, &|_| false, &|_| None);
        }
        assert!((walker.eye.y + scene.origin.y - EYE).abs() < 0.02);
    }

    #[test]
    fn a_person_falls_to_the_floor_and_not_out_of_the_world() {
        let (_, at) = walk(DVec3::new(0.0, EYE + 2.0, 1.0), DVec3::ZERO, 2.0);
        assert!((at.y - EYE).abs() < 1e-6, "{at}");
        let (_, at) = walk(DVec3::new(20.0, EYE, 1.0), DVec3::ZERO, 2.0);
        assert_eq!(at.y, EYE, "nothing is below");
    }

    #[test]
    fn who_is_shut_in_is_out_after_one_step() {
        for (what, (min, max)) in [("counter", COUNTER), ("cupboard", CUPBOARD), ("rock", ROCK)] {
            let inside = ((min + max) * 0.5).with_y(EYE);
            let (_, at) = walk(inside, DVec3::Z, 1.0 / 60.0);
            let beside = DVec3::new((min.x - at.x).max(at.x - max.x), 0.0, (min.z - at.z).max(at.z - max.z));
            assert!(beside.max_element() >= RADIUS - 1e-3, "{what}: still in it at {at}");
            // Not farther than to its nearest side, and a body and a stride from there; on the floor.
            let nearest = ((max - min) * 0.5).with_y(f64::INFINITY).min_element();
            assert!(at.distance(inside) < nearest + 2.0 * RADIUS + 0.2 && (at.y - EYE).abs() < 1e-6, "{what}: {at}");
            // Without input, the walker stays.
            let (_, at) = walk(inside, DVec3::ZERO, 0.1);
            assert!(at.distance(inside) < 0.5, "{what}: {at}");
        }
        // A walker that flew into a solid.
        let (scene, inside) = (scene(), ((ROCK.0 + ROCK.1) * 0.5).with_y(EYE));
        let (solid, mut walker) =
            (Solid::new(&scene), Walker::new(DVec3::new(0.0, EYE, 1.0) - scene.origin, DVec3::X, false));
        let go =
            |walker: &mut Walker| walker.go(0.01, &MoveInput { to: DVec3::Z, hurry: false }, &solid, &|_| false, &|_| None);
        go(&mut walker);
        (walker.flies, walker.eye) = (true, inside - scene.origin);
        go(&mut walker);
        walker.flies = false;
        go(&mut walker);
        let at = walker.eye + scene.origin;
        assert!(at.x < ROCK.0.x || at.x > ROCK.1.x || at.z < ROCK.0.z || at.z > ROCK.1.z, "{at}");
    }

    #[test]
    fn who_stands_free_is_where_they_step() {
        for from in [DVec3::new(0.0, EYE, 1.0), DVec3::new(2.7, EYE, 3.0), DVec3::new(-3.0, EYE + 0.9, -4.0)] {
            let (_, at) = walk(from, DVec3::Z, 1.0 / 60.0);
            assert!((at - from).length() < 0.06, "{from} to {at}");
        }
    }

    #[test]
    fn who_flies_goes_through_walls() {
        let scene = scene();
        let solid = Solid::new(&scene);
        let mut walker = Walker::new(DVec3::new(0.0, EYE, 1.0) - scene.origin, DVec3::X, true);
        for _ in 0..60 {
            walker.go(1.0 / 60.0, &MoveInput { to: DVec3::Z, hurry: false }, &solid, &|_| false, &|_| None);
        }
        assert!(walker.eye.x + scene.origin.x > 5.0);
    }
}
