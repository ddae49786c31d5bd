//! The plan of a storey as an SVG file.

use crate::building::Building;
use crate::doors::swings::Swing;
use enfilade_measure::pages::plans::Plans;
use enfilade_measure::pages::storeys::Storey;
use std::fmt::Write;

/// The style sheet of the library's plans and of the doors' swings, on white paper. `tN` are cells.
const STYLE: &str = "<style>svg{background:#fff;font-family:'DejaVu Sans',sans-serif}path{fill:none}\
.wall,.thing{stroke-linecap:round}\
.t0{fill:#cfe0f3}.t1{fill:#f6dfc4}.t2{fill:#d3ead2}.t3{fill:#ecd5e6}.t4{fill:#f4ecbb}.t5{fill:#cfe9e8}.t6{fill:#e3dcf3}\
.wall{stroke:#33363d;stroke-width:1.1}.thing{stroke:#aeb0b5;stroke-width:0.6}\
.portal{stroke-width:3.2}.lying{stroke-width:1.3;stroke-dasharray:5 4}\
.door{stroke:#c2460b}.window{stroke:#1f7fd6}.opening{stroke:#2a8f52}\
.axis{stroke:#5d6068;stroke-width:1}.swing{stroke:#c2460b;stroke-width:0.9}\
text{fill:#5d6068;font-size:13px}.name{fill:#1c1d20;font-weight:600;text-anchor:middle}</style>\n";

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
        drawn.insert_str(end + 2, STYLE);
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
