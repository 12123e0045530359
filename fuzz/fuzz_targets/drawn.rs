//! Bytes as what a culler of another engine drew.
#![no_main]

#[path = "../reader.rs"]
mod reader;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| reader::drawn(bytes));
