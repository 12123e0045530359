//! How objects stand to one another in the space, before the world's own scale.

use glam::{DQuat, DVec3};

use super::shapes::Shape;
use super::{SPACE, power, within};
use crate::scene::generate::Chosen;
use crate::scene::{Object, Placement, Stream};

/// Most objects at scale 1.
const MOST_OBJECTS: u32 = 100;

/// How objects stand to one another.
#[derive(Clone, Copy)]
enum Layout {
    /// Anywhere in the space.
    Scattered,
    /// On a grid of whole units, faces and edges touching.
    Grid,
    /// Behind walls across the view, with gaps between them.
    Walls,
    /// In cells between walls that cross.
    Rooms,
    /// Most of them in one place.
    Heap,
}

/// The placement that puts the middle of a mesh where the origin of `placement` is.
pub(super) fn by_middle(placement: Placement, middle: DVec3) -> Placement {
    let arm = placement.world_from_object().transform_vector3(middle);
    Placement { translation: placement.translation - arm, ..placement }
}

/// Where everything stands in the space.
pub(super) fn placed(chosen: &Chosen, layout: &mut Stream, shapes: &[Shape]) -> Vec<Object> {
    let mut place = Stream::new(chosen.seed, "placement");
    let kinds = [
        Layout::Scattered,
        Layout::Grid,
        Layout::Walls,
        Layout::Walls,
        Layout::Rooms,
        Layout::Heap,
    ];
    let kind = layout.pick(&kinds);
    // Distorted placements fully or not at all.
    let (turned, distorted) = (layout.below(3) > 0, layout.below(4) == 0);
    let largest = layout.pick(&[0.5, 1.5, 4.0]);
    let count = (f64::from(1 + layout.below(MOST_OBJECTS)) * chosen.scale).ceil() as u32;
    let mut objects = Vec::new();
    let mut put = |mesh: u32, placement: Placement| {
        let placement = by_middle(placement, shapes[mesh as usize].middle);
        objects.push(Object { mesh, placement });
    };
    let wall = |translation: DVec3, scale: DVec3| Placement { scale, ..Placement::at(translation) };
    match kind {
        Layout::Walls => {
            for row in 0..1 + layout.below(3) {
                let z = 4.0 - 4.0 * f64::from(row);
                let gap = layout.range(0.0, 2.0);
                for side in [-1.0, 1.0] {
                    let wide = SPACE - gap;
                    let at = DVec3::new(side * (gap + wide * 0.5), 0.0, z);
                    put(0, wall(at, DVec3::new(wide, SPACE, 0.1)));
                }
            }
        }
        Layout::Rooms => {
            let rooms = 2 + layout.below(3);
            for line in 0..=rooms {
                let at = f64::from(line) / f64::from(rooms) * 2.0 * SPACE - SPACE;
                let (long, thin) = (SPACE * 1.7, 0.05);
                put(0, wall(DVec3::new(at, 0.0, 0.0), DVec3::new(thin, 4.0, long)));
                put(0, wall(DVec3::new(0.0, 0.0, at), DVec3::new(long, 4.0, thin)));
            }
        }
        Layout::Scattered | Layout::Grid | Layout::Heap => {}
    }
    // Flat sheets at the ends of the world, beyond all that stands in the space.
    if layout.below(5) == 0 {
        for axis in DVec3::AXES {
            for side in [-1.0, 1.0] {
                let at = within(&mut place, DVec3::splat(SPACE * 0.7)) * (DVec3::ONE - axis);
                let out = axis * (side * SPACE * place.range(1.3, 1.6));
                put(0, wall(at + out, (DVec3::ONE - axis) * SPACE * 0.4));
            }
        }
    }
    for _ in 0..count {
        let reach = match kind {
            Layout::Heap => DVec3::splat(SPACE * 0.15),
            Layout::Rooms => DVec3::new(SPACE, 1.5, SPACE),
            _ => DVec3::new(SPACE, SPACE * 0.5, SPACE),
        };
        let mut translation = within(&mut place, reach);
        let mut scale = DVec3::splat(power(&mut place, -0.7, 0.0) * largest);
        let mut rotation = DQuat::IDENTITY;
        if turned {
            let axis = within(&mut place, DVec3::ONE).try_normalize().unwrap_or(DVec3::Y);
            rotation = DQuat::from_axis_angle(axis, place.range(-3.0, 3.0));
        }
        if let Layout::Grid = kind {
            (translation, scale, rotation) = (translation.round(), DVec3::ONE, DQuat::IDENTITY);
        }
        let mut placement = Placement { translation, scale, rotation, ..Placement::IDENTITY };
        if distorted {
            placement.scale *= DVec3::new(
                place.pick(&[1.0, -1.0, 0.01, 10.0]),
                1.0,
                place.pick(&[1.0, 1.0, 0.0, 3.0]),
            );
            placement.shear = within(&mut place, DVec3::ONE);
        }
        put(place.below(shapes.len() as u32), placement);
    }
    objects
}
