//! Limits that a real device's oracle keeps while it sends its commands. No answer depends on them.

/// Queries in one pass of a real device; a batch with more has several passes. Mesa 22.3.6's lavapipe counts
/// wrongly in passes of 512 and more empty queries, from the 449th on: each stores a state of 32 KiB, and a
/// scene of its rasterizer is full (`tests/driver/full_scene.rs` shows it). A quarter of that keeps away.
pub const QUERIES_PER_PASS: usize = 128;

/// How many queries and bytes an oracle of a real device sends at once.
///
/// The defaults suit each driver that was measured; sweeps draw tiny ones, so that every way across a limit
/// is taken often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Query objects of one render pass; a batch with more has several passes. From 1 to
    /// [`DeviceLimits::MOST_QUERIES`]; what lies outside is moved to the nearer end.
    pub queries_per_pass: usize,
    /// Most bytes, by an upper estimate, that a software rasterizer may bin of one submission with questions;
    /// a batch with more is sent in several submissions. `None` is the driver's own limit: half of what
    /// llvmpipe holds, none on any other device. `Some` holds on every device; with 0 each question goes
    /// alone, with `u64::MAX` nothing is cut.
    pub scene_bytes: Option<u64>,
}

impl DeviceLimits {
    /// What WebGPU allows in one query set.
    pub const MOST_QUERIES: usize = 4096;
}

impl Default for DeviceLimits {
    fn default() -> Self {
        Self { queries_per_pass: QUERIES_PER_PASS, scene_bytes: None }
    }
}
