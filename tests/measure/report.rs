//! `enfilade report` of a building: what the page and the tables say is what `bake` and `check` say.

use crate::cli::{self, LEVEL, building, folder, refused, run, run_words};
use enfilade::BitMatrix;
use enfilade::bake::BakeOptions;
use enfilade::cells::PortalKind;
use enfilade::file::PvsFile;
use enfilade::pvs::{Guarantee, PvsOptions};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::pages::curves::held_out;
use enfilade_measure::pages::html::thousands;
use enfilade_measure::pages::storeys::{along_a_walk, storeys};
use enfilade_measure::pages::undecided::{closed_and_open, hardest, kinds, of_cell};
use enfilade_measure::verify::{CheckOptions, check};
use serde_json::Value;
use std::path::Path;
use testing::bakes;
use testing::meshes::obj;
use testing::page::check_page;
use testing::rooms::three_yards;

fn json(arguments: &[&str]) -> Value {
    cli::json(&cli::run_words(arguments))
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// A page by its headings, without the times in it.
fn without_times(html: &str) -> Vec<&str> {
    let times = |part: &&str| ["Error against run time", "Tubes", "Time and memory"].iter().all(|t| !part.starts_with(t));
    html.split("<h2>").flat_map(|part| part.split("<details class=\"part\">\n<summary>")).filter(times).collect()
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn the_page_says_what_bake_says() {
    let folder = folder("page");
    let model = building("villa_rotonda.glb");
    let (model, page) = (model.to_str().unwrap(), folder.join("villa.html"));
    let rays = ["--rays", "400k", "--seed", "3"];
    let file = folder.join("villa.pvs");
    let baked =
        json(&[&["bake", model, "-o", file.to_str().unwrap(), "--rows", "both", "--json"], rays.as_slice()].concat());
    let report = |page: &Path| {
        json(&[&["report", model, "-o", page.to_str().unwrap(), "--views", "40", "--json"], rays.as_slice()].concat())
    };
    let told = report(&page);
    // The same numbers, but for times and memory.
    for key in ["triangles", "objects", "cells", "open_cells", "portals", "strategy", "left_out", "notes", "repairs", "pvs"]
    {
        assert_eq!(told[key], baked[key], "{key}");
    }
    assert_eq!(told["file_bytes"], baked["file_bytes"]);
    let html = text(&page);
    check_page(&html);
    assert!(!html.contains("http:") && !html.contains("https:"));
    let pvs = &baked["pvs"];
    let numbers = [
        ("triangles", &baked["triangles"]),
        ("objects", &baked["objects"]),
        ("cells", &baked["cells"]),
        ("portals", &baked["portals"]),
        ("pairs", &pvs["total_pairs"]),
        ("witnessed", &pvs["lower_pairs"]),
        ("not proven hidden", &pvs["upper_pairs"]),
        ("undecided", &pvs["undecided_pairs"]),
        ("cells witnessed", &pvs["cell_lower_pairs"]),
        ("cells not proven hidden", &pvs["cell_upper_pairs"]),
    ];
    for (what, number) in numbers {
        assert!(html.contains(&format!("<data value=\"{number}\">")), "{what}: {number}");
    }
    assert!(html.contains("<code>enfilade report villa_rotonda.glb --rays 400k --views 40 --seed 3</code>"));
    check_curves(&text(&folder.join("villa.csv")), &told, pvs);
    let cells = text(&folder.join("villa.cells.csv"));
    check_cells(&cells, &baked);
    let [closed, open] = ["closed_cells", "open_cells_apart"].map(|key| told[key]["upper_pairs"].as_u64().unwrap());
    assert_eq!(closed + open, pvs["upper_pairs"].as_u64().unwrap());

    // Once more: the same but for times.
    let again = folder.join("again.html");
    report(&again);
    let other = text(&again);
    let (a, b) = (without_times(&html), without_times(&other));
    assert!(a.len() > 6 && a == b);
    assert_eq!(text(&folder.join("again.cells.csv")), cells);
}

/// The table of curves ends where the bake, `pvs`, ends.
fn check_curves(csv: &str, told: &Value, pvs: &Value) {
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(
        rows[0].join(" "),
        "strategy cpu_seconds rays lower_pairs upper_pairs false_pixels_mean false_pixels_p95 false_pixels_max"
    );
    let points: usize = told["curves"].as_array().unwrap().iter().map(|c| c["points"].as_array().unwrap().len()).sum();
    assert_eq!(rows.len(), points + 1);
    assert!(points > 3 && rows.iter().all(|r| r.len() == 8));
    let last = rows.iter().rfind(|r| r[0] == "everything").unwrap();
    assert_eq!([last[3], last[4]], [&pvs["lower_pairs"], &pvs["upper_pairs"]].map(Value::to_string));
    let mut strategies: Vec<&str> = rows[1..].iter().map(|row| row[0]).collect();
    strategies.dedup();
    assert_eq!(strategies, ["everything", "flow", "random rays", "uniform cubes", "adaptive cubes", "guided", "scheduled"]);
    for row in &rows[1..] {
        // What fewer rays prove is as true.
        assert!(row[3].parse::<u64>().unwrap() <= pvs["upper_pairs"].as_u64().unwrap(), "{row:?}");
        // Sampling alone proves nothing hidden.
        let both = ["everything", "flow"].contains(&row[0]);
        let upper = row[4].parse::<u64>().ok();
        assert_eq!(upper.map(|upper| upper >= pvs["lower_pairs"].as_u64().unwrap()), both.then_some(true), "{row:?}");
    }
}

/// Every cell has a line, and they add up.
fn check_cells(cells: &str, baked: &Value) {
    let pvs = &baked["pvs"];
    let sum = |column: usize| {
        cells.lines().skip(1).map(|l| l.split(',').nth(column).unwrap().parse::<u64>().unwrap()).sum::<u64>()
    };
    assert_eq!(cells.lines().count() as u64 - 1, baked["cells"].as_u64().unwrap());
    assert_eq!(
        [sum(5), sum(6), sum(7)].map(Value::from),
        [&pvs["lower_pairs"], &pvs["upper_pairs"], &pvs["undecided_pairs"]].map(Clone::clone)
    );
}

/// A bake of a shipped building with both bounds.
fn baked(name: &str, ray_budget: u64, rows_from: Guarantee) -> (Scene, PvsFile) {
    let scene = import(&building(name), &ImportOptions::default()).unwrap();
    let pvs = PvsOptions { ray_budget, rows_from, ..PvsOptions::default() };
    let file = bakes::baked(&scene, BakeOptions { pvs, keep_bounds: true, ..BakeOptions::default() });
    (scene, file)
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn views_drawn_once_count_what_check_counts() {
    let (scene, file) = baked("villa_rotonda.glb", 20_000, Guarantee::Sampled);
    let options = CheckOptions { rays: 0, views: 30, seed: 5, leaks: false };
    let checked = check(&file, &scene, &options).unwrap();
    let views = held_out(&scene, &file, 5, 30);
    assert_eq!(views.count(), checked.views as usize);
    let lower = &file.bounds.as_ref().unwrap().objects_lower;
    let found = views.false_pixels(lower);
    assert_eq!(found, [checked.false_pixels.mean, checked.false_pixels.p95, checked.false_pixels.max]);
    assert!(found[0] > 0.0, "so few rays miss something");
    // Rows that hold everything miss nothing; rows that hold nothing miss all that isn't sky.
    let (mut all, none) = (lower.clone(), BitMatrix::new(lower.rows(), lower.columns()));
    (0..all.rows()).for_each(|r| (0..all.columns()).for_each(|c| _ = all.set(r, c)));
    assert_eq!(views.false_pixels(&all), [0.0; 3]);
    let [mean, _, max] = views.false_pixels(&none);
    assert!(mean > 0.5 && max == 1.0);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn storeys_are_those_of_the_plan() {
    let (_, file) = baked("office.glb", 100_000, Guarantee::Conservative);
    let expected: Value = serde_json::from_str(&text(&building("office.expected.json"))).unwrap();
    let found = storeys(&file);
    assert_eq!(found.len() as u64, expected["storeys"].as_u64().unwrap());
    // Storeys are 3.3 m high.
    for (k, storey) in found.iter().enumerate() {
        assert!((storey.floor + file.origin.y - 3.3 * k as f64).abs() < 0.01, "{}", storey.floor);
    }
    // Each closed cell is on one.
    let closed = file.cells.iter().filter(|c| !c.open).count();
    let mut all: Vec<_> = found.iter().flat_map(|s| s.cells.clone()).collect();
    all.sort_unstable();
    all.dedup();
    assert_eq!((all.len(), found.iter().map(|s| s.cells.len()).sum::<usize>()), (closed, closed));
    // The walk passes every cell once, storey by storey, and goes on to a neighbour wherever there is one.
    let walk = along_a_walk(&file, &found);
    let mut sorted = walk.clone();
    sorted.sort_unstable();
    assert!(sorted.iter().enumerate().all(|(i, c)| c.index() == i) && sorted.len() == file.cells.len());
    let on = |c| found.iter().position(|s| s.cells.contains(&c));
    assert!(walk.iter().map(|&c| on(c)).is_sorted());
    let joined = |a, b| file.portals.iter().any(|p| p.cells == [a, b] || p.cells == [b, a]);
    let begun = (1..walk.len()).filter(|&i| {
        on(walk[i - 1]) == on(walk[i]) && !walk[..i].iter().any(|&c| on(c) == on(walk[i]) && joined(c, walk[i]))
    });
    assert_eq!(begun.count(), 0, "offices of a storey are joined by its corridor");

    // What is undecided is counted once, by kind; the hardest pairs are undecided.
    let [closed, open] = closed_and_open(&file);
    let all = closed.with(open);
    assert_eq!(all.upper, file.pairs.upper);
    assert_eq!(kinds(&file).iter().map(|k| k.1).sum::<u64>(), all.undecided());
    let hardest = hardest(&file, 12);
    assert_eq!(hardest.len(), 12);
    let bounds = file.bounds.as_ref().unwrap();
    for (cell, object) in &hardest {
        let [lower, upper] = [&bounds.objects_lower, &bounds.objects_upper].map(|m| m.get(cell.index(), object.index()));
        assert!(!lower && upper && of_cell(&file, *cell).undecided() > 0);
    }
    let mut cells: Vec<_> = hardest.iter().map(|h| h.0).collect();
    cells.sort_unstable();
    cells.dedup();
    assert_eq!(cells.len(), 12, "spread over cells");
}

/// How wrong tubes are drawn: within the limit, where nothing is over it; and a coarser limit takes less. What is told of them is what they are.
#[test]
fn a_page_tells_how_wrong_tubes_are_drawn() {
    let folder = folder("tubes");
    let [model, page, file] = ["pipes.glb", "pipes.html", "pipes.pvs"].map(|name| folder.join(name));
    let [model, page, file] = [&model, &page, &file].map(|path| path.to_str().unwrap());
    run(&["generate", "pipes", "--sections", "2000", "-o", model].map(Path::new));
    let told = json(&["report", model, "-o", page, "--rays", "20k", "--views", "3", "--json"]);
    let scene = import(Path::new(model), &ImportOptions::default()).unwrap();
    let tubes = &told["tubes"];
    let sections = scene.tubes.sections.len();
    assert_eq!(
        (tubes["tubes"].as_u64(), tubes["sections"].as_u64()),
        (Some(scene.tubes.tubes.len() as u64), Some(sections as u64))
    );
    assert_eq!(tubes["section_bytes"].as_u64(), Some(16 * sections as u64));
    let of_mesh: usize =
        scene.tubes.tubes.iter().map(|tube| enfilade_tubes::mesh(&scene.tubes, tube, 18).triangles.len()).sum();
    assert_eq!(tubes["triangles_of_18_sides"].as_u64(), Some(of_mesh as u64));
    let objects = scene.objects.iter().filter(|object| object.is_tube()).count();
    let line = format!(
        "{} tubes of {sections} sections in {objects} objects: {} bytes; with 18 sides {of_mesh} triangles of {} bytes",
        scene.tubes.tubes.len(),
        16 * sections,
        48 * of_mesh
    );

    let html = text(Path::new(page));
    check_page(&html);
    assert!(html.contains(&format!("<h2>Tubes</h2>\n<p>{line}.</p>")));
    let table = text(&folder.join("pipes.tubes.csv"));
    let number = |text: &str| text.parse::<f64>().unwrap();
    let rows: Vec<Vec<f64>> = table.lines().skip(1).map(|row| row.split(',').map(number).collect()).collect();
    assert_eq!(rows.iter().map(|row| row[0]).collect::<Vec<_>>(), [0.1, 0.25, 0.5, 1.0, 2.0, 4.0]);
    let errors = told["tube_errors"]["errors"].as_array().unwrap();
    assert_eq!(errors.len(), rows.len());
    for (row, error) in rows.iter().zip(errors) {
        let [limit, over, greatest, mean, samples] = [0, 3, 4, 5, 6].map(|k| row[k]);
        assert!(mean > 0.0 && mean < limit && mean < greatest && samples > 500.0, "{row:?}");
        assert!(greatest <= limit || over > 0.0, "{row:?}");
        assert!((error["greatest_px"].as_f64().unwrap() - greatest).abs() < 1e-4, "{row:?}");
        let [worst, mean] = ["greatest_weight", "mean_weight"].map(|key| error[key].as_f64().unwrap());
        assert!(row[9] > 10.0 && mean > 0.0 && mean <= worst.abs() && mean < 0.05, "{worst} {mean} {row:?}");
        assert!((worst - row[7]).abs() < 1e-4 && (mean - row[8]).abs() < 1e-4, "{row:?}");
    }
    for pair in rows.windows(2) {
        assert!(pair[1][1] <= pair[0][1] && pair[1][2] < pair[0][2], "a coarser limit takes more: {pair:?}");
    }

    // `bake` reports the same, and nothing of tubes where there are none.
    let bake = json(&["bake", model, "-o", file, "--rays", "20k", "--json"]);
    assert!(bake["details"].as_array().unwrap().iter().any(|detail| *detail == *line), "{bake}");
    let never = json(&["bake", model, "-o", file, "--rays", "20k", "--tubes", "never", "--json"]);
    assert!(never.get("tubes").is_none() && !never["details"].to_string().contains("with 18 sides"));
}

/// What a reader wants to know comes first: four numbers, plans with the numbers of portals, what is dear. Figures of the method are folded away.
#[test]
fn a_page_opens_with_four_numbers_and_plans() {
    let folder = folder("opens");
    let (model, out) = cli::maze(&folder);
    let page = folder.join("maze.html");
    let report = ["report", cli::text(&model), "-o", cli::text(&page), "--rays", "100k", "--views", "20", "--json"];
    let told = json(&report);
    let html = text(&page);
    check_page(&html);
    // 1. Four numbers, then the plans.
    let (head, rest) = html.split_once("<h2>").unwrap();
    let tiles = head.split("<div class=\"tiles wide\">").nth(1).unwrap();
    let tiles: Vec<&str> = tiles.split("<div>").skip(1).map(|tile| tile.split("</b>").next().unwrap()).collect();
    let closed = told["cells"].as_u64().unwrap() - told["open_cells"].as_u64().unwrap();
    let drawn = format!("Drawn<b>{:.0} %", 100.0 * told["expected_draw"]["both"].as_f64().unwrap());
    let file = PvsFile::load(&out).unwrap();
    let doors = file.portals.iter().filter(|portal| portal.kind == PortalKind::Door).count();
    assert_eq!(tiles, [format!("Rooms<b>{closed}"), format!("Doors<b>{doors}"), drawn, "Pixels missed<b>0".to_owned()]);
    assert_eq!(told["missed_pixels"], 0, "the rows of a conservative file lack nothing");
    assert!(rest.starts_with("Plans</h2>"), "{rest}");
    let plan = rest.split("</svg>\n</div>").next().unwrap();
    let numbers: Vec<usize> =
        plan.split("<text class=\"id\"").skip(1).map(|t| t.split(['>', '<']).nth(1).unwrap().parse().unwrap()).collect();
    assert!(!numbers.is_empty() && numbers.iter().all(|portal| *portal < file.portals.len()), "{numbers:?}");
    // 2. What is dear. Rows are told in triangles.
    let (open, folded) = html.split_once("<details class=\"part\">").unwrap();
    let rows = file.object_rows.as_ref().unwrap();
    let row = |cell: usize| rows.ones(cell).map(|o| u64::from(file.objects[o].triangles)).sum::<u64>();
    let dearest = (0..file.cells.len()).filter(|c| !file.cells[*c].open).map(row).max().unwrap();
    assert!(
        open.contains("The most expensive rooms and doors</h2>")
            && open.contains(&format!("<td>{}</td>", thousands(dearest)))
    );
    let costs = told["portal_costs"].as_array().unwrap();
    let triangles: Vec<f64> = costs.iter().map(|cost| cost["triangles"].as_f64().unwrap()).collect();
    let drawn = &told["expected_draw"];
    let most = drawn["both"].as_f64().unwrap() * drawn["frustum_triangles"].as_f64().unwrap();
    assert!(!costs.is_empty() && triangles.iter().all(|t| *t > 0.0 && *t < most), "{triangles:?} of {most}");
    assert!(
        triangles.is_sorted_by(|a, b| a >= b) && costs.iter().all(|cost| cost["portal"].as_u64() < told["portals"].as_u64())
    );
    // 3. The rest is folded, and the lower set's error is not called the file's.
    for words in ["Error against run time", "Bits a pair", "How sure the rows are", "Visibility matrix", "Time and memory"] {
        assert!(!open.contains(words) && folded.contains(words), "{words}");
    }
    assert!(!html.contains("were the rows the lower set") && !html.to_lowercase().contains("false pixels"));
}

#[test]
fn a_hall_without_anything_to_tell_is_a_page_too() {
    let folder = folder("hall");
    let (model, page) = (folder.join("hall.glb"), folder.join("<i>.html"));
    let model = model.to_str().unwrap();
    run(&["generate", "hall", "-o", model].map(Path::new));
    let told = json(&["report", model, "-o", page.to_str().unwrap(), "--rays", "50k", "--views", "5", "--json"]);
    assert_eq!((told["cells"].as_u64(), told["portals"].as_u64()), (Some(2), Some(0)));
    let html = text(&page);
    check_page(&html);
    assert!(html.contains("rows: one closed cell without portals sees everything"));
    assert!(!html.contains("<h2>Tubes</h2>") && told.get("tube_errors").is_none());
    // No rays at all, no views at all.
    json(&["report", model, "-o", page.to_str().unwrap(), "--rays", "0", "--views", "0", "--json"]);
    check_page(&text(&page));
}

/// Each split saves something for its bytes, and they end where the bake says that they end.
#[test]
fn view_cells_are_drawn_split_by_split_until_the_bake_stopped() {
    let folder = folder("splits");
    let [model, page, file] = ["yards.obj", "page.html", "yards.pvs"].map(|name| folder.join(name));
    let yards = three_yards().into_iter().enumerate().map(|(i, (name, min, max))| (format!("{name} {i}"), min, max));
    std::fs::write(&model, obj(&yards.collect::<Vec<_>>())).unwrap();
    let [model, page_name, file] = [&model, &page, &file].map(|path| path.to_str().unwrap());
    let flags = ["--rays", "300k", "--seed", "2", "--view-cells", "auto:2K", "--json"];
    let told = json(&[&["report", model, "-o", page_name, "--views", "5"], &flags[..]].concat());
    let bake = json(&[&["bake", model, "-o", file], &flags[..]].concat());
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    let (splits, of_bake) = (&told["view_cell_splits"], &bake["view_cells"]);
    let points = splits["points"].as_array().unwrap();
    assert_eq!((splits["bytes_allowed"].as_u64(), points[0]["bytes"].as_u64()), (Some(2048), Some(0)));
    for pair in points.windows(2) {
        assert!(number(&pair[0]["bytes"]) < number(&pair[1]["bytes"]), "{pair:?}");
        assert!(number(&pair[0]["triangles"]) >= number(&pair[1]["triangles"]), "{pair:?}");
        assert!(number(&pair[1]["bytes"]) <= 2048.0);
    }
    let count = of_bake["count"].as_u64().unwrap_or(0);
    assert_eq!(points.last().unwrap()["view_cells"].as_u64(), Some(count));
    let note = bake["notes"].as_array().unwrap().iter().filter_map(Value::as_str).find(|n| n.contains("by cost")).unwrap();
    assert_eq!(note.ends_with("the bytes are used up"), splits["ended_by"] == "bytes");
    // Over one sky portals prove nothing: a file that promises to hold all keeps no view cell, and says so.
    assert!(note.contains("none kept") && count == 0, "{note}");
    let html = text(&page);
    check_page(&html);
    assert!(html.contains(&format!("stopped at {count} view cells, ")));
    let lines = points.iter().map(|p| ["view_cells", "bytes", "triangles"].map(|key| number(&p[key]).to_string()).join(","));
    let lines: Vec<String> = ["view_cells,bytes,triangles".to_owned()].into_iter().chain(lines).collect();
    assert_eq!(text(&page.with_extension("view-cells.csv")).lines().collect::<Vec<_>>(), lines);
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder("bad");
    let (level, villa) = (folder.join("level.prt"), building("villa_rotonda.glb"));
    std::fs::write(&level, LEVEL).unwrap();
    let in_folder = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (level, villa) = (level.to_str().unwrap(), villa.to_str().unwrap());
    let cases: [(&[&str], &[&str]); 11] = [
        (&[&in_folder("none.glb")], &["none.glb: "]),
        (&[&in_folder("none.xyz")], &["none.xyz: no importer"]),
        (&[&in_folder("a.pvs")], &["a.pvs: report bakes a model itself"]),
        (&[villa, "--steps", "7"], &["villa_rotonda.glb: is no level; --steps is for levels"]),
        (&[villa, "--against", level], &["villa_rotonda.glb: is no level; --against is for levels"]),
        (&[level, "--cells", "plan"], &["level.prt: is a level; --cells is for buildings"]),
        (&[level, "--views", "7"], &["level.prt: is a level; --views is for buildings"]),
        (&[level, "--view-cells", "auto"], &["is a level; --view-cells is for buildings"]),
        (&[villa, "--rays=-1"], &["--rays", "takes a whole number"]),
        (&[villa, "-o", &in_folder("page.csv")], &["page.csv: -o names the page"]),
        (&[villa, "--cells", "authored", "-o", &in_folder("p.html")], &["villa_rotonda.glb: the model names no rooms"]),
    ];
    for (words, says) in cases {
        refused(&run_words(&[&["report"], words].concat()), says);
    }
}
