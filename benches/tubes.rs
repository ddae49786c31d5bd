//! Sections from points on one thread, over pipes of 20,000 to 5.12 million sections: racks with elbows, risers and coils as `generate pipes`
//! makes them, of which the largest has as many as the largest scene of the studies of tubes.
//!
//! Before any time counts, there are as many tubes and sections as the generator knows of, and each tube begins and ends where its line does.
//! Printed are seconds, the fastest of several runs, nanoseconds a section, and the exponent of growth between neighbours: 1 is linear.
//! `--test` takes the smallest alone.

use enfilade_scenes::{Kind, generate};
use enfilade_tubes::{Counts, Shape, Tubes, usual_error};
use glam::{DVec3, Vec3};
use serde_json::Value;
use testing::glb::parts;
use testing::times::{growth, is_told, least};

const SIZES: [usize; 3] = [20_000, 320_000, 5_120_000];
const RUNS: usize = 3;
/// Metres: what single precision of places within a pipe, and of the file's points, may take.
const ROUNDING: f64 = 1e-4;

fn main() {
    let sizes = if is_told("--test") { &SIZES[..1] } else { &SIZES[..] };
    let mut before = None;
    for &size in sizes {
        let made = generate(Kind::Pipes { sections: size }, 1).expect("pipes");
        let [counted, pipes] = ["sections", "pipes"].map(|key| made.expected[key].as_u64().expect("a number") as usize);
        let lines = lines(&made.glb);
        drop(made);
        assert_eq!(lines.len(), pipes);
        let tubes = tubes(&lines);
        // Single precision of the file's points may make a bend one section more.
        let divided = tubes.divided().sections.len();
        assert!(divided.abs_diff(counted) <= 1 + counted / 1000, "{divided} sections, not {counted}");
        assert_ends(&lines, &tubes);
        let seconds = least(RUNS, || self::tubes(&lines)).as_secs_f64();
        let count = tubes.sections.len() as f64;
        let growth = growth(&mut before, count, seconds);
        let points: usize = lines.iter().map(|line| line.points.len()).sum();
        let nanoseconds = 1e9 * seconds / count;
        println!("{pipes} lines of {points} points: {count} sections in {seconds:.3} s, {nanoseconds:.0} ns each{growth}");
    }
}

struct Line {
    points: Vec<DVec3>,
    radius: f64,
    smooth: bool,
}

fn tubes(lines: &[Line]) -> Tubes {
    let (mut tubes, mut counts) = (Tubes::default(), Counts::default());
    for Line { points, radius, smooth } in lines {
        let (shape, error) = (Shape { radius: *radius, inner: 0.0, capped: true }, usual_error(*radius));
        let made = match smooth {
            true => tubes.through(points, false, shape, error, &mut counts),
            false => tubes.line(points, false, shape, error, &mut counts),
        };
        made.expect("a line");
    }
    assert_eq!(counts, Counts::default());
    tubes
}

/// No line of these turns back, so each has one tube.
fn assert_ends(lines: &[Line], tubes: &Tubes) {
    assert_eq!(lines.len(), tubes.tubes.len());
    for (line, tube) in lines.iter().zip(&tubes.tubes) {
        let sections = tubes.of(tube);
        let place = |i: usize| tube.origin + Vec3::from(sections[i].place).as_dvec3();
        for (found, expected) in
            [(place(0), line.points[0]), (place(sections.len() - 1), line.points[line.points.len() - 1])]
        {
            assert!(found.distance(expected) < ROUNDING, "{found}, not {expected}");
        }
    }
}

/// The lines of a generated file with their radii.
fn lines(glb: &[u8]) -> Vec<Line> {
    let (document, bytes) = parts(glb);
    let number = |value: &Value| value.as_u64().unwrap_or(0) as usize;
    let tubes = document["nodes"].as_array().expect("nodes").iter().filter_map(|node| {
        let tube = &node["extras"]["enfilade"]["tube"];
        Some((node, tube, tube["radius"].as_f64()?))
    });
    let line = |(node, tube, radius): (&Value, &Value, f64)| {
        let primitive = &document["meshes"][number(&node["mesh"])]["primitives"][0];
        let accessor = &document["accessors"][number(&primitive["attributes"]["POSITION"])];
        let from = number(&accessor["byteOffset"]);
        let floats = bytes[from..from + 12 * number(&accessor["count"])].as_chunks::<4>().0;
        let at = DVec3::from(std::array::from_fn(|k| node["translation"][k].as_f64().unwrap_or(0.0)));
        let point = |p: &[[u8; 4]; 3]| at + Vec3::from(p.map(f32::from_le_bytes)).as_dvec3();
        let points = floats.as_chunks::<3>().0.iter().map(point).collect();
        Line { points, radius, smooth: tube["smooth"].as_bool().unwrap_or(false) }
    };
    tubes.map(line).collect()
}
