//! Scene + culler + oracle to a trace. The truth is rendered once per frame and shared by all lanes
//! that run side by side; each finished frame is handed to the lane's observers and then forgotten.
//! It must not know the checks: an observer is anything that implements [`Observer`].

mod account;
mod audit;
mod boxes;
mod calibrate;
mod canary;
mod frame;
mod heartbeat;
mod lane;
mod price;
mod stop;
mod told;
mod trace;
mod truth;

pub use account::{Account, Made, PartTruth, Step, account};
pub use boxes::Boxes;
pub use calibrate::{Bench, CalibrationKnobs, Workload, frames_to_measure, measure, workloads};
pub use canary::Canary;
pub use frame::{FrameState, FrameWork, World};
pub use heartbeat::{Beat, oldest_beat};
pub use lane::{Lane, LaneInfo, Observer, Repeat, RunError, run};
pub use price::{Arithmetic, Rendering, StatePrice, price_states, render_approximately};
pub use stop::{Cause, Stop, caught};
pub use told::{Said, told};
pub use trace::{DeviceImages, FrameRecord, FrameTrace, Moment, Repetition, Trace};
pub use truth::{
    Truth, depth_complexity, difference_to, fates_of_parts, partition_difference, render,
    render_naively,
};

/// FNV-1a over whole words with a rotation, the hash of everything a trace compares.
#[must_use]
pub fn fold(hash: u64, word: u64) -> u64 {
    (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29)
}

/// Where a chain of [`fold`]s begins.
pub const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;
