//! The checks: observers of a run, one property per file. [`Gate`] holds them all for one lane and
//! says the verdict. It must not know reports.

mod conservative;
mod counts;
mod determinism;
mod device_image;
mod excess;
mod gate;
mod image;
mod invariants;

pub use conservative::{Conservative, Miss};
pub use counts::CountsCheck;
pub use determinism::Determinism;
pub use device_image::DeviceImage;
pub use excess::Excess;
pub use gate::{Gate, Verdict, judge};
pub use image::ImageCheck;
pub use invariants::Invariants;
