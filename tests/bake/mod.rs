//! A bake from a scene to a file.

mod again;
mod bytes;
mod faults;
mod object_size;
mod resume;
mod stopped;
mod workers;
