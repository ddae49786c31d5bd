//! Files that are damaged, cut or not IFC.

use enfilade::scene::{ImportError, ImportOptions, Scene};
use enfilade_formats::ifc::import_bytes;
use std::time::{Duration, Instant};
use testing::house::House;
use testing::random::Random;

#[test]
fn damage_to_one_element_costs_that_element() {
    let text = House::default().text();
    let whole = import_bytes(text.clone().into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(whole.source.notes, Vec::<String>::new());
    let nodes = |s: &Scene| s.objects.iter().map(|o| o.node.clone()).collect::<Vec<_>>();
    // The chair's profile gone, and the chair put beyond the Earth: the rest is as before.
    for (from, to) in [("/*chair*/", "/*chair*/#"), ("/*chair at*/", "/*chair at*/1.E30+")] {
        let damaged = text.replace(from, to);
        assert_ne!(damaged, text);
        let scene = import_bytes(damaged.into_bytes(), "house", &ImportOptions::default()).unwrap();
        assert_eq!(nodes(&scene), ["wall", "door-1", "window-3", "pane"], "{to}");
        assert!(!scene.source.notes.is_empty(), "{to}");
    }
}

#[test]
fn a_data_section_given_twice_adds_nothing() {
    let text = House::default().text();
    let data = &text[text.find("DATA;").unwrap()..text.find("END-ISO").unwrap()];
    let twice = text.replace("END-ISO", &format!("{data}END-ISO"));
    let once = import_bytes(text.clone().into_bytes(), "house", &ImportOptions::default()).unwrap();
    let twice = import_bytes(twice.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(once.hash(), twice.hash());
    assert_eq!(once.hints, twice.hints);
    assert_eq!(twice.source.notes.len(), 1, "{:?}", twice.source.notes);
}

#[test]
fn circles_and_chains_end() {
    let text = House::default().text();
    let chain = |from: usize, links: usize, link: &dyn Fn(usize) -> String| -> String {
        (from..from + links).map(|i| format!("#{i}={};\n", link(i + 1))).collect()
    };
    let shape = "IFCSHAPEREPRESENTATION(#10,'Body','SweptSolid',(#703))";
    let map = "#5000=IFCMAPPEDITEM(#5001,#5002);\n#5001=IFCREPRESENTATIONMAP(#11,#702);\n\
               #5002=IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,#12,$,$);\n";
    let cut = |operand: usize| format!("IFCBOOLEANRESULT(.DIFFERENCE.,#{operand},#803)");
    let cases = [
        // A storey in itself, a solid cut from itself, a map of itself.
        ("'agg-1',$,$,$,#20,(#40)", "'agg-1',$,$,$,#40,(#40)", String::new()),
        (shape, "IFCSHAPEREPRESENTATION(#10,'Body','CSG',(#5000))", format!("#5000={};\n", cut(5000))),
        (shape, "IFCSHAPEREPRESENTATION(#10,'Body','MappedRepresentation',(#5000))", map.to_owned()),
        // A placement and a solid that only end after 50,000 links.
        (
            "#41=IFCLOCALPLACEMENT(#21,",
            "#41=IFCLOCALPLACEMENT(#5000,",
            chain(5000, 50_000, &|next| format!("IFCLOCALPLACEMENT(#{next},#11)")) + "#55000=IFCLOCALPLACEMENT($,#11);\n",
        ),
        (
            shape,
            "IFCSHAPEREPRESENTATION(#10,'Body','CSG',(#5000))",
            chain(5000, 50_000, &cut) + "#55000=IFCBLOCK(#707,1.,1.,1.);\n",
        ),
        ("'Ground'", &format!("{}'Ground'{}", "(".repeat(100_000), ")".repeat(100_000)), String::new()),
    ];
    // A placement relative to itself: nothing has a place, which is an error.
    let circle = text.replace("#41=IFCLOCALPLACEMENT(#21,", "#41=IFCLOCALPLACEMENT(#41,");
    let error = import_bytes(circle.into_bytes(), "house", &ImportOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("no element's geometry can be read; the first is wall"), "{error}");
    for (from, to, more) in cases {
        assert!(text.contains(from), "{from}");
        let start = Instant::now();
        let text = text.replace(from, to).replace("ENDSEC;\nEND-ISO", &format!("{more}ENDSEC;\nEND-ISO"));
        let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default());
        let to = &to[..to.len().min(60)];
        // The wall is still there, whatever became of the rest.
        assert!(scene.is_ok_and(|s| s.objects.iter().any(|o| o.node == "wall")), "{to}");
        assert!(start.elapsed() < Duration::from_secs(20), "{to}");
    }
}

#[test]
fn foreign_cut_and_empty_files_are_refused_with_a_reason() {
    let options = ImportOptions::default();
    let message = |bytes: &[u8]| import_bytes(bytes.to_vec(), "x", &options).unwrap_err().to_string();
    assert_eq!(message(b""), "the file is empty");
    assert!(message(b"glTF\x02\0\0\0").contains("not an IFC file"));
    let text = House::default().text();
    let cut = &text.as_bytes()[..text.len() / 2];
    let lines = cut.iter().filter(|&&b| b == b'\n').count() + 1;
    assert!(message(cut).starts_with(&format!("line {lines}: the file ends before")), "{}", message(cut));
    let header = &text[..text.find("#1=").unwrap()];
    let point = format!("{header}#1=IFCCARTESIANPOINT((0.,0.,0.));\nENDSEC;\nEND-ISO-10303-21;\n");
    assert!(message(point.as_bytes()).contains("no IFCPROJECT and no product"), "{}", message(point.as_bytes()));
    assert!(message(format!("{header}ENDSEC;\nEND-ISO-10303-21;\n").as_bytes()).contains("no records"));
    let bare = text.lines().filter(|l| !l.contains("IFCSHAPEREPRESENTATION(")).collect::<Vec<_>>().join("\n");
    assert!(message(bare.as_bytes()).contains("element"), "{}", message(bare.as_bytes()));
    let small = ImportOptions { max_triangles: 10, ..ImportOptions::default() };
    let refused = import_bytes(text.into_bytes(), "x", &small);
    assert!(matches!(refused, Err(ImportError::TooLarge { limit: 10 })), "{refused:?}");
}

/// Lines left out or mixed up; other mutants are those of tests/hostile.
#[test]
fn mutants_neither_panic_nor_hang() {
    let text = House::default().text().into_bytes();
    let lines: Vec<&[u8]> = text.split_inclusive(|&b| b == b'\n').collect();
    let mut random = Random::new(9);
    let mut mutants: Vec<Vec<u8>> = Vec::new();
    for skip in 0..lines.len() {
        mutants.push(lines.iter().enumerate().filter(|&(i, _)| i != skip).flat_map(|(_, l)| l.to_vec()).collect());
    }
    for _ in 0..60 {
        // Two lines' tails swapped: references to records of the wrong kind.
        let [a, b] = [0; 2].map(|_| random.below(lines.len()));
        let number = |l: &[u8]| l.iter().position(|&c| c == b'=').map_or(0, |p| p + 1);
        let swapped = lines.iter().enumerate().flat_map(|(i, l)| match i {
            _ if i == a => [&lines[a][..number(lines[a])], &lines[b][number(lines[b])..]].concat(),
            _ if i == b => [&lines[b][..number(lines[b])], &lines[a][number(lines[a])..]].concat(),
            _ => l.to_vec(),
        });
        mutants.push(swapped.collect());
    }
    let (mut read, mut refused) = (0, 0);
    for mutant in mutants {
        let start = Instant::now();
        match import_bytes(mutant.clone(), "mutant", &ImportOptions::default()) {
            Ok(_) => read += 1,
            Err(_) => refused += 1,
        }
        assert!(start.elapsed() < Duration::from_secs(40), "{}", String::from_utf8_lossy(&mutant));
    }
    assert!(read > 100 && refused > 5, "{read} read, {refused} refused");
}
