//! The corpora that fuzzing starts from: in `fuzz/corpus`, as the seeds here make them.

use crate::targets::TARGETS;
use std::path::{Path, PathBuf};

fn folder(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("fuzz/corpus").join(name)
}

#[test]
fn every_reader_accepts_its_seeds_and_fuzzing_starts_from_them() {
    for target in TARGETS {
        let seeds = (target.seeds)();
        assert!(!seeds.is_empty(), "{}", target.name);
        for (i, seed) in seeds.iter().enumerate() {
            assert!((target.run)(seed), "{}: seed {i} is refused", target.name);
            let path = folder(target.name).join(format!("seed{i}"));
            let kept = std::fs::read(&path).unwrap_or_default();
            assert!(
                &kept == seed,
                "{}: run `cargo test --features full --test counted -- --ignored write_seeds`",
                path.display()
            );
        }
        let fuzz =
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(format!("fuzz/fuzz_targets/{}.rs", target.name));
        assert!(fuzz.is_file(), "no {}", fuzz.display());
    }
}

#[test]
#[ignore = "writes fuzz/corpus"]
fn write_seeds() {
    for target in TARGETS {
        std::fs::create_dir_all(folder(target.name)).unwrap();
        for (i, seed) in (target.seeds)().iter().enumerate() {
            std::fs::write(folder(target.name).join(format!("seed{i}")), seed).unwrap();
        }
    }
}
