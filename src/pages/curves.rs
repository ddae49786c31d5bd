//! Error against run time: what strategies have found of a scene after how much work.

pub use crate::verify::{Views, held_out};

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

/// What a strategy finds, by run time.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Curve {
    /// Its name.
    pub strategy: &'static str,
    /// By ascending run time; each is a run of its own, or a moment of one.
    pub points: Vec<CurvePoint>,
}

/// What is known after some work.
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
    /// False pixels of the lower side on views that were held out ([`Views::false_pixels`]): mean, 95th percentile, maximum, as
    /// fractions of a view.
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

/// What a generated office of some size costs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Growth {
    /// Offices that were asked for; corridors and halls come on top.
    pub offices: u64,
    /// Cells.
    pub cells: u64,
    /// Portals.
    pub portals: u64,
    /// Objects.
    pub objects: u64,
    /// Triangles.
    pub triangles: u64,
    /// Rays cast.
    pub rays: u64,
    /// Processor time of splitting into cells, all threads, seconds.
    pub cells_cpu_seconds: f64,
    /// Processor time of working out visibility.
    pub pvs_cpu_seconds: f64,
    /// Cell-object pairs not proven hidden.
    pub upper_pairs: u64,
}

/// The power of `x` that `y` grows with: the slope of the line that fits their logarithms best. `None` for fewer than two different
/// `x`, or where one isn't above 0.
pub fn exponent(points: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points.into_iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |(a, b), p| (a + p.0 / n, b + p.1 / n));
    let slope =
        logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / logs.iter().map(|p| (p.0 - x) * (p.0 - x)).sum::<f64>();
    Some(slope).filter(|s| s.is_finite())
}

#[cfg(test)]
mod tests {
    use super::exponent;

    #[test]
    fn a_power_is_found_again() {
        let power = |p: f64| exponent([1.0, 3.0, 10.0, 50.0].map(|x: f64| (x, 7.0 * x.powf(p)))).unwrap();
        assert!([0.0, 1.0, 1.5, 2.0].into_iter().all(|p| (power(p) - p).abs() < 1e-9));
        assert_eq!([exponent([]), exponent([(2.0, 1.0), (2.0, 5.0)]), exponent([(1.0, 0.0), (2.0, 5.0)])], [None; 3]);
    }
}
