//! What the examples share: a level, a way through its doors, and a plan in the terminal, since the crates that they need draw nothing.
#![allow(dead_code, reason = "not every example needs all")]

use bevy_app::{App, AppExit, ScheduleRunnerPlugin, Startup, TaskPoolPlugin};
use bevy_asset::{AssetPlugin, AssetServer};
use bevy_camera::visibility::Visibility;
use bevy_ecs::prelude::*;
use bevy_enfilade::prelude::*;
use bevy_math::Vec3;
use bevy_transform::TransformPlugin;
use bevy_transform::components::Transform;
use enfilade::CellId;
use enfilade::file::PvsFile;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Columns and rows of the plan.
const SIZE: [usize; 2] = [100, 36];
/// Frames of a way from door to door.
const STEPS: usize = 12;

/// A level's file, for what the plan shows.
#[derive(Resource)]
pub struct Level {
    pub file: PvsFile,
    /// Eyes on the way.
    pub way: Vec<Vec3>,
    path: PathBuf,
}

/// The frame, from 0.
#[derive(Resource, Default)]
pub struct Frame(pub usize);

/// An app with the level that the command line names: loaded, its objects spawned, and a camera.
///
/// # Errors
///
/// One line.
pub fn app(camera: PortalCamera) -> Result<App, String> {
    let path = PathBuf::from(std::env::args_os().nth(1).ok_or("give a level: level.pvs, from `enfilade bake`")?);
    let file = PvsFile::load(&path).map_err(|e| e.to_string())?;
    let way = way(&file);
    if way.is_empty() {
        return Err(format!("{}: no two rooms have a portal between them", path.display()));
    }
    let mut app = App::new();
    let folder = path.parent().unwrap_or(Path::new(""));
    let assets = AssetPlugin {
        file_path: std::path::absolute(folder).map_err(|e| e.to_string())?.display().to_string(),
        ..Default::default()
    };
    app.add_plugins((TaskPoolPlugin::default(), assets, TransformPlugin, EnfiladePlugins));
    app.add_plugins(ScheduleRunnerPlugin::run_loop(Duration::from_millis(100)));
    let spawn = move |assets: Res<AssetServer>, level: Res<Level>, mut commands: Commands| {
        let name = level.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        commands.insert_resource(LevelHandle(assets.load(name)));
        commands.spawn((camera, Transform::from_translation(level.way[0])));
        commands.spawn_batch(
            (0..level.file.objects.len() as u32).map(|id| EnfiladeObject::new(ObjectId(id))).collect::<Vec<_>>(),
        );
    };
    app.insert_resource(Level { file, way, path }).init_resource::<Frame>().add_systems(Startup, spawn);
    Ok(app)
}

/// From door to door, always on by the one that was passed longest ago.
fn way(file: &PvsFile) -> Vec<Vec3> {
    let place = |p: enfilade::glam::Vec3| Vec3::from_array((p.as_dvec3() + file.origin).as_vec3().to_array());
    // At the height of an eye over the threshold, if the door is as high.
    let middle = |portal: usize| {
        let winding = &file.portals[portal].winding;
        let middle = winding.iter().sum::<enfilade::glam::Vec3>() / winding.len() as f32;
        let low = winding.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
        place(enfilade::glam::Vec3::new(middle.x, middle.y.min(low + 1.6), middle.z))
    };
    let open = |cell: CellId| file.cells[cell.index()].open;
    let mut passed = vec![0; file.portals.len()];
    let Some(first) = file.portals.iter().position(|p| !p.cells.iter().any(|&cell| open(cell))) else { return Vec::new() };
    let (mut at, mut cell, mut way) = (first, file.portals[first].cells[0], Vec::new());
    for turn in 1..=2 * file.portals.len() {
        passed[at] = turn;
        let cells = file.portals[at].cells;
        cell = if cells[0] == cell { cells[1] } else { cells[0] };
        let leads_in = |&p: &usize| file.portals[p].cells.contains(&cell) && !file.portals[p].cells.iter().any(|&c| open(c));
        let next = (0..file.portals.len()).filter(leads_in).min_by_key(|&p| passed[p]).unwrap_or(at);
        way.extend((0..STEPS).map(|step| middle(at).lerp(middle(next), step as f32 / STEPS as f32)));
        at = next;
    }
    way
}

/// The camera goes on along the way; at its end the app exits.
pub fn walk(
    level: Res<Level>,
    mut frame: ResMut<Frame>,
    mut camera: Single<&mut Transform, With<PortalCamera>>,
    mut exit: MessageWriter<AppExit>,
) {
    frame.0 += 1;
    let (Some(&at), Some(&next)) = (level.way.get(frame.0), level.way.get(frame.0 + 1)) else {
        exit.write(AppExit::Success);
        return;
    };
    camera.translation = at;
    if at.distance_squared(next) > 1e-6 {
        camera.look_at(next, Vec3::Y);
    }
}

/// A plan of the storey around an eye.
pub struct Plan {
    letters: Vec<char>,
    corner: Vec3,
    scale: [f32; 2],
}

impl Plan {
    /// Of the objects of a level: those that are seen, and those that are hidden.
    pub fn new(level: &Level, eye: Vec3, objects: &Query<(&EnfiladeObject, &Visibility)>) -> Self {
        let place = |p: enfilade::glam::Vec3| Vec3::from_array((p.as_dvec3() + level.file.origin).as_vec3().to_array());
        let boxes: Vec<[Vec3; 2]> = level.file.objects.iter().map(|object| object.bounds.map(place)).collect();
        let (low, high) = level.way.iter().fold((eye, eye), |(low, high), p| (low.min(*p), high.max(*p)));
        let (low, size) = (low - 3.0, high - low + 6.0);
        let mut plan = Self {
            letters: vec![' '; SIZE[0] * SIZE[1]],
            corner: low,
            scale: [SIZE[0] as f32 / size.x, SIZE[1] as f32 / size.z],
        };
        let mut shown: Vec<(usize, bool)> =
            objects.iter().map(|(object, visibility)| (object.first.index(), *visibility != Visibility::Hidden)).collect();
        // Small ones last, over the floors that they stand on.
        let area = |i: usize| (boxes[i][1].x - boxes[i][0].x) * (boxes[i][1].z - boxes[i][0].z);
        shown.sort_by(|a, b| area(b.0).total_cmp(&area(a.0)));
        for (i, is_seen) in shown {
            let [min, max] = boxes[i];
            if min.y < eye.y && max.y > eye.y - 1.0 {
                let ([left, top], [right, bottom]) = (plan.cell(min), plan.cell(max));
                for y in top..=bottom {
                    for x in left..=right {
                        plan.letters[y * SIZE[0] + x] = if is_seen { '#' } else { '.' };
                    }
                }
            }
        }
        plan
    }

    fn cell(&self, p: Vec3) -> [usize; 2] {
        let at = |along: f32, scale: f32, size: usize| ((along * scale).max(0.0) as usize).min(size - 1);
        [at(p.x - self.corner.x, self.scale[0], SIZE[0]), at(p.z - self.corner.z, self.scale[1], SIZE[1])]
    }

    /// Puts a letter at a place.
    pub fn put(&mut self, p: Vec3, letter: char) {
        let [x, y] = self.cell(p);
        self.letters[y * SIZE[0] + x] = letter;
    }

    /// Writes it over the last one, with a line below.
    pub fn print(&self, line: &str) {
        let rows: Vec<String> = self.letters.chunks(SIZE[0]).map(|row| row.iter().collect()).collect();
        println!("\x1b[H\x1b[2J{}\n{line}", rows.join("\n"));
    }
}

/// How many objects are seen, of how many.
pub fn count(objects: &Query<(&EnfiladeObject, &Visibility)>) -> String {
    let seen = objects.iter().filter(|(_, visibility)| **visibility != Visibility::Hidden).count();
    format!("{seen} of {} objects are shown", objects.iter().count())
}
