//! Render targets and their way back to this side.

use super::gpu::Gpu;
use super::stage::{DEPTH, GpuStage, IDS};
use crate::oracle::{OracleError, ReadBack};
use crate::scene::{DepthOrder, Viewport};

/// A depth target, with part ids where they are wanted.
pub(super) struct Images {
    viewport: Viewport,
    order: DepthOrder,
    depth: wgpu::Texture,
    pub(super) depth_view: wgpu::TextureView,
    ids: Option<(wgpu::Texture, wgpu::TextureView)>,
    staging: wgpu::Buffer,
}

impl Images {
    /// The depth image as a pass draws into it.
    pub(super) fn depth_attachment(
        &self,
        load: wgpu::LoadOp<f32>,
    ) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth_view,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }
    }

    pub(super) fn new(stage: &GpuStage, with_ids: bool) -> Self {
        let (gpu, viewport, order) = (&stage.gpu, stage.stage.viewport, stage.stage.depth);
        let texture = |format| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(viewport),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC
                    | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let depth = texture(DEPTH);
        let ids = with_ids.then(|| texture(IDS)).map(|ids| {
            let view = view(&ids);
            (ids, view)
        });
        let staging = staging(gpu, viewport, if with_ids { 2 } else { 1 });
        Self { viewport, order, depth_view: view(&depth), depth, ids, staging }
    }

    /// Pixels.
    pub(super) fn viewport(&self) -> Viewport {
        self.viewport
    }

    /// Samples from a row to the next in a copy.
    pub(super) fn stride(&self) -> usize {
        row_bytes(self.viewport) as usize / 4
    }

    /// A buffer on this side for so many copies of an image.
    pub(super) fn new_staging(&self, gpu: &Gpu, images: u64) -> wgpu::Buffer {
        staging(gpu, self.viewport, images)
    }

    /// Encodes a copy of the depth target to the beginning of `to`.
    pub(super) fn copy_depth(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Buffer) {
        self.copy(encoder, &self.depth, to, 0);
    }

    pub(super) fn ids_view(&self) -> Option<&wgpu::TextureView> {
        self.ids.as_ref().map(|(_, view)| view)
    }

    /// Copies the images at the end of `encoder`, submits it and waits.
    pub(super) fn read_back(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
    ) -> Result<ReadBack, OracleError> {
        self.copy(&mut encoder, &self.depth, &self.staging, 0);
        if let Some((ids, _)) = &self.ids {
            self.copy(&mut encoder, ids, &self.staging, image_bytes(self.viewport));
        }
        let index = gpu.queue.submit([encoder.finish()]);
        let slice = self.staging.slice(..);
        slice.map_async(wgpu::MapMode::Read, |_| {});
        gpu.wait(Some(index))?;
        let read_back = {
            let mapped =
                slice.get_mapped_range().map_err(|error| OracleError::Lost(error.to_string()))?;
            let (depth, ids) = mapped.split_at(image_bytes(self.viewport) as usize);
            ReadBack {
                depth: self.depths(self.rows(depth)).collect(),
                parts: self.ids.is_some().then(|| self.rows(ids).collect()),
            }
        };
        self.staging.unmap();
        Ok(read_back)
    }

    /// Depths of words as the device stores them.
    pub(super) fn depths(&self, words: impl Iterator<Item = u32>) -> impl Iterator<Item = f32> {
        let order = self.order;
        words.map(move |word| order.on_device(f32::from_bits(word)))
    }

    /// Which way depth runs.
    pub(super) fn order(&self) -> DepthOrder {
        self.order
    }

    fn copy(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        to: &wgpu::Buffer,
        offset: u64,
    ) {
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: to,
                layout: wgpu::TexelCopyBufferLayout {
                    offset,
                    bytes_per_row: Some(row_bytes(self.viewport)),
                    rows_per_image: None,
                },
            },
            extent(self.viewport),
        );
    }

    /// The words of an image without the padding of its rows.
    fn rows<'a>(&self, bytes: &'a [u8]) -> impl Iterator<Item = u32> + 'a {
        let wide = self.viewport.width as usize * 4;
        bytes
            .chunks_exact(row_bytes(self.viewport) as usize)
            .flat_map(move |row| row[..wide].chunks_exact(4))
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
    }
}

fn staging(gpu: &Gpu, viewport: Viewport, images: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: image_bytes(viewport) * images,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn extent(viewport: Viewport) -> wgpu::Extent3d {
    wgpu::Extent3d { width: viewport.width, height: viewport.height, depth_or_array_layers: 1 }
}

/// Rows in a buffer begin at multiples of 256 bytes.
fn row_bytes(viewport: Viewport) -> u32 {
    (viewport.width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

fn image_bytes(viewport: Viewport) -> u64 {
    u64::from(row_bytes(viewport)) * u64::from(viewport.height)
}
