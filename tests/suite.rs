//! The integration tests: a module a subject, one program, since each links the whole library. Those that count memory are in `counted.rs`.

mod cli;

mod bake;
mod cases;
mod cells;
mod commands;
mod docs;
mod extremes;
mod file;
mod formats;
mod generate;
mod ground_loop;
mod levels;
mod licences;
mod measure;
mod occlusion;
mod pack;
mod pvs;
mod real;
mod runtime;
mod terrain;
mod tubes;
mod wgpu_loop;
