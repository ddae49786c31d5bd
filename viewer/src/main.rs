//! The viewer's place in the workspace. Until it is written it says what to use instead.

fn main() {
    eprintln!("enfilade-viewer: not written yet; `enfilade walk FILE.pvs --model MODEL --frames DIR` makes pictures");
    std::process::exit(2);
}
