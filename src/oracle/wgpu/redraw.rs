//! Parts drawn again in the order of draw indices, with their ids: what the device image check looks at.

use super::images::Images;
use super::stage::{DrawnObject, GpuStage};
use crate::part::{ObjectId, PartId};

/// Draws `parts`, ascending, in draw-index order into `encoder`. `drawn_object`: what the shader is told
/// of an object.
pub(super) fn encode_redraw(
    stage: &GpuStage,
    drawn_object: &dyn Fn(ObjectId) -> DrawnObject,
    encoder: &mut wgpu::CommandEncoder,
    images: &Images,
    parts: &[PartId],
) {
    let partition = &stage.stage.partition;
    let mut runs: Vec<(ObjectId, std::ops::Range<u32>, bool)> = Vec::new();
    let mut picked: Vec<[u32; 3]> = Vec::new();
    let mut rest = parts;
    while let Some(&part) = rest.first() {
        let (object, _) = partition.locate(part);
        let first = partition.first_part(object).0;
        let mesh = partition.mesh(object);
        let end = first + mesh.parts.len() as u32;
        let (these, later) = rest.split_at(rest.partition_point(|p| p.0 < end));
        rest = later;
        if these.len() == mesh.parts.len() {
            runs.push((object, 0..mesh.triangles.len() as u32 * 3, true));
            continue;
        }
        let mut wanted = vec![false; mesh.parts.len()];
        these.iter().for_each(|p| wanted[(p.0 - first) as usize] = true);
        let ranked = &stage.meshes[partition.mesh_index(object) as usize].ranked;
        let from = picked.len() as u32 * 3;
        let of = ranked.iter().zip(&mesh.part_of_rank);
        picked.extend(of.filter(|(_, part)| wanted[**part as usize]).map(|(t, _)| *t));
        runs.push((object, from..picked.len() as u32 * 3, false));
    }
    let device = &stage.gpu.device;
    let size = (size_of_val(picked.as_slice()) as u64).max(16);
    let usage = wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST;
    let indices = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size,
        usage,
        mapped_at_creation: false,
    });
    stage.gpu.queue.write_buffer(&indices, 0, bytemuck::cast_slice(&picked));
    let ids = images.ids_view().map(|view| wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
            store: wgpu::StoreOp::Store,
        },
    });
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[ids],
        depth_stencil_attachment: Some(
            images.depth_attachment(wgpu::LoadOp::Clear(stage.clear_depth())),
        ),
        ..Default::default()
    });
    pass.set_pipeline(&stage.drawing.draw_ids);
    for (object, run, whole) in runs {
        let mesh = &stage.meshes[partition.mesh_index(object) as usize];
        pass.set_vertex_buffer(0, mesh.parts.vertices.slice(..));
        let from = if whole { &mesh.by_rank } else { &indices };
        pass.set_index_buffer(from.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_immediates(0, bytemuck::bytes_of(&drawn_object(object)));
        pass.draw_indexed(run, 0, 0..1);
    }
}
