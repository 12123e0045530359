//! Real occlusion queries through wgpu on Vulkan: the only folder that names wgpu. It must not know
//! indexes or cullers.
//!
//! The shader transforms in the raster rules' written order; WGSL permits fusing all the same, so
//! whether a device matches is a matter of comparison. WebGPU promises zero or non-zero and no more,
//! so answers are booleans.

mod gpu;
mod hardware;
mod images;
mod pyramid;
mod read_back;
mod redraw;
mod scene_size;
mod slot;
mod stage;

pub use gpu::{Gpu, NO_DEVICE};
pub use hardware::Hardware;
pub use stage::GpuStage;
