//! Before the integration tests: what `cargo test` leaves to `just test-full`, in a line.

use std::path::Path;

/// Tests below a folder that are for `just test-full` alone.
fn long_ones(folder: &Path) -> usize {
    let of = |path: &Path| match path.extension() {
        _ if path.is_dir() => long_ones(path),
        Some(end) if end == "rs" => std::fs::read_to_string(path).unwrap_or_default().matches("ignore = \"long; ").count(),
        _ => 0,
    };
    std::fs::read_dir(folder).map_or(0, |entries| entries.flatten().map(|e| of(&e.path())).sum())
}

fn main() {
    if cfg!(feature = "full") || std::env::args().any(|a| a == "--list") {
        return;
    }
    // Its own mention is none.
    let long = long_ones(&Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests")).saturating_sub(1);
    println!(
        "the short tests: {long} long ones, shown as ignored, and those of IFC, Quake and the GPU are run by `just test-full`"
    );
}
