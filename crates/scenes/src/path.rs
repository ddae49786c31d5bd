//! A walk through a building at eye height, from room to room through the middle of doors.

use super::facts::{Facts, Fill};
use enfilade::types::person::EYE_HEIGHT;
use glam::DVec3;
use serde_json::{Value, json};
use std::collections::VecDeque;

/// Distance of the camera's target along the path, metres.
const AHEAD: f64 = 2.5;
/// Length of the straight path before and behind a door's wall, metres: past an open leaf.
const STRAIGHT: f64 = 1.05;

/// A camera path in the model's coordinates.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct CameraPath {
    /// Eye and target of each frame.
    pub(super) frames: Vec<[DVec3; 2]>,
}

impl CameraPath {
    /// Frames along a polyline of floor points, at most `step` metres apart; every corner is a frame, so that the straight line
    /// between two frames never leaves the path.
    pub(super) fn along(way: &[DVec3], step: f64) -> Self {
        let mut eyes: Vec<DVec3> = Vec::new();
        for leg in way.windows(2) {
            let parts = (leg[0].distance(leg[1]) / step).ceil().max(1.0) as usize;
            eyes.extend((0..parts).map(|i| leg[0].lerp(leg[1], i as f64 / parts as f64) + DVec3::Y * EYE_HEIGHT));
        }
        eyes.extend(way.last().map(|p| *p + DVec3::Y * EYE_HEIGHT));
        let frames =
            (0..eyes.len()).map(|i| [eyes[i], look_ahead(&eyes[i..]).unwrap_or(eyes[i] + heading(&eyes))]).collect();
        Self { frames }
    }

    /// The format of `walk --path`.
    pub(super) fn json(&self, name: &str) -> Value {
        let round = |p: DVec3| p.to_array().map(|x| (x * 1e4).round() / 1e4 + 0.0);
        let frames: Vec<Value> =
            self.frames.iter().map(|[eye, target]| json!({ "eye": round(*eye), "target": round(*target) })).collect();
        json!({ "name": name, "fov_y_degrees": 60.0, "near": 0.1, "frames": frames })
    }
}

/// The point [`AHEAD`] metres along the path; `None` if less than half a metre remains.
fn look_ahead(eyes: &[DVec3]) -> Option<DVec3> {
    let mut left = AHEAD;
    for leg in eyes.windows(2) {
        let length = leg[0].distance(leg[1]);
        if length >= left {
            return Some(leg[0].lerp(leg[1], left / length));
        }
        left -= length;
    }
    let last = *eyes.last()?;
    (last.distance(eyes[0]) > 0.5).then_some(last)
}

/// The direction of the last leg of non-zero length.
fn heading(eyes: &[DVec3]) -> DVec3 {
    eyes.windows(2).rev().map(|l| l[1] - l[0]).find(|d| d.length() > 0.0).map_or(DVec3::NEG_Z, DVec3::normalize) * AHEAD
}

impl Facts {
    /// The rooms on a shortest path (fewest doors), both ends included; empty if there is none. `None` is outside.
    pub(super) fn shortest(&self, from: Option<usize>, to: Option<usize>) -> Vec<Option<usize>> {
        let slot = |r: Option<usize>| r.map_or(0, |r| r + 1);
        let mut next = vec![Vec::new(); self.rooms.len() + 1];
        let doors = self.openings.iter().filter(|o| o.fill != Fill::Glass).map(|o| o.rooms);
        for [a, b] in doors.chain(self.stairs.iter().map(|s| s.rooms.map(Some))) {
            next[slot(a)].push(b);
            next[slot(b)].push(a);
        }
        let mut came = vec![None; next.len()];
        came[slot(from)] = Some(from);
        let mut queue = VecDeque::from([from]);
        while let Some(room) = queue.pop_front() {
            for &to in &next[slot(room)] {
                if came[slot(to)].is_none() {
                    came[slot(to)] = Some(room);
                    queue.push_back(to);
                }
            }
        }
        let mut way = vec![to];
        while let Some(&room) = way.last()
            && room != from
        {
            match came[slot(room)] {
                Some(before) => way.push(before),
                None => return Vec::new(),
            }
        }
        way.reverse();
        way
    }

    /// A shortest path through several rooms in turn, from outside.
    pub(super) fn tour(&self, stops: &[usize]) -> Vec<Option<usize>> {
        let mut way = vec![None];
        for &stop in stops {
            let last = way[way.len() - 1];
            way.extend(self.shortest(last, Some(stop)).into_iter().skip(1));
        }
        way
    }

    /// Floor points of a walk through consecutive rooms. A room that is entered and left by the same door is walked into as far
    /// as its middle.
    pub(super) fn way(&self, rooms: &[Option<usize>]) -> Vec<DVec3> {
        let mut way = Vec::new();
        for (i, pair) in rooms.windows(2).enumerate() {
            let [a, b] = [pair[0], pair[1]];
            if let Some(stair) = self.stairs.iter().find(|s| s.rooms.map(Some) == [a, b] || s.rooms.map(Some) == [b, a]) {
                let up = stair.rooms[0] == a.unwrap_or(usize::MAX);
                way.extend(stair.way.iter().copied());
                if !up {
                    let n = stair.way.len();
                    let start = way.len() - n;
                    way[start..].reverse();
                }
            } else if let Some(door) =
                self.openings.iter().find(|o| o.fill != Fill::Glass && (o.rooms == [a, b] || o.rooms == [b, a]))
            {
                let towards = if door.rooms[0] == b { door.normal } else { -door.normal };
                let sill = door.centre - DVec3::Y * (door.size.y / 2.0);
                let reach = towards * (STRAIGHT + door.size.z / 2.0);
                if a.is_none() {
                    way.push(sill - reach * 8.0);
                }
                way.extend([sill - reach, sill, sill + reach]);
            }
            let turns_back = rooms.get(i + 2).is_none_or(|&next| next == a);
            if let (true, Some(room)) = (turns_back, b) {
                way.push(self.rooms[room].middle());
            }
        }
        way
    }
}
