//! The lines that tell a culler of a scene; see the room's format.

use glam::DMat4;
use serde::Serialize;
use serde_json::json;

use super::VERSION;
use crate::math::Aabb;
use crate::part::{ObjectId, PartId};
use crate::run::{FrameState, World};
use crate::scene::{DepthOrder, Lens};

#[derive(Serialize)]
struct Moved {
    object: u32,
    world_from_object: [f64; 16],
    min: [f64; 3],
    max: [f64; 3],
    jumped: bool,
}

/// The first line.
#[must_use]
pub fn header_line(world: &World) -> String {
    let partition = &world.partition;
    let part = |id: u32| {
        let (object, primitive) = partition.locate(PartId(id));
        let this = partition.part(PartId(id));
        let Aabb { min, max } = this.bounds;
        json!({
            "object": object.0,
            "mesh": partition.mesh_index(object),
            "primitive": primitive,
            "triangles": this.triangle_count,
            "min": min.to_array(),
            "max": max.to_array(),
        })
    };
    let object = |id: u32| {
        let id = ObjectId(id);
        json!({
            "mesh": partition.mesh_index(id),
            "first_part": partition.first_part(id).0,
            "parts": partition.parts_of(id).count(),
        })
    };
    let viewport = world.scene.viewport;
    json!({
        "plainsight": "frames",
        "version": VERSION,
        "scene": world.scene.name,
        "seed": world.scene.seed,
        "frames": world.scene.frames,
        "views": world.views(),
        "viewport": [viewport.width, viewport.height],
        "depth": match world.scene.depth {
            DepthOrder::Forward => "forward",
            DepthOrder::Reversed => "reversed",
        },
        "parts": (0..partition.part_count()).map(part).collect::<Vec<_>>(),
        "objects": (0..partition.object_count()).map(object).collect::<Vec<_>>(),
    })
    .to_string()
}

/// The line of one view of a frame.
#[must_use]
pub fn frame_line(world: &World, state: &FrameState) -> String {
    let frame = state.moment.frame;
    let moved = |object: u32, jumped: bool| {
        let Aabb { min, max } = state.objects[object as usize].bounds;
        let placed: DMat4 = world.world_from_object(ObjectId(object), frame);
        Moved {
            object,
            world_from_object: placed.to_cols_array(),
            min: min.to_array(),
            max: max.to_array(),
            jumped,
        }
    };
    let moved: Vec<Moved> = if frame == 0 {
        (0..world.partition.object_count()).map(|object| moved(object, false)).collect()
    } else {
        let jumped = |id| state.jumped.binary_search(id).is_ok();
        state.moved.iter().map(|id| moved(id.0, jumped(id))).collect()
    };
    let camera = state.camera;
    let (perspective, height) = match camera.lens {
        Lens::Perspective { fov_y, shift } => (Some((fov_y, shift)), None),
        Lens::Orthographic { height } => (None, Some(height)),
    };
    let mut clip_from_world = state.clip_from_world.to_cols_array();
    if world.scene.depth == DepthOrder::Reversed {
        // An engine's z is positive.
        clip_from_world.iter_mut().skip(2).step_by(4).for_each(|z| *z = 0.0 - *z);
    }
    json!({
        "frame": frame,
        "view": state.moment.view,
        "eye": camera.eye.to_array(),
        "forward": camera.forward.to_array(),
        "fov_y": perspective.map(|(fov_y, _)| fov_y),
        "shift": perspective.map(|(_, shift)| shift),
        "height": height,
        "near": camera.near,
        "far": camera.far,
        "clip_from_world": clip_from_world,
        "moved": moved,
    })
    .to_string()
}
