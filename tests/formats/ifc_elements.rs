//! What IFC files say of their elements: against lines of real files read by hand, and against a file of which every word is known.
#![cfg(feature = "ifc")]

use enfilade_formats::elements;
use enfilade_formats::elements::{Element, Elements, Value};
use enfilade_formats::ifc::elements_of_bytes;
use std::fmt::Write;
use testing::data::data;
use testing::random::Random;

fn told(element: &Element, set: &str, property: &str) -> Vec<String> {
    let sets = element.all_sets().filter(|s| s.name == set);
    sets.flat_map(|s| &s.properties).filter(|p| p.name == property).map(|p| p.value.to_string()).collect()
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_files_say_what_stands_in_their_text() {
    let folder = data();
    let read = |file: &str| elements(&folder.join(file)).unwrap();
    // #4131, #4134 and #4185 of the file.
    let duplex = read("duplex/Duplex_A_20110907.ifc");
    let wall = duplex.get("2O2Fr$t4X7Zf8NOew3FNld").unwrap();
    assert_eq!((wall.class.as_str(), wall.tag.as_deref()), ("IfcWallStandardCase", Some("138584")));
    assert_eq!(wall.name.as_deref(), Some("Basic Wall:Interior - Partition (92mm Stud):138584"));
    assert_eq!(told(wall, "Pset_WallCommon", "LoadBearing"), ["false"]);
    assert_eq!(told(wall, "PSet_Revit_Constraints", "Unconnected Height"), ["2.795 m"]);
    assert_eq!(told(wall, "PSet_Revit_Constraints", "Location Line"), ["2"]);
    // Its ten relations have one set each.
    assert_eq!((wall.sets.len(), wall.kind.is_none()), (10, true));
    let door = duplex.get("1hOSvn6df7F8_7GcBWlRGQ").unwrap();
    let style = door.kind.as_ref().unwrap();
    assert_eq!((style.class.as_str(), door.type_name()), ("IfcDoorStyle", Some("1250mm x 2010mm")));
    // Of 21 spaces each has its area, without a unit of its own.
    let spaces: Vec<_> = duplex.all.iter().filter(|e| e.class == "IfcSpace").collect();
    let areas = spaces.iter().filter(|e| told(e, "GSA Space Areas", "GSA BIM Area").len() == 1).count();
    assert_eq!((spaces.len(), areas), (21, 21));
    let foyer = duplex.get("0BTBFw6f90Nfh9rP1dlXrr").unwrap();
    assert_eq!((foyer.name.as_deref(), foyer.long_name.as_deref(), &foyer.tag), (Some("A101"), Some("Foyer"), &None));

    let office = read("webifc-mpl/Office_A_20110811.ifc");
    let door = office.get("2N3oFtM8X6lO2dN1$77x1u").unwrap();
    assert_eq!((door.type_name(), door.tag.as_deref()), (Some("0915 x 2134mm"), Some("184606")));
    assert_eq!(told(door, "PSet_Revit_Other", "Head Height"), ["2.134 m"]);
    assert_eq!(told(door, "Pset_DoorCommon", "FireRating"), ["Fire Rating"]);

    let house = read("webifc-mpl/AC20-FZK-Haus.ifc");
    let wall = house.get("2XPyKWY018sA1ygZKgQPtU").unwrap();
    assert_eq!(wall.kind.as_ref().map(|kind| kind.class.as_str()), Some("IfcWallType"));
    assert_eq!(wall.type_name(), Some("Leichtbeton 102890359 240"));
    assert_eq!(told(wall, "ArchiCADProperties", "Ebene"), ["Innenwände"]);
    // An empty label says nothing.
    assert!(told(wall, "ArchiCADProperties", "Name des Sachmerkmal-Objekts").is_empty());

    let flats = read("kit-apache/AC11-Smiley-West.ifc");
    let cellar = flats.get("2fC0lVoybCoBf80Fr0Jfzg").unwrap();
    assert_eq!(cellar.long_name.as_deref(), Some("KELLERRAUM-2-1"));
    let quantities = cellar.sets.iter().find(|s| s.is_quantities).unwrap();
    let [volume, area] = &quantities.properties[..] else { panic!("{quantities:?}") };
    assert_eq!([volume.value.to_string(), area.value.to_string()], ["72.396351 m³", "30.418635 m²"]);
    assert_eq!(told(cellar, "Pset_SpaceThermalRequirements", "SpaceTemperatureMax"), ["15 °C"]);
    for elements in [duplex, office, house, flats] {
        assert_eq!(elements.notes, [""; 0]);
    }
}

/// A file with a wall #10 and these records.
fn file(records: &str) -> Vec<u8> {
    let text = format!(
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\n\
         #1=IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.);\n#2=IFCUNITASSIGNMENT((#1));\n\
         #3=IFCPROJECT('project',$,$,$,$,$,$,$,#2);\n#10=IFCWALL('wall',$,'W',$,'thick',$,$,'7',$);\n{records}\n\
         ENDSEC;\nEND-ISO-10303-21;\n"
    );
    text.into_bytes()
}

fn read(records: &str) -> Elements {
    elements_of_bytes(file(records)).unwrap()
}

#[test]
fn every_kind_of_value_is_told() {
    let elements = read(
        "#20=IFCPROPERTYSINGLEVALUE('length',$,IFCLENGTHMEASURE(2010.),$);\n\
         #21=IFCPROPERTYENUMERATEDVALUE('status',$,(IFCLABEL('NEW'),IFCLABEL('OTHER')),$);\n\
         #22=IFCPROPERTYLISTVALUE('widths',$,(IFCREAL(1.5),IFCREAL(2.)),#29);\n\
         #23=IFCPROPERTYBOUNDEDVALUE('load',$,IFCREAL(5.),IFCREAL(1.),$,$);\n\
         #24=IFCPROPERTYBOUNDEDVALUE('most',$,IFCREAL(5.),$,$,IFCREAL(4.));\n\
         #25=IFCPROPERTYSINGLEVALUE('known',$,IFCLOGICAL(.U.),$);\n\
         #26=IFCCOMPLEXPROPERTY('glass',$,'use',(#25,#26));\n\
         #27=IFCPROPERTYSINGLEVALUE('nothing',$,$,$);\n\
         #29=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n\
         #30=IFCPROPERTYSET('s',$,'All',$,(#20,#21,#22,#23,#24,#26,#27));\n\
         #31=IFCQUANTITYLENGTH('l',$,$,3000.,$);\n#32=IFCQUANTITYAREA('a',$,$,2.5,$);\n#33=IFCQUANTITYVOLUME('v',$,$,1.,$);\n\
         #34=IFCQUANTITYCOUNT('c',$,$,4.,$);\n#35=IFCQUANTITYWEIGHT('w',$,$,80.,$);\n#36=IFCQUANTITYTIME('t',$,$,60.,$);\n\
         #37=IFCELEMENTQUANTITY('q',$,'Base',$,$,(#31,#32,#33,#34,#35,#36));\n\
         #40=IFCRELDEFINESBYPROPERTIES('r',$,$,$,(#10),#30);\n\
         #41=IFCRELDEFINESBYPROPERTIES('r2',$,$,$,(#10),IFCPROPERTYSETDEFINITIONSET((#37)));\n\
         #42=IFCPROPERTYSET('s2',$,'Of the type',$,(#20));\n#43=IFCWALLTYPE('type',$,'Thick',$,$,(#42),$,$,$,.SOLIDWALL.);\n\
         #44=IFCRELDEFINESBYTYPE('r3',$,$,$,(#10),#43);",
    );
    let wall = elements.get("wall").unwrap();
    let sets: Vec<(&str, bool)> = wall.all_sets().map(|s| (s.name.as_str(), s.is_quantities)).collect();
    assert_eq!(sets, [("All", false), ("Base", true), ("Of the type", false)]);
    for (set, property, value) in [
        ("All", "length", "2010 mm"),
        ("All", "status", "NEW, OTHER"),
        ("All", "widths", "1.5 m, 2 m"),
        ("All", "load", "1 to 5"),
        ("All", "most", "4 (5 or less)"),
        ("All", "glass: known", "unknown"),
        ("Base", "l", "3000 mm"),
        ("Base", "a", "2.5 m²"),
        ("Base", "v", "1 m³"),
        ("Base", "c", "4"),
        ("Base", "w", "80 kg"),
        ("Base", "t", "60 s"),
        ("Of the type", "length", "2010 mm"),
    ] {
        let found = told(wall, set, property);
        // A circle is followed a few times and then ended.
        assert!(!found.is_empty() && found.iter().all(|found| found == value), "{set}, {property}: {found:?}");
    }
    assert!(told(wall, "All", "nothing").is_empty());
    assert_eq!((wall.type_name(), wall.object_type.as_deref()), (Some("Thick"), Some("thick")));
    assert!(
        matches!(&wall.sets[1].properties[0].value, Value::Number(number, Some(unit)) if *number == 3000.0 && unit == "mm")
    );
}

#[test]
fn what_leads_nowhere_is_passed_over_in_one_line() {
    let elements = read(
        "#20=IFCPROPERTYSET('s',$,$,$,(#98,#10,#20));\n#21=IFCRELDEFINESBYPROPERTIES('r',$,$,$,(#10,#97,#97),#20);\n\
         #22=IFCRELDEFINESBYPROPERTIES('r',$,$,$,(#10),#96);\n#23=IFCRELDEFINESBYTYPE('t',$,$,$,(#10),#10);\n\
         #24=IFCRELDEFINESBYTYPE('t',$,$,$,(#10),#95);\n#25=IFCRELDEFINESBYPROPERTIES($,$);\n#26=IFCWALL();\n\
         #27=IFCRELDEFINESBYPROPERTIES('r',$,$,$,#10,'x');\n#28=IFCELEMENTQUANTITY('q',$,'q',$,$,(#29));\n\
         #29=IFCQUANTITYLENGTH('l',$,$,1.E999,$);\n#30=IFCRELDEFINESBYPROPERTIES('r',$,$,$,(#10),#28);",
    );
    let wall = elements.get("wall").unwrap();
    assert!(wall.sets.iter().all(|set| set.properties.is_empty()) && wall.kind.is_none(), "{wall:?}");
    assert!(elements.get("#26").is_some());
    let [note] = &elements.notes[..] else { panic!("{:?}", elements.notes) };
    assert!(note.ends_with("references to types, sets and properties have no target"), "{note}");
}

#[test]
fn what_a_file_repeats_is_kept_only_so_often() {
    // 1000 letters, told 3000 times in a set; 2000 sets of a wall, told 2000 times.
    let mut records = format!("#20=IFCPROPERTYSINGLEVALUE('p',$,IFCLABEL('{}'),$);\n", "x".repeat(1000));
    let many = |id: u32, n: usize| vec![format!("#{id}"); n].join(",");
    let _ = writeln!(records, "#21=IFCPROPERTYSET('s',$,'long',$,({}));", many(20, 30_000));
    let _ = writeln!(records, "#22=IFCPROPERTYSET('s',$,'short',$,());");
    let _ = writeln!(
        records,
        "#23=IFCRELDEFINESBYPROPERTIES('r',$,$,$,({}),IFCPROPERTYSETDEFINITIONSET((#21,{})));",
        many(10, 2000),
        many(22, 2000)
    );
    let length = records.len();
    let elements = read(&records);
    let wall = elements.get("wall").unwrap();
    let texts: usize = wall.sets.iter().take(1).flat_map(|s| &s.properties).map(|p| p.value.to_string().len()).sum();
    assert!(
        texts + 8 * wall.sets.len() <= 4 * length + (2 << 20),
        "{texts} letters and {} sets of {length} bytes",
        wall.sets.len()
    );
    assert!(elements.notes.iter().any(|note| note.starts_with("some properties are left out")), "{:?}", elements.notes);
    for bad in ["", "ISO-10303-21;\nDATA;\n#1=IFC", "PK\x03\x04"] {
        assert!(elements_of_bytes(bad.as_bytes().to_vec()).is_err(), "{bad:?}");
    }
}

#[test]
fn mutants_of_a_file_are_read_or_refused_in_one_line() {
    let sound = file(
        "#20=IFCPROPERTYSINGLEVALUE('length',$,IFCLENGTHMEASURE(2010.),$);\n#21=IFCCOMPLEXPROPERTY('c',$,'use',(#20,#21));\n\
         #22=IFCPROPERTYBOUNDEDVALUE('load',$,IFCREAL(5.),IFCREAL(1.),#1,$);\n#23=IFCPROPERTYLISTVALUE('l',$,(IFCREAL(1.5)),$);\n\
         #30=IFCPROPERTYSET('s',$,'All',$,(#20,#21,#22,#23));\n#31=IFCQUANTITYLENGTH('l',$,$,3000.,$);\n\
         #37=IFCELEMENTQUANTITY('q',$,'Base',$,$,(#31));\n#40=IFCRELDEFINESBYPROPERTIES('r',$,$,$,(#10),#30);\n\
         #41=IFCRELDEFINESBYPROPERTIES('r2',$,$,$,(#10),IFCPROPERTYSETDEFINITIONSET((#37)));\n\
         #43=IFCWALLTYPE('type',$,'Thick',$,$,(#30),$,$,$,.SOLIDWALL.);\n#44=IFCRELDEFINESBYTYPE('r3',$,$,$,(#10),#43);",
    );
    let data = sound.windows(5).position(|w| w == b"DATA;").unwrap();
    let (mut random, mut read) = (Random::new(5), 0);
    for _ in 0..1500 {
        let mut mutant = sound.clone();
        for _ in 0..1 + random.below(6) {
            let at = data + 5 + random.below(mutant.len() - data - 30);
            match random.below(3) {
                0 => mutant[at] = b"#(),$'.;=*019\x00\xff"[random.below(15)],
                1 => drop(mutant.remove(at)),
                _ => {
                    let end = at + 1 + random.below(20);
                    let part = mutant[at..end].to_vec();
                    mutant.splice(at..at, part);
                }
            }
        }
        match elements_of_bytes(mutant) {
            Ok(elements) => read += usize::from(!elements.all.is_empty()),
            // What panics is told as damaged.
            Err(e) => assert!(e.to_string().lines().count() == 1 && !e.to_string().contains("damaged"), "{e}"),
        }
    }
    assert!(read > 1000, "{read}");
}
