//! Cheaper questions than one query object each: rectangles are answered by a compute shader over
//! maxima of the depth target (tiles of 8 × 8 samples, blocks of 64 × 64). The answers are those of
//! occlusion queries, sample for sample; the cost is one pass over the target a batch and next to
//! nothing a question, where a query object costs its setting up and its rectangle's fill.
//!
//! The maxima are those of a hierarchical z-buffer (Greene, Kass & Miller 1993), built on the device.

use super::gpu::Gpu;
use crate::scene::{DepthOrder, Viewport};

/// Samples along a tile, and tiles along a block.
const SIDE: u32 = 8;
/// Questions of one workgroup; as in the shader.
const GROUP: u32 = 64;

/// A rectangle with its question's number in the batch.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Ask {
    pub(super) low: [u32; 2],
    pub(super) high: [u32; 2],
    pub(super) depth: f32,
    pub(super) question: u32,
}

/// Pipelines, made once a stage.
pub(super) struct Pipelines {
    layout: wgpu::BindGroupLayout,
    tiles: wgpu::ComputePipeline,
    blocks: wgpu::ComputePipeline,
    answer: wgpu::ComputePipeline,
}

/// Maxima of one target.
pub(super) struct Pyramid {
    tiles: wgpu::Buffer,
    blocks: wgpu::Buffer,
    groups: [[u32; 2]; 2],
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device, order: DepthOrder) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("pyramid.wgsl"));
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let storage = |read_only| wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let depth = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Depth,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[
                entry(0, depth),
                entry(1, storage(false)),
                entry(2, storage(false)),
                entry(3, storage(true)),
                entry(4, storage(false)),
                entry(5, storage(true)),
            ],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let reversed = f64::from(u8::from(order == DepthOrder::Reversed));
        let pipeline = |entry_point| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: Some(&pipeline_layout),
                module: &shader,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[("reversed", reversed)],
                    ..Default::default()
                },
                cache: None,
            })
        };
        let [tiles, blocks, answer] = ["reduce_tiles", "reduce_blocks", "answer"].map(pipeline);
        Self { layout, tiles, blocks, answer }
    }
}

impl Pyramid {
    pub(super) fn new(gpu: &Gpu, viewport: Viewport) -> Self {
        let tiles = [viewport.width, viewport.height].map(|side| side.div_ceil(SIDE));
        let blocks = tiles.map(|count| count.div_ceil(SIDE));
        let buffer = |[wide, tall]: [u32; 2]| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: u64::from(wide) * u64::from(tall) * 4,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            })
        };
        let groups = [tiles, blocks].map(|count| count.map(|n| n.div_ceil(SIDE)));
        Self { tiles: buffer(tiles), blocks: buffer(blocks), groups }
    }

    /// Encodes the answers to asks `run` of `asks` against what `depth` holds at this point: 1 is
    /// written over `answers` for every question that shows.
    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        (asks, answers): (&wgpu::Buffer, &wgpu::Buffer),
        run: std::ops::Range<u32>,
    ) {
        use wgpu::util::DeviceExt;
        let bounds = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(&[run.start, run.end]),
            usage: wgpu::BufferUsages::STORAGE,
        });
        let buffer = |binding, buffer: &wgpu::Buffer| (binding, buffer.clone());
        let buffers = [
            buffer(1, &self.tiles),
            buffer(2, &self.blocks),
            buffer(3, asks),
            buffer(4, answers),
            buffer(5, &bounds),
        ];
        let mut entries = vec![wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(depth),
        }];
        entries.extend(buffers.iter().map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: buffer.as_entire_binding(),
        }));
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipelines.layout,
            entries: &entries,
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &bindings, &[]);
        let [tiles, blocks] = self.groups;
        pass.set_pipeline(&pipelines.tiles);
        pass.dispatch_workgroups(tiles[0], tiles[1], 1);
        pass.set_pipeline(&pipelines.blocks);
        pass.dispatch_workgroups(blocks[0], blocks[1], 1);
        pass.set_pipeline(&pipelines.answer);
        pass.dispatch_workgroups((run.end - run.start).div_ceil(GROUP), 1, 1);
    }
}
