//! The example's command line.

use std::path::{Path, PathBuf};

/// Hands the arguments to `run` and prints the line that comes back. Exits with 2 where it is an error.
pub fn main(run: fn(&Path, &Path, Option<&Path>) -> Result<String, String>) {
    let args: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let result = match &args[..] {
        [pvs, model] => run(pvs, model, None),
        [pvs, model, picture] => run(pvs, model, Some(picture)),
        _ => Err("give FILE.pvs MODEL [PICTURE.png]".to_owned()),
    };
    match result {
        Ok(line) => println!("{line}"),
        Err(line) => {
            eprintln!("wgpu_loop: {line}");
            std::process::exit(2);
        }
    }
}
