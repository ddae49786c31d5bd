//! The viewer's command line: parse, run, exit.

use clap::Parser;
use enfilade_viewer::args::Args;
use std::process::ExitCode;

fn main() -> ExitCode {
    match enfilade_viewer::run(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(line) => {
            eprintln!("enfilade-viewer: {line}");
            ExitCode::from(2)
        }
    }
}
