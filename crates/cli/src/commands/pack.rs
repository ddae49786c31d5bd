//! `enfilade pack`.

use super::files::Files;
use super::{CliError, Outcome, at, say};
use enfilade::file::{PvsFile, load_bytes};
use enfilade_formats::export::ExportError;
use enfilade_pack::{Building, Cells, Figures, PackError, folder, pack};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The .pvs file.
    #[arg(value_name = "FILE.pvs")]
    file: PathBuf,
    /// The file's model.
    #[arg(long, value_name = "INPUT")]
    model: PathBuf,
    /// The folder to write; a folder that pack wrote is replaced.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    files: super::FilesFlag,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Run")]
    threads: Option<usize>,
    /// Print JSON to stdout.
    #[arg(long)]
    json: bool,
}

/// The answer as JSON.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    figures: Figures,
    notes: Vec<String>,
}

impl Args {
    /// Input files and the output folder.
    pub fn files(&self) -> Files {
        let files = Files::new().reads(&self.file, &["pvs"]).model(&self.model).reads_too(self.files.paths());
        files.replaces(&self.output, folder::refusal)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let Args { file: path, model, output, files, threads, json } = args;
    let bytes = load_bytes(&path)?;
    let file = PvsFile::read(&bytes).map_err(|e| at(&path, e))?;
    let packed = super::pool(threads)?.install(|| pack(&bytes, &file, &model, &files.again(&file.import)));
    let Building { files, figures, notes, .. } = packed.map_err(|e| match e {
        PackError::Model(ExportError::OtherModel { .. }) => at(&model, format!("{}: {e}", path.display())),
        e => at(&model, e),
    })?;
    folder::write(&output, &files).map_err(|e| at(&output, e))?;
    if json {
        super::answer(&super::json(&Report { figures, notes })?)?;
    } else {
        let last = format!("{}: {}", output.display(), prose(&figures));
        super::answer(&notes.into_iter().chain([last]).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Outcome::Done)
}

fn prose(figures: &Figures) -> String {
    let Figures { bytes, chunk_bytes, objects, chunks, meshes, mesh_files, pictures, cells, .. } = figures;
    let Cells { share_mean, share_worst, extra_mean, extra_worst, requests_mean, requests_worst, .. } = cells;
    let mut out = String::new();
    say!(out, "{objects} objects in {chunks} chunks, {meshes} shared meshes in {mesh_files} files, {pictures} pictures");
    say!(out, "{bytes} bytes, of which {chunk_bytes} are chunks");
    say!(
        out,
        "a cell fetches {:.1} % of the bytes (at most {:.1} %) in {requests_mean:.1} files (at most {requests_worst}): {:.1} % more than its row asks for (at most {:.1} %)",
        share_mean * 1e2,
        share_worst * 1e2,
        extra_mean * 1e2,
        extra_worst * 1e2,
    );
    out
}
