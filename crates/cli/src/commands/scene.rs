//! Flags for buildings: import, cells, objects, rays.

use super::{CliError, at, count};
use clap::ValueEnum;
use enfilade::bake::{BakeError, BakeOptions, ObjectSizes, size_objects};
use enfilade::cells::{CellGraph, SplitOptions, Strategy, read_cells};
use enfilade::job::Job;
use enfilade::scene::{ImportOptions, Scene, split_objects};
use enfilade_formats::indoorgml::read_indoorgml;
use std::path::{Path, PathBuf};

/// Flags of commands that bake.
#[derive(clap::Args)]
pub struct SceneFlags {
    /// The unit of the input: mm, cm, inch, ft, m, km, or metres per unit [default: the format's own]
    #[arg(long, value_name = "METRES", value_parser = unit, help_heading = "Model")]
    pub unit: Option<f64>,
    /// Up axis of OBJ, glTF, PLY and STL [default: y]; other formats define their own
    #[arg(long, value_enum, help_heading = "Model")]
    pub up: Option<UpFlag>,
    /// auto: pipes are tubes if there are many; never: pipes are meshes; METRES: auto, and the radius of lines without one (OBJ, glTF,
    /// GeoJSON)
    #[arg(long, value_name = "auto|never|METRES", value_parser = tubes, default_value = "auto", help_heading = "Model")]
    pub tubes: Tubes,
    #[command(flatten)]
    pub files: super::FilesFlag,
    /// How to find cells; or your own cells and portals, as JSON (like `dump --json`) or IndoorGML. bsp:METRES sets the smallest surface
    /// that splits space
    #[arg(long, value_name = "auto|authored|plan|bsp[:METRES]|leaves|C.json|C.gml", value_parser = cells, default_value = "auto", hide_possible_values = true, help_heading = "Cells")]
    pub cells: Cells,
    /// Close holes narrower than this (cracks, grilles, gaps); objects visible only through them are culled [default: closes none]
    #[arg(long, value_name = "METRES", value_parser = metres, help_heading = "Cells")]
    pub smallest_hole: Option<f64>,
    /// Split meshes into objects of at most N triangles; whole: keep the author's objects [default: the cheapest size, at 16 triangles per
    /// draw call]
    #[arg(long, value_name = "N|whole", value_parser = object_triangles, help_heading = "Cells")]
    pub object_triangles: Option<ObjectTriangles>,
    /// Rays and segments of the whole bake, as 500k or 20M; shafts against triangles come on top, one for five rays [default: 20M; 1G with
    /// --unseen]
    #[arg(long, value_name = "COUNT", value_parser = count::parse, help_heading = "Rows")]
    pub rays: Option<u64>,
}

/// The up axis.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UpFlag {
    Y,
    Z,
}

/// The treatment of pipes and lines.
#[derive(Clone, Copy, PartialEq)]
pub enum Tubes {
    Auto,
    Never,
    /// As `Auto`, and lines have this radius, metres.
    Radius(f64),
}

/// How to find cells.
#[derive(Clone, PartialEq)]
pub enum Cells {
    Auto,
    Authored,
    Plan,
    /// Surfaces smaller than this, metres, do not split space; `None`: a size that fits the scene.
    Bsp(Option<f64>),
    Leaves,
    File(PathBuf),
}

/// The limit of object sizes.
#[derive(Clone, Copy, PartialEq)]
pub enum ObjectTriangles {
    Whole,
    Most(u32),
}

/// Metres, above 0.
fn metres(text: &str) -> Result<f64, String> {
    let metres = text.parse::<f64>().ok().filter(|&m| m > 0.0 && m.is_finite());
    metres.ok_or_else(|| "takes metres, above 0".into())
}

fn tubes(text: &str) -> Result<Tubes, String> {
    match text {
        "auto" => Ok(Tubes::Auto),
        "never" => Ok(Tubes::Never),
        radius => metres(radius).map(Tubes::Radius).map_err(|_| "takes auto, never, or a radius in metres, above 0".into()),
    }
}

fn cells(text: &str) -> Result<Cells, String> {
    let is_file =
        || Path::new(text).extension().is_some_and(|e| e.eq_ignore_ascii_case("json") || is_indoorgml(Path::new(text)));
    Ok(match text {
        "auto" => Cells::Auto,
        "authored" => Cells::Authored,
        "plan" => Cells::Plan,
        "bsp" => Cells::Bsp(None),
        "leaves" => Cells::Leaves,
        _ if text.starts_with("bsp:") => Cells::Bsp(Some(metres(&text[4..])?)),
        _ if is_file() => Cells::File(text.into()),
        _ => return Err("takes auto, authored, plan, bsp, bsp:METRES, leaves, or a file that ends in .json or .gml".into()),
    })
}

fn object_triangles(text: &str) -> Result<ObjectTriangles, String> {
    let number = || text.parse().ok().filter(|&n| n > 0).map(ObjectTriangles::Most);
    let parsed = if text == "whole" { Some(ObjectTriangles::Whole) } else { number() };
    parsed.ok_or_else(|| "takes a number of triangles, above 0, or whole".into())
}

/// Default number of rays.
pub const RAYS: u64 = 20_000_000;
/// A smaller number above 0 is probably meant in millions.
const FEW: u64 = 1_000;

impl SceneFlags {
    /// Refuses an up axis for formats that define their own; notes a suspiciously small number of rays.
    pub fn check(&self, input: &Path) -> Result<(), CliError> {
        if self.up.is_some() && !enfilade_formats::format_of(input).is_some_and(|format| format.is_up_open) {
            let open = enfilade_formats::FORMATS.iter().filter(|format| format.is_up_open).map(|format| format.name);
            let open = open.collect::<Vec<_>>().join(", ");
            return Err(at(input, format!("--up is for {open}; this format defines its own up axis")));
        }
        if let Some(rays) = self.rays.filter(|rays| (1..FEW).contains(rays)) {
            eprintln!("note: --rays {rays} is {rays} rays; {rays} million are --rays {rays}M");
        }
        Ok(())
    }

    /// The named files.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.cells_file().into_iter().chain(self.files.paths())
    }

    /// How to import.
    pub fn import(&self) -> ImportOptions {
        ImportOptions {
            // Whole until the size is chosen.
            object_triangles: self.most_triangles().unwrap_or(u32::MAX),
            metres_per_unit: self.unit,
            z_up: self.up == Some(UpFlag::Z),
            tube_radius: if let Tubes::Radius(radius) = self.tubes { Some(radius) } else { None },
            tubes: self.tubes != Tubes::Never,
            smallest_hole: self.smallest_hole,
            ..self.files.options()
        }
    }

    /// The scene with objects of the given or the cheapest size, and the sizes tried.
    pub fn sized(
        &self,
        scene: Scene,
        options: &mut BakeOptions,
        work: &Job<'_>,
    ) -> Result<(Scene, Option<ObjectSizes>), BakeError> {
        if self.most_triangles().is_some() {
            return Ok((scene, None));
        }
        let is_whole = self.object_triangles == Some(ObjectTriangles::Whole);
        if !scene.tubes.tubes.is_empty() && !is_whole {
            options.import.object_triangles = ImportOptions::default().object_triangles;
            return Ok((split_objects(scene, options.import.object_triangles), None));
        }
        size_objects(scene, options, is_whole, work)
    }

    /// How to split.
    pub fn split(&self) -> SplitOptions {
        let (strategy, smallest_occluder) = match self.cells {
            Cells::Auto | Cells::File(_) => (None, None),
            Cells::Authored => (Some(Strategy::Authored), None),
            Cells::Plan => (Some(Strategy::Plan), None),
            Cells::Bsp(smallest) => (Some(Strategy::Bsp), smallest),
            Cells::Leaves => (Some(Strategy::Leaves), None),
        };
        SplitOptions { strategy, smallest_occluder, in_metres: self.unit.is_some(), ..SplitOptions::default() }
    }

    fn most_triangles(&self) -> Option<u32> {
        if let Some(ObjectTriangles::Most(n)) = self.object_triangles { Some(n) } else { None }
    }

    fn cells_file(&self) -> Option<&PathBuf> {
        if let Cells::File(path) = &self.cells { Some(path) } else { None }
    }

    /// The user's own cells and portals. IndoorGML has them too, unless --cells is given.
    pub fn given(&self, input: &Path, scene: &Scene) -> Result<Option<CellGraph>, CliError> {
        let ready = (is_indoorgml(input) && self.cells == Cells::Auto).then_some(input);
        self.cells_file().map(PathBuf::as_path).or(ready).map(|path| cells_file(path, scene)).transpose()
    }

    /// Flags that differ from the default, as on a command line; `name` shortens a path.
    pub fn given_again(&self, name: &dyn Fn(&Path) -> String) -> Vec<(&'static str, String)> {
        let mut flags = Vec::new();
        let cells = match &self.cells {
            Cells::Auto => None,
            Cells::Authored => Some("authored".to_owned()),
            Cells::Plan => Some("plan".to_owned()),
            Cells::Bsp(None) => Some("bsp".to_owned()),
            Cells::Bsp(Some(metres)) => Some(format!("bsp:{metres}")),
            Cells::Leaves => Some("leaves".to_owned()),
            Cells::File(path) => Some(name(path)),
        };
        flags.extend(cells.map(|v| ("--cells", v)));
        flags.extend(self.smallest_hole.map(|v| ("--smallest-hole", v.to_string())));
        flags.extend(self.rays.map(|rays| ("--rays", count::text(rays))));
        let triangles = self.object_triangles.map(|size| match size {
            ObjectTriangles::Whole => "whole".to_owned(),
            ObjectTriangles::Most(n) => n.to_string(),
        });
        flags.extend(triangles.map(|v| ("--object-triangles", v)));
        flags.extend(self.unit.map(|v| ("--unit", v.to_string())));
        let up = self.up.and_then(|up| up.to_possible_value());
        flags.extend(up.map(|v| ("--up", v.get_name().to_owned())));
        let tubes = match self.tubes {
            Tubes::Auto => None,
            Tubes::Never => Some("never".to_owned()),
            Tubes::Radius(metres) => Some(metres.to_string()),
        };
        flags.extend(tubes.map(|v| ("--tubes", v)));
        flags.extend(self.files.files_under.as_deref().map(|path| ("--files-under", name(path))));
        flags
    }
}

/// Metres per unit, from a number or a name.
fn unit(text: &str) -> Result<f64, String> {
    let metres = match text {
        "mm" => 1e-3,
        "cm" => 1e-2,
        "in" | "inch" => 0.0254,
        "ft" => 0.3048,
        "m" => 1.0,
        "km" => 1e3,
        number => number.parse().unwrap_or(0.0),
    };
    let is_sound = metres > 0.0 && f64::is_finite(metres);
    is_sound.then_some(metres).ok_or_else(|| "takes mm, cm, inch, ft, m, km, or metres per unit, above 0".into())
}

fn cells_file(path: &Path, scene: &Scene) -> Result<CellGraph, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| at(path, e))?;
    let graph = if is_indoorgml(path) { read_indoorgml(&text, scene) } else { read_cells(&text, scene) };
    graph.map_err(|e| at(path, e))
}

fn is_indoorgml(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gml"))
}
