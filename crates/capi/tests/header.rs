//! The header is what the code says. `ENFILADE_WRITE_DOCS=1` writes it.

use std::path::Path;

#[test]
fn the_header_is_that_of_the_code() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let mut made = Vec::new();
    cbindgen::generate_with_config(folder, config).unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let path = folder.join("include/enfilade.h");
    if std::env::var_os("ENFILADE_WRITE_DOCS").is_some() {
        std::fs::write(&path, &made).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == made, "include/enfilade.h is of another day: run this test with ENFILADE_WRITE_DOCS=1");
    for name in ["enf_version", "enf_building_open", "enf_view_cull", "enf_view_mirrors", "ENF_STATUS_TOO_SMALL"] {
        assert!(made.contains(name), "{name}");
    }
}

/// Those of C# are written by hand: none is missing, and none is of another day.
#[test]
fn c_sharp_has_the_same_functions() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let functions = |file: &str, start: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.join(file)).unwrap();
        let lines = text.lines().filter(|line| line.starts_with(start) && !line.trim_start().starts_with("//"));
        let name = |line: &str| {
            let from = line.find("enf_")?;
            Some(line[from..].split('(').next()?.to_owned())
        };
        let mut names: Vec<String> = lines.filter(|line| line.contains('(')).filter_map(name).collect();
        names.sort();
        names
    };
    let ours = functions("include/enfilade.h", "");
    assert!(ours.len() > 40, "{ours:?}");
    assert_eq!(ours, functions("Enfilade.cs", "        [DllImport"));
}
