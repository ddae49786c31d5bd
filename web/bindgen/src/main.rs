//! `enfilade-bindgen IN.wasm OUT_DIR`: writes `OUT_DIR/enfilade_bg.wasm` and the JavaScript and types around it, with the names of functions.

use std::env::args_os;
use std::process::ExitCode;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let [Some(input), Some(output)] = [args_os().nth(1), args_os().nth(2)] else {
        eprintln!("usage: enfilade-bindgen IN.wasm OUT_DIR");
        return ExitCode::from(2);
    };
    let mut bindgen = Bindgen::new();
    let made = bindgen.input_path(input).out_name("enfilade").web(true).and_then(|bindgen| {
        bindgen.typescript(true).remove_producers_section(true).generate(output)
    });
    match made {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
    }
}
