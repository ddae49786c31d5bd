//! Explains why two clusters of a level see each other, or don't.

use super::super::bake::progress_bar;
use super::super::level::Input;
use super::super::vis::chain;
use super::super::{CliError, Outcome, answer, at, say};
use super::{Args, MOST_SHOWN};
use enfilade::job::Job;
use enfilade_levels::{PairProof, Term, VisOptions, vis, why};
use enfilade_measure::why::{no_line_passes, numbered};
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Computes the rows of a level and explains a pair.
pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let input = Input::read(&args.file)?;
    input.notes.iter().for_each(|n| eprintln!("{n}"));
    let cluster = |word: &String| input.cluster(word).map_err(|e| at(&args.file, e));
    let [a, b] = [cluster(&args.from)?, cluster(&args.to)?];
    let bar = progress_bar();
    let progress = |stage: &str, done: f64| {
        bar.set_message(stage.to_owned());
        bar.set_position((done * 1000.0) as u64);
    };
    let options = VisOptions::default();
    let found = vis(&input.level, &options, None, &Job::new(&progress));
    bar.finish_and_clear();
    let found = found.map_err(|e| at(&args.file, e))?;
    let proof = why(&input.level, &options, &found, a, b).map_err(|e| at(&args.file, e))?;
    answer(&if args.json { format!("{:#}", proof_json([a, b], &proof)) } else { explain([a, b], &proof) })?;
    Ok(Outcome::Done)
}

fn proof_json(pair: [u32; 2], why: &PairProof) -> Value {
    match why {
        PairProof::Witnessed(line) => json!({
            "pair": pair,
            "verdict": "witnessed",
            "from": line.from.to_array(),
            "to": line.to.to_array(),
            "chain": chain(&line.portals),
        }),
        PairProof::Separated(separations) => json!({
            "pair": pair,
            "verdict": "separated",
            "chains": separations.len(),
            "separations": separations.iter().take(MOST_SHOWN).map(|s| json!({
                "chain": chain(&s.chain),
                "sums": s.sums.iter().map(|sum| sum.iter().map(term_json).collect::<Vec<_>>()).collect::<Vec<_>>(),
                "planes": s.planes.iter().map(|p| [p.n.x, p.n.y, p.n.z, p.d]).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        }),
        PairProof::Undecided(portals) => json!({ "pair": pair, "verdict": "undecided", "chain": chain(portals) }),
    }
}

fn term_json(term: &Term) -> Value {
    let points = |edge: &[glam::DVec3; 2]| edge.map(|p| p.to_array());
    json!({ "weight": term.weight, "edges": term.edges.iter().map(points).collect::<Vec<_>>() })
}

fn explain([a, b]: [u32; 2], why: &PairProof) -> String {
    let mut out = String::new();
    let way = |portals: &[u32]| numbered(portals.iter().map(|p| (p / 2).to_string()));
    match why {
        PairProof::Witnessed(line) => {
            say!(out, "{a} and {b} see each other: the line from {:?} to {:?}", line.from.to_array(), line.to.to_array());
            say!(out, "  through {}", way(&line.portals));
        }
        PairProof::Separated(separations) => {
            say!(out, "{a} and {b} don't see each other: {}", no_line_passes(separations.len()));
            for s in separations.iter().take(MOST_SHOWN) {
                let end = match (s.planes.is_empty(), s.sums.is_empty()) {
                    (false, _) => ": lines beyond stay inside",
                    (_, true) => ": impassable",
                    _ => ": impassable: a line would make a sum of positive terms zero",
                };
                say!(out, "  {}{end}", way(&s.chain));
                for sum in &s.sums {
                    say!(out, "    0 =");
                    for term in sum {
                        let side = |[a, b]: &[glam::DVec3; 2]| format!(" * side({:?} {:?})", a.to_array(), b.to_array());
                        say!(out, "      + {}{}", term.weight, term.edges.iter().map(side).collect::<String>());
                    }
                }
                s.planes.iter().for_each(|p| say!(out, "    {:?} . p <= {}", p.n.to_array(), p.d));
            }
            if separations.len() > MOST_SHOWN {
                say!(out, "  and {} more", separations.len() - MOST_SHOWN);
            }
        }
        PairProof::Undecided(portals) => say!(out, "{a} and {b}: undecided, through {}", way(portals)),
    }
    out
}
