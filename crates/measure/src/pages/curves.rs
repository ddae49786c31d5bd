//! Error against run time: the results of strategies after increasing work.

pub use crate::verify::{Views, held_out};

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// Results of a strategy by run time.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Curve {
    /// Its name.
    pub strategy: &'static str,
    /// By ascending run time; each is a run of its own or a moment of one.
    pub points: Vec<CurvePoint>,
}

/// Results after some work.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct CurvePoint {
    /// Processor time of all threads, seconds.
    pub cpu_seconds: f64,
    /// Rays cast.
    pub rays: u64,
    /// Cell-object pairs with a witness.
    pub lower_pairs: u64,
    /// Cell-object pairs not proven hidden; `None` for strategies that prove nothing hidden.
    pub upper_pairs: Option<u64>,
    /// False pixels of the lower set in held-out views ([`Views::false_pixels`]): mean, 95th percentile, maximum, as fractions of
    /// a view.
    #[serde(serialize_with = "named")]
    pub false_pixels: [f64; 3],
}

fn named<S: Serializer>([mean, p95, max]: &[f64; 3], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(3))?;
    map.serialize_entry("mean", mean)?;
    map.serialize_entry("p95", p95)?;
    map.serialize_entry("max", max)?;
    map.end()
}
