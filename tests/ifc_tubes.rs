//! Pipes of IFC as tubes: triangles against the exact surfaces of cylinders and elbows, and real files.
#![cfg(feature = "ifc")]

use enfilade::geom::Aabb;
use enfilade::scene::ifc::import_bytes;
use enfilade::scene::{ImportOptions, Object, Scene, import};
use enfilade::tubes::usual_sides;
use glam::{DVec3, dvec3};
use testing::data::data;

/// Pipes in a row along +X (IFC's coordinates, millimetres), each as the records of its body say; the first number of its own is 100.
fn file(pipes: usize, class: &str, body: &str) -> String {
    let mut text = String::from(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\nFILE_SCHEMA(('IFC4'));\n\
         ENDSEC;\nDATA;\n#1=IFCPROJECT('p',$,$,$,$,$,$,(#5),#2);\n#2=IFCUNITASSIGNMENT((#3,#4));\n\
         #3=IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.);\n#4=IFCSIUNIT(*,.PLANEANGLEUNIT.,$,.RADIAN.);\n\
         #5=IFCGEOMETRICREPRESENTATIONCONTEXT($,'Model',3,1.E-5,#6,$);\n#6=IFCAXIS2PLACEMENT3D(#7,$,$);\n\
         #7=IFCCARTESIANPOINT((0.,0.,0.));\n#8=IFCDIRECTION((0.,0.,1.));\n#9=IFCDIRECTION((1.,0.,0.));\n\
         #10=IFCDIRECTION((0.,1.,0.));\n",
    );
    text.push_str(body);
    for k in 0..pipes {
        let (own, at) = (1000 + 10 * k, 5000 * k);
        let (point, place, object, product) = (own, own + 1, own + 2, own + 3);
        text.push_str(&format!(
            "#{point}=IFCCARTESIANPOINT(({at}.,0.,1000.));\n#{place}=IFCAXIS2PLACEMENT3D(#{point},$,$);\n\
             #{object}=IFCLOCALPLACEMENT($,#{place});\n#{product}={class}('pipe{k}',$,$,$,$,#{object},#100,$,$);\n"
        ));
    }
    text + "ENDSEC;\nEND-ISO-10303-21;\n"
}

fn read(text: &str) -> Scene {
    import_bytes(text.as_bytes().to_vec(), "pipes", &ImportOptions::default()).unwrap().meshed(usual_sides)
}

const SHAPE: &str = "#100=IFCPRODUCTDEFINITIONSHAPE($,$,(#101));\n";
/// A pipe of 200 mm that goes up by 2 m.
const CYLINDER: &str = "#101=IFCSHAPEREPRESENTATION(#5,'Body','SweptSolid',(#102));\n\
    #102=IFCEXTRUDEDAREASOLID(#103,$,#8,2000.);\n#103=IFCCIRCLEPROFILEDEF(.AREA.,$,$,100.);\n";
/// An elbow of 90 degrees and 300 mm, of a pipe of 200 mm: a circle about (300, 0), about an axis along +Y.
const ELBOW: &str = "#101=IFCSHAPEREPRESENTATION(#5,'Body','SweptSolid',(#102));\n\
    #102=IFCREVOLVEDAREASOLID(#103,$,#106,1.5707963267948966);\n#103=IFCCIRCLEPROFILEDEF(.AREA.,$,#104,100.);\n\
    #104=IFCAXIS2PLACEMENT2D(#105,$);\n#105=IFCCARTESIANPOINT((300.,0.));\n#106=IFCAXIS1PLACEMENT(#7,#10);\n";
/// A disk of 100 mm along a line, mapped at half its size.
const MAPPED: &str = "#101=IFCSHAPEREPRESENTATION(#5,'Body','MappedRepresentation',(#102));\n\
    #102=IFCMAPPEDITEM(#103,#110);\n#103=IFCREPRESENTATIONMAP(#6,#104);\n\
    #104=IFCSHAPEREPRESENTATION(#5,'Body','AdvancedSweptSolid',(#105));\n#105=IFCSWEPTDISKSOLID(#106,100.,$,$,$);\n\
    #106=IFCPOLYLINE((#7,#107));\n#107=IFCCARTESIANPOINT((0.,0.,4000.));\n\
    #110=IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,#7,0.5,$);\n";

/// From a place to a curve, metres.
type Distance = fn(DVec3) -> f64;

/// Triangles of an object, in the file's coordinates (metres, +Y up).
fn corners<'s>(scene: &'s Scene, object: &Object) -> impl Iterator<Item = [DVec3; 3]> + 's {
    object.triangles.clone().map(|t| scene.corners(t as usize).map(|p| p + scene.origin))
}

fn area(scene: &Scene, object: &Object) -> f64 {
    corners(scene, object).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

#[test]
fn extruded_swept_and_revolved_circles_are_where_they_belong() {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    let of_cylinder = |p: DVec3| (p - dvec3(0.0, p.y, 0.0)).length();
    // In +Y up, the elbow turns from +X downwards, about the origin.
    let of_elbow = |p: DVec3| {
        let [x, y] = [p.x, p.y - 1.0];
        (x.hypot(y) - 0.3).hypot(p.z)
    };
    let cases: [(&str, &str, f64, Distance, f64); 3] = [
        ("cylinder", CYLINDER, 0.1, of_cylinder, TAU * 0.1 * 2.0 + 2.0 * PI * 0.01),
        ("mapped", MAPPED, 0.05, of_cylinder, TAU * 0.05 * 2.0 + 2.0 * PI * 0.0025),
        ("elbow", ELBOW, 0.1, of_elbow, TAU * 0.1 * 0.3 * FRAC_PI_2 + 2.0 * PI * 0.01),
    ];
    for (name, body, radius, from_curve, whole) in cases {
        let scene = read(&file(70, "IFCPIPESEGMENT", &format!("{SHAPE}{body}")));
        assert_eq!(scene.source.notes, ["70 round pipes are tubes, with sides by their radius"], "{name}");
        // One alone is as the reader has it: in the same place, but for the sides.
        let alone = read(&file(1, "IFCPIPESEGMENT", &format!("{SHAPE}{body}")));
        assert!(alone.source.notes.is_empty(), "{name}: {:?}", alone.source.notes);
        let first = scene.objects.iter().filter(|object| object.node == "pipe0");
        let found = Aabb::of(first.flat_map(|object| corners(&scene, object)).flatten());
        let expected = Aabb::of(alone.objects.iter().flat_map(|object| corners(&alone, object)).flatten());
        let off = (found.min - expected.min).abs().max((found.max - expected.max).abs()).max_element();
        assert!(off < 0.05 * radius, "{name}: {found:?}, not {expected:?}");
        for k in 0..70 {
            // A mesh of many triangles is more than one object.
            let of = || scene.objects.iter().filter(|object| object.node == format!("pipe{k}"));
            let found: f64 = of().map(|object| area(&scene, object)).sum();
            assert!((found / whole - 1.0).abs() < 0.01, "{name} {k}: {found} m2 of {whole}");
            let home = dvec3(5.0 * f64::from(k), 0.0, 0.0);
            for p in of().flat_map(|object| corners(&scene, object)).flatten() {
                let off = (from_curve(p - home) - radius).abs();
                assert!(off < 1e-4, "{name} {k}: {} is {off} m off", p - home);
            }
        }
    }
}

/// A few pipes stay as the reader has them, and so do columns, and oblique or square ones.
#[test]
fn what_is_no_pipe_or_hardly_one_stays_a_mesh() {
    let few = read(&file(63, "IFCPIPESEGMENT", &format!("{SHAPE}{CYLINDER}")));
    assert!(few.source.notes.is_empty(), "{:?}", few.source.notes);
    let columns = read(&file(70, "IFCCOLUMN", &format!("{SHAPE}{CYLINDER}")));
    assert!(columns.source.notes.is_empty(), "{:?}", columns.source.notes);
    let oblique = CYLINDER.replace("#103,$,#8,2000.", "#103,$,#107,2000.") + "#107=IFCDIRECTION((0.5,0.,1.));\n";
    let square = CYLINDER.replace("IFCCIRCLEPROFILEDEF(.AREA.,$,$,100.)", "IFCRECTANGLEPROFILEDEF(.AREA.,$,$,100.,50.)");
    for body in [oblique, square] {
        let scene = read(&file(70, "IFCPIPESEGMENT", &format!("{SHAPE}{body}")));
        assert!(scene.objects.len() >= 70 && scene.source.notes.is_empty(), "{:?}", scene.source.notes);
    }
}

#[test]
fn pipes_and_bars_of_real_files_are_tubes() {
    let Some(folder) = data("pipes_and_bars_of_real_files_are_tubes") else { return };
    // 100 pipe segments, 30 fittings with a bend and one with two cylinders; 63 sets of bars, 590 in all.
    for (name, count) in [("hvac_heating", 131), ("rebar_330", 63)] {
        let scene = import(&folder.join("tubes").join(format!("{name}.ifc")), &ImportOptions::default()).unwrap();
        let note = format!("{count} round pipes are tubes, with sides by their radius");
        assert!(scene.source.notes.contains(&note), "{name}: {:?}", scene.source.notes);
    }
}
