//! `enfilade why`, for a `.pvs` or a level.

mod level;

use super::files::Files;
use super::vis::chain;
use super::{CliError, Outcome, at};
use enfilade::file::PvsFile;
use enfilade::proof::{Asker, Doubt, Goal, Sight, Why};
use enfilade::pvs::pair_proof::Separation;
use enfilade::{CellId, DirectedPortal, ObjectId};
use enfilade_formats::import;
use enfilade_measure::why::{Pair, way};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Limit of separations of a pair, and of names in a message.
const MOST_SHOWN: usize = 20;

/// Flags.
#[derive(clap::Args)]
pub struct Args {
    /// The file from `bake --rows both`, or a level
    #[arg(value_name = "OUT.pvs|LEVEL.prt|LEVEL.bsp")]
    file: PathBuf,
    /// The cell to look from: 3, cell:3, or a room's name; in a level a cluster's number, or a point in it, as 480,-352,88
    #[arg(value_name = "A", allow_hyphen_values = true)]
    from: String,
    /// The target: an object (17, object:17), another cell (cell:4), or a name; in a level as A
    #[arg(value_name = "B", allow_hyphen_values = true)]
    to: String,
    /// The file's model: witnesses and occluders are tested against its triangles
    #[arg(long, value_name = "INPUT")]
    model: Option<PathBuf>,
    #[command(flatten)]
    files: super::FilesFlag,
    /// Print JSON to stdout
    #[arg(long)]
    json: bool,
}

fn is_level(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("prt") || e.eq_ignore_ascii_case("bsp"))
}

/// The cell of a word: its number, its name or its author's id.
fn cell(file: &PvsFile, word: &str) -> Result<CellId, String> {
    let word = word.strip_prefix("cell:").unwrap_or(word);
    if let Ok(id) = word.parse() {
        return Ok(CellId(id));
    }
    match &cells_named(file, word)[..] {
        [] => Err(format!("no cell is named {word:?}; give its number, as 3 or cell:3, or a name, as `dump` lists them")),
        cells => only(word, "cells", cells).map(CellId),
    }
}

/// The object or cell of a word; a plain number is an object's.
fn goal(file: &PvsFile, word: &str) -> Result<Goal, String> {
    if word.starts_with("cell:") {
        return cell(file, word).map(Goal::Cell);
    }
    let name = word.strip_prefix("object:").unwrap_or(word);
    if let Ok(id) = name.parse() {
        return Ok(Goal::Object(ObjectId(id)));
    }
    let objects = named(file.objects.iter().map(|object| [Some(object.node.as_str()), None]), name);
    let cells = if name == word { cells_named(file, name) } else { Vec::new() };
    match (&objects[..], &cells[..]) {
        ([], []) => {
            let forms = "an object, as 17 or object:17, a cell, as cell:4, or a name, as `dump` lists them";
            Err(format!("no object or cell is named {name:?}; give {forms}"))
        }
        ([], cells) => only(name, "cells", cells).map(|id| Goal::Cell(CellId(id))),
        (objects, []) => only(name, "objects", objects).map(|id| Goal::Object(ObjectId(id))),
        _ => Err(format!("an object and a cell are named {name:?}; give object:{name} or cell:{name}")),
    }
}

/// Cells of this name or author's id.
fn cells_named(file: &PvsFile, name: &str) -> Vec<u32> {
    named(file.cells.iter().map(|cell| [Some(cell.name.as_str()), cell.source.as_deref()]), name)
}

/// Numbers of all with this name; the case is ignored if none matches exactly.
fn named<'n>(names: impl Iterator<Item = [Option<&'n str>; 2]> + Clone, name: &str) -> Vec<u32> {
    let by = |is: &dyn Fn(&str) -> bool| -> Vec<u32> {
        let has = |of: [Option<&str>; 2]| of.into_iter().flatten().any(is);
        (0..).zip(names.clone()).filter(|(_, of)| has(*of)).map(|(id, _)| id).collect()
    };
    let exactly = by(&|of| of == name);
    if exactly.is_empty() { by(&|of| of.to_lowercase() == name.to_lowercase()) } else { exactly }
}

/// The only id, or an error that lists them.
fn only(name: &str, what: &str, ids: &[u32]) -> Result<u32, String> {
    match ids {
        [id] => Ok(*id),
        _ => {
            let listed: Vec<String> = ids.iter().take(MOST_SHOWN).map(ToString::to_string).collect();
            Err(format!("{} {what} are named {name:?}: {}; give a number", ids.len(), listed.join(" ")))
        }
    }
}

impl Args {
    /// Input files.
    pub fn files(&self) -> Files {
        let file = &self.file;
        let files = if is_level(file) {
            Files::new().reads_too(&[file.clone(), file.with_extension("prt")])
        } else {
            Files::new().reads(file, &["pvs"])
        };
        let files = files.reads_too(self.files.paths());
        self.model.iter().fold(files, |files, model| files.model(model))
    }
}

/// Runs the command.
pub fn run(args: Args) -> Result<Outcome, CliError> {
    if is_level(&args.file) {
        if args.model.is_some() || args.files.paths().next().is_some() {
            return Err(at(&args.file, "is a level, which needs no model: leave out --model and --files-under"));
        }
        return level::run(&args);
    }
    let file = PvsFile::load(&args.file)?;
    let (from, to) = (cell(&file, &args.from), goal(&file, &args.to));
    let (from, to) = (from.map_err(|e| at(&args.file, e))?, to.map_err(|e| at(&args.file, e))?);
    let model = args.model.as_ref();
    let options = args.files.again(&file.import);
    let scene = model.map(|path| import(path, &options).map_err(|e| at(path, e))).transpose()?;
    let asker = Asker::new(&file, scene.as_ref()).map_err(|e| at(model.unwrap_or(&args.file), e))?;
    let why = asker.why(from, to).map_err(|e| at(&args.file, e))?;
    let answer = Answer(Pair { file: &file, from, to });
    if args.json {
        super::answer(&format!("{:#}", answer.json(&why)))?;
    } else {
        super::answer(&answer.prose(&why))?;
    }
    let is_refuted = matches!(&why, Why::Witnessed(Sight { clear: Some(false), .. }));
    Ok(if is_refuted { Outcome::Failed } else { Outcome::Done })
}

/// The answer as JSON or as text.
struct Answer<'f>(Pair<'f>);

impl Answer<'_> {
    fn json(&self, why: &Why) -> Value {
        let mut out = json!({ "from": self.cell_json(self.0.from), "to": self.goal_json() });
        let entries: &[(&str, Value)] = &match why {
            Why::Itself => vec![("verdict", "itself".into())],
            Why::Witnessed(sight) => vec![
                ("verdict", "witnessed".into()),
                ("segment", json!([sight.from, sight.to].map(|p| (p + self.0.file.origin).to_array()))),
                ("cells", sight.cells.iter().map(|c| c.0).collect()),
                ("chain", ids(&sight.portals)),
                ("clear", sight.clear.into()),
            ],
            Why::Known(portals) => vec![("verdict", "visible".into()), ("chain", ids(portals))],
            Why::Apart => vec![("verdict", "apart".into())],
            Why::Separated(found) => vec![
                ("verdict", "separated".into()),
                ("chains", found.len().into()),
                ("separations", self.separations(found)),
            ],
            Why::Occluded(occlusion) => {
                vec![
                    ("verdict", "occluded".into()),
                    ("chain", ids(&occlusion.chain)),
                    ("confirmed", occlusion.confirmed.into()),
                ]
            }
            Why::Behind => vec![("verdict", "behind".into())],
            Why::Joined(cells) => vec![("verdict", "joined".into()), ("joined_from", (*cells).into())],
            Why::Undecided(doubt) => {
                let mut entries = vec![("verdict", "undecided".into())];
                entries.extend(match doubt {
                    Doubt::Inside => vec![("because", "inside".into()), ("chain", json!([]))],
                    Doubt::Open(portals) => vec![("because", "open".into()), ("chain", ids(portals))],
                    Doubt::OutOfSteps => vec![("because", "steps".into()), ("chain", json!([]))],
                    Doubt::Separated(found) => {
                        vec![("because", "separated".into()), ("separations", self.separations(found))]
                    }
                });
                entries
            }
        };
        entries.iter().for_each(|(key, value)| out[*key] = value.clone());
        out
    }

    fn cell_json(&self, cell: CellId) -> Value {
        json!({ "cell": cell, "name": self.0.file.cells[cell.index()].name })
    }

    fn goal_json(&self) -> Value {
        match self.0.to {
            Goal::Cell(cell) => self.cell_json(cell),
            Goal::Object(object) => json!({ "object": object, "node": self.0.file.objects[object.index()].node }),
        }
    }

    fn separations(&self, found: &[Separation]) -> Value {
        let entry = |s: &Separation| {
            let planes: Vec<[f64; 4]> = s.planes.iter().map(|p| self.plane(p)).collect();
            json!({ "chain": ids(&s.chain), "planes": planes })
        };
        found.iter().take(MOST_SHOWN).map(entry).collect()
    }

    /// A plane in the model's own coordinates.
    fn plane(&self, p: &enfilade::math::geom::Plane) -> [f64; 4] {
        [p.n.x, p.n.y, p.n.z, p.d + p.n.dot(self.0.file.origin)]
    }

    fn prose(&self, why: &Why) -> String {
        let mut lines = vec![self.0.sentence(why)];
        match why {
            Why::Witnessed(sight) => {
                let cells: Vec<String> = sight.cells.iter().map(ToString::to_string).collect();
                lines.push(format!("  through {}, cells {}", way(&sight.portals), cells.join(" ")));
                match sight.clear {
                    Some(true) => lines.push("  tested against the model: unobstructed".into()),
                    Some(false) => lines.push("  tested against the model: an opaque triangle blocks it".into()),
                    None => {}
                }
            }
            Why::Occluded(occlusion) => match occlusion.confirmed {
                Some(true) => lines.push("  tested again with the model: every line is blocked".into()),
                Some(false) => lines
                    .push("  tested again with the model, this pair alone and with rounded portals: not confirmed".into()),
                None => lines.push("  --model tests this again with the model's triangles".into()),
            },
            Why::Separated(found) | Why::Undecided(Doubt::Separated(found)) => {
                for s in found.iter().take(MOST_SHOWN) {
                    let end = if s.planes.is_empty() { ": impassable" } else { ": lines beyond stay inside" };
                    lines.push(format!("  {}{end}", way(&s.chain)));
                    let plane = |p| self.plane(p);
                    lines.extend(s.planes.iter().map(plane).map(|[x, y, z, d]| format!("    {:?} . p <= {d}", [x, y, z])));
                }
                if found.len() > MOST_SHOWN {
                    lines.push(format!("  and {} more", found.len() - MOST_SHOWN));
                }
            }
            _ => {}
        }
        lines.iter().map(|l| format!("{l}\n")).collect()
    }
}

fn ids(portals: &[DirectedPortal]) -> Value {
    chain(&portals.iter().map(|p| p.0).collect::<Vec<_>>())
}
