//! Frustum culling by bounding spheres and planes, the first culler of every engine: an object is outside
//! if its sphere lies wholly beyond one of the six planes, whose equations are sums and differences of the
//! matrix's rows (Gribb & Hartmann 2001). It carries the faults of sphere and plane arithmetic; without
//! one it is held to the gate like any culler.

use glam::{DMat3, DVec3, DVec4, Vec3};

use super::{Fault, Rig, two_pass};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::oracle::{Always, OracleError};
use crate::part::ObjectId;
use crate::scene::{Camera, DepthOrder, Lens, Viewport};

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
    /// The mesh's radius is scaled by the longest column of the matrix.
    LongestColumn,
    /// The mesh's radius is scaled by the largest coordinate of the image of (1, 1, 1).
    ImageOfOnes,
    /// The radius is the length of the image of half the box's diagonal.
    ImageOfHalf,
    /// Side planes are made of corners in f32, the far ones of an endless frustum very far out.
    FarCorners,
    /// What a matrix flattens is passed over.
    FlattenedSkipped,
}

/// Room for the rounding of a plane equation in f64, a share of the terms' sum: four products, three
/// additions, and as much again for the middle and the radius.
const PLANE_GAMMA: f64 = 16.0 * f64::EPSILON;
/// Where the corners of an endless frustum are taken to be, world units ahead.
const ENDLESS: f32 = 1.0e7;

struct Spheres {
    flaw: Option<Flaw>,
}

impl Spheres {
    fn has(&self, flaw: Flaw) -> bool {
        self.flaw == Some(flaw)
    }

    fn sphere(&self, view: &View<'_>, object: ObjectId) -> (DVec3, f64) {
        let seen = &view.objects[object.0 as usize];
        let (center, radius) = (seen.bounds.center(), seen.bounds.size().length() * 0.5);
        let world = || view.clip_from_world.inverse() * seen.clip_from_object;
        let own = view.partition.mesh(object).bounds;
        let half = own.size() * 0.5;
        match self.flaw {
            Some(Flaw::NotRotated) => (world().w_axis.truncate() + own.center(), radius),
            Some(Flaw::LongestColumn) => {
                let columns = DMat3::from_mat4(world());
                let lengths = [columns.x_axis, columns.y_axis, columns.z_axis].map(|c| c.length());
                (center, half.length() * lengths.into_iter().fold(0.0, f64::max))
            }
            Some(Flaw::ImageOfOnes) => {
                let image = world().transform_vector3(DVec3::ONE);
                (center, half.length() * image.abs().max_element())
            }
            Some(Flaw::ImageOfHalf) => (center, world().transform_vector3(half).length()),
            _ => (center, radius),
        }
    }

    /// Whether the matrix takes an axis of the object's space to nothing.
    fn flattened(view: &View<'_>, object: ObjectId) -> bool {
        let clip = view.objects[object.0 as usize].clip_from_object;
        [clip.x_axis, clip.y_axis, clip.z_axis].contains(&DVec4::ZERO)
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
        let mut planes: [(DVec4, f64); 6] =
            [(w + x, ew + ex), (w - x, ew + ex), (w + y, ew + ey), (w - y, ew + ey), near, far];
        if self.has(Flaw::FarCorners) {
            let sides = corner_planes(&view.camera, view.viewport);
            planes.iter_mut().zip(sides).for_each(|(plane, side)| *plane = (side, 0.0));
        }
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

/// The left, right, lower and upper plane of a view through its corners, in f32 like these; normals point
/// inwards.
fn corner_planes(camera: &Camera, viewport: Viewport) -> [DVec4; 4] {
    let (eye, forward) = (camera.eye.as_vec3(), camera.forward.as_vec3());
    let up = if forward.x == 0.0 && forward.z == 0.0 { Vec3::Z } else { Vec3::Y };
    let right = forward.cross(up).normalize();
    let up = right.cross(forward);
    let far = if camera.far.is_finite() { camera.far as f32 } else { ENDLESS };
    let [shift_x, shift_y] = match camera.lens {
        Lens::Perspective { shift, .. } => shift.map(|along| along as f32),
        Lens::Orthographic { .. } => [0.0; 2],
    };
    let corner = |ahead: f32, x: f32, y: f32| {
        let half = camera.lens.height_at(f64::from(ahead)) as f32 * 0.5;
        let wide = half * viewport.width as f32 / viewport.height as f32;
        eye + forward * ahead + right * ((x + shift_x) * wide) + up * ((y + shift_y) * half)
    };
    let near = camera.near as f32;
    let inner = corner(near * 2.0, 0.0, 0.0);
    [[-1.0, -1.0, -1.0, 1.0], [1.0, -1.0, 1.0, 1.0], [-1.0, -1.0, 1.0, -1.0], [-1.0, 1.0, 1.0, 1.0]]
        .map(|[x0, y0, x1, y1]| {
            let a = corner(far, x0, y0);
            let normal = (corner(far, x1, y1) - a).cross(corner(near, x0, y0) - a).normalize();
            let inward =
                if normal.dot(inner - corner(near, x0, y0)) < 0.0 { -normal } else { normal };
            inward.extend(-inward.dot(a)).as_dvec4()
        })
}

impl Culler for Spheres {
    fn name(&self) -> &str {
        "spheres"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        for object in (0..view.partition.object_count()).map(ObjectId) {
            let skipped = self.has(Flaw::FlattenedSkipped) && Self::flattened(view, object);
            if !skipped && !self.outside(view, object) {
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
    Fault::drops(
        ("longest-column", 61),
        "the sphere is scaled by the longest column of the matrix, and a shear makes more of it",
        &["hard/spars", "hard/crossed-spars"],
        (RIG, with!(LongestColumn)),
    ),
    Fault::drops(
        ("image-of-ones", 62),
        "the sphere is scaled by the largest coordinate of the image of (1, 1, 1)",
        &["hard/poles", "hard/crossed-spars"],
        (RIG, with!(ImageOfOnes)),
    ),
    Fault::drops(
        ("image-of-half", 63),
        "the radius is the image of half the diagonal, which a shear of the other sign shortens",
        &["hard/crossed-spars"],
        (RIG, with!(ImageOfHalf)),
    ),
    Fault::drops(
        ("far-corners", 65),
        "side planes are made of corners in f32, those of an endless frustum very far out",
        &["hard/endless-sides"],
        (RIG, with!(FarCorners)),
    ),
    Fault::drops(
        ("flattened-skipped", 67),
        "what has a scale of zero is passed over, though it shows flat",
        &["hard/collapsed"],
        (RIG, with!(FlattenedSkipped)),
    ),
];
