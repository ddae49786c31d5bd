//! Random lines that check a level's rows: they find every bit that is missing, and nothing else.

use enfilade::BitMatrix;
use enfilade_levels::Level;
use enfilade_levels::prt::read_prt;
use enfilade_measure::verify::level_lines::{LineOptions, LineReport, check_rows};
use testing::bakes::on;
use testing::data::data;
use testing::prt;

/// Four rooms in a row along x, doors at x = 4, 8, 12; `shift` is how far along y the last door is.
fn row(shift: f64) -> Level {
    let door = |k: u32, x: f64, y: f64| {
        let (low, high) = (y - 1.0, y + 1.0);
        format!("4 {k} {} ({x} {low} -1) ({x} {high} -1) ({x} {high} 1) ({x} {low} 1)\n", k + 1)
    };
    let doors = [door(0, 4.0, 0.0), door(1, 8.0, 0.0), door(2, 12.0, shift)].concat();
    read_prt(format!("PRT1\n4\n3\n{doors}").as_bytes()).unwrap().level
}

fn rows(n: usize, without: &[(usize, usize)]) -> BitMatrix {
    let mut rows = BitMatrix::new(n, n);
    (0..n).for_each(|a| (0..n).for_each(|b| _ = rows.set(a, b)));
    without.iter().for_each(|&(a, b)| rows.clear(a, b));
    rows
}

fn check(level: &Level, rows: &BitMatrix, rays: u64, seed: u64) -> LineReport {
    check_rows(level, rows, &LineOptions { rays, seed })
}

#[test]
fn full_rows_pass_and_each_missing_bit_is_found() {
    let level = row(0.0);
    let full = check(&level, &rows(4, &[]), 10_000, 1);
    assert!(full.passed && full.missed_pairs == 0 && full.bent == 0 && full.rays > 9_900, "{full:?}");
    // Some lines go through all three doors.
    assert!(full.crossings > full.rays + 1000);
    for a in 0..4 {
        for b in (0..4).filter(|&b| b != a) {
            let report = check(&level, &rows(4, &[(a, b)]), 10_000, 1);
            assert!(!report.passed && report.missed_pairs == 1 && report.missed_rays > 0, "{a} {b}: {report:?}");
            let found = report.examples[0].cells.map(|c| c as usize);
            assert!(found == [a, b] || found == [b, a], "{a} {b}: {found:?}");
        }
    }
}

#[test]
fn a_line_that_is_shown_is_one() {
    let level = row(0.0);
    let report = check(&level, &rows(4, &[(0, 3)]), 10_000, 1);
    let line = &report.examples[0];
    assert_eq!(
        (line.portals.len(), [line.from.x, line.to.x].map(f64::round)),
        (3, if line.cells[0] == 0 { [4.0, 12.0] } else { [12.0, 4.0] })
    );
    // Both ends are in their doors, and so is the point between them.
    for p in [line.from, line.to, (line.from + line.to) * 0.5] {
        assert!(p.y.abs() <= 1.0 && p.z.abs() <= 1.0, "{line:?}");
    }
}

#[test]
fn what_no_line_can_see_need_not_be_in_the_rows() {
    // Through the doors at x = 4 and 8, from y = -1 to 1, a line gets at most 2 aside from x = 8 to 12: y below 3.
    let hidden = row(4.5);
    assert!(check(&hidden, &rows(4, &[(0, 3), (3, 0)]), 200_000, 1).passed);
    assert!(!check(&hidden, &rows(4, &[(1, 3)]), 200_000, 1).passed);
    // A slit of a hundredth is found: lines are aimed where rows end.
    let slit = row(3.99);
    assert!(!check(&slit, &rows(4, &[(0, 3), (3, 0)]), 2_000_000, 1).passed);
}

#[test]
fn the_same_lines_on_any_number_of_threads() {
    let level = row(1.0);
    let of = |threads: usize, seed: u64| LineReport {
        seconds: 0.0,
        ..on(threads, || check(&level, &rows(4, &[(3, 0)]), 300_000, seed))
    };
    assert_eq!(of(1, 5), of(3, 5));
    assert_ne!(of(1, 5).crossings, of(1, 6).crossings);
}

#[test]
fn no_portals_no_lines() {
    let level = Level { cells: 2, portals: Vec::new(), rounding: 0.0 };
    let report = check(&level, &rows(2, &[(0, 1)]), 1000, 0);
    assert!(report.passed && report.rays == 0);
}

/// Bits taken out of a third party's rows of a real level are found, and only those.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn bits_taken_from_real_rows_are_found() {
    let folder = data();
    let level = prt::level(&folder.join("prt/lqdm12.prt"));
    let whole = prt::rows(&folder.join("prt/lqdm12.vis.txt.gz"), level.cells);
    assert!(check(&level, &whole, 400_000, 1).passed);
    // Pairs that a few other lines happen to show, neighbours and not.
    let mut own = BitMatrix::new(level.cells, level.cells);
    (0..level.cells).for_each(|i| _ = own.set(i, i));
    let mut taken = Vec::new();
    for seed in 0..16 {
        let shown = check(&level, &own, 100, 1000 + seed);
        taken.extend(shown.examples.iter().take(1).map(|e| e.cells.map(|c| c as usize)));
    }
    taken.sort_unstable();
    taken.dedup();
    assert!(taken.len() > 10);
    for [a, b] in taken {
        let mut less = whole.clone();
        less.clear(a, b);
        let report = check(&level, &less, 400_000, 2);
        assert_eq!(report.missed_pairs, 1, "{a} {b}");
    }
}
