//! Seeded test scenes of any size, with known contents.
//!
//! Every building consists of closed solids, with one node per wall between two rooms and per floor, and comes with facts from
//! its plan: rooms, doors, windows, and a path. Three scenes are no buildings: teapots, cities and an offshore platform, modelled
//! on two studies of occlusion culling for comparison with their tables. A ground is a height raster, a landscape a level's portal file. The same options and seed
//! give the same bytes on every machine.

mod building;
mod city;
mod deck;
mod facts;
mod furniture;
mod glb;
mod grid;
mod ground;
mod house;
mod landscape;
mod model;
mod office;
mod path;
mod pipes;
mod plan;
mod plant;
mod solid;
mod teapots;

pub use ground::{GROUND_SIZES, GROUND_SPACINGS, Ground, ground};
pub use landscape::{LANDSCAPE_CLUSTERS, Landscape, landscape};

use building::Building;
use facts::Fill;
use serde_json::{Value, json};

/// Most rooms of a scene.
pub const MAX_ROOMS: usize = 100_000;
/// Allowed edges of a plant's site, metres.
pub const PLANT_SIZES: std::ops::RangeInclusive<usize> = 60..=2000;
/// Most teapots of a scene: 49 million triangles. An import refuses more than 50 million by default.
pub const MAX_TEAPOTS: usize = 18_000;
/// Allowed objects of an offshore platform. An import refuses more than 50 million triangles by default.
pub const DECK_OBJECTS: std::ops::RangeInclusive<usize> = 1_000..=400_000;
/// Most sections of pipes in a scene.
pub const MAX_SECTIONS: usize = 20_000_000;
/// Allowed scales of a teapot: life size to 28 m, more than half the edge of the box.
pub const TEAPOT_SCALES: std::ops::RangeInclusive<usize> = 1..=100;

/// A kind of scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Offices on both sides of corridors, several storeys, stairs.
    Office {
        /// Offices, 1 to [`MAX_ROOMS`]; corridors, stairs, lifts, stores, meeting rooms and the lobby are additional.
        rooms: usize,
        /// Storeys, 1 to the number of offices; `None`: about 50 offices on each.
        storeys: Option<usize>,
        /// With desks, chairs, screens, cupboards and lamps: about a thousand triangles per office.
        furnished: bool,
    },
    /// Rooms in a grid with works of art.
    Gallery {
        /// 1 to [`MAX_ROOMS`].
        rooms: usize,
    },
    /// Small rooms in a grid, with long paths.
    Maze {
        /// 1 to [`MAX_ROOMS`].
        rooms: usize,
    },
    /// Villa Almerico Capra, La Rotonda: see `data/buildings/README.md`. The seed changes nothing.
    House,
    /// One closed room.
    Hall,
    /// A process plant: sheds, tanks, structures, racks of pipes.
    Plant {
        /// Edge of its square site, metres, [`PLANT_SIZES`].
        size: usize,
    },
    /// Racks of pipes, risers and coils, as lines with a radius.
    Pipes {
        /// Sections of their tubes, 1 to [`MAX_SECTIONS`]; the result may have a few more.
        sections: usize,
    },
    /// Teapots at random in a box of 40 m.
    Teapots {
        /// 1 to [`MAX_TEAPOTS`].
        count: usize,
        /// Scale relative to life size, [`TEAPOT_SCALES`].
        scale: usize,
    },
    /// Buildings and trees at random on 5 x 5 km, in a scene graph of four levels.
    City {
        /// 25,426 buildings on 22 % of the plane; otherwise 2,028 on 2 %.
        dense: bool,
    },
    /// An offshore platform: four decks of pipes, fittings, gratings and vessels; few large objects, very many small ones.
    Deck {
        /// Its objects, [`DECK_OBJECTS`]; about 52 vertices each on average.
        objects: usize,
    },
}

/// Error of a scene that can't be made.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// Too few or too many clusters.
    #[error("{clusters} clusters requested; give {} to {}", LANDSCAPE_CLUSTERS.start(), LANDSCAPE_CLUSTERS.end())]
    Clusters {
        /// The requested number.
        clusters: usize,
    },
    /// Too few or too many rooms.
    #[error("{rooms} rooms requested; give 1 to {MAX_ROOMS}")]
    Rooms {
        /// The requested number.
        rooms: usize,
    },
    /// Too small or too large a plant.
    #[error("a plant of {size} m requested; give {} to {}", PLANT_SIZES.start(), PLANT_SIZES.end())]
    Size {
        /// The requested size, metres.
        size: usize,
    },
    /// Too few or too many sections.
    #[error("{sections} sections requested; give 1 to {MAX_SECTIONS}")]
    Sections {
        /// The requested number.
        sections: usize,
    },
    /// Too few or too many teapots.
    #[error("{count} teapots requested; give 1 to {MAX_TEAPOTS}")]
    Teapots {
        /// The requested number.
        count: usize,
    },
    /// Too small or too large a teapot.
    #[error("teapots at a scale of {scale} requested; give {} to {}", TEAPOT_SCALES.start(), TEAPOT_SCALES.end())]
    Scale {
        /// The requested scale.
        scale: usize,
    },
    /// Too small or too large a platform.
    #[error("a deck of {objects} objects requested; give {} to {}", DECK_OBJECTS.start(), DECK_OBJECTS.end())]
    Objects {
        /// The requested number.
        objects: usize,
    },
    /// Too few or too many storeys.
    #[error("{storeys} storeys requested for {rooms} offices; give 1 to {rooms}")]
    Storeys {
        /// The requested number.
        storeys: usize,
        /// Offices.
        rooms: usize,
    },
    /// Too few or too many samples.
    #[error("a ground of {size} samples per side requested; give {} to {}", GROUND_SIZES.start(), GROUND_SIZES.end())]
    GroundSize {
        /// The requested number.
        size: u32,
    },
    /// Samples too close or too far apart.
    #[error("samples {spacing} m apart requested; give {} to {}", GROUND_SPACINGS.start(), GROUND_SPACINGS.end())]
    GroundSpacing {
        /// The requested spacing, metres.
        spacing: String,
    },
    /// The file can't be written.
    #[error("{what}")]
    Write {
        /// The system's message.
        what: String,
    },
}

/// A scene and its facts.
#[derive(Clone, PartialEq, Debug)]
pub struct Generated {
    /// The model: binary glTF.
    pub glb: Vec<u8>,
    /// A camera path: `{name, fov_y_degrees, near, frames: [{eye, target}]}`, metres, in the model's coordinates.
    pub path: Value,
    /// Rooms, doors and windows, as in `*.rooms.json`.
    pub rooms: Value,
    /// Counts: rooms, doors, openings, windows, storeys, stairs, triangles, nodes, frames.
    pub expected: Value,
}

/// Makes a scene.
pub fn generate(kind: Kind, seed: u64) -> Result<Generated, GenerateError> {
    if let Kind::Office { rooms, .. } | Kind::Gallery { rooms } | Kind::Maze { rooms } = kind
        && !(1..=MAX_ROOMS).contains(&rooms)
    {
        return Err(GenerateError::Rooms { rooms });
    }
    let building = match kind {
        Kind::Office { rooms, storeys: Some(storeys), .. } if !(1..=rooms).contains(&storeys) => {
            return Err(GenerateError::Storeys { storeys, rooms });
        }
        Kind::Office { rooms, storeys, furnished } => office::office(rooms, storeys, furnished, seed),
        Kind::Gallery { rooms } => grid::gallery(rooms, seed),
        Kind::Maze { rooms } => grid::maze(rooms, seed),
        Kind::House => house::house(),
        Kind::Hall => grid::hall(seed),
        Kind::Plant { size } if !PLANT_SIZES.contains(&size) => return Err(GenerateError::Size { size }),
        Kind::Plant { size } => plant::plant(size, seed),
        Kind::Pipes { sections } if !(1..=MAX_SECTIONS).contains(&sections) => {
            return Err(GenerateError::Sections { sections });
        }
        Kind::Pipes { sections } => pipes::pipes(sections, seed),
        Kind::Teapots { count, .. } if !(1..=MAX_TEAPOTS).contains(&count) => return Err(GenerateError::Teapots { count }),
        Kind::Teapots { scale, .. } if !TEAPOT_SCALES.contains(&scale) => return Err(GenerateError::Scale { scale }),
        Kind::Teapots { count, scale } => teapots::teapots(count, scale, seed),
        Kind::City { dense } => city::city(dense, seed),
        Kind::Deck { objects } if !DECK_OBJECTS.contains(&objects) => return Err(GenerateError::Objects { objects }),
        Kind::Deck { objects } => deck::deck(objects, seed),
    };
    Ok(building.finish())
}

impl Building {
    fn finish(self) -> Generated {
        let Self { name, seed, counted, model, facts, path } = self;
        let known = [
            ("rooms", facts.rooms.len()),
            ("doors", facts.count(Fill::Door)),
            ("openings", facts.count(Fill::Nothing)),
            ("windows", facts.count(Fill::Glass)),
            ("storeys", facts.storeys.len()),
            ("stairs", facts.stairs.len()),
            ("triangles", model.triangles()),
            ("nodes", model.nodes.len()),
            ("frames", path.frames.len()),
        ];
        let mut expected = json!({ "name": name, "seed": seed });
        for (what, count) in counted.into_iter().chain(known) {
            expected[what] = count.into();
        }
        Generated { glb: glb::write(&model, &name), path: path.json(&name), rooms: facts.rooms_json(&name), expected }
    }
}

/// JSON for people and for `diff`: one line per key, and per element of a list of objects.
pub fn pretty(value: &Value) -> String {
    let mut out = String::from("{\n");
    let Value::Object(map) = value else {
        return value.to_string();
    };
    for (i, (key, value)) in map.iter().enumerate() {
        let end = if i + 1 == map.len() { "" } else { "," };
        match value {
            Value::Array(items) if items.iter().any(Value::is_object) => {
                let lines: Vec<String> = items.iter().map(|item| format!("    {item}")).collect();
                out += &format!("  {}: [\n{}\n  ]{end}\n", json!(key), lines.join(",\n"));
            }
            _ => out += &format!("  {}: {value}{end}\n", json!(key)),
        }
    }
    out + "}\n"
}
