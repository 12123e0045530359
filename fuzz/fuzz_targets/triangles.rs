//! Raw triangles: the fast renderer must equal the naive one at every SIMD level.
#![no_main]

#[path = "../case.rs"]
mod case;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = case::check(bytes) {
        panic!("{error}");
    }
});
