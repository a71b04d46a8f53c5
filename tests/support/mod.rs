//! What the tests of the engine share: soups, ways to break them, files, and judgement.

#![allow(dead_code, reason = "each test file uses its own part")]

pub mod breakage;
pub mod run;
pub mod soups;
pub mod surface;
