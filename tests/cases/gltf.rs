//! Cases of glTF and OBJ.
