//! A portico.

use super::{BLOCK, FLOOR, FOOT, House, PORTICO, PORTICO_FRONT, feet};
use crate::model::{Material, Placement};
use crate::solid::{Solid, cuboid, extrude, lathe, perforated};
use enfilade::scene::Role;
use glam::{DVec2, DVec3};

/// Floor, columns, entablature, gable, side walls with an arch, steps.
pub(super) fn portico(house: &mut House, direction: &str, p: &dyn Fn(f64, f64) -> [f64; 2], z: bool, s: f64) {
    let name = |what: &str| format!("{what} {direction}");
    let top = FLOOR + 6.9;
    let beam = PORTICO_FRONT - 2.4;
    let mut block = |what: &str, a: [f64; 2], b: [f64; 2], y: [f64; 2]| {
        let bounds = feet(a, b, y);
        house.solid(name(what), Material::Stone, cuboid(bounds.min, bounds.max));
    };
    block("portico floor", p(-PORTICO, BLOCK), p(PORTICO, PORTICO_FRONT), [0.0, FLOOR]);
    block("portico ceiling", p(-PORTICO, BLOCK), p(PORTICO, beam), [FLOOR + 6.4, top]);
    block("entablature", p(-PORTICO, beam), p(PORTICO, PORTICO_FRONT), [FLOOR + 6.0, top]);
    // Walls beside the steps.
    let (tread, rise) = (0.3, FLOOR / 20.0);
    let run = 19.0 * tread / FOOT;
    block("flank left", p(-13.0, PORTICO_FRONT), p(-11.0, PORTICO_FRONT + run), [0.0, FLOOR]);
    block("flank right", p(11.0, PORTICO_FRONT), p(13.0, PORTICO_FRONT + run), [0.0, FLOOR]);
    for (i, across) in [-13.2, -8.3, -3.4, 3.4, 8.3, 13.2].into_iter().enumerate() {
        let [x, zz] = p(across, PORTICO_FRONT - 1.2);
        let placement = Placement { at: DVec3::new(x * FOOT, FLOOR, zz * FOOT), turns: 0.0 };
        house.model.place(format!("column {direction} {i}"), Role::Structure, placement, "column", Material::Stone, column);
    }
    for (side, a) in [("left", -PORTICO), ("right", PORTICO - 1.4)] {
        let bounds = feet(p(a, BLOCK), p(a + 1.4, beam), [FLOOR, FLOOR + 6.4]);
        let mut arch = bounds;
        let along = if z { 2 } else { 0 };
        (arch.min[along], arch.max[along]) = (bounds.centre()[along] - 0.8, bounds.centre()[along] + 0.8);
        arch.max.y = FLOOR + 3.4;
        let solid = perforated(bounds.min, bounds.max, 2 - along, &[arch]);
        house.solid(name(&format!("portico wall {side}")), Material::Plaster, solid);
    }
    // Outwards, and to the right when looking outwards: out x up.
    let out = if z { DVec3::Z * s } else { DVec3::X * s };
    let right = out.cross(DVec3::Y);
    let w = (PORTICO + 0.5) * FOOT;
    let gable = [(-w, 0.0), (w, 0.0), (0.0, 2.2)].map(|(x, y)| DVec2::new(x, y));
    let depth = (PORTICO_FRONT - BLOCK) * FOOT;
    // right x up is -out: extruded from the front back to the wall.
    let solid = extrude(&gable, out * (PORTICO_FRONT * FOOT) + DVec3::Y * top, right, DVec3::Y, depth);
    house.solid(name("gable"), Material::Roof, solid);
    let mut outline = vec![DVec2::ZERO];
    outline.extend(
        (0..19)
            .flat_map(|i| [(19 - i, i), (19 - i, i + 1)])
            .map(|(k, l)| DVec2::new(tread * f64::from(k), rise * f64::from(l))),
    );
    outline.push(DVec2::new(0.0, rise * 19.0));
    let from = out * (PORTICO_FRONT * FOOT) - right * (11.0 * FOOT);
    house.solid(name("steps"), Material::Stone, extrude(&outline, from, out, DVec3::Y, 22.0 * FOOT));
}

/// A column, 6 m high.
fn column() -> Solid {
    let shaft =
        [(0.0, 0.0), (0.5, 0.0), (0.5, 0.15), (0.4, 0.3), (0.4, 2.0), (0.34, 5.6), (0.46, 5.8), (0.46, 6.0), (0.0, 6.0)];
    lathe(&shaft, 16)
}
