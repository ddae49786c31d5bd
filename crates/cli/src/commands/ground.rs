//! `enfilade ground`.

use super::files::Files;
use super::kinds::Kind;
use super::{CliError, FilesFlag, Outcome, at, pool};
use enfilade::file::replace_file_by;
use enfilade_formats::import;
use enfilade_terrain::raster::{Raster, RasterOptions};
use enfilade_terrain::{GroundError, LEAST_TRIANGLES, Made, MakeOptions, Placement, make};
use glam::{DVec2, DVec3};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// Height rasters: GeoTIFF, SRTM .hgt or Esri .asc; adjacent ones form one ground
    #[arg(value_name = "RASTER", required = true)]
    rasters: Vec<PathBuf>,
    /// The ground to write
    #[arg(short, long, value_name = "OUT.ground")]
    output: PathBuf,
    /// Samples of a tile along a side.
    #[arg(long, value_name = "SAMPLES", default_value = "33", value_parser = ["33", "65", "129"])]
    tile: String,
    /// Metres between samples, for a raster without a georeference [default: 1]
    #[arg(long, value_name = "METRES")]
    spacing: Option<f64>,
    /// Make no ground under this building.
    #[arg(long, value_name = "MODEL")]
    keep_out: Option<PathBuf>,
    /// Position of the building's origin: metres east, up and south of the ground's middle; degrees to the left
    #[arg(long, value_name = "X,Y,Z,DEGREES", allow_hyphen_values = true, requires = "keep_out")]
    place: Option<Placement>,
    #[command(flatten)]
    files: FilesFlag,
    /// Threads [default: one a core]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Print JSON to stdout.
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Input and output files.
    pub fn files(&self) -> Files {
        let files = Files::new().reads_too(&self.rasters);
        let files = self.keep_out.iter().fold(files, |files, model| files.model(model));
        files.reads_too(self.files.paths()).writes(&self.output, Kind::Ground)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let spacing = args.spacing;
    if spacing.is_some_and(|s| !(s > 0.0 && s.is_finite())) {
        return Err(CliError(format!("--spacing {}: metres, above 0", spacing.unwrap_or_default())));
    }
    let mut raster = Raster::open(&args.rasters, &RasterOptions { spacing }).map_err(|e| CliError(e.to_string()))?;
    let keep_out = match &args.keep_out {
        Some(model) => footprint(model, &args.files, args.place.unwrap_or_default())?,
        None => Vec::new(),
    };
    let options = MakeOptions { side: args.tile.parse().unwrap_or_default(), keep_out };
    let made = pool(args.threads)?.install(|| write(&mut raster, &options, (&args.rasters[0], &args.output)))?;
    if args.json {
        super::answer(&format!("{:#}", as_json(&made, raster.notes())))?;
    } else {
        super::answer(&raster.notes().iter().cloned().chain(summary(&made, &args.output)).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Outcome::Done)
}

/// A model's triangles from above, in the ground's coordinates.
fn footprint(model: &Path, files: &FilesFlag, place: Placement) -> Result<Vec<[DVec2; 3]>, CliError> {
    let options = files.options();
    let scene = import(model, &options).map_err(|e| at(model, e))?;
    let above = |p: DVec3| {
        let p = place.to_ground(p + scene.origin);
        DVec2::new(p.x, p.z)
    };
    Ok((0..scene.triangles.len()).map(|t| scene.corners(t).map(above)).collect())
}

fn write(raster: &mut Raster, options: &MakeOptions, (input, output): (&Path, &Path)) -> Result<Made, CliError> {
    let mut made = None;
    let written = replace_file_by(output, |file| {
        made = Some(make(raster, options, file));
        match &made {
            Some(Err(_)) => Err(std::io::Error::other("no ground")),
            _ => Ok(()),
        }
    });
    match (made, written) {
        // Errors of reading a raster already name its file.
        (Some(Err(GroundError::Raster(line))), _) => Err(CliError(line)),
        (Some(Err(e @ GroundError::Heights(_))), _) => Err(at(input, e)),
        (Some(Err(e)), _) => Err(at(output, e)),
        (_, Err(e)) => Err(at(output, e)),
        (Some(Ok(made)), Ok(())) => Ok(made),
        (None, Ok(())) => Err(at(output, "nothing was written")),
    }
}

fn as_json(made: &Made, notes: &[String]) -> serde_json::Value {
    let header = &made.header;
    json!({
        "samples": header.grid.size(),
        "spacing_m": header.spacing,
        "origin_m": header.origin,
        "relief_m": made.relief,
        "step_m": header.step,
        "bytes_a_height": header.width.bytes(),
        "voids": header.voids,
        "kept_out": made.kept_out,
        "triangles": made.triangles,
        "tile": header.grid.side(),
        "levels": header.grid.top() + 1,
        "tiles": made.tiles,
        "bytes": made.bytes,
        "notes": notes,
    })
}

fn summary(made: &Made, output: &Path) -> Vec<String> {
    let header = &made.header;
    let [columns, rows] = header.grid.size();
    let [dx, dz] = header.spacing;
    let mut lines = vec![format!(
        "{columns} x {rows} samples, {dx:.3} x {dz:.3} m apart, heights within {:.1} m in steps of {:.6} m",
        made.relief, header.step
    )];
    if header.voids > 0 {
        lines.push(format!("{} samples have no height, {} of them under the building", header.voids, made.kept_out));
    }
    if header.grid.top() == 0 {
        lines.push(format!(
            "the full mesh has {} triangles, fewer than {LEAST_TRIANGLES}: it is drawn whole, without levels, cache or thread",
            made.triangles
        ));
    }
    lines.push(format!(
        "{}: {} tiles of {} x {} in {} levels, {} bytes",
        output.display(),
        made.tiles,
        header.grid.side(),
        header.grid.side(),
        header.grid.top() + 1,
        made.bytes
    ));
    lines
}
