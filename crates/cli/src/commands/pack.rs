//! `enfilade pack`.

use super::files::Files;
use super::{CliError, Outcome, at, say};
use enfilade::file::{PvsFile, load_bytes};
use enfilade::runtime::{Culler, Mode, View};
use enfilade_formats::export::ExportError;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_pack::{Building, Cells, Figures, Manifest, Needed, PackError, folder, pack};
use serde::Serialize;
use std::collections::BTreeSet;
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
    /// A page to put into the folder, which walks in it: web/demo/dist, as web/README.md builds it
    #[arg(long, value_name = "DIR")]
    page: Option<PathBuf>,
    /// A camera path, of which the bytes to load are printed
    #[arg(long, value_name = "FILE")]
    path: Option<PathBuf>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    path: Option<PathBytes>,
    notes: Vec<String>,
}

/// Bytes to load on a path, with the manifest and the .pvs file: for the rows of its cells, and for what its frames draw.
#[derive(Serialize)]
struct PathBytes {
    frames: usize,
    first_row_bytes: u64,
    first_frame_bytes: u64,
    all_rows_bytes: u64,
    all_frames_bytes: u64,
}

impl Args {
    /// Input files and the output folder.
    pub fn files(&self) -> Files {
        let files = Files::new().reads(&self.file, &["pvs"]).model(&self.model).reads_too(self.files.paths());
        let files = files.reads_too(&self.path).reads_too(&self.page);
        files.replaces(&self.output, folder::refusal)
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    let Args { file: pvs, model, output, page, path, files, threads, json } = args;
    let page = page.map(|page| folder::page(&page).map_err(|e| at(&page, e))).transpose()?;
    let walk = path.map(|path| CameraPath::load(&path).map_err(|e| at(&path, e))).transpose()?;
    let bytes = load_bytes(&pvs)?;
    let file = PvsFile::read(&bytes).map_err(|e| at(&pvs, e))?;
    let packed = super::pool(threads)?.install(|| pack(&file, &model, &files.again(&file.import)));
    let mut packed = packed.map_err(|e| match e {
        PackError::Model(ExportError::OtherModel { .. }) => at(&model, format!("{}: {e}", pvs.display())),
        e => at(&model, e),
    })?;
    if let Some(page) = page {
        packed.add_page(page);
    }
    let Building { manifest, files, figures, notes } = packed;
    folder::write(&output, &files).map_err(|e| at(&output, e))?;
    let path = walk.map(|walk| PathBytes::of(&walk, &file, &manifest, figures.manifest_bytes + figures.pvs_bytes));
    if json {
        super::answer(&super::json(&Report { figures, path, notes })?)?;
    } else {
        let last = format!("{}: {}", output.display(), prose(&figures, path.as_ref()));
        super::answer(&notes.into_iter().chain([last]).collect::<Vec<_>>().join("\n"))?;
    }
    Ok(Outcome::Done)
}

fn prose(figures: &Figures, path: Option<&PathBytes>) -> String {
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
    if let Some(path) = path {
        let percent = |part: u64| part as f64 * 1e2 / *bytes as f64;
        say!(
            out,
            "the first frame of the path loads {:.1} % of the bytes (its row {:.1} %), all frames {:.1} % (their rows {:.1} %)",
            percent(path.first_frame_bytes),
            percent(path.first_row_bytes),
            percent(path.all_frames_bytes),
            percent(path.all_rows_bytes),
        );
    }
    out
}

impl PathBytes {
    /// Of a path; `head`: the bytes that come before any chunk.
    fn of(path: &CameraPath, file: &PvsFile, manifest: &Manifest, head: u64) -> Self {
        let chunk_of = manifest.chunk_of_object();
        let culler = Culler::new(file);
        let mut view = View::new(&culler);
        let (mut by_rows, mut by_frames) = (BTreeSet::new(), BTreeSet::new());
        let bytes = |chunks: &BTreeSet<u32>| head + Needed::of(manifest, chunks.iter().copied()).bytes(manifest);
        let mut first = None;
        for frame in 0..path.frames.len() {
            let camera = path.camera(frame, file.origin, ASPECT);
            let drawn = view.cull(&camera, Mode::PortalsAndPvs);
            let of_frame: Vec<u32> = drawn.objects.iter().map(|object| chunk_of[object.index()]).collect();
            // An eye in no cell sees what is in the frustum.
            match culler.cell_of((path.frames[frame].eye - file.origin).as_vec3()) {
                Some(cell) => by_rows.extend(file.objects_seen(cell).map(|object| chunk_of[object.index()])),
                None => by_rows.extend(&of_frame),
            }
            by_frames.extend(of_frame);
            first.get_or_insert_with(|| [bytes(&by_rows), bytes(&by_frames)]);
        }
        let [first_row_bytes, first_frame_bytes] = first.unwrap_or([head; 2]);
        let [all_rows_bytes, all_frames_bytes] = [bytes(&by_rows), bytes(&by_frames)];
        Self { frames: path.frames.len(), first_row_bytes, first_frame_bytes, all_rows_bytes, all_frames_bytes }
    }
}

/// Width over height of the camera's picture.
const ASPECT: f64 = 16.0 / 9.0;
