//! Objects whose ends reach just into the view: what a bound that is a little too small loses first.
//! Placements are built backwards, from where the end of a long mesh is to be.

use glam::{DMat3, DQuat, DVec3};

use crate::math::{cos, sin};
use crate::scene::{Camera, Lens, Placement, Viewport};

/// Sides of a view: left, right, bottom, top.
pub(super) const SIDES: u32 = 4;

/// The camera's axes to the right and up, as its matrix has them.
pub(super) fn axes(camera: &Camera) -> (DVec3, DVec3) {
    let f = camera.forward;
    let up = if f.x == 0.0 && f.z == 0.0 { DVec3::Z } else { DVec3::Y };
    let right = f.cross(up).normalize();
    (right, right.cross(f))
}

/// The point `ahead` units before the camera that is seen at `[x, y]`, each from −1 to 1 across the
/// picture.
pub(super) fn seen_at(camera: &Camera, viewport: Viewport, ahead: f64, [x, y]: [f64; 2]) -> DVec3 {
    let (right, up) = axes(camera);
    let [shift_x, shift_y] = match camera.lens {
        Lens::Perspective { shift, .. } => shift,
        Lens::Orthographic { .. } => [0.0; 2],
    };
    let half = camera.lens.height_at(ahead) * 0.5;
    let aspect = f64::from(viewport.width) / f64::from(viewport.height);
    let (across, above) = ((x + shift_x) * half * aspect, (y + shift_y) * half);
    camera.eye + camera.forward * ahead + right * across + up * above
}

/// A point on a side plane of the view, `ahead` units before the camera and `along` (−1 to 1) that side,
/// and the unit normal of the plane there that points into the view.
pub(super) fn edge(
    camera: &Camera,
    viewport: Viewport,
    side: u32,
    (ahead, along): (f64, f64),
) -> (DVec3, DVec3) {
    let out = if side.is_multiple_of(2) { -1.0 } else { 1.0 };
    let at = |ahead: f64, along: f64| {
        let place = if side < 2 { [out, along] } else { [along, out] };
        seen_at(camera, viewport, ahead, place)
    };
    let point = at(ahead, along);
    let normal = (at(ahead, along + 1.0) - point).cross(at(ahead * 2.0, along) - point).normalize();
    let inside = seen_at(camera, viewport, ahead, [0.0; 2]) - point;
    (point, if normal.dot(inside) < 0.0 { -normal } else { normal })
}

/// What scale and shear make of a direction.
fn leaned(scale: DVec3, shear: DVec3) -> DMat3 {
    let DVec3 { x, y, z } = shear;
    DMat3::from_cols(DVec3::X, DVec3::new(x, 1.0, 0.0), DVec3::new(y, z, 1.0))
        * DMat3::from_diagonal(scale)
}

/// The unit direction that scale and shear lengthen most, by the power method, and by what factor.
pub(super) fn longest(scale: DVec3, shear: DVec3) -> (DVec3, f64) {
    let matrix = leaned(scale, shear);
    let square = matrix.transpose() * matrix;
    // No axis, nor any diagonal of two of them, is orthogonal to it.
    let start = DVec3::new(0.48, 0.6, 0.64);
    let along = (0..64).fold(start, |along, _| (square * along).try_normalize().unwrap_or(along));
    (along, (matrix * along).length())
}

/// The placement, with that scale and shear, that puts the point `tip` of a mesh at `at` with the mesh's
/// origin behind it, seen along the unit vector `towards`; `roll` radians about that line are free. At the
/// mesh's own turn where scale and shear bring the tip to the origin.
pub(super) fn reaching(
    (scale, shear): (DVec3, DVec3),
    tip: DVec3,
    at: DVec3,
    (towards, roll): (DVec3, f64),
) -> Placement {
    let arm = leaned(scale, shear) * tip;
    let rotation = arm.try_normalize().map_or(DQuat::IDENTITY, |arm| {
        let (half_sin, half_cos) = (sin(roll * 0.5), cos(roll * 0.5));
        let turn = towards * half_sin;
        DQuat::from_xyzw(turn.x, turn.y, turn.z, half_cos) * DQuat::from_rotation_arc(arm, towards)
    });
    Placement { translation: at - rotation * arm, rotation, scale, shear }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DepthOrder;

    const VIEWPORT: Viewport = Viewport { width: 160, height: 120 };

    /// Points on a side are on that side of the clip box, and go in along the normal.
    #[test]
    fn edges_are_those_of_the_matrix() {
        let forward = DVec3::new(0.3, -0.4, 0.7).normalize();
        for lens in [
            Lens::Perspective { fov_y: 0.9, shift: [0.6, -0.3] },
            Lens::Orthographic { height: 3.0 },
        ] {
            let camera =
                Camera { eye: DVec3::new(4.0, 5.0, -6.0), forward, lens, near: 0.1, far: 90.0 };
            let clip = camera.clip_from_world(VIEWPORT, DepthOrder::Forward);
            for side in 0..SIDES {
                let (point, inward) = edge(&camera, VIEWPORT, side, (7.0, 0.4));
                let place = |by: f64| {
                    let c = clip * (point + inward * by).extend(1.0);
                    [c.x / c.w, c.y / c.w]
                };
                let axis = side as usize / 2;
                let out = if side % 2 == 0 { -1.0 } else { 1.0 };
                assert!(
                    (place(0.0)[axis] - out).abs() < 1e-9
                        && (place(0.0)[1 - axis] - 0.4).abs() < 1e-9
                );
                assert!(place(0.1)[axis].abs() < 1.0 && place(-0.1)[axis].abs() > 1.0, "{side}");
            }
        }
    }

    #[test]
    fn the_tip_is_where_it_is_asked_for() {
        let (scale, shear) = (DVec3::new(2.0, -1.0, 0.5), DVec3::new(-0.9, 0.4, 1.2));
        let (along, factor) = longest(scale, shear);
        let tip = along * 3.0;
        let towards = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let placed = reaching((scale, shear), tip, DVec3::splat(9.0), (towards, 1.3));
        let world = placed.world_from_object();
        assert!(world.transform_point3(tip).distance(DVec3::splat(9.0)) < 1e-9);
        let arm = world.transform_vector3(tip);
        assert!(arm.normalize().dot(towards) > 1.0 - 1e-12);
        assert!((arm.length() - 3.0 * factor).abs() < 1e-9);
        // No other direction becomes longer.
        for other in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::new(1.0, -1.0, 1.0)] {
            let other = other.normalize() * 3.0;
            assert!(world.transform_vector3(other).length() <= arm.length() + 1e-9, "{other}");
        }
    }
}
