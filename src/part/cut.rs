//! Stub.
use super::{PartedMesh, PartitionKnobs};
use crate::scene::Mesh;
pub(super) fn cut(_: &Mesh, _: PartitionKnobs) -> PartedMesh {
    unreachable!()
}
