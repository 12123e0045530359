//! Frustum culling by blocks, as engines with a static octree do it: the world's box is cut into equal
//! blocks of f32, an object is in every block that its box touches, and what is in a block that the view
//! meets is drawn. Made anew for each frame; without a fault it is held to the gate like any culler.

use glam::{DVec3, Vec3};

use super::{Fault, Rig, two_pass};
use crate::cull::{Culler, CullerSetup, Pen, View};
use crate::math::{Aabb, ClipBox, ClipError};
use crate::oracle::{Always, OracleError};
use crate::part::ObjectId;

/// Blocks along a side: two halvings.
const SIDE: u32 = 4;
/// Coordinates beyond this are not sorted into blocks: sums of them might overflow.
const FARTHEST: f32 = f32::MAX / 16.0;

struct Blocks {
    /// The last block of a row ends where the sum of its lengths does, which may be an ulp short.
    ends_short: bool,
}

/// An object by its box in f32, to the nearest.
struct Thing {
    object: ObjectId,
    min: Vec3,
    max: Vec3,
}

impl Blocks {
    /// Where the `number`th block along an axis begins, and the one before it ends.
    fn bound(&self, min: f32, max: f32, number: u32) -> f32 {
        if number == SIDE && !self.ends_short {
            return max;
        }
        min + (max - min) / SIDE as f32 * number as f32
    }
}

impl Culler for Blocks {
    fn name(&self) -> &str {
        "blocks"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let mut drawn = vec![true; view.objects.len()];
        let mut things = Vec::new();
        for object in (0..view.partition.object_count()).map(ObjectId) {
            let Aabb { min, max } = view.objects[object.0 as usize].bounds;
            let (min, max) = (min.as_vec3(), max.as_vec3());
            // What is no number, or too far out to be sorted, is drawn.
            if min.abs().max(max.abs()).cmplt(Vec3::splat(FARTHEST)).all() {
                drawn[object.0 as usize] = false;
                things.push(Thing { object, min, max });
            }
        }
        let low = things.iter().fold(Vec3::INFINITY, |low, thing| low.min(thing.min));
        let high = things.iter().fold(Vec3::NEG_INFINITY, |high, thing| high.max(thing.max));
        // To the nearest float, a box is off by half an ulp of its largest coordinate at most.
        let rounding = f64::from(low.abs().max(high.abs()).max_element() * f32::EPSILON);
        for number in 0..SIDE * SIDE * SIDE {
            let place = [number % SIDE, number / SIDE % SIDE, number / SIDE / SIDE];
            let corner = |more: u32| {
                Vec3::from_array(std::array::from_fn(|axis| {
                    self.bound(low[axis], high[axis], place[axis] + more)
                }))
            };
            let (min, max) = (corner(0), corner(1));
            let touches = |thing: &&Thing| thing.min.cmple(max).all() && thing.max.cmpge(min).all();
            let inside: Vec<ObjectId> =
                things.iter().filter(touches).map(|thing| thing.object).collect();
            let error = inside.iter().fold(ClipError::ZERO, |most, object| {
                most.max(&view.objects[object.0 as usize].error)
            });
            let space = Aabb::new(min.as_dvec3(), max.as_dvec3()).grown(DVec3::splat(rounding));
            if !ClipBox::new(&space, &view.clip_from_world, &error, view.depth).outside_frustum() {
                inside.iter().for_each(|object| drawn[object.0 as usize] = true);
            }
        }
        let objects = (0..view.partition.object_count()).map(ObjectId);
        for object in objects.filter(|object| drawn[object.0 as usize]) {
            view.partition.parts_of(object).for_each(|part| pen.draw(part));
        }
        Ok(())
    }
}

/// Blocks that end where the world does.
pub(super) const RIG: Rig = Rig {
    name: "blocks",
    culler: |_: CullerSetup| Box::new(Blocks { ends_short: false }),
    oracle: |_| Box::<Always>::default(),
    ..two_pass::EXACT
};

/// The faults.
pub(super) const FAULTS: &[Fault] = &[Fault::drops(
    ("short-block", 64),
    "the last block ends an ulp short of the world, and a flat wall there is in none",
    &["hard/world-edge"],
    (RIG, Rig { culler: |_| Box::new(Blocks { ends_short: true }), ..RIG }),
)];
