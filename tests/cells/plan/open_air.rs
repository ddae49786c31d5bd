//! What is outside: yards, balconies, and courts between wings.

use super::known::{Known, OPEN, assert_known};
use super::{EYE, FAR, HIGH, door_x, v};
use testing::solids::Box3;
use testing::walls::{Building, WALL};

#[test]
fn a_courtyard_is_outside() {
    let mut b = Building::default();
    // A ring 4 m wide around a yard of 5 x 5 m: the roof has a hole, and a wall stands around it.
    let yard: Box3 = [v(4.2, -1., 4.2), v(9.2, 9., 9.2)];
    b.shell(v(0., 0., 0.), v(13.4, HIGH, 13.4), &[[yard[0].with_y(HIGH), yard[1]]]);
    let (lo, hi) = (v(4., 0., 4.), v(9.4, HIGH, 9.4));
    b.holed(lo, hi, &[yard, [v(6.2, 0., 3.9), v(7.1, 2.1, 4.3)]]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("ring", vec![v(2., EYE, 2.), v(11., EYE, 2.), v(11., EYE, 11.), v(2., EYE, 11.), v(6.7, EYE, 2.)]),
                ("outside", vec![FAR, v(6.7, EYE, 6.7), v(4.3, 0.1, 4.3), v(6.7, 6., 6.7)]),
            ],
            sights: vec![("ring", "outside", [v(6.6, 1.2, 2.), v(6.7, 1.2, 6.)])],
            within: vec![[v(1., EYE, 2.), v(12., EYE, 2.)], [v(6.7, EYE, 6.7), v(6.7, 9., 6.7)]],
        },
    );
}

#[test]
fn a_balcony_is_outside() {
    let mut b = Building::default();
    let out = door_x(6., 3., 2.5);
    // Two storeys of one room each, without a stair; on the upper one a door to a balcony with parapets.
    b.shell(v(0., 0., 0.), v(6., HIGH, 5.), &[]);
    b.shell(v(0., 3., 0.), v(6., 3. + HIGH, 5.), &[out]);
    b.solid(v(6.2, 2.8, 1.), v(8., 3., 4.));
    for (a, c) in [(v(7.9, 3., 1.), v(8., 4., 4.)), (v(6.2, 3., 1.), v(7.9, 4., 1.1)), (v(6.2, 3., 3.9), v(7.9, 4., 4.))] {
        b.solid(a, c);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(3., EYE, 2.5), v(0.1, 0.1, 0.1)]),
                ("upper", vec![v(3., 4.5, 2.5), v(5.9, 5.7, 4.9)]),
                ("outside", vec![FAR, v(7., 4.5, 2.5), v(7., 3.1, 2.5), v(7., 1., 2.5)]),
            ],
            sights: vec![("upper", "outside", [v(3., 4.2, 2.5), v(7.5, 4.2, 2.6)])],
            within: vec![[v(7., 3.2, 2.5), v(7., 6., 2.5)]],
        },
    );
}

/// Wings of three rooms side by side, 6 m apart, each room with a window into what lies between two wings, with or without ground below.
fn wings(count: usize, ground: bool) -> (Building, Known) {
    const ROOMS: [[&str; 3]; 3] = [["a1", "a2", "a3"], ["b1", "b2", "b3"], ["c1", "c2", "c3"]];
    let (mut b, mut known) = (Building::default(), Known::default());
    let west = |wing: usize| 11.0 * wing as f64;
    let window = |x: f64, z: f64| [v(x - 0.01, 0.9, z - 0.7), v(x + WALL + 0.01, 2.2, z + 0.7)];
    let court = |wing: usize| if count < 3 { "outside" } else { OPEN[1 + wing] };
    for (wing, names) in ROOMS.iter().enumerate().take(count) {
        let (x, mut holes) = (west(wing), Vec::new());
        for (room, name) in names.iter().enumerate() {
            let z = 2.0 + 4.2 * room as f64;
            known.cells.push((name, vec![v(x + 2.5, EYE, z), v(x + 0.1, 0.1, z - 1.9), v(x + 4.9, 2.7, z + 1.9)]));
            if wing > 0 {
                holes.push(window(x - WALL, z));
                known.sights.push((name, court(wing - 1), [v(x + 2., 1.5, z), v(x - 3., 1.6, z)]));
            }
            if wing + 1 < count {
                holes.push(window(x + 5., z));
                known.sights.push((name, court(wing), [v(x + 3., 1.5, z), v(x + 8., 1.6, z)]));
            }
        }
        b.shell(v(x, 0., 0.), v(x + 5., HIGH, 12.4), &holes);
        b.solid(v(x, 0., 4.), v(x + 5., HIGH, 4.2));
        b.solid(v(x, 0., 8.2), v(x + 5., HIGH, 8.4));
        if count == 3 && wing < 2 {
            known.cells.push((court(wing), vec![v(x + 8., EYE, 6.), v(x + 5.5, 0.1, 1.), v(x + 10.5, 2.7, 11.)]));
            known.sights.push((court(wing), "outside", [v(x + 8., EYE, 6.), v(x + 8., 9., 6.)]));
            if !ground {
                known.sights.push((court(wing), "outside", [v(x + 8., EYE, 6.), v(x + 8., -3., 6.)]));
            }
        }
    }
    if ground {
        b.solid(v(-6., -WALL - 0.4, -6.), v(west(count), -WALL, 18.));
    }
    known.cells.push(("outside", vec![FAR, v(3., 8., 3.)]));
    (b, known)
}

/// Between two wings there is one court, and nothing that it is shut off from; with three there are two.
#[test]
fn courts_between_wings_are_cells_of_their_own() {
    for (count, ground) in [(2, true), (2, false), (3, true), (3, false)] {
        let (building, known) = wings(count, ground);
        assert_known(&building.finish(), &known);
    }
}
