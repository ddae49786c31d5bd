//! What tests and benches share: scenes by hand, seeded numbers, files taken apart.

pub mod boxes;
pub mod crowd;
pub mod data;
pub mod explain;
pub mod forge;
pub mod grid;
pub mod ground;
pub mod ground_file;
pub mod ground_picture;
pub mod house;
pub mod level_mesh;
pub mod map;
pub mod maze;
pub mod meshes;
pub mod openings;
pub mod page;
pub mod prt;
pub mod prt_texts;
pub mod quake;
pub mod random;
pub mod rooms;
pub mod sights;
pub mod solids;
pub mod tiffs;
pub mod truth;
pub mod world;
