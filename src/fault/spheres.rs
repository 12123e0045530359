//! Frustum culling by bounding spheres and planes, the first culler of every engine: an object is outside
//! if its sphere lies wholly beyond one of the six planes, whose equations are sums and differences of the
//! matrix's rows (Gribb & Hartmann 2001). It carries the faults of sphere and plane arithmetic; without
//! one it is held to the gate like any culler.

use glam::{DVec3, DVec4};

use super::{Fault, Rig, two_pass};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::oracle::{Always, OracleError};
use crate::part::ObjectId;
use crate::scene::DepthOrder;

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    /// The plane's distance goes into the dot product that gives the radius.
    DistanceInRadius,
    /// A plane without a normal, as the far plane of an endless frustum, is divided by its length, and
    /// what is no number counts as outside.
    ZeroNormal,
    /// Distances are compared without dividing by the normal's length.
    NotNormalised,
    /// The sphere's middle is moved with its object but not turned.
    NotRotated,
}

/// Room for the rounding of a plane equation in f64, a share of the terms' sum: four products, three
/// additions, and as much again for the middle and the radius.
const PLANE_GAMMA: f64 = 16.0 * f64::EPSILON;

struct Spheres {
    flaw: Option<Flaw>,
}

impl Spheres {
    fn has(&self, flaw: Flaw) -> bool {
        self.flaw == Some(flaw)
    }

    fn sphere(&self, view: &View<'_>, object: ObjectId) -> (DVec3, f64) {
        let bounds = view.objects[object.0 as usize].bounds;
        let radius = bounds.size().length() * 0.5;
        if self.has(Flaw::NotRotated) {
            let seen = &view.objects[object.0 as usize];
            let world = view.clip_from_world.inverse() * seen.clip_from_object;
            let own = view.partition.mesh(object).bounds.center();
            return (world.w_axis.truncate() + own, radius);
        }
        (bounds.center(), radius)
    }

    fn outside(&self, view: &View<'_>, object: ObjectId) -> bool {
        let (center, radius) = self.sphere(view, object);
        let error = view.objects[object.0 as usize].error.bound;
        let rows = view.clip_from_world.transpose();
        let (x, y, z, w) = (rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis);
        let [ex, ey, ez, ew] = error;
        let [near, far] = match view.depth {
            DepthOrder::Forward => [(z, ez), (w - z, ew + ez)],
            DepthOrder::Reversed => [(w + z, ew + ez), (-z, ez)],
        };
        let planes: [(DVec4, f64); 6] =
            [(w + x, ew + ex), (w - x, ew + ex), (w + y, ew + ey), (w - y, ew + ey), near, far];
        planes.into_iter().any(|(plane, error)| {
            let (normal, at) = (plane.truncate(), center.extend(1.0));
            let distance = plane.dot(at);
            let length = normal.length();
            let rounding =
                plane.abs().dot(at.abs() + DVec3::splat(radius).extend(0.0)) * PLANE_GAMMA;
            let reach = radius * length + error + rounding;
            match self.flaw {
                // The product takes in the fourth component, which is no extent.
                Some(Flaw::DistanceInRadius) => distance + reach + plane.w * radius < 0.0,
                Some(Flaw::ZeroNormal) => {
                    // What is no number is not inside: 0 ÷ 0 for a plane without a normal.
                    let unit = plane / length;
                    let inside = unit.dot(at) + error / length > -radius;
                    !inside
                }
                Some(Flaw::NotNormalised) => distance + radius < 0.0,
                _ => distance + reach < 0.0,
            }
        })
    }
}

impl Culler for Spheres {
    fn name(&self) -> &str {
        "spheres"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        for object in (0..view.partition.object_count()).map(ObjectId) {
            if !self.outside(view, object) {
                view.partition.parts_of(object).for_each(|part| pen.draw(part));
            }
        }
        Ok(())
    }
}

/// No questions at all.
pub(super) const RIG: Rig = Rig {
    name: "spheres",
    culler: |_: CullerSetup| Box::new(Spheres { flaw: None }),
    oracle: |_| Box::<Always>::default(),
    ..two_pass::EXACT
};

macro_rules! with {
    ($flaw:ident) => {
        Rig { culler: |_| Box::new(Spheres { flaw: Some(Flaw::$flaw) }), ..RIG }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("distance-in-radius", 14),
        "the plane's distance goes into the dot product that gives the radius",
        &["hard/far-from-origin", "hard/strays"],
        (RIG, with!(DistanceInRadius)),
    ),
    Fault::drops(
        ("zero-normal", 15),
        "the far plane of an endless frustum has no normal and rejects everything",
        &["hard/infinite-far"],
        (RIG, with!(ZeroNormal)),
    ),
    Fault::drops(
        ("not-normalised", 16),
        "planes that are not normalised against radii that are lengths",
        &["hard/edge-of-view", "hard/telephoto"],
        (RIG, with!(NotNormalised)),
    ),
    Fault::drops(
        ("not-rotated", 18),
        "the sphere's middle is moved with its object but not turned",
        &["hard/pivots"],
        (RIG, with!(NotRotated)),
    ),
];
