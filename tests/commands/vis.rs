//! `enfilade vis` and `enfilade check` on levels, as a user runs them.

use crate::cli::{LEVEL, command, done, enfilade, failed, folder, json, refused, signalled, wait_for};
use enfilade_levels::prt::read_prt;
use enfilade_levels::rows::read_rows;
use serde_json::Value;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;
use testing::data::data;
use testing::prt::unpacked;

const ROWS: &str = "0 3: 0 1 2\n1 4: 0 1 2 3\n2 4: 0 1 2 3\n3 3: 1 2 3\n";
/// As `LEVEL`, but the last door is in line with the others.
const OPEN: &str = "PRT1\n4\n3\n\
    4 0 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n\
    4 1 2 (8 -1 -1) (8 1 -1) (8 1 1) (8 -1 1)\n\
    4 2 3 (12 -1 -1) (12 1 -1) (12 1 1) (12 -1 1)\n";

#[test]
fn rows_of_a_portal_file() {
    let folder = folder("rows");
    let (level, rows) = (folder.join("level.prt"), folder.join("rows.txt"));
    std::fs::write(&level, LEVEL).unwrap();
    let report = json(&enfilade!("vis", &level, "--rows", &rows, "--json", "--threads", "2"));
    assert_eq!(std::fs::read_to_string(&rows).unwrap(), ROWS);
    for (key, value) in [("clusters", 4), ("portals", 3), ("leaves", 4), ("slivers", 0), ("total_pairs", 16)] {
        assert_eq!(report[key], value, "{key}");
    }
    for (key, value) in [("lower_pairs", 14), ("upper_pairs", 14), ("undecided_pairs", 0), ("capped", 0)] {
        assert_eq!(report[key], value, "{key}");
    }
    assert_eq!((&report["portals_from"], &report["mean_visible"]), (&"PRT1".into(), &3.5.into()));
    for key in ["seconds", "steps", "lines"] {
        assert!(report[key].is_number(), "{key}");
    }
    assert!(report["stage_seconds"]["read"].is_number() && report["stage_seconds"]["write"].is_number());
    // Nothing else is left beside it.
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn why_tells_the_line_or_the_chain() {
    let folder = folder("why");
    let level = folder.join("level.prt");
    std::fs::write(&level, LEVEL).unwrap();
    let why = |a: &str, b: &str| json(&enfilade!("why", &level, a, b, "--json"));
    let seen = why("0", "2");
    assert_eq!((&seen["verdict"], seen["pair"].to_string()), (&"witnessed".into(), "[0,2]".into()));
    assert_eq!(seen["chain"].as_array().unwrap().len(), 2);
    let hidden = why("0", "3");
    assert_eq!(hidden["verdict"], "separated");
    assert!(hidden["chains"].as_u64().unwrap() > 0);
    let prose = enfilade!("why", &level, "3", "0");
    assert!(String::from_utf8(prose.stdout).unwrap().starts_with("3 and 0 don't see each other: "));
    let prose = enfilade!("why", &level, "1", "3");
    assert!(String::from_utf8(prose.stdout).unwrap().starts_with("1 and 3 see each other: "));
}

#[test]
fn rows_of_another_tool_are_compared() {
    let folder = folder("against");
    let (level, theirs) = (folder.join("level.prt"), folder.join("theirs.txt"));
    std::fs::write(&level, LEVEL).unwrap();
    // They keep 0 3 and 3 0, which no line joins, and lack 1 3 (not 3 1), and 0 1 both ways.
    std::fs::write(&theirs, "0 3: 0 2 3\n1 2: 1 2\n2 4: 0 1 2 3\n3 4: 0 1 2 3\n").unwrap();
    let out = enfilade!("vis", &level, "--against", &theirs, "--json");
    let report = failed(&out);
    let against = &report["against"];
    for (key, value) in [
        ("their_pairs", 13),
        ("our_pairs", 14),
        ("both_pairs", 11),
        ("refuted_pairs", 2),
        ("lost_pairs", 3),
        ("undecided_pairs", 0),
        ("one_way_pairs", 1),
        ("one_way_refuted_pairs", 0),
    ] {
        assert_eq!(against[key], value, "{key}");
    }
    let lost = against["lost"].as_array().unwrap();
    let pairs: Vec<String> = lost.iter().map(|l| l["pair"].to_string()).collect();
    assert_eq!(pairs, ["[0,1]", "[1,0]", "[1,3]"]);
    // Neighbours: a point of their door. The others: from door to door.
    assert_eq!(
        (&lost[0]["from"], &lost[0]["to"], lost[0]["chain"].to_string()),
        (&lost[0]["to"], &lost[1]["from"], "[[0,0]]".into())
    );
    assert_eq!((&lost[0]["from"][0], lost[1]["chain"].to_string()), (&4.0.into(), "[[0,1]]".into()));
    assert_eq!(lost[2]["chain"].to_string(), "[[1,0],[2,0]]");
    assert_eq!([&lost[2]["from"], &lost[2]["to"]].map(|p| p[0].as_f64().unwrap().round()), [8.0, 12.0]);
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(
        said.contains("theirs.txt has 13 pairs: 11 are in both, 2 are proven hidden; it lacks 3 proven visible"),
        "{said}"
    );
    assert!(
        said.contains("1 of its pairs are in one direction only")
            && said.contains("\n      1      2             0  0 through portals 0: setpos 5.0 0.0 0.0;setang 0.0 180.0 0\n"),
        "{said}"
    );

    // Rows that can't be, before anything is worked out.
    std::fs::write(&theirs, "0 1: 0\n").unwrap();
    refused(
        &enfilade!("vis", &level, "--against", &theirs),
        &["theirs.txt: line 2, cell: 1 lines, but the level has 4 cells"],
    );
    refused(&enfilade!("vis", &level, "--against", &folder.join("none")), &["none: "]);
}

/// The reference's rows of real levels: what is counted is what is there, and each line that they lack is one.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn what_a_reference_lacks_lies_on_lines() {
    let data = data();
    let folder = folder("reference");
    // Pairs in the reference's rows, and pairs that they are known to lack at least.
    for (name, pairs, lost_pairs) in [("lqdm12", 11_501, 0), ("id_dm4", 30_204, 0), ("lqdm13", 131_507, 11)] {
        // A run leaves its state beside its level.
        let path = folder.join(format!("{name}.prt"));
        std::fs::copy(data.join(format!("prt/{name}.prt")), &path).unwrap();
        let theirs = folder.join(format!("{name}.txt"));
        let text = unpacked(&data.join(format!("prt/{name}.vis.txt.gz")));
        std::fs::write(&theirs, &text).unwrap();
        let out = enfilade!("vis", &path, "--against", &theirs, "--json");
        let report = if lost_pairs > 0 { failed(&out) } else { json(&out) };
        let number = |key: &str| report["against"][key].as_u64().unwrap();
        let level = read_prt(&std::fs::read(&path).unwrap()).unwrap().level;
        let rows = read_rows(text.as_bytes(), level.cells).unwrap();
        let one_way = (0..level.cells).map(|a| rows.ones(a).filter(|&b| !rows.get(b, a)).count() as u64).sum::<u64>();
        assert_eq!((number("their_pairs"), number("one_way_pairs")), (pairs, one_way), "{name}");
        assert_eq!(number("both_pairs") + number("refuted_pairs"), pairs);
        let lost = report["against"]["lost"].as_array().unwrap();
        assert_eq!(number("lost_pairs"), lost.len() as u64);
        assert_eq!(number("both_pairs") + number("lost_pairs") + number("undecided_pairs"), number("our_pairs"));
        assert_eq!(report["upper_pairs"], report["against"]["our_pairs"]);
        // Fewer pairs than they have, though they lack some.
        assert!(number("our_pairs") < pairs && lost.len() >= lost_pairs, "{name}: {} lost", lost.len());
        for line in lost {
            check_line(&level, &rows, line);
        }
    }
}

/// A line between two cells that `rows` lack passes every portal of its chain, inwards from every edge.
fn check_line(level: &enfilade_levels::Level, rows: &enfilade::BitMatrix, line: &Value) {
    use glam::DVec3;
    let point = |key: &str| DVec3::from_array([0, 1, 2].map(|i| line[key][i].as_f64().unwrap()));
    let (from, to) = (point("from"), point("to"));
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let mut cell = number(&line["pair"][0]);
    assert!(!rows.get(cell, number(&line["pair"][1])), "{line}");
    for step in line["chain"].as_array().unwrap() {
        let (portal, side) = (&level.portals[number(&step[0])], number(&step[1]));
        assert_eq!(portal.cells[side] as usize, cell, "{line}");
        cell = portal.cells[1 - side] as usize;
        let corners = &portal.winding;
        let normal = enfilade::math::geom::newell(corners).normalize();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (slope, height) = (normal.dot(to - from), normal.dot(middle - from));
        let at = if from == to { from } else { from + (to - from) * (height / slope) };
        assert!(from == to || (slope > 0.0) == (side == 0), "{line}");
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            // Through the inner side of each edge; the file's own coordinates have sixteen digits.
            assert!((b - a).cross(at - a).dot(normal) > -1e-7, "{line}: {at} is outside of portal {step}");
        }
    }
    assert_eq!(cell, number(&line["pair"][1]), "{line}");
}

mod levels {
    use super::*;
    use enfilade_levels::bsp::Bsp;
    use testing::quake::{AIR, Layout, bsp, lumps, three_rooms};

    #[test]
    fn a_level_is_written_back() {
        let folder = folder("bsp");
        let level = folder.join("level.bsp");
        let before = bsp(&three_rooms(AIR), Layout { bsp2: true, extended: true, ..Layout::default() });
        std::fs::write(&level, &before).unwrap();
        // 1. To another name.
        let other = folder.join("other.bsp");
        done(&enfilade!("vis", &level, "-o", &other));
        assert_eq!(std::fs::read(&level).unwrap(), before);
        let rows = Bsp::read(std::fs::read(&other).unwrap()).unwrap().rows().unwrap().unwrap();
        // Doors in line: everything sees everything.
        assert_eq!(rows.count_ones(), 25);
        // 2. In place.
        done(&enfilade!("vis", &level));
        let after = std::fs::read(&level).unwrap();
        assert_eq!(after, std::fs::read(&other).unwrap());
        assert_eq!(
            (lumps(&after)[0].clone(), lumps(&after)[5].clone()),
            (lumps(&before)[0].clone(), lumps(&before)[5].clone())
        );
        // 3. Its rows pass, and are our own.
        done(&enfilade!("check", &level, "--rays", "10000"));
        let report = json(&enfilade!("vis", &level, "--against", &level, "-o", &other, "--json"));
        assert_eq!((&report["against"]["both_pairs"], &report["against"]["their_pairs"]), (&25.into(), &25.into()));
    }

    /// Rooms from x = 0 to 4, 5 to 9 and 10 to 14.
    #[test]
    fn why_takes_places_of_a_level() {
        let level = folder("places").join("level.bsp");
        std::fs::write(&level, bsp(&three_rooms(AIR), Layout::default())).unwrap();
        let cells = |a: &str, b: &str| {
            let why = json(&enfilade!("why", &level, a, b, "--json"));
            assert_eq!(why["verdict"], "witnessed", "{why}");
            why["pair"].clone()
        };
        let by_number = |a: u64, b: u64| serde_json::json!([a, b]);
        // Leaves in the order of the tree: the third room and its door first.
        assert_eq!(cells("1,0,0", "12, 1.5, -1.5"), by_number(4, 0));
        assert_eq!(cells("(7 -1 0)", "4"), by_number(2, 4));
        for (place, said) in [
            ("4.5,1.5,0", "lies in a wall"),
            ("-3,0,0", "lies in a wall or outside"),
            ("1,2", "takes a cluster's number, 0 to 4, or a point"),
            ("1,2,x", "three numbers"),
            ("7", "the level has clusters 0 to 4"),
        ] {
            refused(&enfilade!("why", &level, place, "0"), &[&format!("level.bsp: {place}: "), said]);
        }
    }

    #[test]
    fn the_portal_file_beside_a_level_is_taken_where_it_fits() {
        let folder = folder("beside");
        let (level, prt) = (folder.join("level.bsp"), folder.join("level.prt"));
        std::fs::write(&level, bsp(&three_rooms(AIR), Layout::default())).unwrap();
        let from = || {
            let report = json(&enfilade!("vis", &level, "--json"));
            (report["portals_from"].as_str().unwrap().to_owned(), report["clusters"].as_u64(), report["notes"].to_string())
        };
        assert_eq!(from(), ("tree".into(), Some(5), "[]".into()));
        // Rooms and doors as two clusters, 0 the third room with its door: leaves 0 and 1.
        let fitting = "PRT2\n5\n2\n1\n4 1 0 (9 -1 -1) (9 1 -1) (9 1 1) (9 -1 1)\n0 1 -1\n2 3 4 -1\n";
        std::fs::write(&prt, fitting).unwrap();
        assert_eq!(from(), ("PRT2".into(), Some(2), "[]".into()));
        // Another level's, with other leaves; one with portals elsewhere; one that can't be read.
        let short = fitting.replace("\n5\n", "\n4\n").replace("2 3 4 -1", "2 3 -1");
        let elsewhere =
            "1 of 1 portals do not lie between leaves of their clusters; the first, portal 0, is near (7.0 0.0 0.0)";
        let others = [
            (
                short,
                "level.prt: has 4 leaves, the level 5: it belongs to another level; remove it, and portals come from the tree",
            ),
            (fitting.replace("(9 ", "(7 "), elsewhere),
            (fitting.replace("PRT2", "PRT9"), "level.prt: line 1"),
        ];
        for (other, why) in others {
            std::fs::write(&prt, other).unwrap();
            refused(&enfilade!("vis", &level), &[why]);
        }
        // Four portals, one of which is elsewhere; one whose middle is in solid matter, as where it is led through a pillar.
        let portal = "4 1 0 (9 -1 -1) (9 1 -1) (9 1 1) (9 -1 1)\n";
        let four = fitting.replace("\n1\n4", "\n4\n4").replace(portal, &portal.repeat(3));
        let four = four.replace("0 1 -1\n", &format!("{}0 1 -1\n", portal.replace("(9 ", "(7 ")));
        std::fs::write(&prt, four).unwrap();
        let (portals_from, clusters, notes) = from();
        assert_eq!((portals_from.as_str(), clusters), ("PRT2", Some(2)));
        assert!(
            notes.contains("level.prt 1 of 4 portals do not lie between")
                && notes.contains("portal 3")
                && notes.contains("used anyway"),
            "{notes}"
        );
        // Wider than the opening: its middle is in the wall, and half-way to two of its corners are both rooms.
        std::fs::write(&prt, fitting.replace("(9 1 -1) (9 1 1)", "(9 5 -1) (9 5 1)")).unwrap();
        assert_eq!(from(), ("PRT2".into(), Some(2), "[]".into()));
    }
}

#[test]
fn check_finds_the_missing_bit() {
    let folder = folder("check");
    let (level, rows) = (folder.join("level.prt"), folder.join("rows.txt"));
    std::fs::write(&level, OPEN).unwrap();
    done(&enfilade!("vis", &level, "--rows", &rows));
    done(&enfilade!("check", &level, "--rows", &rows, "--rays", "100000"));
    let whole = std::fs::read_to_string(&rows).unwrap();
    std::fs::write(&rows, whole.replace("0 4: 0 1 2 3\n", "0 3: 0 1 2\n")).unwrap();
    let out = enfilade!("check", &level, "--rows", &rows, "--rays", "100000", "--json");
    assert_eq!(out.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!((&report["passed"], &report["missed_pairs"]), (&false.into(), &1.into()));
    let cells = report["examples"][0]["cells"].to_string();
    assert!(cells == "[0,3]" || cells == "[3,0]", "{cells}");
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(said.contains("through portals") && said.contains("failed in"), "{said}");
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder("bad");
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let (good, bad) = (write("good.prt", LEVEL), write("bad.prt", &LEVEL.replace("4 1 2", "4 1 x")));
    let rows = write("rows.txt", "0 3: 0 1 2\n1 4: 0 1 2 3\n2 4: 0 1 2 3\n3 3: 1 2 4\n");
    refused(&enfilade!("vis", &bad), &["bad.prt: line 5, second cluster: 'x' instead of a whole number"]);
    refused(&enfilade!("vis", &folder.join("none.prt")), &["none.prt: "]);
    refused(&enfilade!("vis", &folder), &["is a folder; give a .prt or .bsp in it"]);
    refused(&enfilade!("vis", &write("cut.bsp", "BSP2")), &["cut.bsp: ends after 4 bytes, within the header"]);
    refused(&enfilade!("why", &good, "0", "4"), &["good.prt: 4: the level has clusters 0 to 3"]);
    refused(
        &enfilade!("why", &good, "0", "1", "--model", &good),
        &["good.prt: is a level, which needs no model: leave out --model"],
    );
    refused(&enfilade!("vis", &good, "-o", &folder.join("out.bsp")), &["out.bsp: -o writes a .bsp"]);
    refused(&enfilade!("vis", &good, "--rows", &folder), &["commands_vis_bad: "]);
    let state = write("good.vis-state", "no state, and longer than the head of one, which has 56 bytes");
    refused(&enfilade!("vis", &good), &["good.vis-state: is not a state of an interrupted run"]);
    std::fs::remove_file(state).unwrap();
    refused(&enfilade!("check", &good), &["good.prt: holds no rows"]);
    refused(&enfilade!("check", &good, "--rows", &rows), &["rows.txt: line 4, id 3: 4 is not a cell"]);
    refused(&enfilade!("check", &good, "--model", &good), &["good.prt: a level is tested by its portals"]);
    refused(&enfilade!("check", &bad, "--rows", &rows), &["bad.prt: line 5"]);
}

#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn an_interrupted_run_leaves_a_state() {
    let data = data();
    let folder = folder("interrupt");
    let (level, state) = (folder.join("level.prt"), folder.join("level.vis-state"));
    std::fs::copy(data.join("prt/lq_e0m2.prt"), &level).unwrap();
    let arguments = [Path::new("vis"), &level, Path::new("--threads"), Path::new("1")];
    let mut child = command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // As soon as there is more than a head.
    wait_for(&mut child, &state, 57);
    let (said, code) = signalled(child, "-INT", Duration::ZERO);
    assert!(code == Some(1) && said.contains("the same command resumes from"), "{said}");
    // Of other options, or of another level: refused, and kept.
    let other = folder.join("other.prt");
    std::fs::write(&other, LEVEL).unwrap();
    std::fs::copy(&state, folder.join("other.vis-state")).unwrap();
    let belongs = |what| [what, "--fresh deletes it and starts again"];
    refused(&enfilade!("vis", &level, "--seed", "1"), &belongs("state: belongs to other options"));
    refused(&enfilade!("vis", &other), &belongs("state: belongs to another input"));
    // The same rows as in one go; the state is gone then.
    let (whole, resumed) = (folder.join("whole.txt"), folder.join("resumed.txt"));
    let out = enfilade!("vis", &level, "--rows", &resumed, "--threads", "2");
    done(&out);
    assert!(String::from_utf8(out.stderr).unwrap().contains("resumes from"));
    assert!(!state.exists());
    done(&enfilade!("vis", &level, "--rows", &whole));
    assert_eq!(std::fs::read(&whole).unwrap(), std::fs::read(&resumed).unwrap());
}
