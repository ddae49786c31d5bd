//! The placement of a building on a ground.

use glam::DVec3;
use std::str::FromStr;

/// The origin and rotation of a building in a ground: `X,Y,Z,DEGREES`.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Placement {
    /// Metres to the east, up and to the south of the ground's origin.
    pub at: DVec3,
    /// Degrees about the vertical axis, counter-clockwise from above.
    pub degrees: f64,
}

impl Placement {
    /// A point of the building in the ground's coordinates.
    pub fn to_ground(&self, p: DVec3) -> DVec3 {
        self.turn(p) + self.at
    }

    /// A direction of the building in the ground's coordinates.
    pub fn turn(&self, v: DVec3) -> DVec3 {
        let (sin, cos) = self.degrees.to_radians().sin_cos();
        DVec3::new(cos * v.x + sin * v.z, v.y, cos * v.z - sin * v.x)
    }
}

impl FromStr for Placement {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z, degrees]) if numbers.iter().flatten().all(|n| n.is_finite()) => {
                Ok(Self { at: DVec3::new(x, y, z), degrees })
            }
            _ => Err(format!(
                "`{text}`: give four numbers, X,Y,Z,DEGREES (metres east, up and south; degrees counter-clockwise)"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_to_the_left_takes_the_east_to_the_north() {
        let placement: Placement = "10,2,-3,90".parse().unwrap();
        let p = placement.to_ground(DVec3::X);
        assert!((p - DVec3::new(10.0, 2.0, -4.0)).length() < 1e-12, "{p}");
        assert!("1,2,3".parse::<Placement>().is_err() && "1,2,3,nan".parse::<Placement>().is_err());
    }
}
