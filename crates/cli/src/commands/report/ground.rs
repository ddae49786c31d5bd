//! `enfilade report` of a ground.

use super::files::{name, write};
use crate::commands::{CliError, Outcome, answer, at, json};
use enfilade_measure::pages::ground::{Flight, GroundReport};
use enfilade_terrain::{Ground, Limit, Measured, flight, measure};
use serde_json::json;
use std::path::Path;

const SIZE: [u32; 2] = [1920, 1080];
const FRAMES: usize = 60;
const ABOVE: [f64; 3] = [2.0, 200.0, 1500.0];
const PIXELS: [f64; 7] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
const BUDGETS: [u32; 7] = [5_000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000];

/// Measures flights over the ground and writes the report: `output` is the page, `table` stands beside it.
pub(super) fn report(
    input: &Path,
    command: &str,
    seed: u64,
    [output, table]: [&Path; 2],
    as_json: bool,
) -> Result<Outcome, CliError> {
    // All of it in memory, to measure the selection and not the disk.
    let ground = Ground::open(input, u64::MAX).map_err(|e| at(input, e))?;
    if let Some(fault) = ground.faults().first() {
        return Err(at(input, fault));
    }
    let limits = PIXELS.map(Limit::Pixels).into_iter().chain(BUDGETS.map(Limit::Triangles));
    let limits: Vec<Limit> = limits.collect();
    let along = |above: f64| {
        let cameras = flight(&ground, above, FRAMES);
        let found = limits.iter().map(|&limit| measure(&ground, &cameras, SIZE, limit, seed)).collect();
        Flight { above, found }
    };
    let flights: Vec<Flight> = ABOVE.into_iter().map(along).collect();
    let header = ground.header();
    let ([columns, rows], [dx, dz]) = (header.grid.size(), header.spacing);
    let facts = [
        format!("{columns} x {rows} samples, {dx:.3} x {dz:.3} m apart, heights in steps of {:.6} m", header.step),
        format!("tiles of {} samples a side in {} levels", header.grid.side(), header.grid.top() + 1),
        format!("{} samples without a height", header.voids),
    ];
    let page = GroundReport { ground: &name(input), command, facts: &facts, size: SIZE, frames: FRAMES, flights: &flights };
    write(&[(output, page.html()), (table, page.csv())])?;
    if as_json {
        let of = |m: &Measured| {
            let limit = match m.limit {
                Limit::Triangles(most) => json!({ "triangles": most }),
                Limit::Pixels(pixels) | Limit::Distance(pixels) => json!({ "pixels": pixels }),
            };
            json!({
                "limit": limit, "triangles": m.triangles, "seconds": m.seconds, "told_px": m.told, "greatest_px": m.greatest,
                "mean_px": m.mean, "samples": m.samples,
            })
        };
        let summary = |f: &Flight| json!({ "above_m": f.above, "found": f.found.iter().map(of).collect::<Vec<_>>() });
        answer(&json(&flights.iter().map(summary).collect::<Vec<_>>())?)?;
    } else {
        answer(&format!("{}: {} flights of {FRAMES} frames; table: {}", output.display(), flights.len(), table.display()))?;
    }
    Ok(Outcome::Done)
}
