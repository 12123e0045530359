//! Frustum culling by a tree of bounding volumes in f32, as engines keep it for many instances: boxes are
//! rounded to f32, parted at the median of their longest side, and looked at from the top. Made anew for
//! each frame; without a fault it is held to the gate like any culler.

use glam::{DVec3, Vec3};

use super::{Fault, Rig, two_pass};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::math::{Aabb, ClipBox, ClipError};
use crate::oracle::{Always, OracleError};
use crate::part::ObjectId;

/// How a box comes to be one of f32.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rounding {
    Outward,
    /// To the nearest.
    Nearest,
    /// A margin that is added in f32, as many units everywhere.
    FixedMargin,
}

/// That margin; far out it is less than half an ulp, and is lost.
const FIXED_MARGIN: f32 = 1.0 / 1024.0;

struct Volumes {
    rounding: Rounding,
}

struct Item {
    object: ObjectId,
    bounds: Aabb,
    error: ClipError,
}

impl Volumes {
    fn rounded(&self, Aabb { min, max }: &Aabb) -> Aabb {
        let each =
            |at: DVec3, of: fn(f32) -> f32| Vec3::from_array(at.as_vec3().to_array().map(of));
        let (min, max) = match self.rounding {
            Rounding::Outward => (each(*min, f32::next_down), each(*max, f32::next_up)),
            Rounding::Nearest => (min.as_vec3(), max.as_vec3()),
            Rounding::FixedMargin => (min.as_vec3() - FIXED_MARGIN, max.as_vec3() + FIXED_MARGIN),
        };
        Aabb::new(min.as_dvec3(), max.as_dvec3())
    }

    fn visit(items: &mut [Item], view: &View<'_>, drawn: &mut [bool]) {
        let whole = items.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
        let error = items.iter().fold(ClipError::ZERO, |most, item| most.max(&item.error));
        let outside =
            || ClipBox::new(&whole, &view.clip_from_world, &error, view.depth).outside_frustum();
        if items.is_empty() || outside() {
            return;
        }
        if let [item] = items {
            drawn[item.object.0 as usize] = true;
            return;
        }
        let size = whole.size();
        let axis = (0..3).fold(0, |most, axis| if size[axis] > size[most] { axis } else { most });
        let key = |item: &Item| item.bounds.center()[axis];
        items.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.object.cmp(&b.object)));
        let (low, high) = items.split_at_mut(items.len() / 2);
        Self::visit(low, view, drawn);
        Self::visit(high, view, drawn);
    }
}

impl Culler for Volumes {
    fn name(&self) -> &str {
        "volumes"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let mut drawn = vec![false; view.objects.len()];
        let mut items = Vec::new();
        for object in (0..view.partition.object_count()).map(ObjectId) {
            let seen = &view.objects[object.0 as usize];
            let bounds = self.rounded(&seen.bounds);
            if bounds.min.is_finite() && bounds.max.is_finite() {
                items.push(Item { object, bounds, error: seen.error });
            } else {
                // A box that is no number would hide its siblings; what is empty draws nothing.
                drawn[object.0 as usize] = true;
            }
        }
        Self::visit(&mut items, view, &mut drawn);
        let objects = (0..view.partition.object_count()).map(ObjectId);
        for object in objects.filter(|object| drawn[object.0 as usize]) {
            view.partition.parts_of(object).for_each(|part| pen.draw(part));
        }
        Ok(())
    }
}

/// Boxes that are rounded outward.
pub(super) const RIG: Rig = Rig {
    name: "volumes",
    culler: |_: CullerSetup| Box::new(Volumes { rounding: Rounding::Outward }),
    oracle: |_| Box::<Always>::default(),
    ..two_pass::EXACT
};

macro_rules! with {
    ($rounding:ident) => {
        Rig { culler: |_| Box::new(Volumes { rounding: Rounding::$rounding }), ..RIG }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("nearest-float", 68),
        "boxes are rounded to the nearest f32 and not widened",
        &["hard/between-floats", "hard/far-from-origin"],
        (RIG, with!(Nearest)),
    ),
    Fault::drops(
        ("fixed-margin", 68),
        "boxes are widened by a fixed margin, which is less than an ulp far out",
        &["hard/between-floats", "hard/far-from-origin"],
        (RIG, with!(FixedMargin)),
    ),
];
