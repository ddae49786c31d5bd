//! The colours of objects.

use enfilade::file::PvsFile;
use enfilade::scene::{Role, Scene};
use enfilade_measure::walkthrough::picture::{hsv, hue};

/// How objects are coloured. All but the first are drawn plain.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tints {
    /// By what they are.
    #[default]
    Roles,
    /// By the first cell that they are in.
    Cells,
    /// Triangles by whether they are seen or drawn in vain in the frame: see [`crate::draw::marks`].
    Waste,
    /// By the frames of the profile in which they are seen.
    Seen,
    /// By the triangles that they cost in vain in the profile.
    InVain,
}

impl Tints {
    /// Whether they say something of the model itself, and not of a frame or a path.
    pub fn is_lasting(self) -> bool {
        matches!(self, Self::Roles | Self::Cells)
    }
}

/// Of a door.
const DOOR: (f32, f32, f32) = (0.075, 0.55, 0.76);

/// Red, green and blue, by object; last of leaves that were made.
pub fn colours(scene: &Scene, file: &PvsFile, tints: Tints) -> Vec<[u8; 3]> {
    let mut colours = of_objects(scene, file, tints);
    colours.push(hsv(DOOR.0, DOOR.1, DOOR.2));
    colours
}

fn of_objects(scene: &Scene, file: &PvsFile, tints: Tints) -> Vec<[u8; 3]> {
    match tints {
        Tints::Roles | Tints::Waste | Tints::Seen | Tints::InVain => {
            (0..scene.objects.len()).map(|o| by_role(scene, o)).collect()
        }
        Tints::Cells => {
            let mut colours = vec![[150; 3]; scene.objects.len()];
            // Cells with lesser numbers have the last word.
            for cell in (0..file.cells.len()).rev() {
                let colour = if file.cells[cell].open { [176, 200, 170] } else { hsv(hue(cell), 0.45, 0.98) };
                file.placement.ones(cell).for_each(|object| colours[object] = colour);
            }
            colours
        }
    }
}

fn by_role(scene: &Scene, id: usize) -> [u8; 3] {
    match scene.objects[id].role {
        Role::Structure | Role::Stair => hsv(0.09 + 0.05 * hue(id), 0.06 + 0.07 * hue(id + 7), 0.96),
        Role::Furnishing => hsv(hue(id), 0.45, 0.92),
        Role::Door => hsv(DOOR.0, DOOR.1, DOOR.2),
        Role::Window => hsv(0.56, 0.30, 0.86),
        Role::Unknown | Role::Helper | Role::Sky => hsv(hue(id), 0.22, 0.96),
    }
}
