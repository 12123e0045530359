//! `city250k`: the city of Wortel 2011, section 4.2: blocks along streets, cars on the roads, pedestrians of
//! several animated limbs on the sidewalks; 19 × 19 blocks and about 250,000 objects at scale 1. `--scale`
//! multiplies the number of blocks, so that what is near the camera stays as much. The camera starts near
//! the middle at eye level and goes straight while it turns; its far plane is the distance limit.
//!
//! The thesis gives neither counts nor speeds. A block here has 33 static objects, 10 cars of 5 to 14 and
//! 65 pedestrians of 0.8 to 1.8 world units a second (metres, thirty frames a second), each of ten limbs:
//! 693 objects, of which 660 move.

use std::sync::Arc;

use glam::DVec3;

use super::shape::Builder;
use super::{Chosen, straight_while_turning};
use crate::scene::{
    Articulated, Effects, Figure, Joint, Limb, Mesh, Motion, Object, Path, Placement, Scene,
    SceneError, Stream,
};

/// Blocks along a side at scale 1.
const BLOCKS: f64 = 19.0;
/// World units from one block to the next, street included.
const PITCH: f64 = 60.0;
/// From the middle of a block to the outer edge of its sidewalk, and to the houses.
const KERB: f64 = 24.0;
const HOUSES: f64 = 20.0;
/// Lots along a block's side.
const LOTS: u32 = 3;
/// Building designs; each is one mesh.
const DESIGNS: u32 = 8;
/// Lamps and trees along the kerb of a block.
const POSTS: u32 = 23;
/// A block.
const CARS: u32 = 10;
const PEDESTRIANS: u32 = 65;
/// Frames a second: speeds are in world units a second.
const RATE: f64 = 30.0;
/// Nothing is drawn beyond.
const DISTANCE: f64 = 150.0;

/// Meshes that follow the designs.
const GROUND: u32 = DESIGNS;
const POST: u32 = DESIGNS + 1;
const CAR: u32 = DESIGNS + 2;
/// The first of the limbs.
const LIMB: u32 = DESIGNS + 3;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let blocks = (BLOCKS * chosen.scale.sqrt()).round().max(1.0) as u32;
    let mut shape = Stream::new(chosen.seed, "shape");
    let mut meshes: Vec<Arc<Mesh>> = (0..DESIGNS).map(|_| Arc::new(building(&mut shape))).collect();
    meshes.extend([ground(), post(), car()].map(Arc::new));
    let walker = Walker::new(&mut meshes);
    let mut city = City {
        place: Stream::new(chosen.seed, "placement"),
        motion: Stream::new(chosen.seed, "motion"),
        walker,
        objects: Vec::new(),
        movers: Vec::new(),
        figures: Vec::new(),
    };
    for block in 0..blocks * blocks {
        let at = DVec3::new(f64::from(block % blocks), 0.0, f64::from(block / blocks));
        city.block((at + DVec3::new(0.5, 0.0, 0.5)) * PITCH);
    }
    let City { objects, movers, figures, .. } = city;
    let street = f64::from(blocks / 2) * PITCH * DVec3::new(1.0, 0.0, 1.0);
    Ok(Scene {
        name: "city250k".to_owned(),
        seed: chosen.seed,
        meshes,
        objects,
        cameras: vec![straight_while_turning(
            chosen,
            street + DVec3::new(3.0, 1.7, 0.0),
            0.0,
            DISTANCE,
        )],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects {
            motion: Some(Motion { movers }),
            articulated: Some(Articulated { figures }),
            teleport: None,
        },
    })
}

/// A city being built.
struct City {
    place: Stream,
    motion: Stream,
    walker: Walker,
    objects: Vec<Object>,
    movers: Vec<(u32, Path)>,
    figures: Vec<Figure>,
}

impl City {
    fn block(&mut self, middle: DVec3) {
        self.objects.push(Object { mesh: GROUND, placement: Placement::at(middle) });
        let lot = 2.0 * HOUSES / f64::from(LOTS);
        for i in 0..LOTS * LOTS {
            let cell = DVec3::new(f64::from(i % LOTS) + 0.5, 0.0, f64::from(i / LOTS) + 0.5);
            let at = middle + cell * lot - DVec3::new(HOUSES, 0.0, HOUSES);
            let scale = DVec3::new(lot * 0.96, self.place.range(0.6, 2.0), lot * 0.96);
            let placement = Placement { scale, ..Placement::at(at) };
            self.objects.push(Object { mesh: self.place.below(DESIGNS), placement });
        }
        for i in 0..POSTS {
            let along = (f64::from(i) + self.place.range(0.2, 0.8)) / f64::from(POSTS) * 4.0;
            let side = (along.fract() * 2.0 - 1.0) * KERB;
            let at = match along as u32 {
                0 => DVec3::new(side, 0.0, -KERB),
                1 => DVec3::new(KERB, 0.0, side),
                2 => DVec3::new(-side, 0.0, KERB),
                _ => DVec3::new(-KERB, 0.0, -side),
            };
            let scale = DVec3::new(1.0, self.place.range(0.6, 1.4), 1.0);
            let placement = Placement { scale, ..Placement::at(middle + at * 0.98) };
            self.objects.push(Object { mesh: POST, placement });
        }
        for _ in 0..CARS {
            let lane = KERB + self.motion.pick(&[1.7, 4.6]);
            let speed = self.motion.range(5.0, 14.0) / RATE;
            let path = self.lap(middle, lane, 4.0, speed);
            self.movers.push((self.objects.len() as u32, path));
            self.objects.push(Object { mesh: CAR, placement: Placement::at(middle) });
        }
        for _ in 0..PEDESTRIANS {
            let lane = self.motion.range(HOUSES + 0.6, KERB - 0.6);
            let direction = self.motion.pick(&[1.0, -1.0]);
            let speed = direction * self.motion.range(0.8, 1.8) / RATE;
            let path = self.lap(middle, lane, 1.0, speed);
            self.figures.push(self.walker.stand(
                path,
                middle,
                speed,
                &mut self.motion,
                &mut self.objects,
            ));
        }
    }

    fn lap(&mut self, center: DVec3, lane: f64, round: f64, speed: f64) -> Path {
        let start = self.motion.range(0.0, 8.0 * lane);
        Path::Lap { center, half: [lane; 2], round, speed, start }
    }
}

/// The limbs of all pedestrians: joints that they share.
struct Walker {
    joints: Vec<Arc<[Joint]>>,
}

/// How long the limbs are, from joint to joint.
const THIGH: f64 = 0.45;
const SHIN: f64 = 0.45;
const UPPER_ARM: f64 = 0.3;

impl Walker {
    /// Ten limbs, each with a mesh: a box about its middle, or from its joint downwards.
    fn new(meshes: &mut Vec<Arc<Mesh>>) -> Self {
        let stiff =
            |x: f64, y: f64, z: f64| Joint { hinge: DVec3::new(x, y, z), swing: 0.0, phase: 0.0 };
        let mut joints: Vec<Arc<[Joint]>> = Vec::new();
        let mut limb = |name: &str, size: [f64; 3], hang: f64, chain: &[Joint]| {
            let half = DVec3::from_array(size) * 0.5;
            let mut mesh = Builder::default();
            let middle = DVec3::new(0.0, -hang * 0.5, 0.0);
            mesh.cuboid(middle - half, middle + half, 1.0, 1);
            meshes.push(Arc::new(mesh.finish(name)));
            joints.push(chain.into());
        };
        limb("torso", [0.22, 0.6, 0.4], 0.0, &[stiff(0.0, 1.2, 0.0)]);
        limb("head", [0.2, 0.24, 0.18], 0.0, &[stiff(0.0, 1.64, 0.0)]);
        for side in [-1.0, 1.0] {
            // An arm goes with the other side's leg.
            let half_turn = if side > 0.0 { std::f64::consts::PI } else { 0.0 };
            let hinge = |y: f64, z: f64, swing: f64, ahead: f64| Joint {
                hinge: DVec3::new(0.0, y, z),
                swing,
                phase: half_turn + ahead,
            };
            let hip = hinge(THIGH + SHIN, side * 0.1, 0.5, 0.0);
            let knee = hinge(-THIGH, 0.0, 0.35, 0.8);
            let shoulder = hinge(1.45, side * 0.26, 0.45, std::f64::consts::PI);
            let elbow = hinge(-UPPER_ARM, 0.0, 0.3, 0.4);
            limb("thigh", [0.16, THIGH, 0.16], THIGH, &[hip]);
            limb("shin", [0.13, SHIN, 0.13], SHIN, &[hip, knee]);
            limb("upper arm", [0.1, UPPER_ARM, 0.1], UPPER_ARM, &[shoulder]);
            limb("forearm", [0.08, 0.28, 0.08], 0.28, &[shoulder, elbow]);
        }
        Self { joints }
    }

    /// One more pedestrian: its limbs among the objects, and the figure.
    fn stand(
        &self,
        path: Path,
        middle: DVec3,
        speed: f64,
        stream: &mut Stream,
        objects: &mut Vec<Object>,
    ) -> Figure {
        let height = stream.range(0.95, 1.05);
        let limb = |(mesh, joints): (u32, &Arc<[Joint]>)| {
            let placement = Placement { scale: DVec3::splat(height), ..Placement::at(middle) };
            objects.push(Object { mesh, placement });
            Limb { object: objects.len() as u32 - 1, joints: Arc::clone(joints) }
        };
        let limbs = (LIMB..).zip(&self.joints).map(limb).collect();
        // A step of each leg to 1.4 units.
        let pace = speed.abs() / 1.4 * std::f64::consts::TAU;
        let phase = stream.range(0.0, std::f64::consts::TAU);
        Figure { path, start: DVec3::ZERO, pace, phase, limbs }
    }
}

/// A tower on the unit lot, 8 to 24 units high, one to three storeys of boxes.
fn building(shape: &mut Stream) -> Mesh {
    let mut mesh = Builder::default();
    let (mut half, mut base) = (0.5, 0.0);
    for _ in 0..1 + shape.below(3) {
        let height = shape.range(6.0, 10.0);
        let corner = DVec3::new(half, 0.0, half);
        mesh.cuboid(DVec3::Y * base - corner, DVec3::Y * (base + height) + corner, 3.0, 4);
        base += height;
        half -= shape.range(0.05, 0.15);
    }
    mesh.finish("building")
}

fn car() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(DVec3::new(-2.0, 0.3, -0.9), DVec3::new(2.0, 1.0, 0.9), 1.0, 4);
    mesh.cuboid(DVec3::new(-1.2, 1.0, -0.8), DVec3::new(1.0, 1.6, 0.8), 1.0, 2);
    mesh.finish("car")
}

/// Roadway and sidewalk of a block.
fn ground() -> Mesh {
    let mut mesh = Builder::default();
    let corner = DVec3::new(PITCH * 0.5, 0.0, PITCH * 0.5);
    let (x, z) = (DVec3::X * PITCH, DVec3::Z * PITCH);
    mesh.grid(-corner - DVec3::Y * 0.15, x, z, [6, 6], |_, _| DVec3::ZERO);
    let kerb = DVec3::new(KERB, 0.0, KERB);
    mesh.cuboid(-kerb - DVec3::Y * 0.15, kerb, 8.0, 6);
    mesh.finish("ground")
}

/// A lamp, or a tree.
fn post() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(DVec3::new(-0.08, 0.0, -0.08), DVec3::new(0.08, 4.0, 0.08), 4.0, 1);
    mesh.cuboid(DVec3::new(-0.5, 3.6, -0.5), DVec3::new(0.5, 4.4, 0.5), 1.0, 1);
    mesh.finish("post")
}

#[cfg(test)]
mod tests {
    use crate::scene::generate::{Knobs, build};

    /// 19 × 19 blocks are the thesis's 250,000 objects.
    #[test]
    fn the_city_is_as_large_as_the_thesis_says() {
        let scene = build("city250k", &Knobs::default()).unwrap();
        assert_eq!(scene.objects.len(), 19 * 19 * 693);
        let limbs = scene.effects.articulated.unwrap().figures.iter().map(|f| f.limbs.len()).sum();
        let cars = scene.effects.motion.unwrap().movers.len();
        assert_eq!((limbs, cars), (19 * 19 * 650_usize, 19 * 19 * 10));
    }
}
