//! Cases of IFC.
