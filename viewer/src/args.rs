//! The command line.

use crate::culling::Oracle;
use crate::draw::tubes::Thin;
use crate::looks::Detail;
use crate::mode::ViewMode;
use crate::settings::TUBE_PIXELS;
use clap::{Parser, ValueEnum};
use enfilade_terrain::Placement;
use std::path::PathBuf;

/// Walk through a building, and see what is not drawn
#[derive(Parser, Clone, Debug)]
#[command(name = "enfilade-viewer", version, about)]
pub struct Args {
    /// A .pvs file, or a model, baked if it has no .pvs file beside it [default: a start screen to choose one]
    #[arg(value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// The model of a .pvs file [default: of the same name, beside it]
    #[arg(long, value_name = "INPUT")]
    pub model: Option<PathBuf>,
    /// Draw one frame into a picture, without a window
    #[arg(long, value_name = "OUT.png", group = "pictures")]
    pub shot: Option<PathBuf>,
    /// Time the frames of a path in every mode, or in that of --mode, without a window: a JSON line each
    #[arg(long, conflicts_with = "shot", group = "pictures")]
    pub bench: bool,
    /// A camera path, as for `enfilade walk`; a window plays it [default: a path through every cell, without a window]
    #[arg(long, value_name = "P.json")]
    pub path: Option<PathBuf>,
    /// Draw the first view of a new visit instead of a frame of a path
    #[arg(long, requires = "shot", conflicts_with_all = ["path", "frame", "freeze"])]
    pub start: bool,
    /// Frame of the path, from 0
    #[arg(long, value_name = "N", default_value_t = 0, requires = "shot")]
    pub frame: usize,
    /// Width and height of the picture or the window, pixels
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<[u32; 2]>,
    /// Culling mode.
    #[arg(long, value_name = "M", help = format!("Culling mode: {}", ViewMode::ALL.map(ViewMode::name).join(", ")), value_parser = |m: &str| m.parse::<ViewMode>())]
    pub mode: Option<ViewMode>,
    /// How to draw: plain, in flat colours; full, as it looks; or smooth, with four samples a pixel [default: full; plain for --bench]
    #[arg(long, value_enum, value_name = "DETAIL")]
    pub detail: Option<Detail>,
    /// The engine for occlusion queries [default: the device, but software if the driver is software]
    #[arg(long, value_enum)]
    pub oracle: Option<OracleArg>,
    /// Compare every frame with a picture of everything; with --shot or --bench, exit with 1 if pixels are missed
    #[arg(long)]
    pub alarm: bool,
    /// Layers over the picture of --shot, separated by commas
    #[arg(long, value_enum, value_delimiter = ',', requires = "shot")]
    pub show: Vec<Shown>,
    /// Ground around the building, from `enfilade ground`
    #[arg(long, value_name = "X.ground", requires = "file")]
    pub ground: Option<PathBuf>,
    /// Position of the building's origin: metres east, up and south of the ground's middle; degrees to the left [default: on the middle]
    #[arg(long, value_name = "X,Y,Z,DEGREES", allow_hyphen_values = true, requires = "ground")]
    pub place: Option<Placement>,
    /// Error limit of tubes, 0.1 to 4 pixels, with --shot or --bench [default: 0.5]
    #[arg(long, value_name = "PIXELS", value_parser = pixels, requires = "pictures")]
    pub tube_pixels: Option<f64>,
    /// Tubes thinner than a pixel, with --shot or --bench: as they are, a pixel wide by their weight, or two pixels wide [default: weighed;
    /// wide where a model has nothing but tubes]
    #[arg(long, value_enum, requires = "pictures")]
    pub thin_tubes: Option<Thin>,
    /// Leave out objects whose boxes cover fewer than N pixels, with --shot or --bench
    #[arg(long, value_name = "N", default_value_t = 0, requires = "pictures")]
    pub min_pixels: u32,
    /// For tests: time passes in steps, each after a key or a button
    #[arg(long, hide = true, conflicts_with_all = ["shot", "bench"])]
    pub steps: bool,
    /// Cull with the camera of this frame of the path, and draw with that of --frame
    #[arg(long, value_name = "N", requires = "shot")]
    pub freeze: Option<usize>,
}

/// See [`Oracle`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum OracleArg {
    /// Queries of the graphics device.
    Device,
    /// A depth buffer on the processor.
    Software,
}

impl From<OracleArg> for Oracle {
    fn from(asked: OracleArg) -> Self {
        match asked {
            OracleArg::Device => Self::Device,
            OracleArg::Software => Self::Software,
        }
    }
}

/// Something over the picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Shown {
    /// Objects in the colours of their cells.
    Cells,
    /// Outlines of portals.
    Portals,
    /// Screen rectangles of portals.
    Rectangles,
    /// The plan of the storey.
    Plan,
    /// The visibility matrix.
    Matrix,
    /// Graphs of frame costs.
    Graphs,
    /// The keys.
    Keys,
    /// Colours of triangles: seen, drawn in vain, culled.
    Waste,
    /// The view culled by the frustum alone in the right half.
    Split,
    /// The profile of the path.
    Profile,
    /// How often objects are seen on the path.
    Heat,
    /// A mirror on the wall that the camera looks at.
    Mirror,
    /// Why the camera's cell sees the object in the middle of the picture.
    Why,
    /// A level section a little above the camera.
    Section,
    /// Names of rooms in the scene.
    Names,
    /// People that walk about.
    People,
    /// Tiles of the ground.
    Ground,
    /// Sides of tubes.
    Tubes,
}

fn pixels(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|n| (TUBE_PIXELS.least..=TUBE_PIXELS.most).contains(n));
    number.ok_or_else(|| format!("give {} to {}", TUBE_PIXELS.least, TUBE_PIXELS.most))
}

/// Largest side of a picture, pixels.
const LARGEST: u32 = 8192;

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |s: &str| s.parse().ok().filter(|n| (1..=LARGEST).contains(n));
    let sides = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| format!("give WIDTHxHEIGHT, each 1 to {LARGEST}"))
}
