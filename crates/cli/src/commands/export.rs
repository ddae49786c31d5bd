//! `enfilade export`.

use super::files::Files;
use super::kinds::Kind;
use super::{CliError, Outcome, at};
use enfilade::file::{PvsFile, replace_file};
use enfilade_formats::export::{ExportError, export};
use serde_json::json;
use std::path::PathBuf;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The .pvs file.
    #[arg(value_name = "OUT.pvs")]
    file: PathBuf,
    /// The file's model.
    #[arg(long, value_name = "INPUT")]
    model: PathBuf,
    /// The model to write, cut into the objects of the file.
    #[arg(short, long, value_name = "OUT.glb")]
    output: PathBuf,
    #[command(flatten)]
    files: super::FilesFlag,
    /// Print JSON to stdout.
    #[arg(long)]
    json: bool,
}

impl Args {
    /// Input and output files.
    pub fn files(&self) -> Files {
        let files = Files::new().reads(&self.file, &["pvs"]).model(&self.model).reads_too(self.files.paths());
        files.writes(&self.output, Kind::Glb)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let Args { file: path, model, output, files, json } = args;
    if !output.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        return Err(at(&output, "export writes binary glTF; give a name that ends in .glb"));
    }
    let file = PvsFile::load(&path)?;
    let made = export(&model, &files.again(&file.import), &file).map_err(|e| match e {
        ExportError::OtherModel { .. } => at(&model, format!("{}: {e}", path.display())),
        e => at(&model, e),
    })?;
    replace_file(&output, |out| out.write_all(&made.glb)).map_err(|e| at(&output, e))?;
    let (objects, meshes, bytes) = (file.objects.len(), made.meshes, made.glb.len());
    if json {
        let report = json!({ "objects": objects, "meshes": meshes, "bytes": bytes, "notes": made.notes });
        super::answer(&format!("{report:#}"))?;
    } else {
        let last = format!("{}: {objects} objects in {meshes} meshes, {bytes} bytes", output.display());
        super::answer(&made.notes.into_iter().chain([last]).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Outcome::Done)
}
