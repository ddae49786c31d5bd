//! The command line: parse, one `match`, library calls.

mod cli;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Cells, portals and potentially visible sets for buildings and game levels.
#[derive(Parser)]
#[command(name = "enfilade", version, disable_help_subcommand = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Split a scene into cells, work out what can be seen from each, write a .pvs file.
    Bake(cli::bake::Args),
    /// Test a .pvs file against its model, independently of how it was baked.
    Check(cli::check::Args),
    /// Walk a camera through a model and say what each culling mode draws.
    Walk(cli::walk::Args),
    /// Say what is in a .pvs file.
    Info(cli::info::Args),
    /// Say why a cell sees an object or another cell, or doesn't.
    Why(cli::why::Args),
    /// Write out cells, portals, objects and rows.
    Dump(cli::dump::Args),
    /// Write the model with a node an object, as .glb, for engines.
    Export(cli::export::Args),
    /// Work out what can be seen in a level with ready portals: a .prt, or a Quake .bsp, whose rows are written back.
    Vis(cli::vis::Args),
    /// Draw what can be seen in a building or a level, both sides of it, against time, as a page of one file.
    Report(cli::report::Args),
    /// Make ground of rasters of heights: tiles that are drawn to within a stated number of pixels.
    Ground(cli::ground::Args),
    /// Make a seeded test scene.
    Generate(cli::generate::Args),
}

/// The arguments; where they can't be understood, one line says why.
fn arguments() -> Result<Args, ExitCode> {
    Args::try_parse().map_err(|error| {
        if !error.use_stderr() {
            // Help, or the version.
            error.exit();
        }
        let text = error.render().to_string();
        let lines: Vec<&str> = text.lines().take_while(|line| !line.is_empty()).map(str::trim).collect();
        eprintln!("enfilade: {} (try --help)", lines.join(" ").trim_start_matches("error: "));
        ExitCode::from(2)
    })
}

fn main() -> ExitCode {
    let args = match arguments() {
        Ok(args) => args,
        Err(code) => return code,
    };
    let result = match args.command {
        Command::Bake(args) => cli::bake::run(args),
        Command::Check(args) => cli::check::run(args),
        Command::Walk(args) => cli::walk::run(args),
        Command::Info(args) => cli::info::run(args),
        Command::Why(args) => cli::why::run(args),
        Command::Dump(args) => cli::dump::run(args),
        Command::Export(args) => cli::export::run(args),
        Command::Vis(args) => cli::vis::run(args),
        Command::Report(args) => cli::report::run(args),
        Command::Ground(args) => cli::ground::run(args),
        Command::Generate(args) => cli::generate::run(args),
    };
    match result {
        Ok(cli::Outcome::Done) => ExitCode::SUCCESS,
        Ok(cli::Outcome::Failed) => ExitCode::from(1),
        Err(error) => {
            eprintln!("enfilade: {error}");
            ExitCode::from(2)
        }
    }
}
