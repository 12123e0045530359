//! Long, thin, stretched, sheared and turned objects whose ends lie at the edge of a view: beside a side
//! plane, an end just inside. A bounding sphere, box or error bound that is a little too small leaves their
//! middles outside and loses what shows.

use std::sync::Arc;

use glam::DVec3;

use super::layout::by_middle;
use super::shapes::Shape;
use super::{Site, power, within};
use crate::scene::generate::Chosen;
use crate::scene::generate::rim::{SIDES, edge, longest, reaching};
use crate::scene::generate::shape::Builder;
use crate::scene::{CameraPath, Object, Placement, Stream};

/// Most objects of this kind at scale 1.
const MOST: u32 = 8;
/// One world in so many has them.
const ONE_IN: u32 = 4;

/// Adds them to the world, in one seed of [`ONE_IN`].
pub(super) fn add(
    chosen: &Chosen,
    cameras: &[CameraPath],
    Site { size, .. }: Site,
    shapes: &mut Vec<Shape>,
    objects: &mut Vec<Object>,
) {
    let mut fringe = Stream::new(chosen.seed, "fringe");
    if fringe.below(ONE_IN) > 0 {
        return;
    }
    // Bars that are stretched to poles or leaned on by a shear, and blocks; some of them or all.
    let kinds = fringe.pick(&[&[0][..], &[1], &[0, 1], &[2], &[0, 1, 2]]);
    let count = (f64::from(1 + fringe.below(MOST)) * chosen.scale).ceil() as u32;
    for _ in 0..count {
        let path = &cameras[fringe.below(cameras.len() as u32) as usize];
        let camera = path.at(fringe.below(chosen.frames));
        let farthest = camera.far.min(40.0 * size.max(camera.near));
        let ahead = camera.near + (farthest - camera.near) * power(&mut fringe, -2.0, -0.3);
        let side = fringe.below(SIDES);
        let (point, inward) =
            edge(&camera, chosen.viewport, side, (ahead, fringe.range(-0.9, 0.9)));
        let high = camera.lens.height_at(ahead);
        let pixel = high / f64::from(chosen.viewport.height);
        // Half its length in the world.
        let arm = high * power(&mut fringe, -1.0, 0.5);
        let thick = pixel.max(arm * 0.01);
        let inside = (arm * power(&mut fringe, -2.5, -0.6)).max(pixel * fringe.range(0.5, 3.0));
        let towards = (inward + within(&mut fringe, DVec3::splat(0.5))).normalize();
        let mirrored = DVec3::from_array([0; 3].map(|_| fringe.pick(&[1.0, 1.0, -1.0])));
        let kind = fringe.pick(kinds);
        if kind == 2 {
            // Not turned, so that its box is no larger than it is; a corner in by a pixel or so.
            let corner = inward.signum() * high * power(&mut fringe, -2.0, -0.5);
            let at = point + inward * (pixel * fringe.range(0.5, 4.0)) - corner;
            let placement = Placement { scale: corner.abs() * 2.0, ..Placement::at(at) };
            objects.push(Object { mesh: 0, placement: by_middle(placement, shapes[0].middle) });
            continue;
        }
        let (scale, shear, tip, radius) = match kind {
            0 => {
                let aside = DVec3::from_array([0; 3].map(|_| thick * fringe.range(0.5, 1.5)));
                let axis = DVec3::AXES[fringe.below(3) as usize];
                let scale = (aside * (DVec3::ONE - axis) + axis * arm) * mirrored;
                (scale, DVec3::ZERO, axis, 1.0)
            }
            _ => {
                let lean = |fringe: &mut Stream| fringe.range(0.3, 1.5) * fringe.pick(&[1.0, -1.0]);
                let leans = fringe.pick(&[DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::ONE]);
                let shear = leans * DVec3::from_array([0; 3].map(|_| lean(&mut fringe)));
                // Along what the shear lengthens most, or anywhere.
                let (along, _) = longest(mirrored, shear);
                let free = within(&mut fringe, DVec3::ONE).try_normalize().unwrap_or(DVec3::X);
                let along = fringe.pick(&[along, along, free]);
                (mirrored, shear, along * arm, thick)
            }
        };
        let at = point + inward * inside;
        let roll = fringe.range(-3.0, 3.0);
        let placement = reaching((scale, shear), tip, at, (towards, roll));
        let mut bar = Builder::default();
        bar.tube(&[-tip, tip], radius, 4);
        let mesh = Arc::new(bar.finish("swarm bar"));
        objects.push(Object { mesh: shapes.len() as u32, placement });
        shapes.push(Shape { mesh, middle: DVec3::ZERO });
    }
}
