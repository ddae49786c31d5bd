//! `enfilade vis --against` as an auditor: what the rows of a level lack is in the table, the JSON, the page and the point files.

use crate::cli::{LEVEL, enfilade, failed, folder, json, refused};
use enfilade::BitMatrix;
use enfilade_levels::bsp::Bsp;
use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};
use testing::games::{Game, level as level_of};
use testing::page::check_page;
use testing::quake::{AIR, Layout, bsp, grated_room, three_rooms};

/// Three rooms with their passages as three clusters in a row: 2, then a door at x = 4, 1, a door at x = 9, 0. Doors reach from -1 to 1.
const PORTALS: &str = "PRT2\n5\n3\n2\n4 2 1 (4 -1 -1) (4 1 -1) (4 1 1) (4 -1 1)\n4 1 0 (9 -1 -1) (9 1 -1) (9 1 1) (9 -1 1)\n\
    0 1 -1\n2 3 -1\n4 -1\n";

/// A level in whose rows clusters 0 and 2 don't see each other, though the doors are in line.
fn level(folder: &Path) -> PathBuf {
    let path = folder.join("level.bsp");
    let without = Bsp::read(bsp(&three_rooms(AIR), Layout::default())).unwrap();
    let mut rows = BitMatrix::new(3, 3);
    [[0, 0], [0, 1], [1, 0], [1, 1], [1, 2], [2, 1], [2, 2]].iter().for_each(|&[a, b]| _ = rows.set(a, b));
    std::fs::write(&path, without.with_rows(&rows, &[0, 0, 1, 1, 2], None).unwrap().bytes).unwrap();
    std::fs::write(folder.join("level.prt"), PORTALS).unwrap();
    path
}

/// Three numbers of a line.
fn numbers<'t>(words: impl Iterator<Item = &'t str>) -> Vec<f64> {
    words.map(|word| word.parse().unwrap()).collect()
}

/// From the door at x = 9 to the one at x = 4, inside both.
fn is_through_both_doors(from: &[f64], to: &[f64]) -> bool {
    let is_in = |p: &[f64]| p[1..].iter().all(|c| c.abs() <= 1.0);
    (from[0] - 9.0).abs() < 1e-6 && (to[0] - 4.0).abs() < 1e-6 && is_in(from) && is_in(to)
}

#[test]
fn a_lost_pair_is_in_every_form() {
    let folder = folder("forms");
    let level = level(&folder);
    let [out, page, pts, lin] = ["out.bsp", "lost.html", "lost.pts", "lost.lin"].map(|name| folder.join(name));
    let run =
        enfilade!("vis", &level, "--against", &level, "-o", &out, "--lost", &page, "--lost", &pts, "--lost", &lin, "--json");
    // 1. JSON.
    let report = failed(&run);
    let against = &report["against"];
    let lost = against["lost"].as_array().unwrap();
    assert_eq!(lost.iter().map(|l| l["pair"].to_string()).collect::<Vec<_>>(), ["[0,2]", "[2,0]"]);
    let clusters = serde_json::json!([
        { "cluster": 0, "lost_pairs": 1, "refuted_pairs": 0, "refuted": [] },
        { "cluster": 2, "lost_pairs": 1, "refuted_pairs": 0, "refuted": [] },
    ]);
    assert_eq!(against["by_cluster"], clusters);
    let end = |line: &Value, key: &str| [0, 1, 2].map(|i| line[key][i].as_f64().unwrap());
    assert!(is_through_both_doors(&end(&lost[0], "from"), &end(&lost[0], "to")), "{}", lost[0]);
    assert!(is_through_both_doors(&end(&lost[1], "to"), &end(&lost[1], "from")), "{}", lost[1]);
    assert_eq!((lost[0]["chain"].to_string(), &lost[0]["on_last_digit"]), ("[[1,1],[0,1]]".into(), &false.into()));

    // 2. The eye is a unit before the first door; what it looks at is behind both.
    let setpos = lost[0]["setpos"].as_str().unwrap();
    let (at, look) = setpos.strip_prefix("setpos ").unwrap().split_once(";setang ").unwrap();
    let (eye, angles) = (numbers(at.split(' ')), numbers(look.split(' ')));
    let [pitch, yaw] = [angles[0], angles[1]].map(f64::to_radians);
    let ahead = [pitch.cos() * yaw.cos(), pitch.cos() * yaw.sin(), -pitch.sin()];
    let at_plane = |x: f64| [0, 1, 2].map(|i| eye[i] + ahead[i] * (x - eye[0]) / ahead[0]);
    assert!(eye[0] > 9.5 && eye[0] <= 10.1 && angles[2] == 0.0, "{setpos}");
    for x in [9.0, 4.0] {
        // A tenth of a unit, and of a degree.
        assert!(at_plane(x)[1..].iter().all(|c| c.abs() < 1.1), "{setpos}");
    }

    // 3. The table.
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(said.contains("\ncluster  lacks  shows hidden  the first"), "{said}");
    assert!(said.contains(&format!("\n      0      1             0  2 through portals 1 0: {setpos}\n")), "{said}");

    // 4. The page.
    let html = std::fs::read_to_string(&page).unwrap();
    check_page(&html);
    assert!(html.contains("<h1>What the rows of level.bsp lack in level.bsp</h1>") && html.contains(setpos), "{html}");
    assert!(html.contains("<td>0 2</td><td>1 0</td><td>9.0 ") && html.contains("<td>2 0</td>"));

    // 5. Points: the line once, at most eight units between two of them.
    let points = |path: &Path| -> Vec<Vec<f64>> {
        std::fs::read_to_string(path).unwrap().lines().map(|line| numbers(line.split(' '))).collect()
    };
    let (dots, ends) = (points(&pts), points(&lin));
    assert_eq!((dots.len(), ends.len()), (2, 2));
    for path in [&dots, &ends] {
        assert!(is_through_both_doors(&path[0], &path[1]), "{path:?}");
    }

    // The same again replaces them. Without lost pairs, there is nothing in them.
    let against_ours =
        enfilade!("vis", &level, "--against", &out, "-o", &out.with_extension("2.bsp"), "--lost", &pts, "--lost", &page);
    assert_eq!(against_ours.status.code(), Some(0), "{}", String::from_utf8_lossy(&against_ours.stderr));
    assert_eq!(std::fs::read_to_string(&pts).unwrap(), "");
    check_page(&std::fs::read_to_string(&page).unwrap());
}

/// Rooms far from each other: a path has points along it. A lost neighbour is a path through the door.
#[test]
fn a_path_is_dotted() {
    let folder = folder("dots");
    let [prt, rows, pts] = ["level.prt", "rows.txt", "lost.pts"].map(|name| folder.join(name));
    std::fs::write(
        &prt,
        "PRT1\n3\n2\n4 0 1 (0 -8 -8) (0 8 -8) (0 8 8) (0 -8 8)\n4 1 2 (100 -8 -8) (100 8 -8) (100 8 8) (100 -8 8)\n",
    )
    .unwrap();
    let points = |theirs: &str| -> Vec<Vec<f64>> {
        std::fs::write(&rows, theirs).unwrap();
        let out = enfilade!("vis", &prt, "--against", &rows, "--lost", &pts);
        assert_eq!(out.status.code(), Some(1));
        std::fs::read_to_string(&pts).unwrap().lines().map(|line| numbers(line.split(' '))).collect()
    };
    // 1. They lack 0 2.
    let path = points("0 2: 0 1\n1 3: 0 1 2\n2 2: 1 2\n");
    assert!((14..=16).contains(&path.len()) && path[0][0] == 0.0 && path[path.len() - 1][0] == 100.0, "{path:?}");
    for pair in path.windows(2) {
        let apart = (0..3).map(|i| (pair[0][i] - pair[1][i]).powi(2)).sum::<f64>().sqrt();
        assert!(apart < 8.002 && pair[1][0] > pair[0][0], "{pair:?}");
        assert!(pair[0][1..].iter().all(|c| c.abs() <= 8.0), "{pair:?}");
    }
    // 2. They lack 1 0, though not 0 1.
    let path = points("0 3: 0 1 2\n1 2: 1 2\n2 3: 0 1 2\n");
    assert_eq!(path, [[8.0, 0.0, 0.0], [0.0, 0.0, 0.0], [-8.0, 0.0, 0.0]]);
    let said = enfilade!("vis", &prt, "--against", &rows);
    assert!(
        String::from_utf8(said.stdout).unwrap().contains("0 through portals 0: setpos 1.0 0.0 0.0;setang 0.0 180.0 0\n")
    );
}

/// Editors read so many points; what doesn't fit is counted.
#[test]
fn a_path_ends_where_editors_do() {
    let folder = folder("long");
    let [prt, rows, pts] = ["level.prt", "rows.txt", "lost.pts"].map(|name| folder.join(name));
    // Doors in line, 10,000 units apart; rows of cells alone.
    let door = |k: usize| {
        let x = 10_000 * k;
        format!("4 {k} {} ({x} -64 -64) ({x} 64 -64) ({x} 64 64) ({x} -64 64)\n", k + 1)
    };
    std::fs::write(&prt, format!("PRT1\n6\n5\n{}", (0..5).map(door).collect::<String>())).unwrap();
    std::fs::write(&rows, (0..6).map(|a| format!("{a} 1: {a}\n")).collect::<String>()).unwrap();
    let out = enfilade!("vis", &prt, "--against", &rows, "--lost", &pts);
    // Row 0 in order: a door (3 points), then lines over 1, 2 and 3 stretches of 1250 steps; over 4 there are too many.
    let count = std::fs::read_to_string(&pts).unwrap().lines().count();
    // A step more where a line is not straight along x.
    assert!((0..=3).contains(&(count as i64 - (3 + 1251 + 2501 + 3751))), "{count}");
    // Each of 15 pairs once.
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(
        said.contains("lost.pts has the worst clusters' lines; 11 more don't fit, as old editors read 8192 points"),
        "{said}"
    );
}

/// A long table ends.
#[test]
fn the_worst_clusters_come_first_and_the_rest_is_counted() {
    let folder = folder("worst");
    let [prt, rows] = ["level.prt", "rows.txt"].map(|name| folder.join(name));
    // 30 rooms with doors in line: all see each other. They lack 7 of what room 3 sees, and one neighbour of all others.
    let door = |k: usize| format!("4 {k} {} ({k} -1 -1) ({k} 1 -1) ({k} 1 1) ({k} -1 1)\n", k + 1);
    std::fs::write(&prt, format!("PRT1\n30\n29\n{}", (0..29).map(door).collect::<String>())).unwrap();
    let row = |a: usize| {
        let lacks = |b: &usize| if a == 3 { (10..17).contains(b) } else { *b == (a + 1) % 30 };
        let seen: Vec<usize> = (0..30).filter(|b| !lacks(b)).collect();
        let text: Vec<String> = seen.iter().map(ToString::to_string).collect();
        format!("{a} {}: {}\n", seen.len(), text.join(" "))
    };
    std::fs::write(&rows, (0..30).map(row).collect::<String>()).unwrap();
    let out = enfilade!("vis", &prt, "--against", &rows, "--threads", "1");
    let said = String::from_utf8(out.stdout).unwrap();
    let table: Vec<&str> = said.lines().skip_while(|line| !line.starts_with("cluster  lacks")).collect();
    assert!(table[1].starts_with("      3      7             0  10 through portals 3 4 5 6 7 8 9: setpos 2.0 "), "{said}");
    assert!(table[2].starts_with("      0      1 ") && table.len() == 22, "{said}");
    assert_eq!(table[21], "and 10 more: --json has all");
    let report = failed(&enfilade!("vis", &prt, "--against", &rows, "--json"));
    assert_eq!(report["against"]["by_cluster"].as_array().unwrap().len(), 30);
    assert_eq!(report["against"]["lost"].as_array().unwrap().len(), 36);
}

#[test]
fn what_is_hidden_though_shown_is_listed() {
    let folder = folder("hidden");
    let [prt, rows] = ["level.prt", "rows.txt"].map(|name| folder.join(name));
    std::fs::write(&prt, LEVEL).unwrap();
    std::fs::write(&rows, "0 4: 0 1 2 3\n1 4: 0 1 2 3\n2 4: 0 1 2 3\n3 4: 0 1 2 3\n").unwrap();
    let report = json(&enfilade!("vis", &prt, "--against", &rows, "--json"));
    let clusters = serde_json::json!([
        { "cluster": 0, "lost_pairs": 0, "refuted_pairs": 1, "refuted": [3] },
        { "cluster": 3, "lost_pairs": 0, "refuted_pairs": 1, "refuted": [0] },
    ]);
    assert_eq!(report["against"]["by_cluster"], clusters);
}

#[test]
fn rows_of_another_level_are_refused_with_both_numbers() {
    let folder = folder("another");
    let [five, four, clusters] = ["five.bsp", "four.bsp", "clusters.bsp"].map(|name| folder.join(name));
    std::fs::write(&five, bsp(&three_rooms(AIR), Layout::default())).unwrap();
    std::fs::write(&four, grated_room(AIR)).unwrap();
    std::fs::write(&clusters, level_of(Game::Quake2)).unwrap();
    for (level, other, said) in [
        (&five, &four, "four.bsp: has 4 leaves, the level 5; the rows belong to another level"),
        (&four, &clusters, "clusters.bsp: has 5 clusters, the level 4; the rows belong to another level"),
        (&clusters, &four, "four.bsp: has 4 leaves, the level 5; the rows belong to another level"),
        (&five, &five, "five.bsp: has no rows"),
    ] {
        let before = std::fs::read(level).unwrap();
        refused(&enfilade!("vis", level, "--against", other), &[said]);
        assert!(std::fs::read(level).unwrap() == before);
    }
}

#[test]
fn files_of_lost_pairs_are_refused_before_the_work() {
    let folder = folder("refused");
    let level = level(&folder);
    let lost = |name: &str| enfilade!("vis", &level, "--against", &level, "--lost", &folder.join(name));
    refused(&lost("lost.txt"), &["lost.txt: --lost writes a page, .html, or a point file, .pts or .lin"]);
    // The compiler's traces of a leak.
    refused(&lost("level.pts"), &["level.pts: is an input"]);
    refused(&lost("level.lin"), &["level.lin: is an input"]);
    refused(&enfilade!("vis", &level, "--lost", &folder.join("lost.pts")), &["--against"]);
    let twice = folder.join("a.pts");
    refused(&enfilade!("vis", &level, "--against", &level, "--lost", &twice, "--lost", &twice), &["would be written twice"]);
}

/// A portal file of another day, and one that is missing because the map leaks.
#[test]
fn a_stale_or_missing_portal_file_is_told() {
    let folder = folder("stale");
    let [level, prt, pts, out] = ["level.bsp", "level.prt", "level.pts", "out.bsp"].map(|name| folder.join(name));
    let write = |path: &Path, bytes: &[u8], seconds: u64| {
        std::fs::write(path, bytes).unwrap();
        let file = File::options().write(true).open(path).unwrap();
        file.set_modified(UNIX_EPOCH + Duration::from_secs(seconds)).unwrap();
    };
    let notes = || json(&enfilade!("vis", &level, "-o", &out, "--json"))["notes"].to_string();
    // 2024-02-29 12:00, and the evening before.
    let (day, evening) = (1_709_208_000, 1_709_157_480);
    write(&level, &bsp(&three_rooms(AIR), Layout::default()), day);
    write(&prt, PORTALS.as_bytes(), day - 60);
    assert_eq!(notes(), "[]");
    write(&prt, PORTALS.as_bytes(), evening);
    let said = notes();
    assert!(said.contains("level.prt is of 2024-02-28 21:58 UTC, the level of 2024-02-29 12:00 UTC: "), "{said}");
    assert!(said.contains("Close a leak that it told of, run the compiler anew, and then vis"), "{said}");
    write(&pts, b"0 0 0\n9 9 9\n", day + 1);
    assert!(
        notes().contains("level.pts traces the leak). Load that in your map editor, close the hole, run the compiler anew")
    );
    std::fs::remove_file(&prt).unwrap();
    let said = notes();
    assert!(
        said.contains("level.prt is missing, and ") && said.contains("level.pts traces a leak: the map leaks"),
        "{said}"
    );
    // One from before the level says nothing of it.
    write(&pts, b"0 0 0\n9 9 9\n", evening);
    assert_eq!(notes(), "[]");
}

/// A level of Half-Life as its own tools made it: the pairs that its rows lack are those whose lines were followed apart from Enfilade
/// (`lost.tsv`), and those whose line lies in the plane of a portal that it passes hang on the file's last digits.
#[cfg(feature = "full")]
#[test]
fn a_real_level_lacks_what_was_found_apart_from_this() {
    use std::collections::BTreeMap;
    use testing::data::data;
    let name = "hl/msr_insomnia";
    let case = crate::levels::games::cases().into_iter().find(|case| case.name == name).unwrap();
    let folder = folder("real");
    let [level, out, lin] = ["level.bsp", "out.bsp", "lost.lin"].map(|name| folder.join(name));
    std::fs::write(&level, case.part("vis.bsp").unwrap()).unwrap();
    std::fs::write(level.with_extension("prt"), case.part("prt").unwrap()).unwrap();
    let report = failed(&enfilade!("vis", &level, "--against", &level, "-o", &out, "--lost", &lin, "--json"));
    let against = &report["against"];
    let number = |value: &Value| value.as_u64().unwrap();
    let is_on_digits: BTreeMap<[u64; 2], bool> = (against["lost"].as_array().unwrap().iter())
        .map(|line| ([0, 1].map(|i| number(&line["pair"][i])), line["on_last_digit"].as_bool().unwrap()))
        .collect();
    // 1. The pairs: level, a, b, portals, length, margin, height over a portal's plane.
    let table = std::fs::read_to_string(data().join("other-games/lost.tsv")).unwrap();
    let rows = table.lines().map(|line| line.split('\t').collect::<Vec<_>>()).filter(|row| row[0] == name);
    let known: BTreeMap<[u64; 2], f64> =
        rows.map(|row| ([1, 2].map(|i| row[i].parse().unwrap()), row[6].parse().unwrap())).collect();
    assert!(known.len() == 40 && is_on_digits.keys().all(|pair| known.contains_key(pair)), "{is_on_digits:?}");
    // 2. Lines in a portal's plane, to 0.0005 units, pass only by the file's last digits; what is found of them is told so.
    let flat = |pair: &[u64; 2]| known[pair] < 5e-4;
    assert_eq!(known.keys().filter(|pair| flat(pair)).count(), 11);
    let firm = |pairs: &mut dyn Iterator<Item = &[u64; 2]>| pairs.filter(|pair| !flat(pair)).copied().collect::<Vec<_>>();
    assert_eq!(firm(&mut is_on_digits.keys()), firm(&mut known.keys()));
    assert!(is_on_digits.iter().all(|(pair, &told)| told || !flat(pair)), "{is_on_digits:?}");
    // 3. Clusters have all of them.
    let sum = |key: &str| against["by_cluster"].as_array().unwrap().iter().map(|of| number(&of[key])).sum::<u64>();
    assert_eq!((sum("lost_pairs"), sum("refuted_pairs")), (is_on_digits.len() as u64, number(&against["refuted_pairs"])));
    // 4. Two points for each pair, one way.
    let ways: std::collections::BTreeSet<[u64; 2]> = is_on_digits.keys().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    assert_eq!(std::fs::read_to_string(&lin).unwrap().lines().count(), 2 * ways.len());
}
