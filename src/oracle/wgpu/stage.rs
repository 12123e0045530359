//! What stays on the device for a whole run: geometry and pipelines, shared by all oracles of a
//! scene.

use std::sync::{Arc, OnceLock};

use wgpu::util::DeviceExt;

use super::gpu::Gpu;
use super::pyramid;
use super::scene_size::Shape;
use crate::oracle::{OracleError, Stage};
use crate::part::PartedMesh;
use crate::scene::DepthOrder;

/// Depth of every target.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Part id plus one.
pub(super) const IDS: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// A vertex on the device: a position and the number of its part in the mesh. Parts share no
/// vertices, so all three corners of a triangle agree.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Vertex {
    position: [f32; 3],
    part: u32,
}

/// What the shader is told of an object before its parts are drawn.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct DrawnObject {
    /// Column-major.
    pub(super) clip_from_object: [f32; 16],
    pub(super) first_part: u32,
    /// The size of the structure is a multiple of 16 bytes.
    pub(super) padding: [u32; 3],
}

/// What drawing the parts of a mesh takes.
pub(super) struct GpuParts {
    pub(super) vertices: wgpu::Buffer,
    /// Grouped by part, counted from the part's first vertex.
    pub(super) by_part: wgpu::Buffer,
}

/// One mesh on the device.
pub(super) struct GpuMesh {
    pub(super) parts: GpuParts,
    /// In the order of ranks, counted from the mesh's first vertex.
    pub(super) by_rank: wgpu::Buffer,
    /// The same on this side, to pick parts from.
    pub(super) ranked: Vec<[u32; 3]>,
}

impl GpuParts {
    /// Uploads them; as many bytes as `mesh_bytes` says.
    pub(super) fn new(device: &wgpu::Device, mesh: &PartedMesh) -> Self {
        let mut vertices = Vec::with_capacity(mesh.positions.len());
        for (number, part) in mesh.parts.iter().enumerate() {
            let of = |&position: &[f32; 3]| Vertex { position, part: number as u32 };
            vertices.extend(mesh.positions_of(part).iter().map(of));
        }
        let (points, corners) = (wgpu::BufferUsages::VERTEX, wgpu::BufferUsages::INDEX);
        Self {
            vertices: buffer(device, bytemuck::cast_slice(&vertices), points),
            by_part: buffer(device, bytemuck::cast_slice(&mesh.triangles), corners),
        }
    }

    /// Gives the memory back at once; nothing on its way may use it.
    pub(super) fn destroy(&self) {
        self.vertices.destroy();
        self.by_part.destroy();
    }
}

/// What drawing and asking take, one set a device and depth order: drivers compile it for a tenth of a
/// second and longer.
pub(super) struct Drawing {
    /// Less, writes depth.
    pub(super) draw: wgpu::RenderPipeline,
    /// Less, writes depth and part ids.
    pub(super) draw_ids: wgpu::RenderPipeline,
    /// Less or equal, writes nothing.
    pub(super) ask: wgpu::RenderPipeline,
    /// Answers by maxima of depth.
    pub(super) pyramid: pyramid::Pipelines,
}

impl Drawing {
    /// Compiled anew.
    pub(super) fn new(device: &wgpu::Device, order: DepthOrder) -> Self {
        let pipelines = Pipelines::new(device, order);
        Self {
            draw: pipelines.part(None),
            draw_ids: pipelines.part(Some(IDS)),
            ask: pipelines.proxy(),
            pyramid: pyramid::Pipelines::new(device, order),
        }
    }
}

/// Geometry and pipelines of one scene.
pub struct GpuStage {
    pub(super) gpu: Arc<Gpu>,
    pub(super) stage: Stage,
    pub(super) meshes: Vec<GpuMesh>,
    pub(super) drawing: Arc<Drawing>,
    shapes: OnceLock<Vec<Vec<Shape>>>,
}

impl GpuStage {
    /// Shapes of the parts of each mesh, made when first needed.
    pub(super) fn shapes(&self) -> &[Vec<Shape>] {
        self.shapes.get_or_init(|| {
            let of = |mesh: &Arc<PartedMesh>| {
                mesh.parts.iter().map(|part| Shape::of(mesh, part)).collect()
            };
            self.stage.partition.meshes().iter().map(of).collect()
        })
    }

    /// What the depth target is cleared to.
    pub(super) fn clear_depth(&self) -> f32 {
        let [_, far] = self.stage.depth.range();
        self.stage.depth.on_device(far)
    }
}

impl GpuStage {
    /// Uploads every mesh once.
    ///
    /// # Errors
    /// [`OracleError::Lost`] where the device refuses.
    pub fn new(gpu: &Arc<Gpu>, stage: &Stage) -> Result<Arc<Self>, OracleError> {
        let device = &gpu.device;
        let limit = device.limits().max_texture_dimension_2d;
        if stage.viewport.width.max(stage.viewport.height) > limit {
            let what = format!("{} draws at most {limit} pixels a side", gpu.name());
            return Err(OracleError::Lost(what));
        }
        let meshes = stage.partition.meshes().iter().map(|mesh| upload(device, mesh)).collect();
        let made = Arc::new(Self {
            gpu: Arc::clone(gpu),
            stage: stage.clone(),
            meshes,
            drawing: gpu.drawing(stage.depth),
            shapes: OnceLock::new(),
        });
        gpu.wait(None)?;
        Ok(made)
    }
}

/// A comparison of depths as the device makes it, whose reversed depths are greater the nearer.
fn on_device(order: DepthOrder, compare: wgpu::CompareFunction) -> wgpu::CompareFunction {
    match (order, compare) {
        (DepthOrder::Reversed, wgpu::CompareFunction::Less) => wgpu::CompareFunction::Greater,
        (DepthOrder::Reversed, wgpu::CompareFunction::LessEqual) => {
            wgpu::CompareFunction::GreaterEqual
        }
        (_, compare) => compare,
    }
}

fn buffer(device: &wgpu::Device, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    // An empty mesh still has buffers to bind.
    let contents = if contents.is_empty() { &[0; 16] } else { contents };
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
}

fn upload(device: &wgpu::Device, mesh: &PartedMesh) -> GpuMesh {
    let mut absolute = Vec::with_capacity(mesh.triangles.len());
    for part in &mesh.parts {
        let from_first = |t: &[u32; 3]| t.map(|corner| corner + part.first_vertex);
        absolute.extend(mesh.triangles_of(part).0.iter().map(from_first));
    }
    let ranked: Vec<[u32; 3]> =
        mesh.triangle_of_rank.iter().map(|&place| absolute[place as usize]).collect();
    GpuMesh {
        parts: GpuParts::new(device, mesh),
        by_rank: buffer(device, bytemuck::cast_slice(&ranked), wgpu::BufferUsages::INDEX),
        ranked,
    }
}

struct Pipelines<'a> {
    device: &'a wgpu::Device,
    shader: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    order: DepthOrder,
}

impl<'a> Pipelines<'a> {
    fn new(device: &'a wgpu::Device, order: DepthOrder) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("shader.wgsl"));
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[],
            immediate_size: size_of::<DrawnObject>() as u32,
        });
        Self { device, shader, layout, order }
    }

    fn part(&self, ids: Option<wgpu::TextureFormat>) -> wgpu::RenderPipeline {
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let entry = if ids.is_some() { "part_vertex" } else { "depth_vertex" };
        self.build(entry, vertices, ids, (wgpu::CompareFunction::Less, true))
    }

    fn proxy(&self) -> wgpu::RenderPipeline {
        let attributes = wgpu::vertex_attr_array![0 => Float32x4];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: 16,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        self.build("proxy_vertex", vertices, None, (wgpu::CompareFunction::LessEqual, false))
    }

    fn build(
        &self,
        entry: &str,
        vertices: wgpu::VertexBufferLayout<'_>,
        ids: Option<wgpu::TextureFormat>,
        (compare, write): (wgpu::CompareFunction, bool),
    ) -> wgpu::RenderPipeline {
        let targets = [ids.map(wgpu::ColorTargetState::from)];
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.shader,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(vertices)],
            },
            // Both faces count, nothing is culled.
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(write),
                depth_compare: Some(on_device(self.order, compare)),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: ids.map(|_| wgpu::FragmentState {
                module: &self.shader,
                entry_point: Some("part_fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
