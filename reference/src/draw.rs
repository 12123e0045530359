//! What is drawn: triangles under one matrix, and the vertex transform.

use crate::clip::ClipVertex;

/// Which faces of a triangle are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Faces {
    /// Both: nothing is assumed closed.
    #[default]
    Both,
    /// Only triangles whose vertices go round counter-clockwise as seen on the screen.
    CounterClockwise,
}

/// One run of triangles under one matrix.
#[derive(Clone, Copy, Debug)]
pub struct Draw<'a> {
    /// Positions in the object's space.
    pub positions: &'a [[f32; 3]],
    /// Three places in `positions` each.
    pub triangles: &'a [[u32; 3]],
    /// As many as `triangles`. The draw index of triangle i is `first_draw + ranks[i]`.
    pub ranks: &'a [u32],
    /// See `ranks`; every draw index is below `u32::MAX`.
    pub first_draw: u32,
    /// Object-to-clip matrix, column-major.
    pub clip_from_object: [f32; 16],
    /// Which faces count.
    pub faces: Faces,
}

impl Draw<'_> {
    /// The written vertex transform.
    pub(crate) fn clip_vertex(&self, vertex: u32) -> ClipVertex {
        transform(&self.clip_from_object, self.positions[vertex as usize])
    }

    /// What is stored for triangle `i`: its draw index plus one.
    ///
    /// # Panics
    /// Where the draw index does not fit.
    pub(crate) fn stored_id(&self, i: usize) -> u32 {
        let draw = self.first_draw.checked_add(self.ranks[i]).expect("a draw index fits 32 bits");
        draw.checked_add(1).expect("the largest draw index is reserved")
    }
}

/// `((m₀·x + m₄·y) + m₈·z) + m₁₂` for each row.
pub(crate) fn transform(m: &[f32; 16], [x, y, z]: [f32; 3]) -> ClipVertex {
    std::array::from_fn(|row| ((m[row] * x + m[4 + row] * y) + m[8 + row] * z) + m[12 + row])
}
