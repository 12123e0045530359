//! What stands in for the hardware oracle in a build without the feature `hardware`: the same names,
//! no device ever.

use std::sync::Arc;

use super::{
    Answer, DeviceLimits, FrameView, Oracle, OracleError, Proxy, QueryId, Questions, ReadBack,
    Stage,
};
use crate::part::PartId;

/// Said where a device is listed or required.
pub const NO_DEVICE: &str = "none: built without the feature `hardware`";

/// A device that cannot be.
#[derive(Debug)]
pub enum Gpu {}

impl Gpu {
    /// Never finds one.
    ///
    /// # Errors
    /// Always [`OracleError::NoDevice`].
    pub fn open(_: Option<&str>) -> Result<Arc<Self>, OracleError> {
        Err(OracleError::NoDevice(NO_DEVICE.to_owned()))
    }

    /// Names of the devices: none.
    #[must_use]
    pub fn adapters() -> Vec<String> {
        Vec::new()
    }
}

/// Geometry on a device that cannot be.
#[derive(Debug)]
pub enum GpuStage {}

impl GpuStage {
    /// Never called, for want of a [`Gpu`].
    ///
    /// # Errors
    /// None.
    pub fn new(gpu: &Arc<Gpu>, _: &Stage) -> Result<Arc<Self>, OracleError> {
        match **gpu {}
    }
}

/// An oracle that cannot be.
#[derive(Debug)]
pub enum Hardware {}

impl Hardware {
    /// Never called, for want of a [`GpuStage`].
    ///
    /// # Errors
    /// None.
    pub fn new(stage: &Arc<GpuStage>, _: Questions) -> Result<Self, OracleError> {
        match **stage {}
    }

    /// Never called, for want of a [`GpuStage`].
    ///
    /// # Errors
    /// None.
    pub fn with_limits(
        stage: &Arc<GpuStage>,
        _: Questions,
        _: DeviceLimits,
    ) -> Result<Self, OracleError> {
        match **stage {}
    }

    /// Submissions so far.
    #[must_use]
    pub fn submissions(&self) -> u64 {
        match *self {}
    }
}

impl Oracle for Hardware {
    fn name(&self) -> &'static str {
        match *self {}
    }

    fn begin_frame(&mut self, _: &FrameView<'_>) -> Result<(), OracleError> {
        match *self {}
    }

    fn draw_part(&mut self, _: PartId) {
        match *self {}
    }

    fn ask(&mut self, _: &[Proxy]) -> QueryId {
        match *self {}
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        match *self {}
    }

    fn collect(&mut self, _: &mut Vec<Answer>) -> Result<(), OracleError> {
        match *self {}
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        match *self {}
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        match *self {}
    }
}
