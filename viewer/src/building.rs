//! What is looked at: a model with its `.pvs` file, found, read or baked.

use crate::looks::Looks;
use enfilade::bake::{BakeError, BakeOptions, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::scene::{ImportOptions, Scene, import};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Extensions of models, in the order in which they are looked for beside a `.pvs` file.
const MODELS: [&str; 7] = ["glb", "gltf", "obj", "ifc", "gml", "bsp", "map"];

/// A model and what was baked of it.
pub struct Building {
    /// The triangles.
    pub scene: Scene,
    /// Cells, portals and rows.
    pub file: PvsFile,
    /// Materials and pictures.
    pub looks: Looks,
}

/// How far opening is: a stage and its fraction.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

impl Building {
    /// Opens a `.pvs` file with its model, or a model with the `.pvs` file beside it; without one that fits, bakes, and leaves the result
    /// beside the model where that can be written. The error is one line.
    pub fn open(file: &Path, model: Option<&Path>, progress: Progress<'_>, stop: &AtomicBool) -> Result<Self, String> {
        progress("read", 0.0);
        if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvs")) {
            let pvs = PvsFile::load(file).map_err(|e| at(file, e))?;
            let model = match model {
                Some(model) => model.to_owned(),
                None => beside(file)?,
            };
            let options = ImportOptions { trace: true, ..pvs.import.options() };
            let scene = import(&model, &options).map_err(|e| at(&model, e))?;
            if scene.hash() != pvs.model_hash {
                let file = file.display();
                return Err(format!("{}: not the model that {file} was baked for; give it with --model", model.display()));
            }
            return Ok(Self::with_looks(scene, pvs, &model, &options, progress));
        }
        if let Some(model) = model {
            return Err(format!("{}: --model goes with a .pvs file, and {} is a model", model.display(), file.display()));
        }
        let baked = file.with_extension("pvs");
        let there = baked.exists().then(|| Self::open(&baked, Some(file), progress, stop)).and_then(Result::ok);
        match there {
            Some(building) => Ok(building),
            None => Self::bake(file, &baked, progress, stop),
        }
    }

    fn bake(model: &Path, to: &Path, progress: Progress<'_>, stop: &AtomicBool) -> Result<Self, String> {
        let options = ImportOptions { trace: true, ..ImportOptions::default() };
        let scene = import(model, &options).map_err(|e| at(model, e))?;
        let work = Job::new(progress).until(stop);
        let baked =
            bake(&scene, BakeOptions { keep_bounds: true, ..BakeOptions::default() }, &work).map_err(|e| match e {
                BakeError::Stopped(_) => "stopped".to_owned(),
                e => at(model, e),
            })?;
        // A file that isn't this model's isn't replaced.
        if to.exists() {
            eprintln!("{}: of another model, and left as it is", to.display());
        } else if let Err(e) = baked.file.save(to) {
            eprintln!("{}: not kept: {e}", to.display());
        }
        Ok(Self::with_looks(scene, baked.file, model, &options, progress))
    }

    fn with_looks(scene: Scene, file: PvsFile, model: &Path, options: &ImportOptions, progress: Progress<'_>) -> Self {
        let looks = Looks::read(&scene, model, options, &|done| progress("pictures", done));
        looks.notes.iter().for_each(|note| eprintln!("{}: {note}", model.display()));
        Self { scene, file, looks }
    }
}

/// The model of a `.pvs` file that has its name.
fn beside(file: &Path) -> Result<PathBuf, String> {
    let found = MODELS.map(|extension| file.with_extension(extension)).into_iter().find(|path| path.exists());
    found.ok_or_else(|| format!("{}: no model of that name beside it ({}); give --model", file.display(), MODELS.join(", ")))
}

fn at(path: &Path, error: impl std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}
