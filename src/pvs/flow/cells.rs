//! Which cells may see each other.

use super::FlowInput;
use super::goals::CellGoals;
use super::might_see::{MightSee, get, set};
use super::net::Net;
use super::schedule::{Found, Tally, Task, costs, rounds, run};
use super::search::Search;
use crate::pvs::Progress;
use crate::{BitMatrix, bits};

/// Decides every pair of cells; `might_see` loses what that rules out.
pub(super) fn decide(
    input: &FlowInput<'_>,
    net: &Net,
    might_see: &mut MightSee,
    tally: &mut Tally,
    progress: Progress<'_>,
) -> BitMatrix {
    let n = net.cells;
    let mut upper = known(input, net);
    let mut hidden = BitMatrix::new(n, n);
    for i in 0..n {
        let reached = reached(net, might_see, net.out(i));
        for j in (0..n).filter(|&j| !upper.get(i, j) && !get(&reached, j)) {
            set_both(&mut hidden, i, j);
        }
    }
    might_see.drop_hidden(net, &hidden);

    // Each pair is searched for from one side.
    let costs = costs(net, might_see);
    let mut wanted = BitMatrix::new(n, n);
    for i in 0..n {
        for j in (0..n).filter(|&j| (costs[i], i) < (costs[j], j) && !upper.get(i, j) && !hidden.get(i, j)) {
            wanted.set(i, j);
        }
    }
    let rounds = rounds(net, might_see, (0..n).filter(|&c| wanted.count_row(c) > 0));
    let before = tally.steps;
    for (k, round) in rounds.iter().enumerate() {
        progress("flow: cells", k as f64 / rounds.len() as f64);
        let found = run(&rounds, k, tally.steps - before, net, might_see, input.max_steps, |search, task| {
            search_from(net, might_see, search, task, wanted.row(task.cell))
        });
        for (task, found) in round.iter().zip(&found) {
            for j in bits::ones(&found.seen) {
                set_both(&mut upper, task.cell, j);
                wanted.clear(task.cell, j);
            }
            for (portal, cells) in &found.refuted {
                might_see.drop_into(net, *portal, cells);
            }
            tally.add(&found.tally);
        }
        for task in round.iter().filter(|task| task.last) {
            wanted.ones(task.cell).for_each(|j| set_both(&mut hidden, task.cell, j));
        }
        might_see.drop_hidden(net, &hidden);
    }
    upper
}

/// Pairs that need no search: a cell and itself, neighbours, and what the caller knows.
fn known(input: &FlowInput<'_>, net: &Net) -> BitMatrix {
    let mut upper = BitMatrix::new(net.cells, net.cells);
    for i in 0..net.cells {
        upper.set(i, i);
        let neighbours = net.out(i).map(|p| net.target[p] as usize);
        input.cells_lower.ones(i).chain(neighbours).for_each(|j| set_both(&mut upper, i, j));
    }
    upper
}

/// Searches from the portals of a task for the cells whose bit is set in `wanted`.
fn search_from(net: &Net, might_see: &MightSee, search: &mut Search<'_>, task: &Task, wanted: &[u64]) -> Found {
    let mut found = Found { seen: wanted.to_vec(), refuted: Vec::new(), tally: Tally::default() };
    let mut goals = CellGoals::new(net, wanted.to_vec());
    for &portal in &task.portals {
        let outcome = search.run(portal, &mut goals);
        found.tally.steps += outcome.steps;
        if outcome.capped {
            found.tally.capped.insert(portal);
            bits::ones(&reached(net, might_see, [portal])).for_each(|cell| goals.see(net, cell));
        } else if !net.out(task.cell).any(|back| get(might_see.row(portal), net.twin[back] as usize)) {
            // Loops through the cell itself leave out this portal: only where there are none has it been tried for all.
            found.refuted.push((portal, goals.wanted().to_vec()));
        }
    }
    found.seen.iter_mut().zip(goals.wanted()).for_each(|(seen, left)| *seen &= !left);
    found
}

/// Cells that lines through some portals might reach, as bits.
pub(super) fn reached(net: &Net, might_see: &MightSee, portals: impl IntoIterator<Item = usize>) -> Vec<u64> {
    let mut cells = vec![0; net.cells.div_ceil(64)];
    for portal in portals {
        set(&mut cells, net.target[portal] as usize);
        bits::ones(might_see.row(portal)).for_each(|q| set(&mut cells, net.target[q] as usize));
    }
    cells
}

fn set_both(matrix: &mut BitMatrix, i: usize, j: usize) {
    matrix.set(i, j);
    matrix.set(j, i);
}
