//! The peer: Mesa's lavapipe through wgpu, doing the same work. Buffers are resident, everything goes in
//! one instanced draw, depth and R32Uint ids are written; a frame is encode, submit, wait.

use plainsight_reference::Viewport;
use wgpu::util::DeviceExt;

use super::works::Work;

const SHADER: &str = "
@group(0) @binding(0) var<storage, read> clip_from_object: array<mat4x4<f32>>;
struct Varying {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) object: u32,
}
@vertex
fn vertex(@location(0) p: vec3<f32>, @builtin(instance_index) object: u32) -> Varying {
    let m = clip_from_object[object];
    return Varying(((m[0] * p.x + m[1] * p.y) + m[2] * p.z) + m[3], object + 1u);
}
@fragment
fn fragment(in: Varying) -> @location(0) u32 {
    return in.object;
}
";

/// One work on the device.
pub(crate) struct Lavapipe {
    pub(crate) name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    index_count: u32,
    instances: u32,
    ids: wgpu::Texture,
    depth: wgpu::TextureView,
    viewport: Viewport,
}

impl Lavapipe {
    /// Uploads the work to the first CPU adapter.
    pub(crate) fn new(work: &Work) -> Result<Self, String> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        descriptor.flags = wgpu::InstanceFlags::empty();
        let instance = wgpu::Instance::new(descriptor);
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let is_cpu = |a: &wgpu::Adapter| a.get_info().device_type == wgpu::DeviceType::Cpu;
        let adapter = adapters
            .into_iter()
            .find(is_cpu)
            .ok_or("no lavapipe found; tests/run.sh installs it (Debian: mesa-vulkan-drivers)")?;
        let info = adapter.get_info();
        let limits =
            wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&limits)).map_err(|e| e.to_string())?;
        let upload = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: None,
                contents,
                usage,
            })
        };
        let vertices = upload(bytemuck::cast_slice(&work.positions), wgpu::BufferUsages::VERTEX);
        let indices = upload(bytemuck::cast_slice(&work.triangles), wgpu::BufferUsages::INDEX);
        let matrices = upload(bytemuck::cast_slice(&work.matrices), wgpu::BufferUsages::STORAGE);
        let pipeline = pipeline(&device);
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: matrices.as_entire_binding() }],
        });
        let viewport = work.viewport;
        let texture = |format| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(viewport),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            })
        };
        let depth = texture(wgpu::TextureFormat::Depth32Float).create_view(&Default::default());
        Ok(Self {
            name: format!("{} ({})", info.name, info.driver_info),
            pipeline,
            bindings,
            vertices,
            indices,
            index_count: 3 * work.triangles.len() as u32,
            instances: work.matrices.len() as u32,
            ids: texture(wgpu::TextureFormat::R32Uint),
            depth,
            viewport,
            device,
            queue,
        })
    }

    fn encode(&self) -> wgpu::CommandEncoder {
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let ids = self.ids.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &ids,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.index_count, 0, 0..self.instances);
        drop(pass);
        encoder
    }

    fn wait(&self) -> Result<(), String> {
        let poll = wgpu::PollType::Wait { submission_index: None, timeout: None };
        self.device.poll(poll).map(|_| ()).map_err(|e| e.to_string())
    }

    /// One frame.
    pub(crate) fn frame(&self) -> Result<(), String> {
        self.queue.submit([self.encode().finish()]);
        self.wait()
    }

    /// Object plus one at each sample, row by row, 0 where nothing was drawn.
    pub(crate) fn objects(&self) -> Result<Vec<u32>, String> {
        let row = (self.viewport.width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row) * u64::from(self.viewport.height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.encode();
        encoder.copy_texture_to_buffer(
            self.ids.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: None,
                },
            },
            extent(self.viewport),
        );
        self.queue.submit([encoder.finish()]);
        staging.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.wait()?;
        let mapped = staging.slice(..).get_mapped_range().map_err(|e| e.to_string())?;
        Ok(mapped
            .chunks_exact(row as usize)
            .flat_map(|bytes| bytes[..self.viewport.width as usize * 4].chunks_exact(4))
            .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
            .collect())
    }
}

fn extent(viewport: Viewport) -> wgpu::Extent3d {
    wgpu::Extent3d { width: viewport.width, height: viewport.height, depth_or_array_layers: 1 }
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &shader,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3],
            })],
        },
        primitive: wgpu::PrimitiveState {
            front_face: wgpu::FrontFace::Ccw,
            cull_mode: Some(wgpu::Face::Back),
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &shader,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::TextureFormat::R32Uint.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
