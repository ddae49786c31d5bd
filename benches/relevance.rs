//! Who may see whom: 64 players walk from portal to portal at 7 m/s, and a server knows of each where they were 150 ms ago (`cargo bench
//! --bench relevance`, with the data of $ENFILADE_DATA; `--test` runs briefly).
//!
//! Somebody who comes into sight (whose cell is in the row of the other's cell) and was not sent before is a surprise; there is none by the rows
//! of [`Relevance`], nor by the cells that both may have got into from their places ([`View::within_metres`]). By the rows of the cells where both
//! were, there would be. Levels of `.prt` files have no pieces to find places in; there a cell counts as reached if the straight line is short.

use enfilade::bake::BakeOptions;
use enfilade::file::{FileCell, FilePortal, PvsFile};
use enfilade::math::random::Prng;
use enfilade::runtime::{Culler, Doors, Relevance, View};
use enfilade::types::portal::{PortalKind, PortalState};
use enfilade::{BitMatrix, CellId};
use enfilade_formats::import;
use enfilade_levels::Level;
use glam::{DVec3, Vec3};
use std::hint::black_box;
use std::path::Path;
use testing::bakes::{baked, with_rays};
use testing::data::data;
use testing::times::{is_told, least, timed};
use testing::{files, prt};

const PLAYERS: usize = 64;
/// Metres a second.
const SPEED: f64 = 7.0;
/// Ticks a second, and those that a server is late: 150 ms.
const RATE: usize = 20;
const LATE: usize = 3;
/// Metres of a walk in that time, and a little for rounding.
const METRES: f64 = SPEED * LATE as f64 / RATE as f64 + 1e-3;
/// Of one unit of a level.
const UNIT: f64 = 1.0 / 32.0;
const TICKS: usize = 2000;
const RAYS: u64 = 200_000;

fn main() {
    let brief = is_told("--test");
    println!(
        "| level | cells | made, ms | in sight, % | kept back by rows, % | by places, % | surprises | without either | ns a pair | by places | us a body |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    );
    for level in ["dm4", "e1m1"].iter().take(if brief { 1 } else { 2 }) {
        let scene =
            import(&data().join(format!("quake-id-gpl/{level}.bsp")), &Default::default()).unwrap_or_else(|e| panic!("{e}"));
        let options = BakeOptions { relevance: Some(METRES), ..with_rays(RAYS) };
        simulate(level, &baked(&scene, options), brief);
    }
    for level in ["lqdm12", "lqdm13", "lq_e0m1", "lq_e0m2", "lq_e0m3"].iter().take(if brief { 1 } else { 5 }) {
        let Some(folder) = prt::folder() else { continue };
        simulate(level, &of_prt(&folder, level), brief);
    }
}

/// A file with the portals and the reference rows of a level.
fn of_prt(folder: &Path, name: &str) -> PvsFile {
    let Level { cells, portals, .. } = prt::level(&folder.join(format!("{name}.prt")));
    let rows = prt::rows(&folder.join(format!("{name}.vis.txt.gz")), cells);
    let cell = || FileCell { name: String::new(), source: None, open: false, pieces: Vec::new() };
    let portal = |portal: enfilade_levels::LevelPortal| {
        let corners: Vec<DVec3> = portal.winding.iter().map(|p| *p * UNIT).collect();
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        FilePortal {
            cells: portal.cells.map(CellId),
            plane: n.extend(n.dot(corners[0])).as_vec4(),
            winding: corners.iter().map(|p| p.as_vec3()).collect(),
            kind: PortalKind::Opening,
            state: PortalState::default(),
            source: None,
        }
    };
    PvsFile {
        cells: (0..cells).map(|_| cell()).collect(),
        portals: portals.into_iter().map(portal).collect(),
        placement: BitMatrix::new(cells, 0),
        cell_rows: Some(rows),
        ..files::bare()
    }
}

/// Portals of each cell, and boxes around portals.
struct Net<'f> {
    file: &'f PvsFile,
    portals: Vec<Vec<usize>>,
    boxes: Vec<[Vec3; 2]>,
}

/// Where somebody is.
#[derive(Clone, Copy)]
struct Player {
    at: Vec3,
    cell: CellId,
    /// The portal that they go to, and the point in it.
    portal: usize,
    to: Vec3,
}

impl<'f> Net<'f> {
    fn new(file: &'f PvsFile) -> Self {
        let mut portals = vec![Vec::new(); file.cells.len()];
        for (q, portal) in file.portals.iter().enumerate() {
            portal.cells.iter().for_each(|cell| portals[cell.index()].push(q));
        }
        let around = |portal: &FilePortal| {
            let corners = portal.winding.iter();
            corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
        };
        Self { file, portals, boxes: file.portals.iter().map(around).collect() }
    }

    /// Somewhere in a portal.
    fn point(&self, portal: usize, random: &mut Prng) -> Vec3 {
        let corners = &self.file.portals[portal].winding;
        let i = 1 + random.below(corners.len() - 2);
        corners[0].lerp(corners[i].lerp(corners[i + 1], random.unit() as f32), random.unit().sqrt() as f32)
    }

    /// Somebody in a portal.
    fn start(&self, random: &mut Prng) -> Player {
        let portal = random.below(self.file.portals.len());
        let at = self.point(portal, random);
        self.enter(Player { at, cell: self.file.portals[portal].cells[0], portal, to: at }, random)
    }

    /// Goes through the portal, to the next one.
    fn enter(&self, player: Player, random: &mut Prng) -> Player {
        let cells = self.file.portals[player.portal].cells;
        let cell = cells[usize::from(cells[0] == player.cell)];
        let out = &self.portals[cell.index()];
        let portal = out[random.below(out.len())];
        Player { at: player.to, cell, portal, to: self.point(portal, random) }
    }

    /// Goes on for a tick.
    fn walk(&self, mut player: Player, random: &mut Prng) -> Player {
        let mut left = (SPEED / RATE as f64) as f32;
        // Of many portals at one place, some are left for the next tick.
        for _ in 0..64 {
            let rest = player.at.distance(player.to);
            if rest > left {
                player.at += (player.to - player.at) * (left / rest);
                break;
            }
            left -= rest;
            player = self.enter(player, random);
        }
        player
    }

    /// The cells that a player may be in after so many metres. A straight line may leave a cell that is not convex: then their place is not in it.
    fn around(&self, (culler, view): (&Culler, &mut View), player: &Player) -> Vec<CellId> {
        let is_there = culler.cell_of(player.at) == Some(player.cell);
        if is_there { view.within_metres([player.at; 2], METRES).to_vec() } else { self.straight(player, METRES as f32) }
    }

    /// The same by straight lines to portals alone.
    fn straight(&self, player: &Player, metres: f32) -> Vec<CellId> {
        let mut cells = vec![player.cell];
        let mut next = 0;
        while let Some(&cell) = cells.get(next) {
            next += 1;
            for &portal in &self.portals[cell.index()] {
                let [low, high] = self.boxes[portal];
                let gap = (low - player.at).max(player.at - high).max(Vec3::ZERO).length();
                for cell in self.file.portals[portal].cells {
                    if gap <= metres && !cells.contains(&cell) {
                        cells.push(cell);
                    }
                }
            }
        }
        cells
    }
}

/// What a run counts, in pairs.
#[derive(Default)]
struct Counts {
    all: u64,
    in_sight: u64,
    sent: u64,
    sent_by_places: u64,
    surprises: u64,
    /// By the rows of the cells where both were.
    by_neither: u64,
}

fn simulate(name: &str, file: &PvsFile, brief: bool) {
    let culler = Culler::new(file);
    let doors = Doors::passable(&culler);
    let (relevance, made) = timed(|| Relevance::new(&culler, METRES, &doors));
    assert!(Relevance::of_file(file).is_none_or(|kept| kept == relevance), "{name}: the file's rows");
    let (net, mut random, mut view) = (Net::new(file), Prng::new(7, 0), View::new(&culler));
    view.set_doors(&doors);
    let mut history = vec![(0..PLAYERS).map(|_| net.start(&mut random)).collect::<Vec<Player>>()];
    let mut counts = Counts::default();
    for _ in 0..if brief { 100 } else { TICKS } {
        let now = history[history.len() - 1].iter().map(|player| net.walk(*player, &mut random)).collect();
        history.push(now);
        if let Some(before) = history.len().checked_sub(1 + LATE) {
            let around: Vec<Vec<CellId>> =
                history[before].iter().map(|player| net.around((&culler, &mut view), player)).collect();
            count(file, (&culler, &relevance), (&history[before], &around), &history[history.len() - 1], &mut counts);
        }
    }
    assert_eq!(counts.surprises, 0, "{name}");
    assert!(counts.by_neither > 0, "{name}: nobody comes into sight");
    let share = |n: u64| n as f64 * 1e2 / counts.all as f64;
    let players = &history[history.len() - 1];
    let around: Vec<Vec<CellId>> = players.iter().map(|player| net.around((&culler, &mut view), player)).collect();
    let by_rows = pair_nanoseconds(|a, b| relevance.may_see(black_box(&[players[a].cell]), black_box(&around[b])));
    let by_places = pair_nanoseconds(|a, b| culler.may_see(black_box(&around[a]), black_box(&around[b])));
    let all = || players.iter().map(|player| view.within_metres(black_box([player.at; 2]), METRES).len()).sum::<usize>();
    let has_places = file.cells.iter().any(|cell| !cell.pieces.is_empty());
    let body = has_places.then(|| format!("{:.2}", least(20, all).as_secs_f64() * 1e6 / PLAYERS as f64));
    println!(
        "| {name} | {} | {:.1} | {:.1} | {:.1} | {:.1} | {} | {} | {by_rows:.1} | {by_places:.1} | {} |",
        file.cells.len(),
        made.as_secs_f64() * 1e3,
        share(counts.in_sight),
        share(counts.all - counts.sent),
        share(counts.all - counts.sent_by_places),
        counts.surprises,
        counts.by_neither,
        body.unwrap_or_else(|| "no places".into())
    );
}

/// Counts a tick: what a server sends by where players were and the cells around, and who is in sight.
fn count(
    file: &PvsFile,
    (culler, relevance): (&Culler, &Relevance),
    (before, around): (&[Player], &[Vec<CellId>]),
    now: &[Player],
    counts: &mut Counts,
) {
    for (a, b) in (0..PLAYERS).flat_map(|a| (0..PLAYERS).map(move |b| (a, b))).filter(|(a, b)| a != b) {
        let in_sight = file.sees_cell(now[a].cell, now[b].cell);
        let sent = relevance.may_see(&[before[a].cell], &around[b]);
        let sent_by_places = culler.may_see(&around[a], &around[b]);
        counts.all += 1;
        counts.in_sight += u64::from(in_sight);
        counts.sent += u64::from(sent);
        counts.sent_by_places += u64::from(sent_by_places);
        counts.surprises += u64::from(in_sight && !(sent && sent_by_places));
        counts.by_neither += u64::from(in_sight && !file.sees_cell(before[a].cell, before[b].cell));
    }
}

/// The time of a pair.
fn pair_nanoseconds(mut may_see: impl FnMut(usize, usize) -> bool) -> f64 {
    let mut all = || (0..PLAYERS * PLAYERS).filter(|pair| may_see(pair / PLAYERS, pair % PLAYERS)).count();
    least(20, &mut all).as_secs_f64() * 1e9 / (PLAYERS * PLAYERS) as f64
}
