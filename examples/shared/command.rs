//! The command line of an example: two files, and where the picture goes.

use std::path::{Path, PathBuf};

/// Hands the arguments to `run` and prints the line that comes back. Exits with 2 where it is an error. `files`: what the two are called.
pub fn main(name: &str, files: &str, run: fn(&Path, &Path, Option<&Path>) -> Result<String, String>) {
    let args: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let result = match &args[..] {
        [first, second] => run(first, second, None),
        [first, second, picture] => run(first, second, Some(picture)),
        _ => Err(format!("give {files} [PICTURE.png]")),
    };
    match result {
        Ok(line) => println!("{line}"),
        Err(line) => {
            eprintln!("{name}: {line}");
            std::process::exit(2);
        }
    }
}
