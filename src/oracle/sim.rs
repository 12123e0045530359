//! The simulated device: the reference rasterizer behind the command stream. It answers every
//! question exactly and at once; draws between two questions go to the renderer together.

use plainsight_reference::fast::Instance;
use plainsight_reference::{Draw, Faces, Image, fast};

use super::batches::Batches;
use super::proxy_mesh::{box_triangles, hull_corners, hull_fan};
use super::{
    Answer, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Replayed, Residency,
    Stage, Step,
};
use crate::part::{PartId, Partition};

/// The reference z-buffer as an oracle.
pub struct Sim {
    stage: Stage,
    image: Image,
    matrices: Vec<[f32; 16]>,
    waiting: Vec<PartId>,
    answers: Batches,
    /// Where memory is limited: what a device would hold, and the steps that led there.
    residency: Option<(Residency, Replayed)>,
    steps: Vec<Step>,
}

/// What the naive renderer needs of one part.
///
/// # Panics
/// For a part or an object that does not exist.
#[must_use]
pub fn part_draw<'a>(partition: &'a Partition, part: PartId, matrices: &[[f32; 16]]) -> Draw<'a> {
    let (object, local) = partition.locate(part);
    let mesh = partition.mesh(object);
    let this = &mesh.parts[local as usize];
    let (triangles, ranks) = mesh.triangles_of(this);
    Draw {
        positions: mesh.positions_of(this),
        triangles,
        ranks,
        first_draw: partition.first_draw(object),
        clip_from_object: matrices[object.0 as usize],
        faces: Faces::Both,
    }
}

/// What the fast renderer needs of one part.
///
/// # Panics
/// For a part or an object that does not exist.
#[must_use]
pub fn part_instance<'a>(
    partition: &'a Partition,
    part: PartId,
    matrices: &[[f32; 16]],
) -> Instance<'a> {
    let (object, local) = partition.locate(part);
    let mesh = &partition.mesh(object).drawable[local as usize];
    let matrix = matrices[object.0 as usize];
    Instance::new(mesh, partition.first_draw(object), matrix, Faces::Both)
}

impl Sim {
    /// An image of its own over the stage.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    #[must_use]
    pub fn new(stage: Stage) -> Self {
        let image = Image::ordered(stage.viewport, stage.depth);
        let residency = stage.memory.map(|knobs| {
            (Residency::new(&stage.partition, knobs), Replayed::new(&stage.partition, knobs))
        });
        Self {
            stage,
            image,
            matrices: Vec::new(),
            waiting: Vec::new(),
            answers: Batches::default(),
            residency,
            steps: Vec::new(),
        }
    }

    /// The image as it is, with everything drawn so far.
    pub(super) fn image(&mut self) -> &Image {
        self.flush();
        &self.image
    }

    fn flush(&mut self) {
        let Self { stage, image, matrices, waiting, .. } = self;
        if !waiting.is_empty() {
            let instance = |&part: &PartId| part_instance(&stage.partition, part, matrices);
            let instances: Vec<Instance<'_>> = waiting.iter().map(instance).collect();
            fast::draw(image, &instances, stage.render);
            waiting.clear();
        }
    }
}

/// As many as a box has triangles, and a hull at most.
const RANKS: [u32; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
/// Of what comes in clip space with w = 1.
const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

impl Proxy {
    /// Whether any of its samples passes against `image`: the reference's answer to a question about it.
    /// Of a rectangle or hull the image must have the viewport that it was made for.
    #[must_use]
    pub fn shows(&self, image: &Image) -> bool {
        let any = |positions: &[[f32; 3]], triangles: &[[u32; 3]], clip_from_object| {
            let ranks = &RANKS[..triangles.len()];
            let (first_draw, faces) = (0, Faces::Both);
            let draw = Draw { positions, triangles, ranks, first_draw, clip_from_object, faces };
            fast::any(image, &draw)
        };
        match *self {
            Self::Rectangle { min, max, depth } => image.any_rectangle(min, max, depth),
            Self::Hull { hull, depth, .. } => {
                let corners = hull_corners(image.viewport(), &hull, depth);
                any(&corners, &hull_fan()[..hull.corners().len().saturating_sub(2)], IDENTITY)
            }
            Self::Box { clip_from_box, min, max } => {
                let (positions, triangles) = box_triangles(min, max);
                any(&positions, &triangles, clip_from_box)
            }
        }
    }
}

impl Oracle for Sim {
    fn name(&self) -> &'static str {
        "sim"
    }

    fn memory(&self) -> Option<Memory> {
        self.residency.as_ref().map(|(residency, _)| residency.counts())
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.image.clear();
        self.matrices.clear();
        self.matrices.extend_from_slice(view.clip_from_object);
        self.waiting.clear();
        self.answers.clear();
        if let Some((residency, replayed)) = &mut self.residency {
            self.steps.clear();
            residency.begin_frame(view, &mut self.steps);
            replayed.follow(&self.steps);
        }
        Ok(())
    }

    fn draw_part(&mut self, part: PartId) {
        if let Some((residency, replayed)) = &mut self.residency {
            let (object, _) = self.stage.partition.locate(part);
            let mesh = self.stage.partition.mesh_index(object);
            self.steps.clear();
            residency.need(mesh, &mut self.steps);
            replayed.follow(&self.steps);
            replayed.draws(mesh);
        }
        self.waiting.push(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        self.flush();
        let visible = proxies.iter().any(|proxy| proxy.shows(&self.image));
        self.answers.answer(visible)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        // A device draws what it is sent: frames without questions are timed with their drawing too.
        self.flush();
        self.answers.submit();
        Ok(())
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.answers.collect(answers);
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        self.flush();
        Ok(Some(ReadBack { depth: self.image.depths(), parts: None }))
    }

    fn check(&self) -> Result<(), String> {
        self.residency.as_ref().map_or(Ok(()), |(residency, replayed)| replayed.check(residency))
    }

    fn reference_image(&self) -> Option<&Image> {
        Some(&self.image)
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}
