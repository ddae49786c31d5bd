//! The upper bound of objects for each cell.

use super::FlowInput;
use super::cells::reached;
use super::goals::{Boxes, ObjectGoals};
use super::might_see::{MightSee, set};
use super::net::Net;
use super::schedule::{Round, Tally, Task, rounds, run};
use super::search::Search;
use crate::BitMatrix;
use crate::job::{Job, Stopped};
use crate::math::bits;
use serde::{Deserialize, Serialize};

/// The result of a task.
#[derive(Serialize, Deserialize)]
struct Found {
    /// Objects that may be visible, as bits.
    seen: Vec<u64>,
    /// Counters.
    tally: Tally,
}

/// Decides every pair of an `own` cell and an object; other rows are meaningless.
pub(super) fn decide(
    input: &FlowInput<'_>,
    net: &Net,
    might_see: &MightSee,
    cells_upper: &BitMatrix,
    own: impl Fn(usize) -> bool,
    tally: &mut Tally,
    work: &Job<'_>,
) -> Result<BitMatrix, Stopped> {
    let mut upper = input.placement.clone();
    upper.union_with(input.objects_lower);
    if input.object_bounds.is_empty() {
        return Ok(upper);
    }
    let boxes = Boxes::new(net, input.graph, input.placement, input.placed_boxes, input.object_bounds);
    let rounds = rounds(net, might_see, (0..net.cells).filter(|&cell| own(cell)));
    let before = tally.steps;
    for (k, round) in rounds.iter().enumerate() {
        let spent = tally.steps - before;
        let of_stage = Round { stage: "flow: objects", before: 0, rounds: &rounds, k, spent, max_steps: input.max_steps };
        let scratch = |max_steps| Search::new(net, might_see, max_steps);
        let search = |search: &mut Search<'_>, task: &Task| {
            let cells = cells_upper.row(task.cell);
            let mut undecided = undecided(input.placement, cells, upper.row(task.cell));
            if let Some(fronts) = input.fronts {
                fronts.keep_shown(input.graph, cells_upper, task.cell, &mut undecided);
            }
            search_from(net, might_see, search, task, &boxes, cells, undecided)
        };
        let found = run(of_stage, scratch, search, work)?;
        for (task, found) in round.iter().zip(&found) {
            upper.row_mut(task.cell).iter_mut().zip(&found.seen).for_each(|(row, seen)| *row |= seen);
            tally.add(&found.tally);
        }
    }
    Ok(upper)
}

/// Objects in any of `cells` that are not `known`, as bits.
fn undecided(placement: &BitMatrix, cells: &[u64], known: &[u64]) -> Vec<u64> {
    let mut objects = vec![0; known.len()];
    for cell in bits::ones(cells) {
        objects.iter_mut().zip(placement.row(cell)).for_each(|(a, b)| *a |= b);
    }
    objects.iter_mut().zip(known).for_each(|(a, b)| *a &= !b);
    objects
}

/// Searches from the portals of a task for `undecided` objects in `cells`.
fn search_from(
    net: &Net,
    might_see: &MightSee,
    search: &mut Search<'_>,
    task: &Task,
    boxes: &Boxes,
    cells: &[u64],
    mut undecided: Vec<u64>,
) -> Found {
    let mut found = Found { seen: vec![0; undecided.len()], tally: Tally::default() };
    for &portal in &task.portals {
        let mut cells_here = reached(net, might_see, [portal]);
        cells_here.iter_mut().zip(cells).for_each(|(a, b)| *a &= b);
        let mut goals = ObjectGoals::new(net, boxes, &undecided, &cells_here, portal);
        let outcome = search.run(portal, &mut goals);
        found.tally.steps += outcome.steps;
        if outcome.capped {
            found.tally.capped.insert(portal);
            goals.see_all();
        }
        for &object in goals.found() {
            set(&mut found.seen, object);
            undecided[object / 64] &= !(1 << (object % 64));
        }
    }
    found
}
