//! A level as an asset: loaded, inserted as the resource, and replaced when its file changes.

use crate::Building;
use bevy_asset::io::Reader;
use bevy_asset::{AssetEvent, AssetId, AssetLoader, Assets, Handle, LoadContext};
use bevy_ecs::message::MessageReader;
use bevy_ecs::resource::Resource;
use bevy_ecs::system::{Commands, Local, Res};
use bevy_reflect::TypePath;
use enfilade::file::{FileError, PvsFile};

/// Loads `.pvs` files as [`Building`]s: `asset_server.load("level.pvs")`.
#[derive(Clone, Copy, Default, Debug, TypePath)]
pub struct PvsLoader;

impl AssetLoader for PvsLoader {
    type Asset = Building;
    type Settings = ();
    type Error = FileError;

    async fn load(&self, reader: &mut dyn Reader, _: &(), _: &mut LoadContext<'_>) -> Result<Building, FileError> {
        let mut bytes = Vec::new();
        reader.read_to_end(&mut bytes).await?;
        Ok(Building::new(&PvsFile::read(&bytes)?))
    }
}

/// The level to walk through. As soon as it is loaded, it is inserted as the resource [`Building`]; and again when its file changes, if the
/// asset server watches files. Doors stay as they are, by the keys of their portals.
#[derive(Resource, Clone, Debug)]
pub struct LevelHandle(pub Handle<Building>);

/// Inserts what was loaded.
pub(crate) fn insert(
    handle: Option<Res<'_, LevelHandle>>,
    levels: Option<Res<'_, Assets<Building>>>,
    mut events: Option<MessageReader<'_, '_, AssetEvent<Building>>>,
    building: Option<Res<'_, Building>>,
    mut inserted: Local<'_, Option<AssetId<Building>>>,
    mut commands: Commands<'_, '_>,
) {
    // All are read, also those of other levels.
    let changed: Vec<_> = events.iter_mut().flat_map(|events| events.read()).copied().collect();
    let (Some(handle), Some(levels)) = (handle, levels) else { return };
    let id = handle.0.id();
    let is_same = *inserted == Some(id);
    let is_new = !is_same || changed.iter().any(|event| event.is_added(id) || event.is_modified(id));
    if let Some(level) = levels.get(id).filter(|_| is_new) {
        let mut level = level.clone();
        if let Some(building) = building.filter(|_| is_same) {
            level.take_doors(&building);
        }
        *inserted = Some(id);
        commands.insert_resource(level);
    }
}
