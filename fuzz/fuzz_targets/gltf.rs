//! Bytes as a Gltf file.
#![no_main]

#[path = "../reader.rs"]
mod reader;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    reader::model(plainsight::scene::import::Format::Gltf, bytes);
});
