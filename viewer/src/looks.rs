//! Looks: materials and pictures, as a graphics processor takes them.

use enfilade::math::parallel::map_range;
use enfilade::scene::{ImportOptions, Material, Picture, Role, Scene};
use enfilade_formats::picture;
use image::imageops::{FilterType, resize};
use image::{ImageReader, RgbaImage};
use std::io::Cursor;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most materials: their number shares a word with a normal. What is of others looks like the last.
pub const MOST_MATERIALS: usize = 1 << 16;
/// Most pictures: layers that every device has.
pub const MOST_PICTURES: usize = 256;
/// Side of pictures on the device, texels, and how many of that size there may be: all of them take 90 MB at most. More are smaller.
const SIDES: [(u32, usize); 3] = [(512, 64), (256, 256), (128, usize::MAX)];
/// Larger pictures are not read: texels on a side, and bytes while one is decoded; as many are decoded at a time as there are cores.
const LARGEST: (u32, u64) = (8192, 300 << 20);

/// Normals lean no more than so many times their picture, and nothing shines more than so many times as bright as a white wall: squares
/// of more leave the shader's numbers.
const MOST_LEAN: f32 = 100.0;
const MOST_SHINE: f32 = 1e6;

/// A material, as the shader has it.
#[repr(C)]
#[derive(Clone, Copy, PartialEq, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Surface {
    /// Red, green, blue and opacity, linear.
    pub colour: [f32; 4],
    /// Red, green and blue that it shines with; and its roughness.
    pub emissive_and_roughness: [f32; 4],
    /// How much of a metal it is.
    pub metallic: f32,
    /// Below this opacity nothing is drawn; 0 draws everything.
    pub cutoff: f32,
    /// Number of its picture; [`NO_PICTURE`] where there is none.
    pub picture: u32,
    /// [`LIT`], [`UNLIT`] or [`SKY`].
    pub kind: u32,
    /// Numbers of the pictures of its normals, of its roughness and metal, and of what it shines with.
    pub others: [u32; 3],
    /// How much normals lean, times the picture.
    pub normal_scale: f32,
}

impl Surface {
    /// Whether it has any.
    pub fn has_picture(&self) -> bool {
        [self.picture, self.others[0], self.others[1], self.others[2]].iter().any(|picture| *picture != NO_PICTURE)
    }
}

/// Light falls on it.
pub const LIT: u32 = 0;
/// No light changes it.
pub const UNLIT: u32 = 1;
/// The sky is seen through it.
pub const SKY: u32 = 2;
/// See [`Surface::picture`].
pub const NO_PICTURE: u32 = u32::MAX;

/// How a scene is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, clap::ValueEnum, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Detail {
    /// In flat colours: the fastest, and clear.
    Plain,
    /// As it looks: materials, sun, shade, edges, glass.
    #[default]
    Full,
    /// The same with four samples a pixel, but for the alarm and sections.
    Smooth,
}

/// Looks of a scene.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    /// Materials; those of the source first, then one a role.
    pub surfaces: Vec<Surface>,
    /// By object: its material.
    pub of_objects: Vec<u16>,
    /// That of leaves that were made for doors without any.
    pub made: u16,
    /// Pictures of one size, square.
    pub pictures: Vec<RgbaImage>,
    /// Pictures that could not be read, a line each.
    pub notes: Vec<String>,
}

impl Looks {
    /// Of a scene that was imported from `path` with its trace. `told` hears the share of pictures that are there.
    pub fn read(scene: &Scene, path: &Path, options: &ImportOptions, told: &(dyn Fn(f64) + Sync)) -> Self {
        let materials = scene.trace.as_ref().map_or(&[][..], |trace| &trace.materials);
        let mut looks = Self::default();
        // 1. Pictures, each once.
        let mut wanted = Vec::new();
        for texture in materials.iter().flat_map(|m| m.pictures()).flatten() {
            if !wanted.contains(&texture) {
                wanted.push(texture);
            }
        }
        let side = SIDES.iter().find(|(_, most)| wanted.len() <= *most).map_or(SIDES[0].0, |(side, _)| *side);
        let (done, all) = (AtomicUsize::new(0), wanted.len().max(1));
        let read = |k: usize| {
            let texels = match k < MOST_PICTURES {
                true => picture(wanted[k], path, options).and_then(|bytes| texels(&bytes, side)),
                false => Err(format!("more than {MOST_PICTURES} pictures")),
            };
            told((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / all as f64);
            texels
        };
        let mut numbers = vec![NO_PICTURE; wanted.len()];
        for (k, texels) in map_range(0..wanted.len(), read).into_iter().enumerate() {
            match texels {
                Ok(texels) => {
                    numbers[k] = looks.pictures.len() as u32;
                    looks.pictures.push(texels);
                }
                Err(why) => looks.notes.push(format!("a picture is left out: {why}")),
            }
        }

        // 2. Materials: the source's, then what stands for those that it doesn't tell.
        let number = |texture: Option<&Picture>| {
            let texture = texture.and_then(|texture| wanted.iter().position(|other| *other == texture));
            texture.map_or(NO_PICTURE, |texture| numbers[texture])
        };
        let kept = materials.len().min(MOST_MATERIALS - ROLES.len());
        looks.surfaces.extend(materials[..kept].iter().map(|m| surface(m, m.pictures().map(number))));
        looks.surfaces.extend(ROLES.map(|(_, colour)| surface(&Material::matt("", colour), [NO_PICTURE; 4])));

        looks.made = (kept + by_role(Role::Door, false)) as u16;

        // 3. Objects.
        looks.of_objects = (0..scene.objects.len())
            .map(|id| {
                let told = scene.trace.as_ref().and_then(|trace| trace.looks[trace.meshes[id] as usize].material);
                let by_role = || kept + by_role(scene.objects[id].role, scene.objects[id].glass);
                told.map_or_else(by_role, |m| (m as usize).min(kept.saturating_sub(1))) as u16
            })
            .collect();
        looks
    }
}

/// Colours of what the source doesn't tell the material of: plaster, wood, glass, cloth.
const ROLES: [(Role, [f32; 4]); 6] = [
    (Role::Structure, [0.68, 0.66, 0.62, 1.0]),
    (Role::Stair, [0.52, 0.49, 0.45, 1.0]),
    (Role::Furnishing, [0.42, 0.33, 0.24, 1.0]),
    (Role::Door, [0.36, 0.23, 0.13, 1.0]),
    (Role::Window, [0.62, 0.74, 0.80, 0.25]),
    (Role::Unknown, [0.58, 0.56, 0.53, 1.0]),
];

/// Which of [`ROLES`]; glass looks like windows.
fn by_role(role: Role, glass: bool) -> usize {
    let role = if glass { Role::Window } else { role };
    ROLES.iter().position(|(other, _)| *other == role).unwrap_or(ROLES.len() - 1)
}

fn surface(m: &Material, [picture, normals, rough, shine]: [u32; 4]) -> Surface {
    // Without the picture that says where, nothing shines, and nothing is a metal or smooth.
    let is_lost = |wanted: &Option<Picture>, number: u32| wanted.is_some() && number == NO_PICTURE;
    let most_shine = if is_lost(&m.emissive_texture, shine) { 0.0 } else { MOST_SHINE };
    let is_matt = is_lost(&m.roughness_and_metallic, rough);
    let [r, g, b] = m.emissive.map(|shine| shine.min(most_shine));
    Surface {
        colour: m.colour,
        emissive_and_roughness: [r, g, b, if is_matt { 1.0 } else { m.roughness }],
        metallic: if is_matt { 0.0 } else { m.metallic },
        cutoff: m.cutoff.unwrap_or(0.0),
        picture,
        kind: match m.unlit {
            // As games name it.
            _ if m.name.starts_with("sky") => SKY,
            true => UNLIT,
            false => LIT,
        },
        others: [normals, rough, shine],
        normal_scale: m.normal_scale.clamp(-MOST_LEAN, MOST_LEAN),
    }
}

/// Decodes a picture, and makes it a square.
fn texels(bytes: &[u8], side: u32) -> Result<RgbaImage, String> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(LARGEST.0), Some(LARGEST.0));
    limits.max_alloc = Some(LARGEST.1);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| e.to_string().replace('\n', " "))?.into_rgba8();
    if picture.width() == side && picture.height() == side {
        return Ok(picture);
    }
    Ok(resize(&picture, side, side, FilterType::Triangle))
}
