//! An offshore platform: four decks of modules, full of pipes with flanges, valves and clips, of beams, gratings, railings,
//! vessels and machines.
//!
//! It replaces a model that isn't public, the platform P-38 of P. Ivson, *Técnicas de Otimização para Visualização de Modelos
//! Massivos*, PUC-Rio, 2006, section 6.1. From it: 90,867 objects with 4,717,749 vertices, most of them with few triangles and
//! spread unevenly in space (section 6.4.4). The rest is made up: modules of 16 m in four decks 8 m apart, a third of them closed
//! (by a blast wall or a room around their contents), with random amounts of objects; pipes run from elbow to elbow. The camera
//! first circles the platform with all of it in view, then follows the passages of the second deck.
//!
//! A platform with fewer objects has fewer modules. Objects may intersect.

mod parts;

use super::building::Building;
use super::facts::Facts;
use super::model::Model;
use super::path::CameraPath;
use super::solid::turn;
use enfilade::math::random::Prng;
use glam::{DAffine3, DMat3, DVec3};
use parts::{BEND, BOOM, PANEL, Part, RAIL};

/// Random streams.
const MODULES: u64 = 1;
const FILLING: u64 = 2;
/// Decks, edge of a module and height of a deck, metres.
const DECKS: usize = 4;
const EDGE: f64 = 16.0;
const HEIGHT: f64 = 8.0;
/// Mean number of objects per module.
const A_MODULE: f64 = 946.0;
/// Width of the passages along a module's sides at -x and -z, metres.
const PASSAGE: f64 = 2.0;
/// Shares of modules with a sheet-metal room and gate, with a blast wall, and with a plate floor instead of gratings.
const ROOMS: f64 = 0.3;
const WALLS: f64 = 0.4;
const PLATES: f64 = 0.7;
/// Radii of pipes, metres: the first ones are likelier.
const RADII: [f64; 10] = [0.02, 0.03, 0.04, 0.05, 0.08, 0.1, 0.15, 0.2, 0.3, 0.4];
/// Index of the radius from which a pipe has more sides.
const MIDDLE: usize = 4;
const THICK: usize = 7;
/// A straight pipe shorter than this, in radii, ends the run.
const SHORTEST: f64 = 8.0;
/// The camera's first and last distance from the middle, in widths of the platform; its revolutions; its frames.
const DISTANCES: [f64; 2] = [1.4, 0.8];
const ROUND: f64 = 0.75;
const FRAMES: usize = 300;
/// Metres from one frame to the next in the passages.
const STEP: f64 = 0.5;
const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Rounds to millimetres, to keep the file short.
fn round_mm(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// Scales, rotates and moves: +x to `along`, +y to `up` (perpendicular unit vectors).
fn placed(at: DVec3, [along, up]: [DVec3; 2], stretch: DVec3) -> DAffine3 {
    let turned = DMat3::from_cols(along * stretch.x, up * stretch.y, along.cross(up) * stretch.z);
    DAffine3::from_mat3_translation(turned, at.map(round_mm))
}

/// Scales and moves.
fn upright(at: DVec3, stretch: DVec3) -> DAffine3 {
    placed(at, [DVec3::X, DVec3::Y], stretch)
}

/// A platform of `objects` objects.
pub(super) fn deck(objects: usize, seed: u64) -> Building {
    let site = Site::of(objects);
    let mut model = Model::default();
    model.enter("deck");
    let mut left = objects;
    let mut shares = site.shares(objects - OUTBOARD, &mut Prng::new(seed, MODULES)).into_iter();
    let rng = &mut Prng::new(seed, FILLING);
    for deck in 0..DECKS {
        model.enter(format!("d{deck}"));
        for number in 0..site.modules() {
            let share = shares.next().unwrap_or_default();
            let mut module = site.module(&mut model, deck, number, share);
            module.build(rng);
            module.fill(rng);
            left -= share;
        }
        let outboard = if deck == 0 {
            LEGS
        } else if deck == DECKS - 1 {
            left
        } else {
            0
        };
        if outboard > 0 {
            let mut module = site.module(&mut model, deck, site.modules(), outboard);
            if deck == 0 {
                module.legs(&site)
            } else {
                module.top(&site)
            }
            left -= outboard;
        }
        model.leave();
    }
    model.leave();
    let vertices = model.nodes.iter().map(|node| model.meshes[node.mesh].0.positions.len()).sum();
    let counted =
        vec![("objects", model.nodes.len()), ("vertices", vertices), ("decks", DECKS), ("modules", DECKS * site.modules())];
    Building { name: "deck".into(), seed, counted, model, facts: Facts::default(), path: site.path() }
}

/// Legs under the platform, and the parts on top: a helideck and two lattices.
const LEGS: usize = 8;
const OUTBOARD: usize = LEGS + 3;

/// Modules along x and along z.
struct Site {
    columns: usize,
    rows: usize,
}

impl Site {
    /// About one and a half times as long as wide.
    fn of(objects: usize) -> Self {
        let modules = (objects as f64 / (DECKS as f64 * A_MODULE)).round().max(1.0) as usize;
        let rows = ((modules as f64 / 1.5).sqrt().round() as usize).max(1);
        Self { columns: modules.div_ceil(rows), rows }
    }

    /// Modules per deck.
    fn modules(&self) -> usize {
        self.columns * self.rows
    }

    /// Size of the platform, metres.
    fn size(&self) -> DVec3 {
        v(self.columns as f64 * EDGE, DECKS as f64 * HEIGHT, self.rows as f64 * EDGE)
    }

    /// Distributes objects to the modules of all decks; some get five times as many as others.
    fn shares(&self, objects: usize, rng: &mut Prng) -> Vec<usize> {
        let weights: Vec<f64> = (0..DECKS * self.modules()).map(|_| 0.4 + 1.8 * rng.unit() * rng.unit()).collect();
        let total: f64 = weights.iter().sum();
        let (mut before, mut dealt) = (0.0, 0);
        let mut share = |weight: &f64| {
            before += weight;
            let until = (objects as f64 * before / total).round() as usize;
            let share = until - dealt;
            dealt = until;
            share
        };
        weights.iter().map(&mut share).collect()
    }

    fn module<'m>(&self, model: &'m mut Model, deck: usize, number: usize, share: usize) -> Module<'m> {
        let name = format!("d{deck}/m{number:02}");
        let (column, row) = (number % self.columns, number / self.columns);
        let low = v(column as f64 * EDGE, deck as f64 * HEIGHT, row as f64 * EDGE);
        let rim = [row == 0, column == 0, row + 1 == self.rows, column + 1 == self.columns];
        let inner = [low + v(PASSAGE + 0.3, 0.2, PASSAGE + 0.3), low + v(EDGE - 0.3, HEIGHT - 0.6, EDGE - 0.3)];
        model.enter(name.clone());
        Module { model, name, low, rim, inner, left: share, made: 0 }
    }

    /// Around the platform from afar, then along passages on the second deck.
    fn path(&self) -> CameraPath {
        let (size, middle) = (self.size(), self.size() * 0.5);
        let width = size.x.max(size.z);
        let around = |i: usize| {
            let part = i as f64 / (FRAMES - 1) as f64;
            let (c, s) = turn(ROUND * part);
            let away = width * (DISTANCES[0] + (DISTANCES[1] - DISTANCES[0]) * part);
            [v(middle.x + away * c, middle.y, middle.z + away * s), middle]
        };
        let (floor, half) = (HEIGHT, 0.5 * PASSAGE + 0.2);
        let (row, column) = ((self.rows / 2) as f64 * EDGE + half, (self.columns / 4) as f64 * EDGE + half);
        let way = [v(size.x - 1.0, floor, row), v(column, floor, row), v(column, floor, half), v(0.6, floor, half)];
        let mut frames: Vec<_> = (0..FRAMES).map(around).collect();
        frames.extend(CameraPath::along(&way, STEP).frames);
        CameraPath { frames }
    }
}

/// A module under construction; it closes its group when dropped.
struct Module<'m> {
    model: &'m mut Model,
    name: String,
    low: DVec3,
    /// Whether its sides towards -z, -x, +z and +x are at the platform's edge.
    rim: [bool; 4],
    /// Corners of its space for equipment.
    inner: [DVec3; 2],
    /// Remaining objects.
    left: usize,
    made: usize,
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        self.model.leave();
    }
}

impl Module<'_> {
    /// Places a part, unless the module has all its objects.
    fn put(&mut self, part: &Part, placement: DAffine3) {
        if self.left > 0 {
            let name = format!("{}/{} {}", self.name, part.key, self.made);
            self.model.place(name, part.role, placement, part.key, part.material, part.make);
            self.left -= 1;
            self.made += 1;
        }
    }

    /// Floor, beams, a column, railings, walls.
    fn build(&mut self, rng: &mut Prng) {
        let low = self.low;
        if rng.chance(PLATES) {
            self.put(&parts::PLATE, upright(low, v(EDGE, 1.0, EDGE)));
        } else {
            for i in 0..16 {
                let at = low + v(PANEL * f64::from(i % 4), 0.0, PANEL * f64::from(i / 4));
                self.put(&parts::GRATING, upright(at, DVec3::ONE));
            }
        }
        self.put(&parts::COLUMN, upright(low, v(1.0, HEIGHT, 1.0)));
        for i in 0..4 {
            let under = low - DVec3::Y * 0.5 + v(0.0, 0.0, PANEL * f64::from(i));
            self.put(&parts::BEAM, upright(under, v(EDGE, 1.0, 1.0)));
            let under = low - DVec3::Y * 0.5 + v(PANEL * f64::from(i), 0.0, 0.0);
            self.put(&parts::BEAM, placed(under, [DVec3::Z, DVec3::Y], v(EDGE, 1.0, 1.0)));
        }
        self.railings();
        self.headers(rng);
        if rng.chance(ROOMS) {
            self.room(rng);
        } else if rng.chance(WALLS) {
            let at = low + v(PASSAGE, 0.0, EDGE - 0.25);
            self.put(&parts::WALL, upright(at, v(EDGE - PASSAGE, HEIGHT - 0.5, 1.0)));
        }
        if rng.chance(0.15) {
            self.put(&parts::STAIRS, upright(low + v(PASSAGE + 2.0, 0.0, PASSAGE - 0.2), DVec3::ONE));
        }
    }

    /// Railings along the platform's edge, but not across passages.
    fn railings(&mut self) {
        let low = self.low;
        let sides = [
            (v(PASSAGE, 0.0, 0.05), DVec3::X),
            (v(0.05, 0.0, EDGE), DVec3::NEG_Z),
            (v(EDGE, 0.0, EDGE - 0.05), DVec3::NEG_X),
            (v(EDGE - 0.05, 0.0, PASSAGE), DVec3::Z),
        ];
        for (_, (from, along)) in self.rim.into_iter().zip(sides).filter(|(is_rim, _)| *is_rim) {
            for k in 0..7 {
                self.put(&parts::RAILING, placed(low + from + along * RAIL * f64::from(k), [along, DVec3::Y], DVec3::ONE));
            }
        }
    }

    /// Thick pipes over the passages, through the whole module.
    fn headers(&mut self, rng: &mut Prng) {
        for along in [DVec3::X, DVec3::Z] {
            let across = v(along.z, 0.0, along.x);
            for level in 0..2 {
                let mut at = 0.3;
                while at < PASSAGE {
                    let r = RADII[MIDDLE + rng.below(4)];
                    let from = self.low + across * (at + r) + DVec3::Y * (5.0 + 1.2 * f64::from(level));
                    self.put(&parts::PIPES[1], placed(from, [along, DVec3::Y], v(EDGE, r, r)));
                    at += 2.0 * r + 0.15;
                }
            }
        }
    }

    /// Walls with a gate, and a roof around the equipment.
    fn room(&mut self, rng: &mut Prng) {
        let [low, high] = self.inner;
        let size = high - low + v(0.2, 0.0, 0.2);
        let (low, high) = (low - v(0.1, 0.2, 0.1), high + v(0.1, 0.0, 0.1));
        let walls = [
            (low, DVec3::X, size.x),
            (v(low.x, low.y, high.z), DVec3::NEG_Z, size.z),
            (v(high.x, low.y, high.z), DVec3::NEG_X, size.x),
            (v(high.x, low.y, low.z), DVec3::Z, size.z),
        ];
        // One of the walls beside a passage has the gate.
        let open = rng.below(2);
        for (i, (at, along, length)) in walls.into_iter().enumerate() {
            let part = if i == open { &parts::GATE } else { &parts::WALL };
            self.put(part, placed(at, [along, DVec3::Y], v(length, high.y - low.y, 1.0)));
        }
        self.put(&parts::PLATE, upright(v(low.x, high.y, low.z), v(size.x, 1.0, size.z)));
    }

    /// Equipment first, then pipe runs and small parts, until the module has all its objects.
    fn fill(&mut self, rng: &mut Prng) {
        for _ in 0..rng.below(4) {
            let at = self.floor(rng, 4.5);
            match rng.below(4) {
                0 => self.vessel(at, rng),
                1 => {
                    let r = round_mm(rng.range(0.8, 2.5));
                    self.put(&parts::TANK, upright(at, v(r, round_mm(rng.range(2.0, 6.0)), r)));
                }
                _ => {
                    for k in 0..1 + rng.below(3) {
                        let (at, size) = (at + DVec3::Z * (1.6 * k as f64 - 1.6), round_mm(rng.range(0.6, 1.4)));
                        self.put(&parts::MACHINE, upright(at, DVec3::splat(size)));
                    }
                }
            }
        }
        while self.left > 0 {
            if rng.chance(0.3) {
                self.run(rng);
            } else {
                self.small(rng);
            }
        }
    }

    /// A random point of the floor, at least `margin` from the sides.
    fn floor(&self, rng: &mut Prng, margin: f64) -> DVec3 {
        let [low, high] = self.inner;
        v(rng.range(low.x + margin, high.x - margin), low.y - 0.2, rng.range(low.z + margin, high.z - margin))
    }

    /// A random point in the module.
    fn place(&self, rng: &mut Prng) -> DVec3 {
        let [low, high] = self.inner;
        low + (high - low) * v(rng.unit(), rng.unit(), rng.unit())
    }

    /// A horizontal vessel, in some cases with tubes inside.
    fn vessel(&mut self, at: DVec3, rng: &mut Prng) {
        let r = round_mm(rng.range(0.6, 1.3));
        let along = [DVec3::X, DVec3::Z][rng.below(2)];
        let placement = placed(at + DVec3::Y * (1.3 * r), [along, DVec3::Y], DVec3::splat(r));
        self.put(&parts::VESSEL, placement);
        if rng.chance(0.5) {
            self.put(&parts::BUNDLE, placement);
        }
    }

    /// Straight pipes and elbows with their fittings.
    fn run(&mut self, rng: &mut Prng) {
        let luck = rng.unit();
        let size = (luck * luck * RADII.len() as f64) as usize;
        let (r, kind) = (RADII[size], usize::from(size >= MIDDLE) + usize::from(size >= THICK));
        let (mut at, mut along) = (self.place(rng), AXES[rng.below(6)]);
        for _ in 0..rng.steps(2, 8, 1) {
            let length = round_mm(self.room_ahead(at, along).min(6.0) * rng.range(0.3, 1.0));
            if length < SHORTEST * r {
                return;
            }
            let up = AXES[(rng.below(4) + 2 + 2 * usize::from(along.y != 0.0) + 4 * usize::from(along.z != 0.0)) % 6];
            self.straight(at, [along, up], [length, r], kind, rng);
            at += along * length;
            if self.room_ahead(at + (along + up) * (BEND * r), up) < SHORTEST * r {
                return;
            }
            self.put(&parts::ELBOWS[kind], placed(at, [along, up], DVec3::splat(r)));
            at += (along + up) * (BEND * r);
            along = up;
        }
        self.put(&parts::FLANGE, placed(at, [along, side(along)], DVec3::splat(r)));
    }

    /// Distance to the module's side, metres.
    fn room_ahead(&self, at: DVec3, along: DVec3) -> f64 {
        let [low, high] = self.inner;
        let side = if along.min_element() < 0.0 { low } else { high };
        (side - at).dot(along)
    }

    /// A straight pipe with flanges, a valve and clips.
    fn straight(&mut self, at: DVec3, axes: [DVec3; 2], [length, r]: [f64; 2], kind: usize, rng: &mut Prng) {
        self.put(&parts::PIPES[kind], placed(at, axes, v(length, r, r)));
        let on = |share: f64| at + axes[0] * (share * length);
        if rng.chance(0.27) {
            let flange = placed(on(rng.range(0.2, 0.4)), axes, DVec3::splat(r));
            self.put(&parts::FLANGE, flange);
            self.put(&parts::BOLTS, flange);
        }
        if rng.chance(0.1) {
            self.put(&parts::VALVE, placed(on(rng.range(0.6, 0.8)), [axes[0], side(axes[0])], DVec3::splat(r)));
        }
        for k in 1..=(length / 1.5) as u32 {
            let (from, size) = (on(f64::from(k) * 1.5 / length), v(0.06, 2.4 * r, 2.6 * r).map(round_mm));
            self.put(&parts::BLOCK, placed(from - axes[1] * (1.2 * r), axes, size));
        }
    }

    /// A small part of a frequent kind.
    fn small(&mut self, rng: &mut Prng) {
        let at = self.place(rng);
        let axes = [[DVec3::X, DVec3::Y], [DVec3::Z, DVec3::Y]][rng.below(2)];
        let room = self.room_ahead(at, axes[0]).max(0.5);
        // Mostly near the lower bound.
        let size = |rng: &mut Prng, low: f64, high: f64| round_mm(low + (high - low) * rng.unit() * rng.unit() * rng.unit());
        match rng.below(20) {
            0..=7 => {
                let edges = v(size(rng, 0.04, 0.6), size(rng, 0.02, 0.5), size(rng, 0.04, 0.4));
                self.put(&parts::BLOCK, placed(at, axes, edges));
            }
            8..=10 => {
                let edge = size(rng, 0.1, 0.3);
                self.put(&parts::GAUGE, placed(at, axes, DVec3::splat(edge)));
            }
            11..=12 => self.put(&parts::LAMP, placed(at, axes, DVec3::splat(0.3))),
            13..=15 => self.put(&parts::PIPES[0], placed(at, axes, v(round_mm(room), 0.012, 0.012))),
            16..=17 => self.put(&parts::TRAY, placed(at, axes, v(round_mm(room), 1.0, 1.0))),
            18 => self.put(&parts::BEAM, placed(at, axes, v(round_mm(room.min(4.0)), 0.5, 0.5))),
            _ => {
                let at = self.floor(rng, 0.5);
                self.put(&parts::CABINET, placed(at, axes, DVec3::ONE));
            }
        }
    }

    /// Legs down to the sea.
    fn legs(&mut self, site: &Site) {
        let size = site.size();
        for i in 0..LEGS {
            let at = v(size.x * (i % 4) as f64 / 3.0, -20.0, size.z * (i / 4) as f64);
            self.put(&parts::COLUMN, upright(at, v(4.0, 20.0, 4.0)));
        }
    }

    /// A helideck over one corner, a flare boom that leans out from another, and a crane.
    fn top(&mut self, site: &Site) {
        let size = site.size();
        self.put(&parts::HELIDECK, upright(v(size.x, size.y + 3.0, size.z), DVec3::ONE));
        let (lean, long) = (v(-0.6, 0.8, 0.0), v(0.8, 0.6, 0.0));
        self.put(&parts::LATTICE, placed(v(0.0, size.y, 0.0), [long, lean], DVec3::ONE));
        let jib = 0.5 * size.x / BOOM;
        self.put(
            &parts::LATTICE,
            placed(v(0.3 * size.x, size.y + 6.0, size.z), [DVec3::NEG_Y, DVec3::X], v(1.0, round_mm(jib), 1.0)),
        );
    }
}

/// An axis perpendicular to another: y, unless that is vertical.
fn side(along: DVec3) -> DVec3 {
    if along.y == 0.0 { DVec3::Y } else { DVec3::X }
}
