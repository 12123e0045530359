//! Questions without query objects, the other way round from `pyramid`: the depth target comes back
//! once for each run of questions, and rectangles are answered on this side from its maxima
//! ([`DepthMaxima`]). The answers are those of occlusion queries, sample for sample. A run costs one
//! copy of the target and one pass over it, a question next to nothing; it wins where the device's
//! memory is near (lavapipe: the same memory) and loses behind a slow bus.

use super::gpu::Gpu;
use super::images::Images;
use super::pyramid::Ask;
use crate::oracle::OracleError;
use crate::oracle::maxima::{DepthMaxima, DepthRows};
use crate::scene::DepthOrder;

/// Copies of the target on their way at once; one more waits for the oldest, so that memory stays
/// bounded however often draws and questions alternate.
pub(super) const MOST_COPIES: usize = 4;

/// Brings depth back and answers from it.
#[derive(Default)]
pub(super) struct DepthReader {
    free: Vec<wgpu::Buffer>,
    maxima: DepthMaxima,
    /// Room for depths whose sign is turned.
    turned: Vec<f32>,
}

impl DepthReader {
    /// Encodes a copy of what the target holds at this point.
    pub(super) fn copy(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        images: &Images,
    ) -> wgpu::Buffer {
        let buffer = self.free.pop().unwrap_or_else(|| images.new_staging(gpu, 1));
        images.copy_depth(encoder, &buffer);
        buffer
    }

    /// Answers `asks` from a copy that has arrived and is mapped: sets `shows` of every question that
    /// any of its rectangles shows.
    pub(super) fn answer(
        &mut self,
        images: &Images,
        copy: wgpu::Buffer,
        asks: &[Ask],
        shows: &mut [bool],
    ) -> Result<(), OracleError> {
        {
            let mapped = copy
                .slice(..)
                .get_mapped_range()
                .map_err(|error| OracleError::Lost(error.to_string()))?;
            let (viewport, stride) = (images.viewport(), images.stride());
            let mut samples: &[f32] = bytemuck::cast_slice(&mapped);
            if images.order() == DepthOrder::Reversed {
                self.turned.clear();
                self.turned.extend(samples.iter().map(|&depth| images.order().on_device(depth)));
                samples = &self.turned;
            }
            let image = DepthRows {
                samples,
                stride,
                width: viewport.width as usize,
                height: viewport.height as usize,
            };
            self.maxima.renew(image);
            for ask in asks {
                let shown = &mut shows[ask.question as usize];
                *shown = *shown || self.maxima.any(image, ask.low, ask.high, ask.depth);
            }
        }
        copy.unmap();
        self.free.push(copy);
        Ok(())
    }
}
