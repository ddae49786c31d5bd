//! Judges and pages.

mod check;
mod damage;
mod exact;
mod leaks;
mod report;
mod rooms;
