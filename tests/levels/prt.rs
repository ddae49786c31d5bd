//! Portal files and rows: what is right is read, what is wrong is named with its line and field, and nothing panics.

use enfilade::BitMatrix;
use enfilade::math::geom::newell;
use enfilade_levels::prt::{Dialect, MOST_ISOLATED, PrtFault, read_prt};
use enfilade_levels::rows::{RowsFault, read_rows, write_rows};
use enfilade_levels::{Level, MOST_CLUSTERS};
use glam::DVec3;
use proptest::prelude::*;
use testing::data::data;
use testing::prt::unpacked;
use testing::prt_texts::{HALF_LIFE, HALF_LIFE_BARE, PRT1, PRT1_AM, PRT2, QUAKE3};

#[test]
fn the_dialects_say_the_same() {
    let [one, two, am] = [PRT1, PRT2, PRT1_AM].map(|text| read_prt(text.as_bytes()).unwrap());
    assert_eq!([one.dialect, two.dialect, am.dialect], [Dialect::Prt1, Dialect::Prt2, Dialect::Prt1Am]);
    assert_eq!((&one.level, &two.level), (&two.level, &am.level));
    assert_eq!((one.leaves, two.leaves, am.leaves), (vec![0, 1, 2], vec![0, 1, 2, 0, 2], vec![0, 1, 2, 0, 2]));
    assert_eq!(one.level.portals[0].winding[2], DVec3::new(4.0, 1.0, 1.0));
    // The normal leads from the first cluster into the second: here along x, and against it.
    let along: Vec<f64> = one.level.portals.iter().map(|p| newell(&p.winding).normalize().x).collect();
    assert_eq!(along, [1.0, -1.0]);
}

#[test]
fn the_dialects_of_half_life_and_quake_3_say_the_same() {
    let [one, counted, bare, three] =
        [PRT1, HALF_LIFE, HALF_LIFE_BARE, QUAKE3].map(|text| read_prt(text.as_bytes()).unwrap());
    assert_eq!([counted.dialect, bare.dialect, three.dialect], [Dialect::HalfLife, Dialect::HalfLifeBare, Dialect::Quake3]);
    let same = |level: &Level| (level.cells, &level.portals) == (one.level.cells, &one.level.portals);
    assert!(same(&counted.level) && same(&bare.level) && same(&three.level));
    // Six decimals.
    assert_eq!([counted.level.rounding, three.level.rounding], [5e-7, 5e-7]);
    assert_eq!((counted.leaves, bare.leaves, three.leaves), (vec![0, 0, 1, 2, 2], vec![0, 1, 2], vec![0, 1, 2]));
    // What only they have is checked, too.
    assert!(matches!(
        damaged(HALF_LIFE, "\n1\n2\n", "\n1\n9999999\n", 5, "leaves of cluster 2"),
        PrtFault::OutOfRange { .. }
    ));
    assert_eq!(damaged(QUAKE3, "4 0 1 0 (", "4 0 1 2 (", 5, "hint"), PrtFault::OutOfRange { value: 2, least: 0, most: 1 });
    assert_eq!(damaged(QUAKE3, "\n3 1 (", "\n3 7 (", 7, "cluster"), PrtFault::OutOfRange { value: 7, least: 0, most: 2 });
    assert_eq!(damaged(QUAKE3, "2\n1\n4", "2\n2\n4", 8, "face"), PrtFault::Missing);
}

/// Damage done to a text, and where it must be found.
fn damaged(text: &str, what: &str, by: &str, line: usize, field: &str) -> PrtFault {
    assert!(text.contains(what), "nothing to damage: {what}");
    let error = read_prt(text.replacen(what, by, 1).as_bytes()).expect_err(&format!("{what:?} -> {by:?} is read"));
    assert_eq!((error.line, error.field.as_str()), (line, field), "{error}");
    let said = error.to_string();
    assert!(said.starts_with(&format!("line {line}, {field}: ")) && said.lines().count() == 1, "{said}");
    error.fault
}

#[test]
fn what_is_no_portal_file_is_refused() {
    assert_eq!(damaged(PRT1, "PRT1", "IBSP", 1, "magic"), PrtFault::NotPrt("IBSP".into()));
    assert_eq!(damaged(PRT1, "PRT1", "PRT1 x", 1, "magic"), PrtFault::Trailing("x".into()));
    assert_eq!(read_prt(b"").unwrap_err().fault, PrtFault::Missing);
    assert_eq!(read_prt(b"PRT1\n\xff").unwrap_err().fault, PrtFault::NotText);
    for (text, said) in [
        (format!("\u{feff}{PRT1}"), "line 1, text: U+FEFF (a byte-order mark) is not allowed in a portal file;"),
        (format!("{PRT1}\u{1a}"), "text: U+001A (Ctrl-Z) is not allowed in a portal file;"),
        (format!("{PRT1}\0\n"), "text: U+0000 (a zero byte) is not allowed in a portal file;"),
    ] {
        let fault = read_prt(text.as_bytes()).unwrap_err().to_string();
        assert!(fault.contains(said), "{fault}");
    }
    assert_eq!(read_prt(b"PRT1\n\xff").unwrap_err().line, 2);
}

#[test]
fn every_count_is_checked() {
    let range = |value, least, most| PrtFault::OutOfRange { value, least, most };
    assert_eq!(damaged(PRT1, "\n3\n", "\n-3\n", 2, "clusters"), range(-3, 0, MOST_CLUSTERS));
    assert_eq!(damaged(PRT1, "\n3\n", "\n3 3\n", 2, "clusters"), PrtFault::Trailing("3".into()));
    assert_eq!(damaged(PRT1, "\n3\n", "\n3.5\n", 2, "clusters"), PrtFault::Unexpected("3.5".into(), "a whole number"));
    assert!(matches!(damaged(PRT1, "\n3\n", "\n99999999999999999999\n", 2, "clusters"), PrtFault::Unexpected(..)));
    assert_eq!(damaged(PRT1, "\n3\n", "\n2\n", 5, "first cluster"), range(2, 0, 1));
    assert_eq!(damaged(PRT1, "\n2\n", "\n3\n", 6, "portal"), PrtFault::Missing);
    assert_eq!(damaged(PRT1, "\n2\n", "\n4000000000\n", 3, "portals"), range(4_000_000_000, 0, u64::from(u32::MAX / 2)));
    assert_eq!(damaged(PRT1, "\n2\n", "\n1\n", 5, "end of file"), PrtFault::Trailing("4".into()));
    assert_eq!(damaged(PRT2, "-1\n1 -1", "1 -1", 9, "leaves of cluster 2"), PrtFault::Missing);
    // A leaf in the first of no clusters; found by libFuzzer.
    let nowhere = read_prt(b"PRT1-AM\n0\n0\n1\n0\n").unwrap_err();
    assert_eq!((nowhere.line, nowhere.field.as_str(), nowhere.fault), (4, "leaves", range(1, 0, 0)));
    let promised = 4 + MOST_ISOLATED;
    let isolated = PrtFault::Isolated { clusters: promised, named: 3 };
    assert_eq!(damaged(PRT1, "\n3\n", &format!("\n{promised}\n"), 2, "clusters"), isolated);
    // A few clusters without portals are in most levels.
    assert_eq!(read_prt(PRT1.replacen("\n3\n", "\n9\n", 1).as_bytes()).unwrap().level.cells, 9);
}

#[test]
fn every_field_of_a_portal_is_checked() {
    let unexpected = |found: &str, due| PrtFault::Unexpected(found.into(), due);
    let at = |what: &str, by: &str, field: &str| damaged(PRT1, what, by, 4, field);
    assert_eq!(at("4 0 1", "2 0 1", "points"), PrtFault::OutOfRange { value: 2, least: 3, most: 1024 });
    assert_eq!(at("4 0 1", "4 0", "second cluster"), unexpected("(", "a whole number"));
    assert_eq!(at("4 0 1", "4 0 3", "second cluster"), PrtFault::OutOfRange { value: 3, least: 0, most: 2 });
    assert_eq!(at("4 0 1", "4 1 1", "second cluster"), PrtFault::SameCluster(1));
    assert_eq!(at("4 0 1", "5 0 1", "point 5"), PrtFault::Missing);
    assert_eq!(at("4 0 1", "3 0 1", "after the last point"), PrtFault::Trailing("(".into()));
    assert_eq!(at("(4 1 -1)", "4 1 -1)", "point 2"), unexpected("4", "'('"));
    assert_eq!(at("(4 1 -1)", "(4 1 -1", "point 2"), unexpected("(", "')'"));
    assert_eq!(at("(4 1 -1)", "(4 1 )", "point 2 z"), unexpected(")", "a number"));
    assert_eq!(at("(4 1 -1)", "(4 1 -1 0)", "point 2"), unexpected("0", "')'"));
    for bad in ["nan", "inf", "-inf", "1e300", "10000001"] {
        assert_eq!(at("(4 1 -1)", &format!("(4 {bad} -1)"), "point 2 y"), PrtFault::Coordinate(bad.into()));
    }
}

#[test]
fn windings_are_flat_convex_and_have_an_area() {
    let fault = |winding: &str| {
        let n = winding.matches('(').count();
        read_prt(format!("PRT1\n2\n1\n{n} 0 1 {winding}\n").as_bytes()).map_err(|e| e.fault)
    };
    assert_eq!(fault("(0 0 0) (1 0 0) (2 0 0)").unwrap_err(), PrtFault::NoArea);
    assert_eq!(fault("(5 5 5) (5 5 5) (5 5 5)").unwrap_err(), PrtFault::NoArea);
    // A square with a corner lifted by h is h/4 off its mean plane.
    assert!(fault("(0 0 0) (9 0 0) (9 9 0.03) (0 9 0)").is_ok());
    assert!(
        matches!(fault("(0 0 0) (9 0 0) (9 9 0.2) (0 9 0)").unwrap_err(), PrtFault::NotPlanar(d) if (d - 0.05).abs() < 1e-3)
    );
    // A dent 3 deep; a bow tie; twice around a triangle.
    assert!(matches!(fault("(0 0 0) (9 0 0) (6 6 0) (0 9 0) (3 3 0)").unwrap_err(), PrtFault::NotConvex(d) if d > 1.0));
    assert!(matches!(fault("(0 0 0) (9 9 0) (9 0 0) (0 8 0)").unwrap_err(), PrtFault::NotConvex(_)));
    let star = "(0 3 0) (-2 -3 0) (3 1 0) (-3 1 0) (2 -3 0)";
    assert!(matches!(fault(star).unwrap_err(), PrtFault::NotConvex(_)));
    // Points along an edge, and the same point twice, are allowed.
    assert!(fault("(0 0 0) (4 0 0) (9 0 0) (9 0 0) (9 9 0) (0 9 0)").is_ok());
    // As many points as a cylinder has.
    let round: Vec<String> = (0..200)
        .map(|i| f64::from(i) * std::f64::consts::TAU / 200.0)
        .map(|a| format!("({} {} 7)", 100.0 * a.cos(), 100.0 * a.sin()))
        .collect();
    assert_eq!(fault(&round.join(" ")).unwrap().level.portals[0].winding.len(), 200);
}

#[test]
fn leaves_are_listed_once() {
    let range = |value| PrtFault::OutOfRange { value, least: 0, most: 4 };
    assert_eq!(damaged(PRT2, "2 4 -1", "2 5 -1", 9, "leaves of cluster 2"), range(5));
    assert_eq!(damaged(PRT2, "2 4 -1", "2 4", 9, "leaves of cluster 2"), PrtFault::Missing);
    assert_eq!(damaged(PRT2, "2 4 -1", "2 4 -1 0", 9, "leaves of cluster 2"), PrtFault::Trailing("0".into()));
    assert_eq!(damaged(PRT2, "2 4 -1", "2 0 -1", 9, "leaves of cluster 2"), PrtFault::LeafTwice(0));
    assert_eq!(damaged(PRT2, "2 4 -1", "2 -1", 2, "leaves"), PrtFault::Leaves { promised: 5, found: 4 });
    assert_eq!(damaged(PRT2, "\n5\n", "\n6\n", 2, "leaves"), PrtFault::Leaves { promised: 6, found: 5 });
    let cluster = PrtFault::OutOfRange { value: 3, least: 0, most: 2 };
    assert_eq!(damaged(PRT1_AM, "0\r\n2\r\n", "0\r\n3\r\n", 11, "cluster of leaf 4"), cluster);
    assert_eq!(damaged(PRT1_AM, "\n5\r\n4", "\n6\r\n4", 12, "cluster of leaf 5"), PrtFault::Missing);
    assert_eq!(damaged(PRT1_AM, "\n5\r\n4", "\n4\r\n4", 11, "end of file"), PrtFault::Trailing("2".into()));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn fixtures_of_a_level_editor() {
    let folder = data();
    let read = |name: &str| read_prt(&std::fs::read(folder.join("prt-fixtures-gpl").join(name)).unwrap());
    for (name, leaves) in [("portaltest_prt1.prt", 6), ("portaltest_prt2.prt", 10), ("portaltest_prt1am.prt", 10)] {
        let prt = read(name).unwrap();
        assert_eq!((prt.level.cells, prt.level.portals.len(), prt.leaves.len()), (6, 5, leaves), "{name}");
        let corners: Vec<usize> = prt.level.portals.iter().map(|p| p.winding.len()).collect();
        assert_eq!(corners, [4, 4, 8, 8, 3], "{name}");
    }
    assert_eq!(read("portaltest_prt2.prt").unwrap().leaves, read("portaltest_prt1am.prt").unwrap().leaves);
    let error = read("portaltest_prt1_invalid.prt").unwrap_err();
    assert_eq!(error.to_string(), "line 6, second cluster: '(' instead of a whole number");
    // Quake 3's has the same clusters and portals.
    let quake3 = read("portaltest_prt1q3.prt").unwrap();
    assert_eq!((quake3.dialect, quake3.level.cells, quake3.level.portals.len()), (Dialect::Quake3, 6, 5));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn seven_levels_and_their_rows() {
    let folder = data();
    // The counts and means of the data's own README.
    let levels = [
        ("lqdm12", Dialect::Prt2, 172, 374, 66.9),
        ("id_dm4", Dialect::Prt1, 408, 944, 74.0),
        ("lq_e0m1", Dialect::Prt2, 572, 1336, 64.5),
        ("lqdm13", Dialect::Prt2, 562, 1885, 234.0),
        ("id_e1m3", Dialect::Prt1, 1149, 3017, 94.0),
        ("lq_e0m3", Dialect::Prt2, 1025, 2978, 106.0),
        ("lq_e0m2", Dialect::Prt2, 1506, 4069, 144.0),
    ];
    for (name, dialect, clusters, portals, mean) in levels {
        let prt = read_prt(&std::fs::read(folder.join(format!("prt/{name}.prt"))).unwrap()).unwrap();
        assert_eq!((prt.dialect, prt.level.cells, prt.level.portals.len()), (dialect, clusters, portals), "{name}");
        let text = unpacked(&folder.join(format!("prt/{name}.vis.txt.gz")));
        let rows = read_rows(text.as_bytes(), clusters).unwrap();
        assert!((rows.count_ones() as f64 / clusters as f64 - mean).abs() < 0.5, "{name}");
        // Neighbours see each other.
        for p in &prt.level.portals {
            assert!(rows.get(p.cells[0] as usize, p.cells[1] as usize), "{name}: {:?}", p.cells);
        }
        let mut again = Vec::new();
        write_rows(&rows, &mut again).unwrap();
        assert_eq!(String::from_utf8(again).unwrap(), text, "{name}");
    }
}

#[test]
fn rows_are_checked() {
    let good = "0 2: 0 1\n1 3: 0 1 2\n2 2: 1 2\n";
    let mut rows = BitMatrix::new(3, 3);
    [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 1), (2, 2)].iter().for_each(|&(a, b)| _ = rows.set(a, b));
    assert_eq!(read_rows(good.as_bytes(), 3).unwrap(), rows);
    let mut text = Vec::new();
    write_rows(&rows, &mut text).unwrap();
    assert_eq!(text, good.as_bytes());

    let fault = |what: &str, by: &str, line: usize| {
        let error = read_rows(good.replacen(what, by, 1).as_bytes(), 3).unwrap_err();
        assert_eq!(error.line, line, "{error}");
        (error.field, error.fault)
    };
    assert_eq!(fault("1 3:", "2 3:", 2), ("cell".into(), RowsFault::Order { found: 2, due: 1 }));
    assert_eq!(fault("1 3:", "1 2:", 2), ("number of ids".into(), RowsFault::Count { promised: 2, found: 3 }));
    assert_eq!(fault("0 1 2", "0 1 3", 2), ("id 3".into(), RowsFault::NoSuchCell(3)));
    assert_eq!(fault("0 1 2", "1 0 2", 2), ("id 2".into(), RowsFault::NotAscending(0)));
    assert_eq!(fault("0 1 2", "0 1 1", 2), ("id 3".into(), RowsFault::NotAscending(1)));
    assert_eq!(fault("0 1 2", "0 x 2", 2), ("id 2".into(), RowsFault::NotANumber("x".into())));
    assert_eq!(fault("1 3: 0 1 2", "1 2: 0 2", 2), ("ids".into(), RowsFault::NotItself(1)));
    assert_eq!(fault("1 3:", "1 3", 2), ("':'".into(), RowsFault::Missing));
    assert_eq!(fault("2 2: 1 2\n", "", 3), ("cell".into(), RowsFault::Lines { found: 2, cells: 3 }));
    assert_eq!(fault("2 2: 1 2\n", "2 2: 1 2\n3 1: 3\n", 4), ("cell".into(), RowsFault::Lines { found: 4, cells: 3 }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn rows_come_back(bits in prop::collection::vec(any::<bool>(), 0..400)) {
        let n = bits.len().isqrt();
        let mut rows = BitMatrix::new(n, n);
        for i in 0..n {
            rows.set(i, i);
            (0..n).filter(|j| bits[i * n + j]).for_each(|j| _ = rows.set(i, j));
        }
        let mut text = Vec::new();
        write_rows(&rows, &mut text).unwrap();
        prop_assert_eq!(read_rows(&text, n).unwrap(), rows);
    }
}

#[test]
fn the_number_of_decimals_says_how_coordinates_were_rounded() {
    let with = |x: &str| {
        let text = format!("PRT1\n2\n1\n4 0 1 ({x} 0 0) ({x} 8 0) ({x} 8 8) ({x} 0 8)\n");
        read_prt(text.as_bytes()).unwrap().level.rounding
    };
    for (x, rounding) in
        [("4", 0.5), ("4.5", 0.05), ("-4.250", 0.0005), ("4.123456789", 5e-10), ("4.1234567891", 0.0), ("4e0", 0.0)]
    {
        assert_eq!(with(x), rounding, "{x}");
    }
}
