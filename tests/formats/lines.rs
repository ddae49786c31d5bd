//! Lines of geographic systems: names, places and radii of tubes, and files that are refused with one line.

use enfilade::math::geom::Aabb;
use enfilade::scene::{ImportOptions, Object, Role, Scene};
use enfilade_formats::geojson;
use enfilade_tubes::{Tube, usual_sides};
use glam::{DVec3, dvec3};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};
use testing::meshes::area_of_all;

fn read(file: &Value) -> Result<Scene, String> {
    geojson::from_slice(file.to_string().as_bytes(), "mains", &ImportOptions::default()).map_err(|e| e.to_string())
}

fn feature(properties: Value, coordinates: Value) -> Value {
    json!({"type": "Feature", "properties": properties, "geometry": {"type": "LineString", "coordinates": coordinates}})
}

/// A line to the east and one to the north: the tubes' boxes are known.
#[test]
fn lines_become_tubes_where_they_are() {
    let file = json!({"type": "FeatureCollection", "features": [
        feature(json!({"name": "main", "radius": 0.5}), json!([[1000.0, 2000.0, 10.0], [1020.0, 2000.0, 10.0]])),
        feature(json!({"id": 12, "diameter": 0.5}), json!([[1020.0, 2000.0, 10.0], [1020.0, 2010.0, 10.0]])),
        {"type": "Feature", "geometry": {"type": "Point", "coordinates": [0, 0]}},
    ]});
    let scene = read(&file).unwrap();
    let names: Vec<&str> = scene.objects.iter().map(|o| o.node.as_str()).collect();
    assert_eq!(names, ["main", "12"]);
    assert!(scene.objects.iter().all(|o| o.opaque && o.role == Role::Furnishing));
    // East is +X, north is -Z, up is +Y.
    let near = |found: DVec3, x: f64, y: f64, z: f64| found.distance(dvec3(x, y, z)) < 0.02;
    let meshed = scene.clone().meshed(usual_sides);
    let corners = |o: &Object| o.triangles.clone().flat_map(|t| meshed.corners(t as usize)).collect::<Vec<_>>();
    let [main, branch] = [0, 1].map(|k| Aabb::of(corners(&meshed.objects[k])));
    assert!(near(main.min + scene.origin, 1000.0, 9.5, -2000.5) && near(main.max + scene.origin, 1020.0, 10.5, -1999.5));
    assert!(
        near(branch.min + scene.origin, 1019.75, 9.75, -2010.0) && near(branch.max + scene.origin, 1020.25, 10.25, -2000.0)
    );
    assert_eq!(scene.source.notes, ["2 lines became tubes of 4 sections", "1 features left out: only lines become tubes"]);

    // Feet: everything is smaller, radii too.
    let feet = ImportOptions { metres_per_unit: Some(0.3048), ..ImportOptions::default() };
    let small = geojson::from_slice(file.to_string().as_bytes(), "mains", &feet).unwrap();
    let [small, whole] = [small.meshed(|_| 32), scene.meshed(|_| 32)].map(|s| Aabb::of(s.positions).size());
    assert!((small / whole - 0.3048).abs().max_element() < 1e-3, "{small} of {whole}");
}

/// Pipes along streets aren't one object each: none is longer than 50 m, and together they are the pipes. What a bake sees holds them, and
/// is no larger by more than a diameter.
#[test]
fn long_pipes_are_several_objects() {
    let street =
        |k: u32| feature(json!({"id": k, "radius": 0.5}), json!([[1000, 10 * k], [1090, 10 * k], [1090, 10 * k + 5]]));
    let file = json!({"type": "FeatureCollection", "features": (0..20).map(street).collect::<Vec<_>>()});
    let scene = read(&file).unwrap();
    assert!(scene.objects.iter().all(|o| o.is_tube()));
    let longest = scene.objects.iter().map(|o| o.bounds.size().max_element()).fold(0.0, f64::max);
    assert!(scene.objects.len() >= 40 && longest < 51.5, "{} objects, the longest {longest} m", scene.objects.len());
    let mut in_objects: Vec<u32> = scene.objects.iter().flat_map(|o| o.segments.clone()).collect();
    let all: Vec<u32> = scene.tubes.tubes.iter().flat_map(|tube| tube.segments()).collect();
    in_objects.retain(|i| all.binary_search(i).is_ok());
    assert_eq!(in_objects, all, "a segment is in no object, or in two");

    let whole = scene.clone().meshed(|_| 64);
    let area = area_of_all(&whole);
    // Two lines and a quarter of a circle of 0.5 m; two ends.
    let expected = 20.0 * (TAU * 0.5 * (89.5 + 4.5 + 0.25 * PI) + TAU * 0.25);
    assert!((area / expected - 1.0).abs() < 2e-3, "{area} m2, not {expected}");
    for (around, object) in scene.objects.iter().zip(&whole.objects) {
        let of = Aabb::of(object.triangles.clone().flat_map(|t| whole.corners(t as usize)));
        let around = around.bounds;
        assert!(of.min.cmpge(around.min).all() && of.max.cmple(around.max).all(), "{around:?} does not hold {of:?}");
        assert!((around.size() - of.size()).max_element() < 1.0, "{around:?} for {of:?}");
    }
    // As meshes, on request.
    let options = ImportOptions { tubes: false, ..ImportOptions::default() };
    let meshes = geojson::from_slice(file.to_string().as_bytes(), "mains", &options).unwrap();
    assert!(meshes.tubes.tubes.is_empty() && meshes.objects.iter().all(|o| !o.is_tube()));
}

/// A radius for all lines that have none.
#[test]
fn lines_without_a_radius_get_the_one_that_is_given() {
    let options = ImportOptions { tube_radius: Some(0.5), metres_per_unit: Some(0.3048), ..ImportOptions::default() };
    let file = feature(json!({}), json!([[5000, 0], [5100, 0]]));
    let scene = geojson::from_slice(file.to_string().as_bytes(), "mains", &options).unwrap();
    let size = Aabb::of(scene.positions).size();
    assert!(size.distance(dvec3(30.48, 1.0, 1.0)) < 0.02, "{size}");
}

/// Visibility depends on tubes, so a model with others is another one.
#[test]
fn other_tubes_are_another_model() {
    let model = |radius: f64, end: f64| {
        let line = |k: u32| feature(json!({"radius": radius}), json!([[500, 10 * k], [end, 10 * k]]));
        let scene = read(&json!({"type": "FeatureCollection", "features": (0..70).map(line).collect::<Vec<_>>()})).unwrap();
        assert_eq!(scene.tubes.tubes.len(), 70);
        scene
    };
    let hash = |radius: f64, end: f64| model(radius, end).hash();
    assert_eq!(hash(0.5, 510.0), hash(0.5, 510.0));
    assert!(hash(0.5, 510.0) != hash(0.5005, 510.0) && hash(0.5, 510.0) != hash(0.5, 510.01));
    // What prisms don't show.
    let one = model(0.5, 510.0);
    let changes: [fn(&mut Tube); 4] =
        [|tube| tube.capped = false, |tube| tube.inner = 0.5, |tube| tube.error *= 2.0, |tube| tube.origin.x += 1e-9];
    for change in changes {
        let mut other = one.clone();
        change(&mut other.tubes.tubes[33]);
        assert!(other.hash() != one.hash());
    }
}

#[test]
fn what_is_odd_is_told() {
    let file = feature(json!({"radius": 0.5}), json!([[500, 0], [500, 0], [520, 0], [510, 0]]));
    let notes = read(&file).unwrap().source.notes;
    let expected = [
        "1 lines became tubes of 4 sections",
        "1 points repeat the one before them",
        "1 reversals: a tube ends there and another begins",
    ];
    assert_eq!(notes, expected);
}

/// Lines without two different points are left out beside others, and counted; what is odd about them isn't counted again.
#[test]
fn lines_of_no_length_are_left_out() {
    let line = |points: Value| feature(json!({"radius": 0.5}), points);
    let dot = json!([[500, 0], [500, 0], [500, 0]]);
    let all = [line(dot.clone()), line(json!([[500, 0], [520, 0]])), line(json!([])), line(json!([[7, 7]]))];
    let scene = read(&json!({"type": "FeatureCollection", "features": all})).unwrap();
    assert_eq!(scene.source.notes, ["1 lines became tubes of 2 sections", "3 lines without two distinct points left out"]);
    assert_eq!(scene.objects.len(), 1);
    // The first place is told where there is nothing else.
    let none = json!({"type": "FeatureCollection", "features": [line(dot), line(json!([]))]});
    assert_eq!(read(&none).unwrap_err(), "features[0].geometry.coordinates: fewer than two different points");
}

/// In numbers that JSON allows, in numbers that options give, and where there are too many.
#[test]
fn bad_numbers_and_too_many_sections_are_refused() {
    let line = |end: Value| feature(json!({"radius": 1}), json!([[500, 0], [500, end]]));
    let refused = |file: &str, options: &ImportOptions| {
        geojson::from_slice(file.as_bytes(), "mains", options).unwrap_err().to_string()
    };
    let usual = ImportOptions::default();
    // JSON has no numbers that aren't finite; one that is too large is none either.
    for (number, told) in [("1e999", "line 1: number out of range"), ("NaN", "line 1: expected value")] {
        let error = refused(&line(json!("X")).to_string().replace("\"X\"", number), &usual);
        assert!(error.starts_with(told), "{error}");
    }
    let none = feature(json!({}), json!([[500, 0], [510, 0]])).to_string();
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e5] {
        let error = refused(&none, &ImportOptions { tube_radius: Some(radius), ..usual.clone() });
        assert!(error.starts_with(&format!("geometry.coordinates: a radius of {radius} m: it must be")), "{error}");
    }
    let zigzag: Vec<Value> = (0..200).map(|k| json!([500 + k, 10 * (k % 2)])).collect();
    let zigzag = feature(json!({"radius": 0.1}), json!(zigzag)).to_string();
    let few = |tubes: bool| ImportOptions { max_triangles: 300, tubes, ..usual.clone() };
    for tubes in [true, false] {
        assert_eq!(refused(&zigzag, &few(tubes)), "more than 300 triangles; raise the limit or split the model");
    }
}

#[test]
fn files_that_make_no_tubes_are_refused_with_the_place() {
    let line = json!([[500, 0], [510, 0]]);
    let with = |properties: Value| json!({"type": "FeatureCollection", "features": [feature(properties, line.clone())]});
    let refused = |file: &Value| read(file).unwrap_err();
    let place = "features[0].geometry.coordinates";
    let no_radius = "no radius; give the feature a property \"radius\" or \"diameter\", in the file's unit of length, or give all lines --tubes METRES";
    assert_eq!(refused(&with(json!({"colour": "red"}))), format!("{place}: {no_radius}"));
    for (radius, told) in [(0.0, "0"), (-2.5, "-2.5")] {
        let error = refused(&with(json!({"radius": radius})));
        assert!(error.starts_with(&format!("{place}: a radius of {told} m: it must be")), "{error}");
    }
    let one = feature(json!({"radius": 1}), json!([[500, 0], [500, 0]]));
    assert_eq!(refused(&one), "geometry.coordinates: fewer than two different points");
    let words = feature(json!({"radius": 1}), json!([[500, 0], [500, "x"]]));
    assert_eq!(refused(&words), "geometry.coordinates[1]: not a position: two or three numbers");
    let far = feature(json!({"radius": 1}), json!([[500, 0], [1e13, 0]]));
    assert_eq!(refused(&far), "geometry.coordinates: a coordinate that is not finite, or beyond 1e12 m");
    let degrees = feature(json!({"radius": 1}), json!([[12.5, 48.1], [12.6, 48.2]]));
    let error = refused(&degrees);
    assert!(error.starts_with("a file with coordinates in degrees is not supported; project it"), "{error}");
    let mut named = degrees.clone();
    named["crs"] = json!({"type": "name", "properties": {"name": "EPSG:32632"}});
    assert!(read(&named).is_ok(), "a file that names its system has no degrees");
    let points = json!({"type": "Point", "coordinates": [500, 0]});
    assert_eq!(refused(&points), "no lines: only LineString and MultiLineString make tubes");
    assert_eq!(refused(&json!({"type": "Circle"})), "type: not a type of GeoJSON");
    let empty = geojson::from_slice(b"", "mains", &ImportOptions::default()).unwrap_err().to_string();
    assert_eq!(empty, "line 1: the file is empty");
    let cut = geojson::from_slice(b"{\"type\":\n\"Point", "mains", &ImportOptions::default()).unwrap_err().to_string();
    assert!(cut.starts_with("line 2: EOF while parsing a string"), "{cut}");
}
