//! The tables of two studies again, each by one command, with the software oracle on one thread, 1024 x 768 pixels: `--table
//! NAME`, all without it. P. Ivson, *Técnicas de Otimização para Visualização de Modelos Massivos*, PUC-Rio, 2006: `boxes`
//! (6.2), `queries` (6.3), `trees` (6.4), `reductions` (6.5). V. Cunha, M. Leitão, *Exploração da Remoção Hierárquica por
//! Oclusão em Simulações em Tempo Real*, ISEP: `levels` (table 2), beside query nodes that nobody chose. `known` is what is left to gain.
//!
//! First the answers are checked: boxes hold all points; no culler leaves out an object that a picture of everything shows,
//! in the middle frame of each stretch; no query calls such an object hidden. `--test` takes small scenes and all tables.

mod boxes;
mod known;
mod levels;
mod queries;
mod reductions;
mod study;
mod trees;

/// Objects of the platform in the study.
const PLATFORM: usize = 90_867;
/// Of the platform in a test.
const SMALL: usize = 1_000;

/// Runs a table; small for a test.
type Run = fn(bool);

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let is_test = words.iter().any(|word| word == "--test");
    let tables: [(&str, Run); 6] = [
        ("boxes", boxes::table),
        ("queries", queries::table),
        ("trees", trees::table),
        ("reductions", reductions::table),
        ("levels", levels::table),
        ("known", known::table),
    ];
    let asked = words.iter().position(|word| word == "--table").map(|at| words.get(at + 1).map_or("", String::as_str));
    let known = tables.iter().filter(|(name, _)| asked.is_none_or(|asked| asked == *name));
    let runs: Vec<Run> = known.map(|(_, run)| *run).collect();
    assert!(!runs.is_empty(), "--table boxes, queries, trees, reductions, levels or known");
    runs.into_iter().for_each(|run| run(is_test));
}

fn platform(is_test: bool) -> usize {
    if is_test { SMALL } else { PLATFORM }
}
