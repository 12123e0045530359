//! Faults of what a culler is shown: another camera than the one that draws, old boxes, no margins. The
//! culler itself is a sound one; only its view of the frame is wrong.

use glam::{DMat4, DVec4};

use super::{Fault, Rig, history};
use crate::cull::{Culler, CullerSetup, Full, FullKnobs, ObjectView, Pen, View, ViewFrustum};
use crate::math::{Aabb, ClipError};
use crate::oracle::OracleError;
use crate::scene::Lens;

/// What a wrong view may change.
struct Shown {
    clip_from_world: DMat4,
    objects: Vec<ObjectView>,
}

impl Shown {
    /// The same objects under another matrix from the world.
    fn under(&mut self, clip_from_world: DMat4) {
        let change = clip_from_world * self.clip_from_world.inverse();
        for object in &mut self.objects {
            object.clip_from_object = change * object.clip_from_object;
        }
        self.clip_from_world = clip_from_world;
    }
}

/// What a wrong view may remember.
#[derive(Default)]
struct Memory {
    /// Of the latest first view.
    first_view: Option<DMat4>,
    /// Object to world, in frame 0.
    world_from_object: Vec<DMat4>,
}

type Wrong = fn(&View<'_>, &mut Shown, &mut Memory);

/// A sound culler that is shown the wrong thing.
struct Misled {
    inner: Box<dyn Culler>,
    wrong: Wrong,
    memory: Memory,
}

impl Culler for Misled {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let (clip_from_world, objects) = (view.clip_from_world, view.objects.to_vec());
        let mut shown = Shown { clip_from_world, objects };
        (self.wrong)(view, &mut shown, &mut self.memory);
        let Shown { clip_from_world, objects } = &shown;
        self.inner.frame(&View { clip_from_world: *clip_from_world, objects, ..*view }, pen)
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        self.inner.check(boxes)
    }
}

fn misled(inner: Box<dyn Culler>, wrong: Wrong) -> Box<dyn Culler> {
    Box::new(Misled { inner, wrong, memory: Memory::default() })
}

fn full(setup: CullerSetup, wrong: Wrong) -> Box<dyn Culler> {
    misled(Box::new(Full::new(setup, FullKnobs::default())), wrong)
}

fn vfc(setup: CullerSetup, wrong: Wrong) -> Box<dyn Culler> {
    misled(Box::new(ViewFrustum::new(setup)), wrong)
}

fn symmetric(view: &View<'_>, shown: &mut Shown, _: &mut Memory) {
    let mut camera = view.camera;
    if let Lens::Perspective { shift, .. } = &mut camera.lens {
        *shift = [0.0; 2];
    }
    shown.under(camera.clip_from_world(view.viewport, view.depth));
}

fn half_of_half(view: &View<'_>, shown: &mut Shown, _: &mut Memory) {
    let mut camera = view.camera;
    if let Lens::Perspective { fov_y, .. } = &mut camera.lens {
        *fov_y *= 0.5;
    }
    shown.under(camera.clip_from_world(view.viewport, view.depth));
}

fn first_eye(view: &View<'_>, shown: &mut Shown, memory: &mut Memory) {
    if view.view == 0 {
        memory.first_view = Some(view.clip_from_world);
    }
    shown.under(memory.first_view.unwrap_or(view.clip_from_world));
}

/// Notes where objects are in frame 0.
fn remember(view: &View<'_>, memory: &mut Memory) {
    let world = view.clip_from_world.inverse();
    if view.frame == 0 {
        memory.world_from_object =
            view.objects.iter().map(|object| world * object.clip_from_object).collect();
    }
}

/// Things are where they are, in the pose that they had at first.
fn rest_pose(view: &View<'_>, shown: &mut Shown, memory: &mut Memory) {
    remember(view, memory);
    let world = view.clip_from_world.inverse();
    for (object, rest) in shown.objects.iter_mut().zip(&memory.world_from_object) {
        let w_axis = (world * object.clip_from_object).w_axis;
        object.clip_from_object = view.clip_from_world * DMat4 { w_axis, ..*rest };
    }
}

fn old_boxes(view: &View<'_>, shown: &mut Shown, memory: &mut Memory) {
    remember(view, memory);
    for (object, then) in shown.objects.iter_mut().zip(&memory.world_from_object) {
        object.clip_from_object = view.clip_from_world * *then;
    }
}

fn single_precision(_: &View<'_>, shown: &mut Shown, _: &mut Memory) {
    let rounded = |column: DVec4| column.as_vec4().as_dvec4();
    let round = |m: DMat4| {
        DMat4::from_cols(rounded(m.x_axis), rounded(m.y_axis), rounded(m.z_axis), rounded(m.w_axis))
    };
    let world = shown.clip_from_world.inverse();
    for object in &mut shown.objects {
        // World matrices in f32, multiplied afterwards.
        let placed = round(world * object.clip_from_object);
        object.clip_from_object = round(shown.clip_from_world) * placed;
        object.error = ClipError::ZERO;
    }
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("taken-for-symmetric", 10),
        "an asymmetric frustum is taken for a symmetric one",
        &["hard/asymmetric", "hard/stereo"],
        (history::FULL, Rig { culler: |setup| full(setup, symmetric), ..history::FULL }),
    ),
    Fault::drops(
        ("first-eye-for-all", 11),
        "one eye's frustum is used for both",
        &["hard/stereo", "hard/split-screen"],
        (
            history::VFC,
            Rig { culler: |setup| vfc(setup, first_eye), keeps_views: true, ..history::VFC },
        ),
    ),
    Fault::drops(
        ("half-of-half-the-field", 13),
        "half the field of view is halved again",
        &["hard/orthographic", "hard/wide-angle", "hard/near-plane"],
        (history::VFC, Rig { culler: |setup| vfc(setup, half_of_half), ..history::VFC }),
    ),
    Fault::drops(
        ("rest-pose", 21),
        "an animated mesh keeps the box of its first pose, wherever it goes",
        &["hard/orthographic", "hard/pivots"],
        (history::FULL, Rig { culler: |setup| full(setup, rest_pose), ..history::FULL }),
    ),
    Fault::drops(
        ("old-boxes", 22),
        "things move and their boxes are those of the first frame",
        &["hard/stop-and-go", "hard/teleports"],
        (history::FULL, Rig { culler: |setup| full(setup, old_boxes), ..history::FULL }),
    ),
    Fault::drops(
        ("single-precision", 24),
        "matrices in single precision, a million units from the origin",
        &["hard/far-from-origin"],
        (history::FULL, Rig { culler: |setup| full(setup, single_precision), ..history::FULL }),
    ),
];
