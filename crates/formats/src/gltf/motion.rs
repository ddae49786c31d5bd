//! Motion of animated nodes: bounds of all poses of everything below a node.
//!
//! Each channel is treated alone, whichever play at the same time: its values have a range, and the bounds of a node hold every
//! combination. Cubic curves stay within the hull of their Bézier points (Farin, *Curves and Surfaces for CAGD*, 1988); a
//! rotation between two others stays within half their angle of the middle one.

use super::data::{Buffers, broken};
use super::document::{Animation, Channel, Document};
use super::placement::{Placement, transform};
use enfilade::math::geom::Aabb;
use enfilade::scene::ImportError;
use glam::{DAffine3, DQuat, DVec3, DVec4};
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};

/// Values that differ from the node's own by less than this, as a share of one plus the value, do not move it. Larger: slow
/// drifts count as rest. Smaller: exporters that write rounded rest poses as keys animate whole models.
const REST: f64 = 1e-6;
/// Rotations are cut into pieces of this quaternion angle, radians: half that of space. Larger: bounds grow by more. Smaller:
/// time.
const PIECE: f64 = 0.02;
/// Below this quaternion angle, radians, an arc is not divided. Larger: rotations leave their arc. Smaller: its sine is zero.
const NO_TURN: f64 = 1e-9;
/// Pieces of a cubic rotation.
const CUBIC_PIECES: usize = 16;
/// With more rotations than this, a node may turn anyhow. Larger: time. Smaller: long animations get the bounds of balls.
const MOST_TURNS: usize = 20_000;
/// Limit of steps through ancestors. Larger: files of deep skeletons take minutes. Smaller: crowds are refused.
const MOST_STEPS: usize = 20_000_000;

/// Nodes and materials that animations change.
pub(super) struct Motion {
    parents: Vec<Option<usize>>,
    /// By animated node.
    ranges: HashMap<usize, Range>,
    /// By node: range of the weights of its morph targets, if an animation changes them.
    weights: HashMap<usize, Vec<[f64; 2]>>,
    /// Nodes that an animation shows or hides.
    shown: HashSet<usize>,
    /// Materials that an animation changes.
    materials: HashSet<usize>,
    /// World transforms of nodes, cached.
    rest: RefCell<HashMap<usize, DAffine3>>,
    /// Steps left of [`MOST_STEPS`].
    left: Cell<usize>,
    /// Number of invalid animations.
    pub unread: usize,
}

/// Range of a node's channels and its own values.
struct Range {
    translation: Aabb,
    scale: Aabb,
    rotations: Turns,
}

/// Rotations. A point at distance 1 is at most `spare` from its place under one of them.
struct Turns {
    all: Vec<DQuat>,
    spare: f64,
}

impl Motion {
    /// Reads all animations.
    pub fn read(document: &Document, buffers: &Buffers<'_>) -> Self {
        let mut parents = vec![None; document.node_count()];
        for node in 0..document.node_count() {
            for &child in &document.node(node).children {
                if let Some(parent) = parents.get_mut(child) {
                    *parent = Some(node);
                }
            }
        }
        let mut motion = Self {
            parents,
            ranges: HashMap::new(),
            weights: HashMap::new(),
            shown: HashSet::new(),
            materials: HashSet::new(),
            rest: RefCell::default(),
            left: Cell::new(MOST_STEPS),
            unread: 0,
        };
        // Channels may share values: a file's bytes are read at most once in all.
        let mut left = buffers.size().saturating_add(1 << 20);
        for animation in document.animations() {
            let is_read = animation.is_some_and(|animation| {
                animation
                    .channels
                    .iter()
                    .all(|channel| motion.channel(document, buffers, &animation, channel, &mut left).is_some())
            });
            motion.unread += usize::from(!is_read);
        }
        motion
    }

    /// Whether an animation moves this node.
    pub fn moves(&self, node: usize) -> bool {
        self.ranges.contains_key(&node)
    }

    /// Whether an animation moves a node or an ancestor.
    pub fn carries(&self, node: usize) -> bool {
        !self.ranges.is_empty() && self.up(node).any(|node| self.moves(node))
    }

    /// Whether an animation shows or hides this node.
    pub fn shows(&self, node: usize) -> bool {
        self.shown.contains(&node)
    }

    /// Whether an animation changes a material, which may fade.
    pub fn changes(&self, material: usize) -> bool {
        self.materials.contains(&material)
    }

    /// Range of the weights of a node's morph targets, if an animation changes them.
    pub fn weights(&self, node: usize) -> Option<&[[f64; 2]]> {
        self.weights.get(&node).map(Vec::as_slice)
    }

    /// A node and its ancestors.
    fn up(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(node), |&node| self.parents[node])
    }

    /// World transform of a node in the file's pose; `root` is that of the scene, always the same.
    pub fn rest(&self, document: &Document, node: usize, root: DAffine3) -> Result<DAffine3, ImportError> {
        let mut known = self.rest.borrow_mut();
        let unknown: Vec<usize> = self.up(node).take_while(|node| !known.contains_key(node)).collect();
        let above = unknown.last().map_or(Some(node), |&last| self.parents[last]);
        let mut world = above.and_then(|above| known.get(&above)).copied().unwrap_or(root);
        for &n in unknown.iter().rev() {
            world *= transform(document.node(n), n)?;
            known.insert(n, world);
        }
        Ok(world)
    }

    /// Bounds of all places of points, given in a node's own coordinates.
    pub fn sweep(&self, document: &Document, node: usize, points: &[DVec3], root: DAffine3) -> Result<Aabb, ImportError> {
        let mut points =
            if points.len() <= 8 { points.to_vec() } else { corners(Aabb::of(points.iter().copied())).to_vec() };
        for n in self.up(node) {
            let left = self.left.get().checked_sub(1);
            self.left.set(left.ok_or_else(|| broken("skeletons with too long chains of joints"))?);
            match self.ranges.get(&n) {
                Some(range) => points = corners(range.sweep(&points)).to_vec(),
                None => {
                    let own = transform(document.node(n), n)?;
                    points.iter_mut().for_each(|p| *p = own.transform_point3(*p));
                }
            }
        }
        Ok(Aabb::of(points.iter().map(|&p| root.transform_point3(p))))
    }

    /// Adds a channel; `None` if it is invalid.
    fn channel(
        &mut self,
        document: &Document,
        buffers: &Buffers<'_>,
        animation: &Animation,
        channel: &Channel,
        left: &mut usize,
    ) -> Option<()> {
        let target = &channel.target;
        let pointed = target.extensions.pointer.as_ref().map(|p| p.pointer.as_str());
        let (node, path) = match (target.path.as_str(), pointed) {
            ("pointer", Some(pointer)) => {
                if let Some(material) = pointer.strip_prefix("/materials/") {
                    self.materials.insert(material.split('/').next()?.parse().ok()?);
                }
                let Some(rest) = pointer.strip_prefix("/nodes/") else { return Some(()) };
                let (node, path) = rest.split_once('/')?;
                (node.parse().ok()?, path)
            }
            (path, _) => match target.node {
                Some(node) => (node, path),
                // Without a target it has no effect.
                None => return Some(()),
            },
        };
        if node >= document.node_count() {
            return None;
        }
        let sampler = animation.samplers.get(channel.sampler)?;
        let values = Values::read(buffers, sampler.input, sampler.output, sampler.interpolation.as_deref(), left)?;
        let own = Placement::of(document.node(node));
        let is_at = |v: &DVec4, own: DVec4| (*v - own).abs().max_element() <= REST * (1.0 + own.abs().max_element());
        let rest = match path {
            "translation" => own.translation.extend(0.0),
            "scale" => own.scale.extend(0.0),
            "rotation" => DVec4::from(own.rotation.to_array()),
            "weights" => return self.weights_of(document, node, &values),
            "extensions/KHR_node_visibility/visible" => {
                self.shown.insert(node);
                return Some(());
            }
            _ => return Some(()),
        };
        let points: Vec<DVec4> = values.points(1).flatten().collect();
        let is_turn = path == "rotation";
        if points.iter().all(|v| is_at(v, rest) || is_turn && is_at(&-*v, rest)) {
            return Some(());
        }
        let range = self.ranges.entry(node).or_insert_with(|| Range {
            translation: Aabb::of([own.translation]),
            scale: Aabb::of([own.scale]),
            rotations: Turns { all: vec![own.rotation], spare: 0.0 },
        });
        match path {
            "translation" => range.translation = points.iter().fold(range.translation, |b, v| b.with(v.truncate())),
            "scale" => range.scale = points.iter().fold(range.scale, |b, v| b.with(v.truncate())),
            _ => values.points(1).for_each(|curve| range.rotations.add(&curve, values.is_cubic)),
        }
        Some(())
    }

    fn weights_of(&mut self, document: &Document, node: usize, values: &Values) -> Option<()> {
        let mesh = document.meshes.get(document.node(node).mesh?)?;
        let targets = mesh.primitives.iter().map(|p| p.targets.len()).max().unwrap_or(0);
        if targets == 0 {
            return Some(());
        }
        let own = |k: usize| document.node(node).weights.as_deref().unwrap_or(&mesh.weights).get(k).copied().unwrap_or(0.0);
        let mut ranges: Vec<[f64; 2]> = (0..targets).map(|k| [own(k); 2]).collect();
        let mut points = 0;
        for (k, curve) in values.points(targets).enumerate() {
            let [low, high] = &mut ranges[k % targets];
            for value in curve {
                (*low, *high) = (low.min(value.x), high.max(value.x));
            }
            points += 1;
        }
        let moves = (0..targets).any(|k| ranges[k].iter().any(|w| (w - own(k)).abs() > REST));
        if points > 0 && moves {
            let known = self.weights.entry(node).or_insert_with(|| ranges.clone());
            known.iter_mut().zip(&ranges).for_each(|(known, new)| *known = [known[0].min(new[0]), known[1].max(new[1])]);
        }
        Some(())
    }
}

/// The corners of a box.
pub(super) fn corners(b: Aabb) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        DVec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] }))
    })
}

impl Range {
    /// Bounds of all places of points.
    fn sweep(&self, points: &[DVec3]) -> Aabb {
        let scales = if self.scale.size() == DVec3::ZERO { vec![self.scale.min] } else { corners(self.scale).to_vec() };
        let scaled: Vec<DVec3> = points.iter().flat_map(|p| scales.iter().map(move |s| *p * *s)).collect();
        let scaled = if scaled.len() <= 8 { scaled } else { corners(Aabb::of(scaled)).to_vec() };
        let radius = scaled.iter().map(|p| p.length()).fold(0.0, f64::max);
        let turned = match self.rotations.all.len() > MOST_TURNS {
            true => Aabb { min: DVec3::splat(-radius), max: DVec3::splat(radius) },
            false => {
                let turned = self.rotations.all.iter().flat_map(|q| scaled.iter().map(move |&p| *q * p));
                Aabb::of(turned).inflated(radius * self.rotations.spare)
            }
        };
        Aabb { min: turned.min + self.translation.min, max: turned.max + self.translation.max }
    }
}

impl Turns {
    /// Adds the rotations of a curve: one value, two (the shorter way between them) or the four Bezier points of a cubic.
    fn add(&mut self, curve: &[DVec4], is_cubic: bool) {
        if self.all.len() > MOST_TURNS {
            return;
        }
        match *curve {
            [a, b, c, d] if is_cubic => {
                for piece in 0..CUBIC_PIECES {
                    let [from, to] = [piece, piece + 1].map(|k| k as f64 / CUBIC_PIECES as f64);
                    self.within(&part([a, b, c, d], from, to));
                }
            }
            [a, b] => {
                let (a, b) = (a.normalize_or(DVec4::W), b.normalize_or(DVec4::W));
                let b = if a.dot(b) < 0.0 { -b } else { b };
                let angle = a.dot(b).clamp(-1.0, 1.0).acos();
                let pieces = (angle / PIECE).ceil().clamp(1.0, MOST_TURNS as f64) as usize;
                let at = |k: usize| {
                    let t = k as f64 / pieces as f64;
                    let [wa, wb] = [(1.0 - t) * angle, t * angle].map(f64::sin);
                    if angle < NO_TURN { a.lerp(b, t) } else { a * wa + b * wb }
                };
                (0..pieces).for_each(|k| self.within(&[at(k), at(k + 1)]));
            }
            _ => curve.iter().for_each(|q| self.within(&[*q])),
        }
    }

    /// Adds all rotations that are positive sums of these.
    fn within(&mut self, hull: &[DVec4]) {
        let unit = |q: &DVec4| q.try_normalize();
        let middle = hull.iter().filter_map(unit).sum::<DVec4>().try_normalize();
        let widest = |middle: DVec4| hull.iter().map(|q| unit(q).map_or(-1.0, |q| q.dot(middle))).fold(1.0, f64::min);
        match middle.map(|middle| (middle, widest(middle))) {
            // Twice the angle in space; a chord is twice the sine of half the angle.
            Some((middle, cosine)) if cosine > 0.5 => {
                self.all.push(DQuat::from_vec4(middle));
                self.spare = self.spare.max(2.0 * (1.0 - cosine * cosine).max(0.0).sqrt());
            }
            // It may turn anyhow.
            _ => self.all.resize(MOST_TURNS + 1, DQuat::IDENTITY),
        }
    }
}

/// The Bezier points of a part of a cubic (de Casteljau).
fn part(points: [DVec4; 4], from: f64, to: f64) -> [DVec4; 4] {
    let blossom = |r: f64, s: f64, t: f64| {
        let [a, b, c, d] = points;
        let (ab, bc, cd) = (a.lerp(b, r), b.lerp(c, r), c.lerp(d, r));
        ab.lerp(bc, s).lerp(bc.lerp(cd, s), t)
    };
    [blossom(from, from, from), blossom(from, from, to), blossom(from, to, to), blossom(to, to, to)]
}

/// The values of a sampler.
struct Values {
    times: Vec<f64>,
    values: Vec<DVec4>,
    is_cubic: bool,
    is_linear: bool,
}

impl Values {
    fn read(
        buffers: &Buffers<'_>,
        input: usize,
        output: usize,
        interpolation: Option<&str>,
        left: &mut usize,
    ) -> Option<Self> {
        let times = buffers.accessor(input, &["SCALAR"]).ok()?;
        let values = buffers.accessor(output, &["SCALAR", "VEC3", "VEC4"]).ok()?;
        *left = left.checked_sub(times.count().checked_add(values.count())?)?;
        let interpolation = interpolation.unwrap_or("LINEAR");
        let (is_cubic, is_linear) = (interpolation == "CUBICSPLINE", interpolation == "LINEAR");
        let times: Vec<f64> = (0..times.count()).map(|i| times.get(i).map_or(0.0, |t| t[0])).collect();
        let values: Vec<DVec4> = (0..values.count()).map(|i| DVec4::from(values.get(i).unwrap_or_default())).collect();
        values.iter().all(|v| v.is_finite()).then_some(Self { times, values, is_cubic, is_linear })
    }

    /// Curves from key to key, and the last key, for `width` values a key: two points of a line, four of a cubic, otherwise one.
    fn points(&self, width: usize) -> impl Iterator<Item = Vec<DVec4>> {
        let each = if self.is_cubic { 3 * width } else { width };
        let keys = (self.values.len() / each.max(1)).min(self.times.len());
        let value = move |key: usize, part: usize, k: usize| self.values[key * each + part * width + k];
        (0..keys).flat_map(move |key| {
            (0..width).map(move |k| {
                let next = (key + 1 < keys).then_some(key + 1);
                match next {
                    Some(next) if self.is_cubic => {
                        let third = (self.times[next] - self.times[key]) / 3.0;
                        let [a, d] = [value(key, 1, k), value(next, 1, k)];
                        vec![a, a + value(key, 2, k) * third, d - value(next, 0, k) * third, d]
                    }
                    Some(next) if self.is_linear => vec![value(key, 0, k), value(next, 0, k)],
                    _ => vec![value(key, usize::from(self.is_cubic), k)],
                }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaf 0.9 m wide turns by a right angle: its bounds hold every pose and are tight.
    #[test]
    fn a_door_that_turns_stays_in_its_box() {
        let quarter = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let mut rotations = Turns { all: vec![DQuat::IDENTITY], spare: 0.0 };
        rotations.add(&[DVec4::W, DVec4::from(quarter.to_array())], false);
        let range = Range { translation: Aabb::of([DVec3::X]), scale: Aabb::of([DVec3::ONE]), rotations };
        let leaf = corners(Aabb { min: DVec3::new(0.0, 0.0, -0.02), max: DVec3::new(0.9, 2.0, 0.02) });
        let found = range.sweep(&leaf);
        let mut exact = Aabb::EMPTY;
        for k in 0..=1000 {
            let turn = DQuat::from_rotation_y(f64::from(k) / 1000.0 * std::f64::consts::FRAC_PI_2);
            exact = leaf.iter().fold(exact, |b, &p| b.with(turn * p + DVec3::X));
        }
        assert!(found.contains(exact.min) && found.contains(exact.max), "{found:?} {exact:?}");
        assert!(exact.inflated(0.06).contains(found.min) && exact.inflated(0.06).contains(found.max), "{found:?} {exact:?}");
    }

    #[test]
    fn a_cubic_that_overshoots_is_held() {
        let curve = [DVec4::ZERO, DVec4::X * 3.0, DVec4::X * -2.0, DVec4::X];
        for k in 0..CUBIC_PIECES {
            let [from, to] = [k, k + 1].map(|k| k as f64 / CUBIC_PIECES as f64);
            let piece = part(curve, from, to);
            let t = from.midpoint(to);
            let exact = 3.0 * t * (1.0 - t) * (1.0 - t) * 3.0 - 3.0 * t * t * (1.0 - t) * 2.0 + t * t * t;
            let (low, high) = piece.iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p.x), h.max(p.x)));
            assert!((low..=high).contains(&exact), "{k}: {exact} not in {low}..{high}");
        }
    }
}
