//! Levels whose coordinates are rounded.

use super::{level, run};
use enfilade_levels::Level;
use enfilade_levels::prt::read_prt;
use glam::{DMat3, DVec3};
use testing::data::data;
use testing::grid::{Grid, Recipe};

/// A level as a `.prt` whose coordinates have so many decimals.
fn rounded(level: &Level, decimals: usize) -> Level {
    let mut text = format!("PRT1\n{}\n{}\n", level.cells, level.portals.len());
    for p in &level.portals {
        text += &format!("{} {} {}", p.winding.len(), p.cells[0], p.cells[1]);
        p.winding.iter().for_each(|c| text += &format!(" ({:.decimals$} {:.decimals$} {:.decimals$})", c.x, c.y, c.z));
        text.push('\n');
    }
    read_prt(text.as_bytes()).expect("a portal file").level
}

/// What rounding moves by less than itself is decided, and nothing that is seen in the level is lost.
#[test]
fn rounded_coordinates_leave_nothing_undecided() {
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.4);
    let mut asked = [0, 0];
    for seed in 0..6 {
        let recipe = Recipe { size: [6, 1, 6], doors: 0.7, joined: 0.2, outside: false, objects: 0 };
        let mut exact = level(&Grid::random(recipe, seed).graph());
        exact.portals.iter_mut().flat_map(|p| &mut p.winding).for_each(|c| *c = turn * *c * 100.0);
        let truth = run(&exact);
        assert_eq!(truth.lower, truth.upper);
        let coarse = rounded(&exact, 3);
        assert_eq!(coarse.rounding, 0.0005);
        let found = run(&coarse);
        assert_eq!(truth.upper.first_outside(&found.upper), None, "seed {seed}: what is seen was lost");
        let undecided = found.upper.count_ones() - found.lower.count_ones();
        assert!(undecided * 1000 <= found.upper.count_ones(), "seed {seed}: {undecided} undecided");
        // Taken for exact, the same file has gaps that must be asked exactly.
        let as_exact = run(&Level { rounding: 0.0, ..coarse });
        asked = [asked[0] + found.stats.exact_asked, asked[1] + as_exact.stats.exact_asked];
    }
    assert!(asked[0] < asked[1], "{asked:?}");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn a_real_level_with_three_decimals_is_decided() {
    let data = data();
    for name in ["lq_e0m1", "id_e1m3"] {
        let exact = read_prt(&std::fs::read(data.join(format!("prt/{name}.prt"))).unwrap()).unwrap().level;
        assert_eq!(exact.rounding, 0.0, "full doubles");
        let truth = run(&exact);
        let found = run(&rounded(&exact, 3));
        assert_eq!(truth.lower.first_outside(&found.upper), None, "{name}");
        let undecided = found.upper.count_ones() - found.lower.count_ones();
        assert!(undecided * 10_000 <= found.upper.count_ones(), "{name}: {undecided} of {}", found.upper.count_ones());
    }
}
