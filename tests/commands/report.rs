//! `enfilade report` as a user runs it: what the page and the table say is what `vis` says.

use crate::cli::{LEVEL, enfilade, folder, json, refused};
use serde_json::Value;
use std::path::Path;
use testing::data::data;
use testing::page::check_page;

/// Lines of a table: method, stage, lines, steps, seconds, lower, upper.
fn table(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("method,stage,lines,steps,seconds,lower_pairs,upper_pairs"));
    let rows: Vec<Vec<String>> = lines.map(|l| l.split(',').map(str::to_owned).collect()).collect();
    assert!(rows.iter().all(|r| r.len() == 7));
    rows
}

fn whole(text: &str) -> u64 {
    text.parse().unwrap_or_else(|e| panic!("'{text}': {e}"))
}

/// The table's bounds never drift apart, and end where `vis` ends.
fn check_table(rows: &[Vec<String>], vis: &Value) {
    let of = |method: &str| rows.iter().filter(|r| r[0] == method).collect::<Vec<_>>();
    let (alone, both) = (of("random lines"), of("two-sided"));
    assert!(alone.len() > 2 && both.len() > 1 && alone.len() + both.len() == rows.len());
    for pair in alone.windows(2).chain(both.windows(2)) {
        let [a, b] = [pair[0], pair[1]];
        assert!(a[4].parse::<f64>().unwrap() <= b[4].parse::<f64>().unwrap(), "{a:?} {b:?}");
        assert!(whole(&a[5]) <= whole(&b[5]), "{a:?} {b:?}");
    }
    for pair in both.windows(2) {
        assert!(whole(&pair[0][6]) >= whole(&pair[1][6]) && whole(&pair[0][3]) <= whole(&pair[1][3]), "{pair:?}");
    }
    assert!(both.iter().all(|r| whole(&r[5]) <= whole(&r[6])));
    // Lines alone may prove what the searches leave undecided, but nothing that they prove hidden.
    let last = both.last().unwrap();
    assert!(alone.iter().all(|r| whole(&r[5]) <= whole(&last[6])));
    let numbers = ["steps", "lower_pairs", "upper_pairs"].map(|key| vis[key].as_u64().unwrap());
    assert_eq!([3, 5, 6].map(|k| whole(&last[k])), numbers);
}

#[test]
fn the_page_says_what_vis_says() {
    let folder = folder("page");
    let level = folder.join("level.prt");
    std::fs::write(&level, LEVEL).unwrap();
    let vis = json(&enfilade!("vis", &level, "--json"));
    let report = json(&enfilade!("report", &level, "--json"));
    let (page, csv) = (folder.join("level.report.html"), folder.join("level.report.csv"));
    assert_eq!((report["page"].as_str(), report["table"].as_str()), (page.to_str(), csv.to_str()));
    // Nothing else is left: no rows, no state.
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3);
    let html = std::fs::read_to_string(&page).unwrap();
    check_page(&html);
    let numbers = ["lower_pairs", "upper_pairs", "undecided_pairs", "total_pairs"];
    for key in numbers {
        assert_eq!(report[key], vis[key]);
        assert!(html.contains(&format!("<data value=\"{}\">", vis[key])), "{key}");
    }
    // 14 of 16 pairs.
    assert!(html.contains("<data value=\"14\">14</data>") && html.contains("<data value=\"2\">2</data>"));
    assert!(
        html.contains("12.5 % of all pairs") && html.contains("None: each pair has a witness line or is proven hidden.")
    );
    assert!(html.contains("data:image/png;base64,iVBORw0KGgo") && html.contains("<code>enfilade report level.prt</code>"));
    check_table(&table(&csv), &vis);
    assert_eq!(report["bounds"].as_array().unwrap().last().unwrap()["upper_pairs"], 14);
    assert_eq!(report["lines_alone"].as_array().unwrap().last().unwrap()["lower_pairs"], 14);
}

#[test]
fn rows_of_another_tool_are_a_line_of_the_chart() {
    let folder = folder("other");
    let (level, rows, page) = (folder.join("level.prt"), folder.join("theirs.txt"), folder.join("page.html"));
    std::fs::write(&level, LEVEL).unwrap();
    // They lack 1 3, which sees through one door; they keep 0 3, which doesn't.
    std::fs::write(&rows, "0 4: 0 1 2 3\n1 3: 0 1 2\n2 4: 0 1 2 3\n3 3: 1 2 3\n").unwrap();
    let report =
        json(&enfilade!("report", &level, "--against", &rows, "-o", &page, "--json", "--threads", "1", "--seed", "3"));
    let against = &report["against"];
    for (key, value) in [("their_pairs", 14), ("both_pairs", 13), ("refuted_pairs", 1), ("lost_pairs", 1)] {
        assert_eq!(against[key], value, "{key}");
    }
    let html = std::fs::read_to_string(&page).unwrap();
    check_page(&html);
    assert!(html.contains("rows of theirs.txt: 14") && html.contains("class=\"curve other\""));
    assert!(html.contains("<code>enfilade report level.prt --against theirs.txt --seed 3 --threads 1</code>"));
    assert!(folder.join("page.csv").is_file());
}

#[cfg(unix)]
#[test]
fn names_are_text() {
    let folder = folder("names");
    let level = folder.join("<script>alert('1')&.prt");
    std::fs::write(&level, LEVEL).unwrap();
    json(&enfilade!("report", &level, "--json", "-o", &folder.join("page.html")));
    let html = std::fs::read_to_string(folder.join("page.html")).unwrap();
    check_page(&html);
    assert!(html.contains("<title>Visibility of &lt;script&gt;alert(&#39;1&#39;)&amp;.prt</title>"));
    // The command can be pasted into a shell.
    assert!(html.contains(
        r"<code>enfilade report &#39;&lt;script&gt;alert(&#39;\&#39;&#39;1&#39;\&#39;&#39;)&amp;.prt&#39;</code>"
    ));
}

#[test]
fn levels_of_next_to_nothing() {
    let folder = folder("small");
    for (name, text) in [("one.prt", "PRT1\n1\n0\n"), ("two.prt", "PRT1\n2\n1\n3 0 1 (0 0 0) (1 0 0) (0 1 0)\n")] {
        let level = folder.join(name);
        std::fs::write(&level, text).unwrap();
        json(&enfilade!("report", &level, "--json"));
        check_page(&std::fs::read_to_string(level.with_extension("report.html")).unwrap());
    }
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder("bad");
    let good = folder.join("good.prt");
    std::fs::write(&good, LEVEL).unwrap();
    refused(&enfilade!("report", &folder.join("villa.pvs")), &["villa.pvs: report bakes a model itself"]);
    refused(&enfilade!("report", &folder.join("villa.glb")), &["villa.glb: "]);
    refused(&enfilade!("report", &good, "--rays", "1M"), &["good.prt: is a level; --rays is for buildings"]);
    refused(&enfilade!("report", &good, "-o", &folder.join("page.csv")), &["page.csv: -o names the page"]);
    refused(&enfilade!("report", &good, "-o", &folder), &["commands_report_bad"]);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn a_real_level_tells_the_same_on_any_number_of_threads() {
    let data = data();
    let (folder, level) = (folder("real"), data.join("prt/lqdm12.prt"));
    let report = |threads: &str| {
        let page = folder.join(format!("{threads}.html"));
        let report = json(&enfilade!("report", &level, "--json", "--threads", threads, "-o", &page));
        check_page(&std::fs::read_to_string(&page).unwrap());
        let mut rows = table(&page.with_extension("csv"));
        check_table(&rows, &report);
        // All but the times.
        rows.iter_mut().for_each(|row| row[4].clear());
        rows
    };
    let rows = report("1");
    assert_eq!(rows, report("2"));
    // The flood, the lines, then rounds of searches.
    let stages: Vec<&str> = rows.iter().filter(|r| r[0] == "two-sided").map(|r| r[1].as_str()).collect();
    assert_eq!(stages[..3], ["might-see", "lines", "flow 1"]);
    assert_eq!(stages.last().copied(), Some(format!("flow {}", stages.len() - 2).as_str()));
    // Searches close what the lines leave open.
    let gap = |row: &[String]| whole(&row[6]) - whole(&row[5]);
    let both: Vec<&Vec<String>> = rows.iter().filter(|r| r[0] == "two-sided").collect();
    assert!(gap(both[1]) > 100 * (gap(both[both.len() - 1]) + 1));
}
