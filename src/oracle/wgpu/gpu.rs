//! The device: chosen by name, opened once, shared by everything that draws.

use std::sync::{Arc, Mutex, OnceLock};

use plainsight_reference::Tolerance;

use super::scene_size::SCENE_BYTES;
use super::stage::Drawing;
use crate::oracle::OracleError;
use crate::scene::DepthOrder;

/// Said where no Vulkan device is found.
pub const NO_DEVICE: &str = "no Vulkan device found; install Mesa's lavapipe (Debian, Ubuntu: apt-get \
install mesa-vulkan-drivers), or run tests/run.sh, which does";

/// An open device.
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    name: String,
    tolerance: Tolerance,
    scene_bytes: Option<u64>,
    /// Pipelines for forward and for reversed depth, made when a scene first needs them.
    drawing: [OnceLock<Arc<Drawing>>; 2],
    /// The first thing the device complained about.
    trouble: Arc<Mutex<Option<String>>>,
}

/// lavapipe's, as measured (Mesa 22.3.6) over all scenes of `tests/it/tolerance.rs` (`tolerances_side_by_side`): with half of it in
/// every respect no part of 26,771 that show came out wrong; with a quarter of the pixels and half of the
/// depths five did, with a quarter of both seven. Depth comes from a plane in f32, and clipping makes
/// other new vertices.
const LAVAPIPE: Tolerance = Tolerance { pixels: 1.0 / 512.0, ulps: 4, clipped_ulps: 64 };
/// How far an edge may stand from the reference's on a device of four bits of sub-pixels, the least that
/// Vulkan allows: it snaps a vertex by up to 1/32 pixel along each axis, the reference by up to 1/512, and
/// an edge goes no farther than its ends, along the diagonal.
const FOUR_BITS: f64 = std::f64::consts::SQRT_2 * (1.0 / 32.0 + 1.0 / 512.0);
/// SwiftShader's, which has four bits, by the same measurement (of the npm package that `tests/run.sh`
/// fetches): with 1/30 pixel one part of 29,791 that show came out wrong, with 1/32 two, with 1/64 78 and
/// with lavapipe's tolerance 534, whatever the depths: beyond the slope, its depth is as good.
const SWIFTSHADER: Tolerance = Tolerance { pixels: FOUR_BITS, ulps: 4, clipped_ulps: 64 };
/// An NVIDIA H100's (driver 580.159.04), by the same measurement: no part of 29,791 that show came out
/// wrong, not even with 1/2048 pixel and one ulp. It covers the very samples that the reference does (0 of
/// 383,813 differ in `tests/it/lavapipe.rs`); twice the least that was tried is declared.
const H100: Tolerance = Tolerance { pixels: 1.0 / 1024.0, ulps: 4, clipped_ulps: 64 };
/// What any Vulkan device may do at least; depth planes of its own making. To be measured for each.
const UNKNOWN: Tolerance = Tolerance { pixels: FOUR_BITS, ulps: 4096, clipped_ulps: 65_536 };

/// A driver that was measured.
struct Driver {
    /// A part of the adapter's name, in lower case.
    name: &'static str,
    tolerance: Tolerance,
    /// Most bytes of a submission with questions; `None` where a driver answers rightly whatever it is sent.
    scene_bytes: Option<u64>,
}

/// Drivers that were measured; the first that is there is the default device.
const MEASURED: [Driver; 3] = [
    Driver { name: "llvmpipe", tolerance: LAVAPIPE, scene_bytes: Some(SCENE_BYTES) },
    Driver { name: "swiftshader", tolerance: SWIFTSHADER, scene_bytes: None },
    Driver { name: "nvidia h100", tolerance: H100, scene_bytes: None },
];

impl Driver {
    /// Whether it drives an adapter.
    fn drives(&self, adapter: &wgpu::Adapter) -> bool {
        adapter.get_info().name.to_lowercase().contains(self.name)
    }
}

fn all_adapters() -> Vec<wgpu::Adapter> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    // The same flags in every build profile: validation layers are not part of the bench.
    descriptor.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(descriptor);
    pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN))
}

fn describe(adapter: &wgpu::Adapter) -> String {
    let info = adapter.get_info();
    format!("{} ({})", info.name, info.driver_info).replace(" ()", "")
}

impl Gpu {
    /// Names of the Vulkan adapters, in the loader's order.
    #[must_use]
    pub fn adapters() -> Vec<String> {
        all_adapters().iter().map(describe).collect()
    }

    /// Opens the adapter whose name holds `adapter`, whatever the case; without a name lavapipe,
    /// SwiftShader, any other CPU adapter, or the first of all.
    ///
    /// # Errors
    /// [`OracleError::NoDevice`] where none fits; the message names those that were found.
    pub fn open(adapter: Option<&str>) -> Result<Arc<Self>, OracleError> {
        let found = all_adapters();
        let is_cpu = |a: &&wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
        let chosen = match adapter {
            Some(name) => {
                let wanted = name.to_lowercase();
                found.iter().find(|a| describe(a).to_lowercase().contains(&wanted))
            }
            // The loader's order is no one's promise.
            None => MEASURED
                .iter()
                .find_map(|driver| found.iter().find(|a| driver.drives(a)))
                .or(found.iter().find(is_cpu))
                .or(found.first()),
        };
        let Some(chosen) = chosen else {
            let names: Vec<String> = found.iter().map(describe).collect();
            return Err(OracleError::NoDevice(match adapter {
                Some(name) if !names.is_empty() => {
                    format!("no adapter is called '{name}'; there are {}", names.join(", "))
                }
                _ => NO_DEVICE.to_owned(),
            }));
        };
        let descriptor = wgpu::DeviceDescriptor {
            // Objects' matrices; every Vulkan device has them (push constants).
            required_features: wgpu::Features::IMMEDIATES,
            required_limits: chosen.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(chosen.request_device(&descriptor))
            .map_err(|error| OracleError::NoDevice(format!("{}: {error}", describe(chosen))))?;
        let trouble = Arc::new(Mutex::new(None));
        let note = |trouble: &Arc<Mutex<Option<String>>>, what: String| {
            // A poisoned lock still holds the first message.
            let mut slot = trouble.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            slot.get_or_insert(what);
        };
        let (uncaptured, lost) = (Arc::clone(&trouble), Arc::clone(&trouble));
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note(&uncaptured, error.to_string());
        }));
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                note(&lost, format!("{reason:?}: {message}"));
            }
        });
        let driver = MEASURED.iter().find(|driver| driver.drives(chosen));
        let tolerance = driver.map_or(UNKNOWN, |driver| driver.tolerance);
        let scene_bytes = driver.and_then(|driver| driver.scene_bytes);
        let (name, drawing) = (describe(chosen), [OnceLock::new(), OnceLock::new()]);
        Ok(Arc::new(Self { device, queue, name, tolerance, scene_bytes, drawing, trouble }))
    }

    /// What drawing takes on this device.
    pub(super) fn drawing(&self, order: DepthOrder) -> Arc<Drawing> {
        let made = || Arc::new(Drawing::new(&self.device, order));
        Arc::clone(self.drawing[usize::from(order == DepthOrder::Reversed)].get_or_init(made))
    }

    /// The adapter's name and driver.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How far its images may stand from the reference's.
    #[must_use]
    pub fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    /// Most bytes of a submission with questions, where the driver has such a limit.
    pub(super) fn scene_bytes(&self) -> Option<u64> {
        self.scene_bytes
    }

    /// Whether the device has complained of anything so far.
    ///
    /// # Errors
    /// [`OracleError::Lost`] with its first complaint.
    pub(super) fn healthy(&self) -> Result<(), OracleError> {
        let trouble = self.trouble.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        trouble.as_ref().map_or(Ok(()), |what| Err(OracleError::Lost(what.replace('\n', " "))))
    }

    /// Waits until the device has done all that was submitted up to `index`.
    pub(super) fn wait(&self, index: Option<wgpu::SubmissionIndex>) -> Result<(), OracleError> {
        let poll = wgpu::PollType::Wait { submission_index: index, timeout: None };
        self.device.poll(poll).map_err(|error| OracleError::Lost(error.to_string()))?;
        self.healthy()
    }
}
