//! The plan of a storey as an SVG file.

use crate::building::Building;
use crate::doors::swings::Swing;
use enfilade_measure::pages::storeys::{Plans, Storey};
use std::fmt::Write;

/// What one class of the library's plans, or of this one, looks like on white paper; of several classes, the later ones decide.
pub struct Look {
    /// Its name.
    pub class: &'static str,
    /// Red, green and blue of what is inside.
    pub fill: Option<[u8; 3]>,
    /// Of lines.
    pub stroke: Option<[u8; 3]>,
    /// Of lines, in the units of the SVG.
    pub width: Option<f32>,
    /// Lengths of dashes and of the gaps between them.
    pub dashes: Option<[f32; 2]>,
}

const fn filled(class: &'static str, fill: [u8; 3]) -> Look {
    Look { class, fill: Some(fill), stroke: None, width: None, dashes: None }
}

const fn drawn(class: &'static str, stroke: Option<[u8; 3]>, width: Option<f32>, dashes: Option<[f32; 2]>) -> Look {
    Look { class, fill: None, stroke, width, dashes }
}

/// All of them.
pub const LOOKS: [Look; 16] = [
    filled("t0", [0xcf, 0xe0, 0xf3]),
    filled("t1", [0xf6, 0xdf, 0xc4]),
    filled("t2", [0xd3, 0xea, 0xd2]),
    filled("t3", [0xec, 0xd5, 0xe6]),
    filled("t4", [0xf4, 0xec, 0xbb]),
    filled("t5", [0xcf, 0xe9, 0xe8]),
    filled("t6", [0xe3, 0xdc, 0xf3]),
    drawn("wall", Some([0x33, 0x36, 0x3d]), Some(1.1), None),
    drawn("thing", Some([0xae, 0xb0, 0xb5]), Some(0.6), None),
    drawn("portal", None, Some(3.2), None),
    drawn("lying", None, Some(1.3), Some([5.0, 4.0])),
    drawn("door", Some([0xc2, 0x46, 0x0b]), None, None),
    drawn("window", Some([0x1f, 0x7f, 0xd6]), None, None),
    drawn("opening", Some([0x2a, 0x8f, 0x52]), None, None),
    drawn("axis", Some([0x5d, 0x60, 0x68]), Some(1.0), None),
    drawn("swing", Some([0xc2, 0x46, 0x0b]), Some(0.9), None),
];
/// Of text: names of cells, and the scale.
pub const INKS: [[u8; 3]; 2] = [[0x1c, 0x1d, 0x20], [0x5d, 0x60, 0x68]];
/// Size of text where none is given, in the units of the SVG.
pub const TEXT: f32 = 13.0;

/// The style sheet of all that.
fn style() -> String {
    let hex = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    let mut sheet = "<style>svg{background:#fff;font-family:'DejaVu Sans',sans-serif}path{fill:none}".to_owned();
    sheet.push_str(".wall,.thing{stroke-linecap:round}");
    for Look { class, fill, stroke, width, dashes } in &LOOKS {
        let _ = write!(sheet, ".{class}{{");
        let parts = [
            fill.map(|c| format!("fill:{}", hex(c))),
            stroke.map(|c| format!("stroke:{}", hex(c))),
            width.map(|w| format!("stroke-width:{w}")),
            dashes.map(|[a, b]| format!("stroke-dasharray:{a} {b}")),
        ];
        sheet.push_str(&parts.into_iter().flatten().collect::<Vec<_>>().join(";"));
        sheet.push('}');
    }
    let [name, scale] = INKS.map(hex);
    let _ = writeln!(
        sheet,
        "text{{fill:{scale};font-size:{TEXT}px}}.name{{fill:{name};font-weight:600;text-anchor:middle}}</style>"
    );
    sheet
}

/// A storey as a whole SVG file. `of`: all storeys, which lie over each other at one scale.
pub fn svg(building: &Building, of: &[Storey], swings: &[Swing], storey: usize) -> String {
    let (scene, file) = (&building.scene, &building.file);
    let title = format!("{}, plan at {:.2} m", scene.name, of[storey].floor + file.origin.y);
    let note = |cell: enfilade::CellId| file.cells[cell.index()].name.clone();
    let plans = Plans::new(file, scene, of);
    let drawn = plans.svg(&of[storey], &title, &note);
    // In a page the style is the page's, and the name space is known.
    let mut drawn = drawn.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1);
    if let Some(end) = drawn.find(">\n") {
        drawn.insert_str(end + 2, &style());
    }
    if let Some(end) = drawn.rfind("</svg>") {
        drawn.insert_str(end, &arcs(&plans, swings, &of[storey]));
    }
    drawn
}

/// How the doors of a storey swing.
fn arcs(plans: &Plans<'_>, swings: &[Swing], storey: &Storey) -> String {
    let mut path = String::new();
    for swing in swings.iter().filter(|swing| swing.is_on(storey)) {
        for (i, p) in swing.line.iter().enumerate() {
            let p = plans.at(*p);
            let _ = write!(path, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, p.x, p.y);
        }
    }
    if path.is_empty() { path } else { format!("<path class=\"swing\" d=\"{path}\"/>\n") }
}
