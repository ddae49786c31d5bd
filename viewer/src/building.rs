//! A building: a model with its `.pvs` file, found, read or baked.

use crate::elements::Author;
use crate::looks::Looks;
use enfilade::bake::{BakeError, BakeOptions, bake, digest, find_cells, without_rows};
use enfilade::cells::CellGraph;
use enfilade::file::PvsFile;
use enfilade::job::{Digest, Job, Journal, JournalError};
use enfilade::pvs::PvsOptions;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::{FORMATS, all_extensions, import};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Sides of the meshes that stand for tubes where these aren't drawn: within the tube, so they hide no more than it does. More: memory.
const SIDES_WITHIN: u32 = 6;

/// A model and what was baked of it.
#[derive(Clone)]
pub struct Building {
    /// The triangles, with meshes of few sides within tubes.
    pub scene: Arc<Scene>,
    /// Cells, portals and rows.
    pub file: PvsFile,
    /// Materials and pictures.
    pub looks: Arc<Looks>,
    /// Elements of the model.
    pub author: Author,
}

/// How far opening is: a stage and its fraction.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

/// Hears of a building before it is baked: first with all of it in one open cell, then with its cells and portals, whose rows hold whatever
/// isn't proven hidden.
pub type Early<'e> = &'e dyn Fn(usize, Building);

/// How many times that is.
pub const EARLY: usize = 2;

impl Building {
    /// Of its parts.
    pub fn new(scene: Scene, file: PvsFile, looks: Looks) -> Self {
        Self { scene: Arc::new(scene), file, looks: Arc::new(looks), author: Author::default() }
    }

    /// Reads elements from this model when they are first needed.
    pub fn told_by(self, model: &Path) -> Self {
        Self { author: Author::of(model), ..self }
    }

    /// Opens a `.pvs` file with its model, or a model with the `.pvs` file beside it; without one that fits, bakes, and leaves the result
    /// beside the model where that can be written. The error is one line.
    pub fn open(
        file: &Path,
        model: Option<&Path>,
        progress: Progress<'_>,
        stop: &AtomicBool,
        early: Option<Early<'_>>,
    ) -> Result<Self, String> {
        progress("read", 0.0);
        if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvs")) {
            let model = model.map_or_else(|| beside(file), |model| Ok(model.to_owned()))?;
            return Self::baked(file, &model, progress);
        }
        if let Some(model) = model {
            return Err(format!("{}: --model is for a .pvs file, but {} is a model", model.display(), file.display()));
        }
        let to = file.with_extension("pvs");
        if !to.exists() {
            return Self::bake(file, &to, progress, stop, early);
        }
        Self::baked(&to, file, progress).or_else(|why| {
            eprintln!("{why}; baking it again");
            Self::bake(file, &to, progress, stop, early)
        })
    }

    /// A `.pvs` file with its model.
    fn baked(file: &Path, model: &Path, progress: Progress<'_>) -> Result<Self, String> {
        let pvs = PvsFile::load(file).map_err(|e| e.to_string())?;
        let options = ImportOptions { trace: true, ..pvs.import.options() };
        let scene = import(model, &options).map_err(|e| at(model, e))?;
        if scene.hash() != pvs.model_hash {
            let file = file.display();
            return Err(format!("{}: not the model of {file}; give its model with --model", model.display()));
        }
        let scene = scene.meshed(|_| SIDES_WITHIN);
        let looks = looks(&scene, model, &options, progress);
        Ok(Self::new(scene, pvs, looks).told_by(model))
    }

    fn bake(
        model: &Path,
        to: &Path,
        progress: Progress<'_>,
        stop: &AtomicBool,
        early: Option<Early<'_>>,
    ) -> Result<Self, String> {
        let import_options = ImportOptions { trace: true, ..ImportOptions::default() };
        let scene = Arc::new(import(model, &import_options).map_err(|e| at(model, e))?);
        // A bake needs prisms around tubes.
        let drawn = if scene.tubes.tubes.is_empty() {
            scene.clone()
        } else {
            Arc::new(Scene::clone(&scene).meshed(|_| SIDES_WITHIN))
        };
        let looks = Arc::new(looks(&drawn, model, &import_options, progress));
        let author = Author::of(model);
        let quickly = |given: CellGraph| {
            let pvs = PvsOptions { ray_budget: 0, ..PvsOptions::default() };
            let options = BakeOptions { given: Some(given), pvs, keep_bounds: true, ..BakeOptions::default() };
            bake(&scene, options, &Job::new(&|_, _| ()).until(stop)).map(|baked| baked.file)
        };
        let failed = |e: BakeError| match e {
            BakeError::Stopped(_) => "stopped".to_owned(),
            e => at(model, e),
        };
        if let Some(early) = early {
            // 1. What nothing is worked out for; 2. what needs no rays.
            let tell = |number, file| {
                early(number, Self { scene: drawn.clone(), file, looks: looks.clone(), author: author.clone() })
            };
            tell(0, without_rows(&scene, &import_options));
            progress("cells", 0.0);
            let cells = find_cells(&scene, &BakeOptions::default().split, &Job::new(progress).until(stop))
                .map_err(|e| failed(e.into()))?;
            tell(1, quickly(cells).map_err(failed)?);
        }
        // 3. The whole.
        let file = whole(&scene, to, progress, stop).map_err(failed)?;
        Ok(Self { scene: drawn, file, looks, author })
    }
}

/// Bakes and saves everything; what is stopped goes on the next time.
fn whole(scene: &Scene, to: &Path, progress: Progress<'_>, stop: &AtomicBool) -> Result<PvsFile, BakeError> {
    let options = BakeOptions { keep_bounds: true, ..BakeOptions::default() };
    let journal = journal(&to.with_extension("viewer-state"), digest(scene, &options).of_this_build());
    let job = Job::new(progress).until(stop);
    let baked = match &journal {
        Some(journal) => bake(scene, options, &job.kept_in(journal)),
        None => bake(scene, options, &job),
    };
    if let (Some(journal), Err(BakeError::Stopped(_))) = (&journal, &baked)
        && let Err(e) = journal.flush()
    {
        eprintln!("{}: the state of the bake is not kept: {e}", to.display());
    }
    let file = baked?.file;
    if to.exists() {
        // The old file is kept.
        let old = to.with_extension("pvs.old");
        let kept = std::fs::rename(to, &old);
        eprintln!(
            "{}: replaced; {}",
            to.display(),
            kept.map_or_else(|e| e.to_string(), |()| format!("it is {} now", old.display()))
        );
    }
    match file.save(to) {
        Ok(()) => drop(journal.map(|journal| journal.remove())),
        Err(e) => eprintln!("{}: not kept: {e}", to.display()),
    }
    Ok(file)
}

fn looks(scene: &Scene, model: &Path, options: &ImportOptions, progress: Progress<'_>) -> Looks {
    let looks = Looks::read(scene, model, options, &|done| progress("pictures", done));
    looks.notes.iter().for_each(|note| eprintln!("{}: {note}", model.display()));
    looks
}

/// The journal of an interrupted bake. `None`: another process uses it, or the folder cannot be written.
fn journal(path: &Path, digest: Digest) -> Option<Journal> {
    match Journal::open(path, digest) {
        // Of an older model or program: it is the viewer's own, and worth nothing any more.
        Err(JournalError::Other(_) | JournalError::NotAJournal) => {
            std::fs::remove_file(path).ok()?;
            Journal::open(path, digest).ok()
        }
        journal => journal.ok(),
    }
}

/// The model of a `.pvs` file that has its name, of any format.
fn beside(file: &Path) -> Result<PathBuf, String> {
    let extensions = FORMATS.iter().flat_map(|format| format.extensions);
    let found = extensions.map(|extension| file.with_extension(extension)).find(|path| path.exists());
    let missing = || format!("{}: no model of that name beside it ({}); give --model", file.display(), all_extensions());
    found.ok_or_else(missing)
}

fn at(path: &Path, error: impl std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_of_any_format_is_found_beside_its_file() {
        let folder = std::env::temp_dir().join(format!("enfilade_beside_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("house.pvs");
        assert!(beside(&file).unwrap_err().contains("no model of that name beside it (.glb, "));
        for extension in ["glb", "gltf", "obj", "ply", "stl", "ifc", "ifczip", "gml", "geojson", "bsp", "map"] {
            let model = file.with_extension(extension);
            std::fs::write(&model, "a model").unwrap();
            assert_eq!(beside(&file).unwrap(), model);
            std::fs::remove_file(&model).unwrap();
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
