//! The plan of a storey as an SVG file.

use crate::building::Building;
use enfilade::pages::storeys::{Plans, Storey};

/// What the classes of the library's plans look like on white paper.
const STYLE: &str = "<style>svg{background:#fff;font-family:'DejaVu Sans',sans-serif}\
.cell{stroke:none}.t0{fill:#cfe0f3}.t1{fill:#f6dfc4}.t2{fill:#d3ead2}.t3{fill:#ecd5e6}.t4{fill:#f4ecbb}.t5{fill:#cfe9e8}.t6{fill:#e3dcf3}\
.wall,.thing,.portal,.axis{fill:none}.wall{stroke:#33363d;stroke-width:1.1;stroke-linecap:round}\
.thing{stroke:#8b8e96;stroke-width:.6;opacity:.7}.portal{stroke-width:3.2}.lying{stroke-width:1.3;stroke-dasharray:5 4}\
.door{stroke:#c2460b}.window{stroke:#1f7fd6}.opening{stroke:#2a8f52}.axis{stroke:#5d6068}\
text{fill:#5d6068;font-size:13px}.name{fill:#1c1d20;font-weight:600;text-anchor:middle}</style>\n";

/// A storey as a whole SVG file. `of`: all storeys, which lie over each other at one scale.
pub fn svg(building: &Building, of: &[Storey], storey: usize) -> String {
    let (scene, file) = (&building.scene, &building.file);
    let title = format!("{}, plan at {:.2} m", scene.name, of[storey].floor + file.origin.y);
    let note = |cell: enfilade::CellId| file.cells[cell.index()].name.clone();
    let drawn = Plans::new(file, scene, of).svg(&of[storey], &title, &note);
    // In a page the style is the page's, and the name space is known.
    let drawn = drawn.replacen("<svg ", "<svg xmlns=\"http://www.w3.org/2000/svg\" ", 1);
    match drawn.find(">\n") {
        Some(end) => format!("{}\n{STYLE}{}", &drawn[..=end], &drawn[end + 2..]),
        None => drawn,
    }
}
