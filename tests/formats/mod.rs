//! Importers and exporters.

mod export;
mod ifc;
mod ifc_elements;
mod ifc_tubes;
mod indoorgml;
mod lines;
mod mesh;
mod tubes;
