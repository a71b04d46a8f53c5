//! All tests of the program and of the library from outside, in one binary: they share their support
//! and are linked once. `cargo test --test all crash::` runs those of one file.

mod support;

mod attributes;
mod batch;
mod beside;
mod cli;
mod corners;
mod crash;
mod defects;
mod equivalence;
mod estimate;
mod format;
mod fuzz_corpus;
mod guarantee;
mod hidden;
mod hostile;
mod inspect;
mod inspect_export;
mod layers;
mod levels;
mod materials;
mod mend;
mod methods;
mod mishaps;
mod models;
mod outcome;
mod panes;
mod parts;
mod report;
mod resume;
mod settings;
mod sharpness;
mod sheets;
mod thin;
mod tidy;
mod units;
mod verify;
mod winding;
