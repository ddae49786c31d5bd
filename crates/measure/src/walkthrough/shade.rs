//! A shaded picture from triangle ids: two lights, flat faces, thin lines between surfaces, tinted glass.

use super::picture::{Colour, Picture, hsv, hue, mix};
use super::raster::{IdBuffer, View};
use enfilade::math::parallel;
use enfilade::scene::{Role, Scene};
use glam::{DVec2, DVec3};

/// Normals with a smaller cosine (32 degrees) have an edge between them.
const BEND: f64 = 0.85;

/// Depths that differ by more than this share of the nearer one have an edge between them.
const STEP: f32 = 0.08;

/// Missed pixels.
pub const MAGENTA: Colour = [255, 0, 200];

const SKY_HIGH: Colour = [198, 218, 238];
const SKY_LOW: Colour = [244, 243, 238];

/// Shades the front triangle of each pixel.
pub fn shade(scene: &Scene, view: &View, ids: &IdBuffer) -> Picture {
    let mut picture = Picture::new(view.width, view.height, SKY_LOW);
    let width = view.width;
    let far = scene.bounds().diagonal().max(1e-9);
    parallel::for_each_chunk(picture.pixels_mut(), width.max(1), |y, row| {
        for (x, colour) in row.iter_mut().enumerate() {
            let pixel = y * width + x;
            let ray = view.camera.ray(view.ndc(DVec2::new(x as f64 + 0.5, y as f64 + 0.5))).normalize();
            *colour = match ids.opaque(pixel) {
                Some(triangle) => {
                    let shaded = light(scene, triangle, ray, base(scene, triangle));
                    let line = if is_edge(scene, ids, pixel, x, y) { mix(shaded, [40, 44, 52], 0.35) } else { shaded };
                    // Distant walls fade a little, to show depth without shadows.
                    mix(line, SKY_LOW, (f64::from(ids.depth(pixel)) / far).min(1.0) as f32 * 0.35)
                }
                None => mix(SKY_LOW, SKY_HIGH, (ray.y * 1.5).clamp(0.0, 1.0) as f32),
            };
            if let Some(triangle) = ids.glass(pixel) {
                let role = scene.objects[scene.object_of(triangle).index()].role;
                let (tint, opacity) =
                    if role == Role::Door { (base(scene, triangle), 0.45) } else { ([150, 205, 220], 0.28) };
                // Glass is clearer at a right angle.
                let slant = 1.0 - normal(scene, triangle).dot(ray).abs() as f32;
                *colour = mix(*colour, light(scene, triangle, ray, tint), opacity + 0.25 * slant);
            }
        }
    });
    picture
}

fn normal(scene: &Scene, triangle: usize) -> DVec3 {
    let [a, b, c] = scene.corners(triangle);
    (b - a).cross(c - a).normalize_or(DVec3::Y)
}

/// Lambert's law with a key light, a fill light and light from above, on the visible side.
fn light(scene: &Scene, triangle: usize, ray: DVec3, colour: Colour) -> Colour {
    let n = normal(scene, triangle);
    let n = if n.dot(ray) > 0.0 { -n } else { n };
    let key = n.dot(DVec3::new(0.55, 0.70, 0.46)).max(0.0);
    let fill = n.dot(DVec3::new(-0.72, 0.15, -0.68)).max(0.0);
    let above = 0.5 + 0.5 * n.y;
    let total = (0.60 + 0.26 * key + 0.12 * fill + 0.14 * above) as f32;
    colour.map(|c| (f32::from(c) * total).min(255.0) as u8)
}

fn base(scene: &Scene, triangle: usize) -> Colour {
    let id = scene.object_of(triangle).index();
    match scene.objects[id].role {
        Role::Structure | Role::Stair => hsv(0.10 + 0.04 * hue(id), 0.05 + 0.06 * hue(id + 7), 0.97),
        Role::Furnishing => hsv(hue(id), 0.42, 0.93),
        Role::Door => hsv(0.075, 0.50, 0.80),
        Role::Window => hsv(0.56, 0.22, 0.88),
        Role::Unknown | Role::Helper | Role::Sky => hsv(hue(id), 0.14, 0.97),
    }
}

/// Whether a surface ends between a pixel and the one below it or to its right: a different triangle at another depth or with a
/// different normal.
fn is_edge(scene: &Scene, ids: &IdBuffer, pixel: usize, x: usize, y: usize) -> bool {
    let Some(here) = ids.opaque(pixel) else { return false };
    let beside = [(x + 1 < ids.width).then_some(pixel + 1), (y + 1 < ids.height).then_some(pixel + ids.width)];
    beside.into_iter().flatten().any(|other| match ids.opaque(other) {
        Some(there) if there == here => false,
        Some(there) => {
            let (a, b) = (ids.depth(pixel), ids.depth(other));
            (a - b).abs() > STEP * a.min(b) || normal(scene, here).dot(normal(scene, there)).abs() < BEND
        }
        None => true,
    })
}
