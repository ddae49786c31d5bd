//! Enfilade: cells, portals and potentially visible sets for buildings and game levels.
//!
//! Data flows one way, and a module uses only those before it:
//!
//! ```text
//! scene   ->  cells  ->  pvs  ->  file  ->  runtime
//! (triangles) (split)    (bake)   (container) (per frame)
//! ```
//!
//! Without default features the crate is [`mod@file`] (reading), [`runtime`] and [`occlusion`]; `bake` adds the builder. Models are read by
//! `enfilade-formats`, results judged by `enfilade-measure`; `enfilade-cli` is the program.
//!
//! # Conventions
//!
//! * **Units** are metres, right-handed, +Y up, as in glTF. Importers convert units and axes, and record the source's.
//! * **Precision**: build-side geometry is `f64` relative to [`scene::Scene::origin`]; the file and the run time hold `f32`
//!   relative to the same origin. Only [`scene`] and `dump` ever add the origin back.
//! * **Planes** are `n . p <= d` inside ([`Plane`]); `n` is a unit vector pointing out.
//! * **Portals** are convex planar windings. Portal `p` has two directed sides, numbered `2 * p + side`: side 0 leads from
//!   `cells[0]` to `cells[1]`, side 1 back. The plane's normal points from `cells[0]` into `cells[1]`, and the winding is
//!   counter-clockwise seen from the tip of that normal: `(b - a) x (c - a)` is along `+n`.
//! * **Triangles** are counter-clockwise from their front; visibility treats them as two-sided, because winding in real models is
//!   inconsistent.
//! * **Matrices** are column-major (glam), column vectors; clip space has `z` in `0..=w`, near at 0, right-handed view space
//!   looking along -Z, as in wgpu. Screen rectangles are in normalised device coordinates, +Y up.
//!
//! # Words
//!
//! *cell*: a region of free space, a union of convex pieces. *portal*: a convex planar polygon between two cells. *object*: the smallest
//! unit of a visible set. *witness*: an unobstructed segment from a point in a cell to a point on an object. *separation*: a proof that no
//! line passes a chain of portals. *lower set* L: every pair in it has a witness. *upper set* U: every pair not in it has a separation. L
//! is a subset of the truth, which is a subset of U.

#[cfg(feature = "bake")]
pub mod bake;
#[cfg(feature = "bake")]
pub mod cells;
pub mod file;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "bake")]
pub mod job;
#[cfg(feature = "bake")]
pub mod math;
#[cfg(not(feature = "bake"))]
mod math;
pub mod occlusion;
#[cfg(feature = "bake")]
pub mod proof;
#[cfg(feature = "bake")]
pub mod pvs;
pub mod runtime;
#[cfg(feature = "bake")]
pub mod scene;
#[cfg(feature = "bake")]
pub mod types;
#[cfg(not(feature = "bake"))]
mod types;

mod ids;

/// The README's example compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The engine guide's program compiles.
#[cfg(doctest)]
#[doc = include_str!("../docs/guide-engine.md")]
struct EngineGuide;

/// The vectors of this crate. A program that uses this re-export has the same version.
pub use glam;
pub use ids::{CellId, DirectedPortal, ObjectId, PortalId};
pub use math::bits::BitMatrix;
pub use math::geom::{Aabb, Plane};
