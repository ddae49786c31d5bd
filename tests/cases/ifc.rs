//! Cases of IFC.
#![cfg(feature = "ifc")]

use super::case;
use enfilade::cells::{CellGraph, SplitOptions, Strategy, split};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::ifc::import_bytes;
use enfilade_formats::import;
use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};
use testing::house::House;

fn imported(path: &Path) -> Scene {
    import(path, &ImportOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn cells(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions::default()).unwrap()
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_50_ifc() {
    let folder = case("50_ifc");
    let mut read = 0;
    for entry in std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.extension().is_none_or(|e| e != "ifc" && e != "ifczip") {
            continue;
        }
        let graph = cells(&imported(&entry));
        let portals = match entry.file_stem().and_then(|stem| stem.to_str()) {
            Some("many") => 84,
            Some("no_opening") => 0,
            _ => 3,
        };
        let found = [graph.cells.len(), graph.cells.iter().filter(|c| c.open).count(), graph.portals.len()];
        assert_eq!(found, [4, 1, portals], "{}", entry.display());
        read += 1;
    }
    assert_eq!(read, 30);
}

/// A wall of 4 x 3 x 0.2 m that is bent a little, both sides of it in `across` x `up` rectangles, each of them a face, in millimetres; with
/// two openings of 0.5 x 0.5 m.
fn bent_wall(across: usize, up: usize) -> String {
    let house = House { units_per_metre: 1000.0, ..House::default() }.text();
    let mut t = String::new();
    let (mut next, mut faces) = (10_000, Vec::new());
    let bend = |x: f64| 0.02 * (1.0 - (x - 2.0).powi(2) / 4.0);
    let mut point = |t: &mut String, [x, y, z]: [f64; 3]| {
        next += 1;
        let _ = writeln!(t, "#{next}=IFCCARTESIANPOINT(({:?},{:?},{:?}));", 1000.0 * x, 1000.0 * y, 1000.0 * z);
        next
    };
    let mut grid = |t: &mut String, side: f64| -> Vec<Vec<u32>> {
        let column = |i: usize| 4.0 * i as f64 / across as f64;
        let at = |i: usize, k: usize| [column(i), bend(column(i)) + side, 3.0 * k as f64 / up as f64];
        (0..=across).map(|i| (0..=up).map(|k| point(t, at(i, k))).collect()).collect()
    };
    let (front, back) = (grid(&mut t, 10.0), grid(&mut t, 10.2));
    for i in 0..across {
        for k in 0..up {
            faces.push([front[i][k], front[i + 1][k], front[i + 1][k + 1], front[i][k + 1]]);
            faces.push([back[i][k], back[i][k + 1], back[i + 1][k + 1], back[i + 1][k]]);
        }
        faces.push([front[i][0], back[i][0], back[i + 1][0], front[i + 1][0]]);
        faces.push([front[i][up], front[i + 1][up], back[i + 1][up], back[i][up]]);
    }
    for k in 0..up {
        faces.push([front[0][k], front[0][k + 1], back[0][k + 1], back[0][k]]);
        faces.push([front[across][k], back[across][k], back[across][k + 1], front[across][k + 1]]);
    }
    let mut all = Vec::new();
    for (i, [a, b, c, d]) in faces.iter().enumerate() {
        let id = 1_000_000 + 3 * i;
        let _ = writeln!(t, "#{id}=IFCPOLYLOOP((#{a},#{b},#{c},#{d}));");
        let _ = writeln!(t, "#{}=IFCFACEOUTERBOUND(#{id},.T.);\n#{}=IFCFACE((#{}));", id + 1, id + 2, id + 1);
        all.push(format!("#{}", id + 2));
    }
    let _ = writeln!(t, "#9000=IFCCLOSEDSHELL(({}));\n#9001=IFCFACETEDBREP(#9000);", all.join(","));
    let _ = writeln!(t, "#9002=IFCSHAPEREPRESENTATION(#10,'Body','Brep',(#9001));");
    let _ = writeln!(t, "#9003=IFCPRODUCTDEFINITIONSHAPE($,$,(#9002));");
    let _ = writeln!(t, "#9004=IFCWALL('bent',$,'Bent',$,$,#41,#9003,$);");
    for (i, x) in [0.7, 2.7].into_iter().enumerate() {
        let id = 9100 + 20 * i;
        let _ = writeln!(t, "#{id}=IFCOPENINGELEMENT('bent-{i}',$,'',$,$,#41,#{},$);", id + 1);
        let _ = writeln!(t, "#{}=IFCPRODUCTDEFINITIONSHAPE($,$,(#{}));", id + 1, id + 2);
        let _ = writeln!(t, "#{}=IFCSHAPEREPRESENTATION(#10,'Body','SweptSolid',(#{}));", id + 2, id + 3);
        let _ = writeln!(t, "#{}=IFCEXTRUDEDAREASOLID(#{},#{},#13,500.);", id + 3, id + 4, id + 7);
        let _ = writeln!(t, "#{}=IFCRECTANGLEPROFILEDEF(.AREA.,$,#{},500.,1000.);", id + 4, id + 5);
        let _ = writeln!(t, "#{}=IFCAXIS2PLACEMENT2D(#{},$);\n#{}=IFCCARTESIANPOINT((0.,0.));", id + 5, id + 6, id + 6);
        let _ = writeln!(t, "#{}=IFCAXIS2PLACEMENT3D(#{},$,$);", id + 7, id + 8);
        let _ = writeln!(t, "#{}=IFCCARTESIANPOINT(({:?},10100.,1000.));", id + 8, 1000.0 * x);
        let _ = writeln!(t, "#{}=IFCRELVOIDSELEMENT('voids-{i}',$,$,$,#9004,#{id});", id + 9);
    }
    house.replace("#800),#40);", "#800,#9004),#40);").replace("ENDSEC;\nEND-ISO", &format!("{t}ENDSEC;\nEND-ISO"))
}

/// Ten thousand faces that are nearly in one plane, narrower than what counts as a crack.
#[test]
fn case_51_ifc_hang() {
    let text = bent_wall(500, 10);
    let begin = Instant::now();
    let scene = import_bytes(text.into_bytes(), "bent", &ImportOptions::default()).unwrap();
    let bent = scene.objects.iter().filter(|o| o.node == "bent").map(|o| o.triangles.len()).sum::<usize>();
    assert!(bent > 10_000, "{bent} {:?}", scene.source.notes);
    for strategy in [Strategy::Bsp, Strategy::Plan] {
        let options = SplitOptions { strategy: Some(strategy), ..SplitOptions::default() };
        assert!(!split(&scene, &options).unwrap().cells.is_empty());
    }
    assert!(begin.elapsed() < Duration::from_secs(120), "{:?}", begin.elapsed());
}

#[test]
fn case_52_ifc_productrepresentation() {
    let text = House::default().text();
    let [plain, old] = [&text, &text.replace("IFCPRODUCTDEFINITIONSHAPE", "IFCPRODUCTREPRESENTATION")]
        .map(|text| import_bytes(text.clone().into_bytes(), "house", &ImportOptions::default()).unwrap());
    assert_eq!(plain.hash(), old.hash());
}

/// A pipe along a polyline, with bends.
#[test]
fn a_polygonal_pipe_is_read_as_a_pipe() {
    let pipe = |record: &str| {
        let parts = [
            "#9000=IFCFLOWSEGMENT('pipe',$,'Pipe',$,$,#41,#9001,$);",
            "#9001=IFCPRODUCTDEFINITIONSHAPE($,$,(#9002));",
            "#9002=IFCSHAPEREPRESENTATION(#10,'Body','AdvancedSweptSolid',(#9003));",
            record,
            "#9004=IFCPOLYLINE((#9005,#9006,#9007));",
            "#9005=IFCCARTESIANPOINT((0.,5.,1.));",
            "#9006=IFCCARTESIANPOINT((2.,5.,1.));",
            "#9007=IFCCARTESIANPOINT((2.,5.,2.));",
        ];
        let house = House::default().text().replace("#800),#40);", "#800,#9000),#40);");
        let text = house.replace("ENDSEC;\nEND-ISO", &format!("{}\nENDSEC;\nEND-ISO", parts.join("\n")));
        import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap()
    };
    let [plain, polygonal] = ["IFCSWEPTDISKSOLID(#9004,0.05,$,0.,2.)", "IFCSWEPTDISKSOLIDPOLYGONAL(#9004,0.05,$,0.,2.,0.1)"]
        .map(|r| pipe(&format!("#9003={r};")));
    assert!(plain.objects.iter().any(|object| object.node == "pipe"), "{:?}", plain.source.notes);
    assert_eq!(plain.hash(), polygonal.hash());
}
