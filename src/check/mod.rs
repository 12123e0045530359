//! The checks: observers of a run, one property per file. [`Gate`] holds them all for one lane and
//! says the verdict. It must not know reports.

mod conservative;
mod counts;
mod determinism;
mod device_image;
mod excess;
mod failure;
mod gate;
mod image;
mod invariants;
mod truth;

pub use conservative::{Conservative, Miss};
pub use counts::CountsCheck;
pub use determinism::Determinism;
pub use device_image::DeviceImage;
pub use excess::Excess;
pub use failure::{Check, Failure, Ruling};
pub use gate::{Gate, Verdict, judge};
pub use image::ImageCheck;
pub use invariants::Invariants;
pub use truth::{Disagreement, TruthCheck};
