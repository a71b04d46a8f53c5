//! Feeds glTF files.

#![no_main]

#[allow(dead_code, reason = "each fuzzer uses one target")]
#[path = "../../tests/support/targets.rs"]
mod targets;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| targets::read_gltf(bytes));
