//! Lines of cells and portals.

use crate::Building;
use bevy_app::{App, Plugin, PostUpdate};
use bevy_color::Color;
use bevy_ecs::system::Res;
use bevy_gizmos::config::{GizmoConfig, GizmoConfigGroup, GizmoConfigStore};
use bevy_gizmos::gizmos::Gizmos;
use bevy_gizmos::{AppGizmoBuilder, GizmoPlugin};
use bevy_math::Vec3;
use bevy_reflect::{Reflect, std_traits::ReflectDefault};
use enfilade::file::PvsFile;
use enfilade::glam::{DVec3, Vec4};
use enfilade::{CellId, PortalId};

/// Draws [`EnfiladeGizmos`], if Bevy's `GizmoPlugin` is there.
pub struct EnfiladeGizmosPlugin;

impl Plugin for EnfiladeGizmosPlugin {
    fn build(&self, _: &mut App) {}

    /// When it is known whether there are gizmos.
    fn finish(&self, app: &mut App) {
        if app.is_plugin_added::<GizmoPlugin>() {
            let off = GizmoConfig { enabled: false, ..GizmoConfig::default() };
            app.register_type::<EnfiladeGizmos>().insert_gizmo_config(EnfiladeGizmos::default(), off);
            app.add_systems(PostUpdate, draw);
        }
    }
}

/// Which lines are drawn. The group is off at first: `config_store.config_mut::<EnfiladeGizmos>().0.enabled = true`.
#[derive(Reflect, GizmoConfigGroup, Clone, Copy, PartialEq, Debug)]
#[reflect(Default)]
pub struct EnfiladeGizmos {
    /// Portals: those that are open, and those that are shut.
    pub portals: Option<[Color; 2]>,
    /// Edges of the pieces of cells; each cell has a hue, and these are its saturation and lightness, 0 to 1. Unbounded pieces have no lines.
    pub cells: Option<[f32; 2]>,
}

impl Default for EnfiladeGizmos {
    fn default() -> Self {
        Self { portals: Some([Color::srgb(0.2, 0.9, 0.3), Color::srgb(0.9, 0.2, 0.2)]), cells: Some([0.7, 0.6]) }
    }
}

fn draw(building: Option<Res<'_, Building>>, store: Res<'_, GizmoConfigStore>, mut gizmos: Gizmos<'_, '_, EnfiladeGizmos>) {
    let (config, group) = store.config::<EnfiladeGizmos>();
    let Some(building) = building.filter(|_| config.enabled) else { return };
    if let Some([open, shut]) = group.portals {
        for (id, winding) in (0..).map(PortalId).zip(&building.outlines.portals) {
            let is_open = (0..2).any(|side| building.doors().is_open(id.directed(side)));
            gizmos.linestrip(winding.iter().chain(winding.first()).copied(), if is_open { open } else { shut });
        }
    }
    if let Some([saturation, lightness]) = group.cells {
        for (cell, [a, b]) in &building.outlines.cells {
            // Golden turns: neighbours differ.
            let hue = (cell.0 as f32 * 137.508) % 360.0;
            gizmos.line(*a, *b, Color::hsl(hue, saturation, lightness));
        }
    }
}

/// Lines of a file, in the model's coordinates, metres.
pub(crate) struct Outlines {
    /// Windings of portals.
    pub portals: Vec<Vec<Vec3>>,
    /// Edges of pieces.
    pub cells: Vec<(CellId, [Vec3; 2])>,
}

impl Outlines {
    pub fn new(file: &PvsFile) -> Self {
        let place = |p: DVec3| Vec3::from_array((p + file.origin).as_vec3().to_array());
        let winding = |corners: &Vec<_>| corners.iter().map(|p: &enfilade::glam::Vec3| place(p.as_dvec3())).collect();
        let cells = (0..).map(CellId).zip(&file.cells);
        let pieces = cells.flat_map(|(id, cell)| cell.pieces.iter().map(move |planes| (id, planes)));
        Self {
            portals: file.portals.iter().map(|portal| winding(&portal.winding)).collect(),
            cells: pieces
                .flat_map(|(id, planes)| edges(planes).into_iter().map(move |edge| (id, edge.map(place))))
                .collect(),
        }
    }
}

/// The edges of the convex piece inside some planes; none of those that don't end.
fn edges(planes: &[Vec4]) -> Vec<[DVec3; 2]> {
    let planes: Vec<(DVec3, f64)> = planes.iter().map(|p| (p.truncate().as_dvec3(), f64::from(p.w))).collect();
    let mut edges = Vec::new();
    for (i, &(n, d)) in planes.iter().enumerate() {
        for &(m, e) in &planes[i + 1..] {
            let along = n.cross(m);
            let size = along.length_squared();
            if size < 1e-9 {
                continue;
            }
            // The line of both planes, cut by all others.
            let start = (m.cross(along) * d + along.cross(n) * e) / size;
            let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
            for &(k, f) in &planes {
                let (slope, rest) = (k.dot(along), f - k.dot(start));
                if slope.abs() < 1e-9 {
                    // Parallel: inside all of the way, or nowhere.
                    to = if rest < -1e-4 { f64::NEG_INFINITY } else { to };
                } else if slope > 0.0 {
                    to = to.min(rest / slope);
                } else {
                    from = from.max(rest / slope);
                }
            }
            if from < to && from.is_finite() && to.is_finite() {
                edges.push([start + along * from, start + along * to]);
            }
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A brick of 1 by 2 by 3 m has twelve edges, 24 m long in all; without its lid, the four on top and the four that go up are not there.
    #[test]
    fn a_brick_has_twelve_edges_and_an_open_one_four() {
        let brick: Vec<Vec4> = (0..3)
            .flat_map(|axis| {
                let n = enfilade::glam::Vec3::AXES[axis];
                [n.extend(axis as f32 + 1.0), (-n).extend(0.0)]
            })
            .collect();
        let length = |edges: &[[DVec3; 2]]| edges.iter().map(|[a, b]| a.distance(*b)).sum::<f64>();
        let all = edges(&brick);
        assert_eq!(all.len(), 12);
        assert!((length(&all) - 24.0).abs() < 1e-6);
        let open: Vec<Vec4> = brick.iter().copied().filter(|plane| plane.y <= 0.0).collect();
        let around = edges(&open);
        assert_eq!(around.len(), 4);
        assert!((length(&around) - 8.0).abs() < 1e-6);
        assert!(edges(&[]).is_empty());
    }
}
