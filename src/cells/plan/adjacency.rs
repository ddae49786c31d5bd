//! Regions as wholes: two that are open to each other over much of their boundary, or through an opening nearly as wide as the
//! narrower of them, are one space, though no single gate between them says so.

use crate::cells::complex::HumanScale;
use crate::cells::complex::arrange::Plan;
use crate::cells::complex::bands::Cut;
use crate::cells::complex::columns::Columns;
use crate::cells::complex::faces::{Face, Surface};
use crate::cells::complex::facets::Facets;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::clearance::{Gate, ends};
use crate::cells::plan::rooms::{HIGH_GATE, Space, least_width};
use crate::cells::plan::voids::STANDING;
use glam::DVec2;
use std::collections::{BTreeMap, HashMap};

/// Two regions are one space where this share of the smaller one's whole boundary is open to the other: a room's door is 2 % of
/// it, a wide window 6 %, half a hall 20 % and more.
const OPEN_SHARE: f64 = 0.2;
/// The same where the smaller region is itself as large as a hall (cubic metres): a level whose halls flow into one another
/// would end up as one cell.
const OPEN_SHARE_OF_HALLS: f64 = 0.35;
const HALL: f64 = 150.0;
/// Two regions indoors are one where what is open between them is this share of the cross-section of the smaller: halves of an attic
/// 1.8, a garage door under its lintel 0.6, a door 0.2.
const OPEN_SECTION: f64 = 1.2;
/// A region smaller than this (cubic metres) goes to a neighbour where this share of its boundary is open in all: over and under the
/// partitions of a toilet's stalls 0.16 and more; a cupboard's door that stands open is 0.13.
const STALL: f64 = 10.0;
const OPEN_SHARE_OF_STALLS: f64 = 0.14;
/// What lies over each other with this share of the lower one's ceiling and of the upper one's floor open is one shaft.
const OPEN_SHARE_OF_SHAFTS: f64 = 0.9;
/// The same where the level is no author's storey: a gallery over a third of a hall leaves 0.67.
const OPEN_SHARE_OF_GALLERIES: f64 = 0.6;

/// A ceiling slopes where it rises by this share of its length: a roof that drains is flatter.
const SLOPE: f64 = 0.1;

/// True where an upright face is higher at one end than at the other.
fn under_slope(f: &Face) -> bool {
    let at = |end: f64| {
        let heights = f.polygon.iter().filter(move |p| (p.x - end).abs() <= 1e-9 * end.abs().max(1.0)).map(|p| p.y);
        heights.fold(f64::NEG_INFINITY, f64::max)
    };
    let low = f.polygon.iter().fold(f64::INFINITY, |low, p| low.min(p.x));
    let high = f.polygon.iter().fold(f64::NEG_INFINITY, |high, p| high.max(p.x));
    (at(high) - at(low)).abs() > SLOPE * (high - low)
}

/// What contacts are told by.
pub(in crate::cells) struct Contacts<'c> {
    pub(in crate::cells) plan: &'c Plan,
    pub(in crate::cells) columns: &'c Columns,
    pub(in crate::cells) facets: &'c Facets,
    pub(in crate::cells) faces: &'c [Face],
    pub(in crate::cells) gates: &'c [Gate],
    pub(in crate::cells) free: &'c [bool],
    pub(in crate::cells) human: HumanScale,
    pub(in crate::cells) seal: f64,
    /// Levels always part regions.
    pub(in crate::cells) storeys_part: bool,
}

/// What two regions share.
#[derive(Default)]
struct Contact {
    /// Open area without leaves and panes, square metres.
    open: f64,
    /// Open faces as high as the regions.
    high: Vec<usize>,
    /// Open area of upright faces under a sloping ceiling, without a frame, square metres: none of those is as high as the regions.
    sloping: f64,
    /// Open area of a level between them, where the lower number is below, and where it is above; square metres.
    level: [f64; 2],
}

impl Contacts<'_> {
    /// Joins regions, those most open to each other first, until no two are open enough. In torn columns what is open may not
    /// be, so those don't count.
    pub(in crate::cells) fn join(&self, space: &mut Space) {
        let whole = |piece: u32| !self.columns.torn[self.columns.of_piece(piece).0];
        loop {
            let mut contacts: BTreeMap<(u32, u32), Contact> = BTreeMap::new();
            let mut boundary = vec![0.0f64; self.free.len()];
            let mut open_in_all = vec![0.0f64; self.free.len()];
            let mut ends_of = vec![[0.0f64; 2]; self.free.len()];
            for (i, (f, gate)) in self.faces.iter().zip(self.gates).enumerate() {
                let (a, b) = (space.regions.find(f.a), space.regions.find(f.b));
                if a == b || !whole(f.a) || !whole(f.b) {
                    continue;
                }
                boundary[a as usize] += f.area;
                boundary[b as usize] += f.area;
                let usable = f.open_area > 0.0 && self.free[f.a as usize] && self.free[f.b as usize] && !gate.leaf;
                if matches!(f.surface, Surface::Cut(_)) {
                    ends_of[a as usize][1] += f.area;
                    ends_of[b as usize][0] += f.area;
                }
                // Eaves have no floor: what the outside lies under is no storey, unless somebody could stand in it.
                let low = space.height[b as usize] < STANDING * self.human.metre;
                let eaves = space.name[a as usize] == Some(-1) && low;
                let level = matches!(f.surface, Surface::Cut(Cut::Level(_)));
                let parted = self.storeys_part && level && !eaves;
                if usable && !(space.named(a) && space.named(b)) && !space.outgrown(a, b) {
                    let contact = contacts.entry((a.min(b), a.max(b))).or_default();
                    if level {
                        contact.level[usize::from(a > b)] += f.open_area;
                    }
                    if parted {
                        continue;
                    }
                    contact.open += f.open_area;
                    open_in_all[a as usize] += f.open_area;
                    open_in_all[b as usize] += f.open_area;
                    let low = space.height[a as usize].min(space.height[b as usize]);
                    if gate.height.is_finite() && !gate.framed && !gate.ledge {
                        if under_slope(f) {
                            contact.sloping += f.open_area;
                        }
                        if gate.height >= HIGH_GATE * low {
                            contact.high.push(i);
                        }
                    }
                }
            }
            let mut most: BTreeMap<u32, f64> = BTreeMap::new();
            for (&(a, b), contact) in &contacts {
                for r in [a, b] {
                    let best = most.entry(r).or_default();
                    *best = best.max(contact.open);
                }
            }
            let outside = |r: u32| space.name[r as usize] == Some(-1);
            let mut wishes: Vec<(f64, (u32, u32))> = Vec::new();
            for (&(a, b), contact) in &contacts {
                let hall = space.volume[a as usize].min(space.volume[b as usize]) >= HALL * self.human.metre.powi(3);
                let least = if hall { OPEN_SHARE_OF_HALLS } else { OPEN_SHARE };
                let share = contact.open / boundary[a as usize].min(boundary[b as usize]);
                let narrower = space.width[a as usize].min(space.width[b as usize]);
                // Only as good as a gate of its own: what sums up to a wide opening may be a row of narrow ones.
                let wide = || {
                    let width = self.width(&contact.high);
                    width >= least_width(width, narrower, self.human)
                };
                let stall = |r: u32| {
                    let small = space.volume[r as usize] < STALL * self.human.metre.powi(3) && !space.named(r);
                    let open = open_in_all[r as usize] >= OPEN_SHARE_OF_STALLS * boundary[r as usize];
                    small && open && contact.open > 0.0 && contact.open >= most[&r]
                };
                let over = |low: u32, high: u32, open: f64| {
                    let least = ends_of[low as usize][1].max(ends_of[high as usize][0]);
                    let share = if self.storeys_part { OPEN_SHARE_OF_SHAFTS } else { OPEN_SHARE_OF_GALLERIES };
                    open > 0.0 && open >= share * least
                };
                let shaft = over(a, b, contact.level[0]) || over(b, a, contact.level[1]);
                let section = narrower * space.height[a as usize].min(space.height[b as usize]);
                let across = section.is_finite() && !outside(a) && !outside(b) && contact.sloping >= OPEN_SECTION * section;
                if share >= least || across || stall(a) || stall(b) || shaft || wide() {
                    wishes.push((share, (a, b)));
                }
            }
            wishes.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            let mut touched = vec![false; self.free.len()];
            let mut joined = false;
            for (_, (a, b)) in wishes {
                if !touched[a as usize] && !touched[b as usize] {
                    space.unite(a, b);
                    (touched[a as usize], touched[b as usize], joined) = (true, true, true);
                }
            }
            if !joined {
                return;
            }
        }
    }

    /// How far the longest run of faces that meet at their ends reaches in plan, metres.
    fn width(&self, faces: &[usize]) -> f64 {
        let ends: Vec<(DVec2, DVec2)> = faces.iter().filter_map(|&i| ends(&self.faces[i], self.plan, self.facets)).collect();
        let key = |p: DVec2| ((p.x / (8.0 * self.seal)).round() as i64, (p.y / (8.0 * self.seal)).round() as i64);
        let mut at: HashMap<(i64, i64), u32> = HashMap::new();
        let mut runs = DisjointSets::new(ends.len());
        for (i, &(a, b)) in ends.iter().enumerate() {
            for end in [a, b] {
                let first = *at.entry(key(end)).or_insert(i as u32);
                runs.join(first, i as u32);
            }
        }
        let mut reach: BTreeMap<u32, Vec<DVec2>> = BTreeMap::new();
        for (i, &(a, b)) in ends.iter().enumerate() {
            reach.entry(runs.find(i as u32)).or_default().extend([a, b]);
        }
        let longest = |points: &Vec<DVec2>| {
            // Good to 2 %: the widest of sixteen directions.
            let directions = (0..16).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::PI / 16.0));
            directions
                .map(|d| {
                    let along = points.iter().map(|p| d.dot(*p));
                    along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
                })
                .fold(0.0, f64::max)
        };
        reach.values().map(longest).fold(0.0, f64::max)
    }
}
