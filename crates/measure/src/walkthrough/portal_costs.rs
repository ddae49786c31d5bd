//! The cost of each portal: the triangles saved if it is shut.

use super::tour::tour;
use enfilade::PortalId;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors, Mode, View};
pub use enfilade::types::portal::PortalCost;

/// Width over height of the screen.
const ASPECT: f64 = 16.0 / 9.0;

/// Mean triangles that a frame saves if a portal is shut and all others are open, on a walk through every cell. Only portals that
/// the walk sees through; the most expensive first, without those that cost nothing.
pub fn portal_costs(file: &PvsFile, seed: u64) -> Vec<PortalCost> {
    let path = tour(file, seed);
    let culler = Culler::new(file);
    let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
    let mut saved = vec![0u64; file.portals.len()];
    for frame in 0..path.frames.len() {
        let camera = path.camera(frame, file.origin, ASPECT);
        view.set_doors(&doors);
        let seen = view.cull(&camera, Mode::PortalsAndPvs);
        let all = seen.stats.triangles;
        let mut portals: Vec<PortalId> = seen.portals.iter().map(|crossed| crossed.portal.portal()).collect();
        portals.sort_unstable();
        portals.dedup();
        for portal in portals {
            doors.set_open(portal, false);
            view.set_doors(&doors);
            let rest = view.cull(&camera, Mode::PortalsAndPvs).stats.triangles;
            doors.set_open(portal, true);
            saved[portal.index()] += all.saturating_sub(rest);
        }
    }
    let mean = |saved: u64| saved as f64 / path.frames.len().max(1) as f64;
    let costs = (0..).map(PortalId).zip(saved).filter(|(_, saved)| *saved > 0);
    let mut costs: Vec<PortalCost> = costs.map(|(portal, saved)| PortalCost { portal, triangles: mean(saved) }).collect();
    costs.sort_by(|a, b| b.triangles.total_cmp(&a.triangles).then(a.portal.cmp(&b.portal)));
    costs
}
