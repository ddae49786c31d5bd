//! `enfilade generate`.

use super::files::Files;
use super::kinds::Kind as FileKind;
use super::{CliError, Outcome, at};
use enfilade::file::replace_file;
use enfilade_scenes::{Ground, Kind, Landscape, generate, ground, landscape, pretty};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    scene: Scene,
}

#[derive(clap::Subcommand)]
enum Scene {
    /// An office building: offices on both sides of corridors, storeys joined by stairs.
    Office {
        /// Offices; corridors, stairs, lifts, stores, meeting rooms and the lobby come on top.
        #[arg(long, value_name = "N")]
        rooms: usize,
        /// Storeys [default: about 50 offices on each].
        #[arg(long, value_name = "N")]
        storeys: Option<usize>,
        /// Desks, chairs, screens, cupboards, lamps: about a thousand triangles an office.
        #[arg(long)]
        furnished: bool,
        #[command(flatten)]
        output: Output,
    },
    /// A gallery: rooms in a grid, doorways mostly off each other's axes, works of art.
    Gallery {
        /// Rooms.
        #[arg(long, value_name = "N")]
        rooms: usize,
        #[command(flatten)]
        output: Output,
    },
    /// A maze of small rooms.
    Maze {
        /// Rooms.
        #[arg(long, value_name = "N")]
        rooms: usize,
        #[command(flatten)]
        output: Output,
    },
    /// Palladio's Villa Rotonda.
    House {
        #[command(flatten)]
        output: Output,
    },
    /// One closed room.
    Hall {
        #[command(flatten)]
        output: Output,
    },
    /// A process plant: sheds, tanks, structures of slabs and gratings, racks of pipes.
    Plant {
        /// Edge of its square site.
        #[arg(long, value_name = "METRES")]
        size: usize,
        #[command(flatten)]
        output: Output,
    },
    /// Pipes: racks with elbows, risers and coils, as lines with a radius.
    Pipes {
        /// Sections of their tubes.
        #[arg(long, value_name = "N")]
        sections: usize,
        #[command(flatten)]
        output: Output,
    },
    /// Teapots at random places and turns in a box of 40 m.
    Teapots {
        /// Teapots.
        #[arg(long, value_name = "N")]
        count: usize,
        /// Scale; 1 is life size.
        #[arg(long, value_name = "S", default_value_t = 10)]
        scale: usize,
        #[command(flatten)]
        output: Output,
    },
    /// A city: buildings and trees at random on 5 x 5 km, in a scene graph of four levels.
    City {
        /// 2,028 buildings on 2 % of the plane instead of 25,426 on 22 %.
        #[arg(long)]
        sparse: bool,
        #[command(flatten)]
        output: Output,
    },
    /// An offshore platform: four decks of pipes, fittings, gratings and vessels, 90,867 objects of very different sizes.
    Deck {
        /// Objects, 1000 to 400000.
        #[arg(long, value_name = "N", default_value_t = 90_867)]
        objects: usize,
        #[command(flatten)]
        output: Output,
    },
    /// A ground: mountains with valleys, and plains between them, as a GeoTIFF.
    Ground {
        /// Samples on a side, 65 to 32769.
        #[arg(long, value_name = "N")]
        size: u32,
        /// Metres between samples, 0.01 to 1000.
        #[arg(long, value_name = "M")]
        spacing: f64,
        /// The raster to write.
        #[arg(short, long, value_name = "X.tif")]
        output: PathBuf,
        /// Seed of every random choice.
        #[arg(long, value_name = "N", default_value_t = 0)]
        seed: u64,
        /// Print the facts as JSON.
        #[arg(long)]
        json: bool,
    },
    /// An open landscape of a level, as a portal file for `vis`: hills under a flat sky, where most clusters see each other.
    Landscape {
        /// Clusters, 2 to 100000; those within hills are left out.
        #[arg(long, value_name = "N")]
        clusters: usize,
        /// The portal file to write.
        #[arg(short, long, value_name = "X.prt")]
        output: PathBuf,
        /// Seed of every random choice.
        #[arg(long, value_name = "N", default_value_t = 0)]
        seed: u64,
        /// Print the facts as JSON.
        #[arg(long)]
        json: bool,
    },
}

#[derive(clap::Args)]
struct Output {
    /// The model to write; binary glTF.
    #[arg(short, long, value_name = "X.glb")]
    output: PathBuf,
    /// Seed of every random choice.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Also write X.path.json (a walk), X.rooms.json (rooms and doors) and X.expected.json (counts).
    #[arg(long)]
    facts: bool,
    /// Print the counts as JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Output files.
    pub fn files(&self) -> Files {
        let out = match &self.scene {
            Scene::Ground { output, .. } => return Files::new().writes(output, FileKind::Tiff),
            Scene::Landscape { output, .. } => return Files::new().writes(output, FileKind::Prt),
            Scene::Office { output, .. }
            | Scene::Gallery { output, .. }
            | Scene::Maze { output, .. }
            | Scene::House { output }
            | Scene::Hall { output }
            | Scene::Plant { output, .. }
            | Scene::Pipes { output, .. }
            | Scene::Teapots { output, .. }
            | Scene::City { output, .. }
            | Scene::Deck { output, .. } => output,
        };
        let facts = FACTS.iter().filter(|_| out.facts).map(|what| out.fact(what));
        facts.fold(Files::new().writes(&out.output, FileKind::Glb), |files, path| files.writes(&path, FileKind::Json))
    }
}

impl Output {
    /// Path of a fact file.
    fn fact(&self, what: &str) -> PathBuf {
        self.output.with_extension(format!("{what}.json"))
    }
}

/// Fact files of a scene.
const FACTS: [&str; 3] = ["path", "rooms", "expected"];

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let (kind, out) = match args.scene {
        Scene::Office { rooms, storeys, furnished, output } => (Kind::Office { rooms, storeys, furnished }, output),
        Scene::Gallery { rooms, output } => (Kind::Gallery { rooms }, output),
        Scene::Maze { rooms, output } => (Kind::Maze { rooms }, output),
        Scene::House { output } => (Kind::House, output),
        Scene::Hall { output } => (Kind::Hall, output),
        Scene::Plant { size, output } => (Kind::Plant { size }, output),
        Scene::Pipes { sections, output } => (Kind::Pipes { sections }, output),
        Scene::Teapots { count, scale, output } => (Kind::Teapots { count, scale }, output),
        Scene::City { sparse, output } => (Kind::City { dense: !sparse }, output),
        Scene::Deck { objects, output } => (Kind::Deck { objects }, output),
        Scene::Ground { size, spacing, output, seed, json } => {
            let made = ground(size, spacing, seed, &output).map_err(|e| at(&output, e))?;
            print_ground(&output, &made, json)?;
            return Ok(Outcome::Done);
        }
        Scene::Landscape { clusters, output, seed, json } => {
            let made = landscape(clusters, seed).map_err(|e| CliError(e.to_string()))?;
            write(&output, made.prt.as_bytes())?;
            let Landscape { clusters, portals, .. } = made;
            super::prose(&format!("{}: {clusters} clusters, {portals} portals", output.display()), json)?;
            if json {
                let facts = json!({ "name": "landscape", "seed": seed, "clusters": clusters, "portals": portals });
                super::answer(&facts.to_string())?;
            }
            return Ok(Outcome::Done);
        }
    };
    let made = generate(kind, out.seed).map_err(|e| CliError(e.to_string()))?;
    write(&out.output, &made.glb)?;
    if out.facts {
        for (what, value) in FACTS.iter().zip([&made.path, &made.rooms, &made.expected]) {
            write(&out.fact(what), pretty(value).as_bytes())?;
        }
    }
    let count = |key: &str| made.expected[key].as_u64().unwrap_or_default();
    let mut summary = format!("{}: {} triangles in {} nodes", out.output.display(), count("triangles"), count("nodes"));
    if count("rooms") > 0 {
        let counts = ["rooms", "doors", "openings", "windows"].map(|key| format!("{} {key}", count(key))).join(", ");
        summary += &format!("; {counts} on {} storeys", count("storeys"));
    }
    super::prose(&summary, out.json)?;
    if out.json {
        super::answer(&made.expected.to_string())?;
    }
    Ok(Outcome::Done)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    replace_file(path, |out| out.write_all(bytes)).map_err(|e| at(path, e))
}

/// Prints a summary of the ground.
fn print_ground(path: &Path, made: &Ground, as_json: bool) -> Result<(), CliError> {
    let &Ground { size, spacing, seed, heights: [low, high] } = made;
    let summary = format!("{}: {size} x {size} samples {spacing} m apart, {low:.1} to {high:.1} m high", path.display());
    super::prose(&summary, as_json)?;
    if as_json {
        let facts =
            json!({ "name": "ground", "seed": seed, "size": size, "spacing": spacing, "lowest": low, "highest": high });
        super::answer(&facts.to_string())?;
    }
    Ok(())
}
