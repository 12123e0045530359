//! A scene's cut meshes as glTF 2.0: a mesh a cut mesh, a primitive a part, a node an object where it stands
//! in frame 0. Positions are those of the parts, bit for bit. `extras` hold the ids.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::part::{ObjectId, PartedMesh};
use crate::run::World;

/// The two files.
pub struct GltfFile {
    /// The text file.
    pub json: String,
    /// What its buffer holds.
    pub binary: Vec<u8>,
}

/// Numbers of glTF's constants.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The scene; `binary_name` is what the text calls the file beside it.
#[must_use]
pub fn gltf_file(world: &World, binary_name: &str) -> GltfFile {
    let mut build = Build::default();
    // Meshes without a triangle cannot be said in glTF; their objects have none.
    let mut mesh_of: BTreeMap<usize, usize> = BTreeMap::new();
    let mut meshes: Vec<Value> = Vec::new();
    for (number, mesh) in world.partition.meshes().iter().enumerate() {
        let primitives = build.primitives(mesh);
        if !primitives.is_empty() {
            mesh_of.insert(number, meshes.len());
            let name = world.scene.meshes[number].name();
            meshes.push(json!({
                "name": name,
                "primitives": primitives,
                "extras": { "mesh": number },
            }));
        }
    }
    let node = |object: u32| {
        let id = ObjectId(object);
        let matrix = world.world_from_object(id, 0).to_cols_array();
        let mut node = json!({
            "name": format!("object {object}"),
            "matrix": matrix,
            "extras": { "object": object, "first_part": world.partition.first_part(id).0 },
        });
        if let Some(mesh) = mesh_of.get(&(world.partition.mesh_index(id) as usize)) {
            node["mesh"] = json!(mesh);
        }
        node
    };
    let nodes: Vec<Value> = (0..world.partition.object_count()).map(node).collect();
    let mut document = json!({
        "asset": { "version": "2.0", "generator": concat!("plainsight ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": world.scene.name, "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes,
    });
    // Empty arrays are not glTF.
    if !meshes.is_empty() {
        document["meshes"] = json!(meshes);
        document["accessors"] = json!(build.accessors);
        document["bufferViews"] = json!(build.views);
        document["buffers"] = json!([{ "uri": binary_name, "byteLength": build.binary.len() }]);
    }
    GltfFile { json: document.to_string(), binary: build.binary }
}

#[derive(Default)]
struct Build {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Build {
    fn primitives(&mut self, mesh: &PartedMesh) -> Vec<Value> {
        let mut primitives = Vec::new();
        for (local, part) in mesh.parts.iter().enumerate() {
            if part.triangle_count == 0 {
                continue;
            }
            let positions = mesh.positions_of(part);
            let bytes = positions.iter().flatten().flat_map(|c| c.to_le_bytes());
            let view = self.view(bytes, ARRAY_BUFFER);
            let bound = |start: f32, pick: fn(f32, f32) -> f32| -> [f32; 3] {
                let axis = |i: usize| positions.iter().fold(start, |all, p| pick(all, p[i]));
                std::array::from_fn(axis)
            };
            self.accessors.push(json!({
                "bufferView": view,
                "componentType": FLOAT,
                "count": positions.len(),
                "type": "VEC3",
                "min": bound(f32::INFINITY, f32::min),
                "max": bound(f32::NEG_INFINITY, f32::max),
            }));
            let (triangles, _) = mesh.triangles_of(part);
            let bytes = triangles.iter().flatten().flat_map(|i| i.to_le_bytes());
            let view = self.view(bytes, ELEMENT_ARRAY_BUFFER);
            self.accessors.push(json!({
                "bufferView": view,
                "componentType": UNSIGNED_INT,
                "count": triangles.len() * 3,
                "type": "SCALAR",
            }));
            let indices = self.accessors.len() - 1;
            primitives.push(json!({
                "attributes": { "POSITION": indices - 1 },
                "indices": indices,
                "mode": 4,
                "extras": { "part": local },
            }));
        }
        primitives
    }

    /// Appends a run of four-byte numbers; returns the view's number.
    fn view(&mut self, bytes: impl Iterator<Item = u8>, target: u32) -> usize {
        let offset = self.binary.len();
        self.binary.extend(bytes);
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": offset,
            "byteLength": self.binary.len() - offset,
            "target": target,
        }));
        self.views.len() - 1
    }
}
