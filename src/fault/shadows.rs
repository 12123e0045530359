//! Occlusion culling by shadow volumes, as engines with hand-made occluders do it (Coorg & Teller 1997,
//! *Real-time occlusion culling for models with large occluders*): the largest triangle of an object throws
//! a shadow away from the eye, and what lies in it is not drawn. Here in the window: an object is in a
//! triangle's shadow if its rectangle is within the triangle and nothing of it is nearer. Without a fault
//! it is held to the gate like any culler.

use glam::{DVec3, DVec4};

use super::{Fault, Rig, two_pass};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::math::{ClipBox, DEPTH_ROUNDING, PixelRectangle, Projection};
use crate::oracle::{Always, OracleError};
use crate::part::ObjectId;
use crate::scene::Lens;

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    /// The shadow spreads from the eye, though rays are parallel.
    FromTheEye,
    /// What is before the near plane throws a shadow too.
    NotCut,
}

/// Triangles that throw shadows, the largest on the screen.
const MOST_SHADOWS: usize = 8;
/// Pixels that a shadow is smaller by on each side: the vertices of its triangle are within one of their
/// exact places, or it throws none; see `RECTANGLE_DILATION_PIXELS` for what moves them besides.
const SHRUNK: f64 = 2.0;
/// Farthest place of a vertex from the window's origin, pixels: well within the guard band.
const FARTHEST: f64 = 8192.0;

struct Shadows {
    flaw: Option<Flaw>,
}

/// A triangle before the camera.
struct Shadow {
    object: ObjectId,
    /// Columns and rows.
    corners: [[f64; 2]; 3],
    /// How far ahead of the camera's place each corner is, world units.
    ahead: [f64; 3],
    /// Nothing of it is farther.
    depth: f64,
    /// Twice its area, square pixels.
    area: f64,
}

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

impl Shadows {
    /// The shadow of a triangle of an object, if it throws one.
    fn shadow(&self, view: &View<'_>, object: ObjectId, corners: [DVec3; 3]) -> Option<Shadow> {
        let seen = &view.objects[object.0 as usize];
        let [ex, ey, ez, ew] = seen.error.bound;
        let size = [view.viewport.width, view.viewport.height].map(f64::from);
        let [near, far] = view.depth.range().map(f64::from);
        let clip = corners.map(|corner| seen.clip_from_object * corner.extend(1.0));
        let place =
            |c: &DVec4| [(c.x / c.w * 0.5 + 0.5) * size[0], (0.5 - c.y / c.w * 0.5) * size[1]];
        let mut depth = f64::NEG_INFINITY;
        for c in &clip {
            let w = c.w - ew;
            let moved = [
                (ex + (c.x / c.w).abs() * ew) / w * size[0],
                (ey + (c.y / c.w).abs() * ew) / w * size[1],
            ];
            let at = c.z / c.w;
            let between = (at > near || self.flaw == Some(Flaw::NotCut)) && at < far;
            let sure = moved.iter().all(|moved| *moved <= 1.0)
                && place(c).iter().all(|at| at.abs() < FARTHEST);
            // Written so that what is no number throws no shadow.
            if !(w > 0.0 && between && sure) {
                return None;
            }
            depth = depth.max(at + (ez + at.abs() * ew) / w);
        }
        let world = view.clip_from_world.inverse();
        let ahead = clip.map(|c| {
            let at = world * c;
            ((at / at.w).truncate() - view.camera.eye).dot(view.camera.forward)
        });
        let corners = [place(&clip[0]), place(&clip[1]), place(&clip[2])];
        let area = cross(corners[0], corners[1], corners[2]).abs();
        Some(Shadow { object, corners, ahead, depth: depth + 2.0 * DEPTH_ROUNDING, area })
    }

    /// The largest triangle of an object, in its own space.
    fn largest(view: &View<'_>, object: ObjectId) -> Option<[DVec3; 3]> {
        let mesh = view.partition.mesh(object);
        let parts = mesh.parts.iter();
        let triangles = parts.flat_map(|part| {
            let positions = mesh.positions_of(part);
            let corner = |v: u32| DVec3::from_array(positions[v as usize].map(f64::from));
            mesh.triangles_of(part).0.iter().map(move |triangle| triangle.map(corner))
        });
        let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length_squared();
        triangles.max_by(|a, b| area(a).total_cmp(&area(b)))
    }

    fn hides(&self, view: &View<'_>, shadow: &Shadow, object: ObjectId) -> bool {
        let seen = &view.objects[object.0 as usize];
        let clip = ClipBox::new(&seen.bounds, &view.clip_from_world, &seen.error, view.depth);
        let Projection::Within { rectangle: PixelRectangle { min, max }, depth } =
            clip.project(view.viewport.width, view.viewport.height)
        else {
            return false;
        };
        if shadow.object == object || f64::from(depth) <= shadow.depth {
            return false;
        }
        let mut corners = shadow.corners;
        let parallel = matches!(view.camera.lens, Lens::Orthographic { .. });
        if self.flaw == Some(Flaw::FromTheEye) && parallel {
            let ahead = (seen.bounds.center() - view.camera.eye).dot(view.camera.forward);
            let middle =
                [view.viewport.width, view.viewport.height].map(|side| f64::from(side) * 0.5);
            for (corner, own) in corners.iter_mut().zip(shadow.ahead) {
                for axis in 0..2 {
                    corner[axis] = middle[axis] + (corner[axis] - middle[axis]) * ahead / own;
                }
            }
        }
        let turn = cross(corners[0], corners[1], corners[2]).signum();
        let holds = |at: [f64; 2]| {
            (0..3).all(|i| {
                let [a, b] = [corners[i], corners[(i + 1) % 3]];
                let long = (b[0] - a[0]).hypot(b[1] - a[1]);
                cross(a, b, at) * turn >= SHRUNK * long
            })
        };
        let [x, y] = [0, 1].map(|axis| [min[axis], max[axis]].map(f64::from));
        x.into_iter().all(|x| y.into_iter().all(|y| holds([x, y])))
    }
}

impl Culler for Shadows {
    fn name(&self) -> &str {
        "shadows"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let objects = || (0..view.partition.object_count()).map(ObjectId);
        let mut shadows: Vec<Shadow> = objects()
            .filter_map(|object| self.shadow(view, object, Self::largest(view, object)?))
            .collect();
        shadows.sort_by(|a, b| b.area.total_cmp(&a.area).then(a.object.cmp(&b.object)));
        shadows.truncate(MOST_SHADOWS);
        for object in objects() {
            let outside = view.object_outside_frustum(object.0);
            if !outside && !shadows.iter().any(|shadow| self.hides(view, shadow, object)) {
                view.partition.parts_of(object).for_each(|part| pen.draw(part));
            }
        }
        Ok(())
    }
}

/// Shadows that are cut and go where rays go.
pub(super) const RIG: Rig = Rig {
    name: "shadows",
    culler: |_: CullerSetup| Box::new(Shadows { flaw: None }),
    oracle: |_| Box::<Always>::default(),
    ..two_pass::EXACT
};

macro_rules! with {
    ($flaw:ident) => {
        Rig { culler: |_| Box::new(Shadows { flaw: Some(Flaw::$flaw) }), ..RIG }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("shadow-from-the-eye", 66),
        "an occluder's shadow spreads from the eye, though rays are parallel",
        &["hard/parallel-shadow", "hard/orthographic"],
        (RIG, with!(FromTheEye)),
    ),
    Fault::drops(
        ("shadow-not-cut", 66),
        "what the near plane cuts off an occluder throws a shadow all the same",
        &["hard/parallel-shadow"],
        (RIG, with!(NotCut)),
    ),
];
