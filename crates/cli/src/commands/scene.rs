//! Buildings as commands take them: how to import one, how to split it, how many rays to spend.

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
    /// How to find cells
    #[arg(long, value_enum, default_value = "auto")]
    pub cells: CellsFlag,
    /// Surfaces smaller than this make no cells, for --cells bsp [default: what fits the scene]
    #[arg(long, value_name = "METRES")]
    pub smallest_occluder: Option<f64>,
    /// Holes narrower than this are closed: cracks, grilles, gaps; what shows only through them is culled [default: none is closed]
    #[arg(long, value_name = "METRES")]
    pub smallest_hole: Option<f64>,
    /// Cells and portals of your own: in the form that `dump --json` writes, or IndoorGML (.gml)
    #[arg(long, value_name = "C.json|C.gml", conflicts_with = "cells")]
    pub cells_file: Option<PathBuf>,
    /// Rays that sampling may cast, as 500k or 20M: a count and not a time, so that the bytes don't depend on the machine [default: 20M]
    #[arg(long, value_name = "COUNT", value_parser = count::parse)]
    pub rays: Option<u64>,
    /// Most triangles of an object; larger meshes are split [default: what draws least, with a draw call counted as 16 triangles]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub object_triangles: Option<u32>,
    /// Objects stay as their author made them; a note says what splitting would save
    #[arg(long, conflicts_with = "object_triangles")]
    pub whole: bool,
    /// The unit of the input: mm, cm, inch, ft, m, km, or metres in a unit [default: the format's own]
    #[arg(long, value_name = "METRES", value_parser = unit)]
    pub unit: Option<f64>,
    /// The axis that is up in the input, for OBJ, glTF, PLY and STL [default: y]; other formats say it themselves
    #[arg(long, value_enum)]
    pub up: Option<UpFlag>,
    /// Radius of tubes along lines that have none of their own (OBJ, glTF, GeoJSON) [default: OBJ and glTF: left out; GeoJSON: refused]
    #[arg(long, value_name = "METRES")]
    pub tube_radius: Option<f64>,
    /// Whether pipes are tubes, where there are many, or meshes
    #[arg(long, value_enum, default_value = "auto")]
    pub tubes: TubesFlag,
    #[command(flatten)]
    pub files: super::FilesFlag,
}

/// The axis that is up.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UpFlag {
    Y,
    Z,
}

/// What pipes are.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TubesFlag {
    Auto,
    Never,
}

/// How to find cells.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CellsFlag {
    Auto,
    Authored,
    Plan,
    Bsp,
    #[value(alias = "brushes")]
    Leaves,
}

/// Rays where nothing is said.
pub const RAYS: u64 = 20_000_000;
/// Fewer rays than this, and more than none, are mostly meant as millions.
const FEW: u64 = 1_000;

impl SceneFlags {
    /// Refuses numbers out of range, and another axis than a format's own.
    pub fn check(&self, input: &Path) -> Result<(), CliError> {
        if self.up.is_some() && !enfilade_formats::format_of(input).is_some_and(|format| format.is_up_open) {
            let open = enfilade_formats::FORMATS.iter().filter(|format| format.is_up_open).map(|format| format.name);
            let open = open.collect::<Vec<_>>().join(", ");
            return Err(at(input, format!("--up is for {open}; this format says itself what is up")));
        }
        if let Some(rays) = self.rays.filter(|rays| (1..FEW).contains(rays)) {
            eprintln!("note: --rays {rays} is {rays} rays; {rays} million are --rays {rays}M");
        }
        for (flag, value) in [
            ("--smallest-occluder", self.smallest_occluder),
            ("--smallest-hole", self.smallest_hole),
            ("--tube-radius", self.tube_radius),
        ] {
            if value.is_some_and(|v| !(v > 0.0 && v.is_finite())) {
                return Err(CliError(format!("{flag} takes metres, above 0")));
            }
        }
        Ok(())
    }

    /// The files that are named.
    pub fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.cells_file.iter().chain(self.files.paths())
    }

    /// How to import.
    pub fn import(&self) -> ImportOptions {
        let Self { unit: metres_per_unit, tube_radius, .. } = *self;
        // Whole ones, where their size is a choice.
        let object_triangles = self.object_triangles.unwrap_or(u32::MAX);
        let (tubes, z_up) = (self.tubes == TubesFlag::Auto, self.up == Some(UpFlag::Z));
        let smallest_hole = self.smallest_hole;
        ImportOptions { object_triangles, metres_per_unit, z_up, tube_radius, tubes, smallest_hole, ..self.files.options() }
    }

    /// The scene with objects of the size that costs least, unless somebody said how large they are; and the sizes that were tried.
    pub fn sized(
        &self,
        scene: Scene,
        options: &mut BakeOptions,
        work: &Job<'_>,
    ) -> Result<(Scene, Option<ObjectSizes>), BakeError> {
        if self.object_triangles.is_some() {
            return Ok((scene, None));
        }
        if !scene.tubes.tubes.is_empty() && !self.whole {
            options.import.object_triangles = ImportOptions::default().object_triangles;
            return Ok((split_objects(scene, options.import.object_triangles), None));
        }
        size_objects(scene, options, self.whole, work).map(|(scene, sizes)| (scene, Some(sizes)))
    }

    /// How to split.
    pub fn split(&self) -> SplitOptions {
        let strategy = match self.cells {
            CellsFlag::Auto => None,
            CellsFlag::Authored => Some(Strategy::Authored),
            CellsFlag::Plan => Some(Strategy::Plan),
            CellsFlag::Bsp => Some(Strategy::Bsp),
            CellsFlag::Leaves => Some(Strategy::Leaves),
        };
        let smallest_occluder = self.smallest_occluder;
        SplitOptions { strategy, smallest_occluder, in_metres: self.unit.is_some(), ..SplitOptions::default() }
    }

    /// Cells and portals of the user's own; IndoorGML is a ready graph, unless another way to find cells is asked for.
    pub fn given(&self, input: &Path, scene: &Scene) -> Result<Option<CellGraph>, CliError> {
        let ready = (is_indoorgml(input) && self.cells == CellsFlag::Auto).then_some(input);
        self.cells_file.as_deref().or(ready).map(|path| cells_file(path, scene)).transpose()
    }

    /// Flags that aren't the default, as they would be given again; `name` is what is left of a path.
    pub fn given_again(&self, name: &dyn Fn(&Path) -> String) -> Vec<(&'static str, String)> {
        let mut flags = Vec::new();
        let cells = self.cells.to_possible_value().map(|v| v.get_name().to_owned());
        flags.extend(cells.filter(|_| self.cells != CellsFlag::Auto).map(|v| ("--cells", v)));
        flags.extend(self.smallest_occluder.map(|v| ("--smallest-occluder", v.to_string())));
        flags.extend(self.smallest_hole.map(|v| ("--smallest-hole", v.to_string())));
        flags.extend(self.cells_file.as_deref().map(|path| ("--cells-file", name(path))));
        flags.extend(self.rays.map(|rays| ("--rays", count::text(rays))));
        flags.extend(self.object_triangles.map(|triangles| ("--object-triangles", triangles.to_string())));
        flags.extend(self.whole.then(|| ("--whole", String::new())));
        flags.extend(self.unit.map(|v| ("--unit", v.to_string())));
        let up = self.up.and_then(|up| up.to_possible_value());
        flags.extend(up.map(|v| ("--up", v.get_name().to_owned())));
        flags.extend(self.tube_radius.map(|v| ("--tube-radius", v.to_string())));
        flags.extend((self.tubes == TubesFlag::Never).then(|| ("--tubes", "never".to_owned())));
        flags.extend(self.files.files_under.as_deref().map(|path| ("--files-under", name(path))));
        flags.extend(self.files.roles.as_deref().map(|path| ("--roles", name(path))));
        flags
    }
}

/// Metres in a unit, which may have a name.
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
    is_sound.then_some(metres).ok_or_else(|| "takes mm, cm, inch, ft, m, km, or metres in a unit, above 0".into())
}

fn cells_file(path: &Path, scene: &Scene) -> Result<CellGraph, CliError> {
    let text = std::fs::read_to_string(path).map_err(|e| at(path, e))?;
    let graph = if is_indoorgml(path) { read_indoorgml(&text, scene) } else { read_cells(&text, scene) };
    graph.map_err(|e| at(path, e))
}

fn is_indoorgml(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gml"))
}
