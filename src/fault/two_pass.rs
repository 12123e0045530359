//! Two-pass occlusion culling, as engines do it today: parts that were visible in the last frame are drawn
//! first; then every part in the frustum is asked about against what they left, and those that show and
//! are not drawn yet follow. No tree, no postponement. Most of the bugs that engines shipped are in code
//! of this shape, so it carries their faults; without one it is held to the gate like any culler.

use glam::{DMat4, DVec3};

use super::{Fault, Rig};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::index::{Index, List};
use crate::math::{Aabb, ClipBox, PixelRectangle, Projection};
use crate::oracle::{Answer, Oracle, OracleError, Proxy, Sim, hierarchical_z::HierarchicalZ};
use crate::part::PartId;
use crate::scene::Lens;

/// What is broken; each is a bug that shipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    /// The place where the second pass writes is not set back between frames, and runs off the end.
    LateOffset,
    /// Depth is that of the nearest point by Euclidean distance.
    EuclideanNearest,
    /// A box with a corner behind the near plane counts as outside.
    NearPlane,
    /// A box without volume counts as empty.
    FlatIsEmpty,
    /// What is smaller than a pixel by its diagonal counts as showing nothing.
    TinyByDiagonal,
    /// The answer of the last frame decides, although things have moved since.
    LateAnswer,
    /// The first view's verdict serves the other views as well.
    OtherView,
    /// An object that is exempt from culling is in neither list.
    ExemptVanishes,
    /// What moves is tested where its mesh was made.
    Untransformed,
    /// The box is that of the first half of the vertices.
    SticksOut,
    /// The box in the world is that of two corners carried over.
    TwoCorners,
    /// Boxes that cannot be projected count as outside.
    FailsClosed,
    /// A distance that is not a number is not near.
    NotANumber,
}

/// Of so many objects, one is exempt from culling.
const EXEMPT: u32 = 5;

/// What is kept of one view.
#[derive(Default)]
struct Eye {
    /// Parts that the latest answers showed.
    seen: Vec<bool>,
}

/// The culler.
struct TwoPass {
    flaw: Option<Flaw>,
    eyes: Vec<Eye>,
    /// Where the second pass writes its next part.
    offset: usize,
}

impl TwoPass {
    fn new(flaw: Option<Flaw>) -> Self {
        Self { flaw, eyes: Vec::new(), offset: 0 }
    }

    fn has(&self, flaw: Flaw) -> bool {
        self.flaw == Some(flaw)
    }

    fn bounds(&self, view: &View<'_>, part: PartId) -> Aabb {
        let (object, local) = view.partition.locate(part);
        let mesh = view.partition.mesh(object);
        let this = &mesh.parts[local as usize];
        if self.has(Flaw::SticksOut) {
            let positions = mesh.positions_of(this);
            return Aabb::of_points(&positions[..positions.len().div_ceil(2)]);
        }
        this.bounds
    }

    fn project(&self, view: &View<'_>, part: PartId) -> Projection {
        let (object, _) = view.partition.locate(part);
        let seen = &view.objects[object.0 as usize];
        let (aabb, pixels) = (self.bounds(view, part), view.viewport);
        if aabb.is_empty() || (self.has(Flaw::FlatIsEmpty) && aabb.size().min_element() <= 0.0) {
            return Projection::Nowhere;
        }
        let moves = || view.moves.has(object);
        let clip = match self.flaw {
            Some(Flaw::Untransformed) if moves() => &view.clip_from_world,
            _ => &seen.clip_from_object,
        };
        let corners = || aabb.corners().map(|corner| *clip * corner.extend(1.0));
        match self.flaw {
            Some(Flaw::NearPlane) if corners().iter().any(|c| c.w <= 0.0 || c.z < 0.0) => {
                return Projection::Nowhere;
            }
            Some(Flaw::TinyByDiagonal) if diagonal_pixels(view, clip, &aabb) < 1.0 => {
                return Projection::Nowhere;
            }
            Some(Flaw::TwoCorners) => {
                let world = view.clip_from_world.inverse() * *clip;
                let [low, high] = [aabb.min, aabb.max].map(|c| world.transform_point3(c));
                let carried = Aabb::new(low, high);
                let outside =
                    ClipBox::new(&carried, &view.clip_from_world, &seen.error, view.depth)
                        .outside_frustum();
                if carried.is_empty() || outside {
                    return Projection::Nowhere;
                }
            }
            Some(Flaw::NotANumber) => {
                // What is no number is not near.
                let near = aabb.center().distance(seen.eye) < f64::INFINITY;
                if !near {
                    return Projection::Nowhere;
                }
            }
            _ => {}
        }
        let found =
            ClipBox::new(&aabb, clip, &seen.error, view.depth).project(pixels.width, pixels.height);
        match (self.flaw, found) {
            (Some(Flaw::FailsClosed), Projection::Unbounded) => Projection::Nowhere,
            (Some(Flaw::EuclideanNearest), Projection::Within { rectangle, .. }) => {
                let world = view.clip_from_world.inverse() * *clip;
                let depth = euclidean_depth(view, &aabb.transformed(&world));
                Projection::Within { rectangle, depth }
            }
            (_, found) => found,
        }
    }

    /// Whether a part of the second pass is written at all.
    fn written(&mut self, parts: usize) -> bool {
        if !self.has(Flaw::LateOffset) {
            return true;
        }
        self.offset += 1;
        self.offset <= parts
    }
}

/// The diagonal of a box over its distance, in pixels.
fn diagonal_pixels(view: &View<'_>, clip: &DMat4, aabb: &Aabb) -> f64 {
    let world = view.clip_from_world.inverse() * *clip;
    let carried = aabb.transformed(&world);
    let distance = carried.center().distance(view.camera.eye);
    let height = view.camera.lens.height_at(distance);
    carried.size().length() / height * f64::from(view.viewport.height)
}

/// The depth of a point straight ahead, as far away as the nearest point of the box.
fn euclidean_depth(view: &View<'_>, world: &Aabb) -> f32 {
    let (camera, eye) = (view.camera, view.camera.eye);
    let nearest: DVec3 = eye.clamp(world.min, world.max);
    let ahead = eye + camera.forward * nearest.distance(eye).max(camera.near);
    let clip = view.clip_from_world * ahead.extend(1.0);
    let depth =
        if matches!(camera.lens, Lens::Perspective { .. }) { clip.z / clip.w } else { clip.z };
    let [near, far] = view.depth.range();
    (depth as f32).clamp(near, far)
}

impl Culler for TwoPass {
    fn name(&self) -> &str {
        "two-pass"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let parts = view.partition.part_count();
        let number = view.view as usize;
        if self.eyes.len() <= number {
            self.eyes.resize_with(number + 1, Eye::default);
        }
        let mut eye = std::mem::take(&mut self.eyes[number]);
        eye.seen.resize(parts as usize, false);
        if view.view > 0 && self.has(Flaw::OtherView) {
            eye.seen.clone_from(&self.eyes[0].seen);
        }
        let (mut questions, mut late) = (Vec::new(), Vec::new());
        for part in (0..parts).map(PartId) {
            if self.has(Flaw::ExemptVanishes)
                && view.partition.locate(part).0.0.is_multiple_of(EXEMPT)
            {
                continue;
            }
            match self.project(view, part) {
                Projection::Nowhere => eye.seen[part.0 as usize] = false,
                Projection::Unbounded => pen.draw(part),
                Projection::Within { rectangle: PixelRectangle { min, max }, depth } => {
                    if eye.seen[part.0 as usize] {
                        pen.draw(part);
                    }
                    questions.push((part, Proxy::Rectangle { min, max, depth }));
                }
            }
        }
        if view.view > 0 && self.has(Flaw::OtherView) {
            self.eyes[number] = eye;
            return Ok(());
        }
        for (_, proxy) in &questions {
            pen.ask(proxy);
        }
        let mut answers: Vec<Answer> = Vec::new();
        pen.round_trip(&mut answers)?;
        for ((part, _), answer) in questions.iter().zip(&answers) {
            let before = std::mem::replace(&mut eye.seen[part.0 as usize], answer.visible);
            let shows =
                if self.has(Flaw::LateAnswer) && view.frame > 0 { before } else { answer.visible };
            if shows {
                late.push(*part);
            }
        }
        for part in late {
            if self.written(parts as usize) {
                pen.draw(part);
            }
        }
        self.eyes[number] = eye;
        Ok(())
    }
}

fn list(entries: &[crate::index::Entry]) -> Box<dyn Index> {
    Box::new(List::new(entries))
}

fn sound(_: CullerSetup) -> Box<dyn Culler> {
    Box::new(TwoPass::new(None))
}

fn sim(stage: crate::oracle::Stage) -> Box<dyn Oracle> {
    Box::new(Sim::new(stage))
}

/// Exact answers.
pub(super) const EXACT: Rig = Rig {
    name: "two-pass on sim",
    culler: sound,
    index: list,
    oracle: sim,
    keeps_views: true,
    alter: None,
};
/// As engines have it.
pub(super) const PYRAMID: Rig = Rig {
    name: "two-pass on hierarchical-z",
    oracle: |stage| Box::new(HierarchicalZ::new(stage)),
    ..EXACT
};

macro_rules! with {
    ($flaw:ident) => {
        Rig { culler: |_| Box::new(TwoPass::new(Some(Flaw::$flaw))), ..EXACT }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("late-offset", 7),
        "the second pass writes on where the last frame's ended, and runs off the end of its buffer",
        &["hard/many", "hard/ping-pong"],
        (EXACT, with!(LateOffset)),
    ),
    Fault::drops(
        ("euclidean-nearest", 8),
        "the nearest point by Euclidean distance, compared as view depth",
        &["hard/behind-a-gap", "hard/wide-angle"],
        (EXACT, with!(EuclideanNearest)),
    ),
    Fault::drops(
        ("near-plane", 12),
        "a box with a corner behind the near plane counts as outside",
        &["hard/near-plane", "hard/eye-on-box"],
        (EXACT, with!(NearPlane)),
    ),
    Fault::drops(
        ("fails-closed", 17),
        "a box that cannot be projected counts as outside",
        &["hard/eye-on-plane", "hard/eye-on-box"],
        (EXACT, with!(FailsClosed)),
    ),
    Fault::drops(
        ("not-a-number", 17),
        "a matrix without an inverse gives a distance that is no number, which fails closed",
        &["hard/collapsed"],
        (EXACT, with!(NotANumber)),
    ),
    Fault::drops(
        ("two-corners", 19),
        "the box in the world is that of two corners carried over: inside out under negative scale",
        &["hard/scales"],
        (EXACT, with!(TwoCorners)),
    ),
    Fault::drops(
        ("flat-is-empty", 23),
        "a box without volume counts as empty",
        &["hard/flat", "hard/pinholes"],
        (EXACT, with!(FlatIsEmpty)),
    ),
    Fault::drops(
        ("tiny-by-diagonal", 25),
        "what is smaller than a pixel by its diagonal counts as showing nothing",
        &["hard/specks"],
        (EXACT, with!(TinyByDiagonal)),
    ),
    Fault::drops(
        ("late-answer", 36),
        "the last frame's answer decides after the geometry has changed",
        &["hard/teleports", "hard/ping-pong"],
        (EXACT, with!(LateAnswer)),
    ),
    Fault::drops(
        ("sticks-out", 38),
        "geometry sticks out of the box that is asked about",
        &["hard/orthographic", "hard/layers"],
        (EXACT, with!(SticksOut)),
    ),
    Fault::drops(
        ("untransformed", 39),
        "what moves is tested where its mesh was made",
        &["hard/stop-and-go", "hard/orthographic"],
        (EXACT, with!(Untransformed)),
    ),
    Fault::drops(
        ("other-view", 52),
        "one camera's verdict overrides another's",
        &["hard/stereo", "hard/split-screen"],
        (EXACT, with!(OtherView)),
    ),
    Fault::drops(
        ("exempt-vanishes", 54),
        "an object that is exempt from culling is in neither list",
        &["hard/orthographic", "hard/layers"],
        (EXACT, with!(ExemptVanishes)),
    ),
];
