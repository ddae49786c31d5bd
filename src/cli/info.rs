//! `enfilade info`.

use super::{CliError, Outcome};

/// Flags.
#[derive(clap::Args)]
pub struct Args {}

/// Runs the command.
pub fn run(_args: Args) -> Result<Outcome, CliError> {
    Err(CliError("not written yet".into()))
}
