//! Files of a game beside a level, in its folders and its archives.

use super::archives::Archive;
use enfilade::scene::ImportOptions;
use enfilade::scene::sidecar::Sidecars;
use std::fs::File;
use std::path::Path;

/// A game's folder, from that of the level on: the same, or the one above (levels are in `maps/`).
const ROOTS: [&str; 2] = ["", "../"];
/// Endings of archives.
const ARCHIVES: [&str; 2] = ["pak", "pk3"];
/// Most archives of a level.
const MOST_ARCHIVES: usize = 64;

/// What is beside a level, by names from the game's folder on, in lower case.
pub(super) struct GameFiles<'a> {
    beside: Sidecars<'a>,
    /// The later ones come first, as in games.
    archives: Vec<Archive<File>>,
}

impl<'a> GameFiles<'a> {
    /// Opens the archives beside a level.
    pub fn beside(path: Option<&'a Path>, options: &'a ImportOptions) -> Self {
        let beside = Sidecars { folder: path.and_then(Path::parent), under: options.files_under.as_deref() };
        let mut archives = Vec::new();
        for root in ROOTS {
            let folder = if root.is_empty() { "." } else { root };
            let of = |ending: &&str| beside.list(folder, ending).unwrap_or_default();
            let mut names: Vec<String> = ARCHIVES.iter().flat_map(of).collect();
            names.sort_by(|a, b| b.cmp(a));
            let opened = names.iter().filter_map(|name| Archive::open(beside.open(&format!("{root}{name}")).ok()?));
            archives.extend(opened.take(MOST_ARCHIVES));
        }
        Self { beside, archives }
    }

    /// A file, from a folder before an archive.
    pub fn read(&mut self, name: &str) -> Option<Vec<u8>> {
        let loose = ROOTS.iter().find_map(|root| self.beside.read(&format!("{root}{name}")).ok());
        loose.or_else(|| self.archives.iter_mut().find_map(|archive| archive.read(name)))
    }

    /// The files of a folder that end so: those of the first folder of that name, then of all archives. At most `most`, and so many bytes.
    pub fn read_all(&mut self, folder: &str, ending: &str, most: usize, most_bytes: usize) -> Vec<Vec<u8>> {
        let mut left = most_bytes;
        let mut fits = |file: &Vec<u8>| {
            let rest = left.checked_sub(file.len());
            left = rest.unwrap_or(0);
            rest.is_some()
        };
        let listed = |root: &&'static str| Some((*root, self.beside.list(&format!("{root}{folder}"), ending).ok()?));
        let (root, names) = ROOTS.iter().find_map(listed).unwrap_or_default();
        let loose = names.iter().take(most).map(|name| format!("{root}{folder}/{name}"));
        let mut files: Vec<Vec<u8>> = loose.filter_map(|name| self.beside.read(&name).ok()).take_while(&mut fits).collect();
        let ending = format!(".{ending}");
        for archive in &mut self.archives {
            let names: Vec<String> = archive.names(folder, &ending).take(most - files.len()).cloned().collect();
            files.extend(names.iter().filter_map(|name| archive.read(name)).take_while(&mut fits));
        }
        files
    }
}
