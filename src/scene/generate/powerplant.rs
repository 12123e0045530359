//! `powerplant`: a generated plant in the place of the UNC power plant, the first scene of Kovalčík &
//! Sochor 2006 (section 4: 1,185 objects, about 13 million triangles, a fly-through sampled
//! regularly). Nothing moves.
//!
//! The plant is a grid of bays, each of 79 objects: walls and slabs, a boiler of tube walls, a turbine,
//! gratings on four levels, stairs, frames, racks and risers of bent pipes (each of its own shape),
//! tanks, ducts, pumps, valves, cabinets, lamps. What comes off a shelf in life is one mesh many
//! times over. `--scale` multiplies the number of bays, two at scale 1; below one bay it keeps the first
//! objects of it. 15 bays at full size.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::Chosen;
use super::plant_parts as parts;
use crate::scene::{
    CameraPath, CameraPose, Effects, Lens, Mesh, Object, Placement, Scene, SceneError, Stream,
    Travel,
};

/// Bays at scale 1, and at full size: 15 × 79 = 1,185 objects.
const BAYS: f64 = 2.0;
/// Objects of a bay.
const OBJECTS: f64 = 79.0;
/// The smallest plant has so many objects.
const FEWEST_OBJECTS: f64 = 8.0;
/// Bays at full size.
const FULL_BAYS: u32 = 15;
/// Bays to a row for each bay of depth: the plant is longer than deep.
const ASPECT: f64 = 5.0 / 3.0;
/// Heights of the levels with gratings.
const LEVELS: [f64; 4] = [8.0, 16.0, 24.0, 32.0];

/// Side of a bay, world units.
pub(super) const BAY: f64 = 30.0;
/// Height of a bay.
pub(super) const HEIGHT: f64 = 42.0;

/// Meshes that many objects share, in the order of [`shelf`].
#[derive(Clone, Copy)]
enum Part {
    Slab,
    Roof,
    Wall,
    Doorway,
    Boiler,
    Turbine,
    Grating,
    Stairs,
    Frame,
    Valve,
    Pump,
    Tank,
    Duct,
    Cabinet,
    Lamp,
}

fn shelf() -> Vec<Arc<Mesh>> {
    [
        parts::slab(),
        parts::roof(),
        parts::wall(false),
        parts::wall(true),
        parts::boiler(),
        parts::turbine(),
        parts::grating(),
        parts::stairs(),
        parts::frame(),
        parts::valve(),
        parts::pump(),
        parts::tank(),
        parts::duct(),
        parts::cabinet(),
        parts::lamp(),
    ]
    .map(Arc::new)
    .to_vec()
}

struct Plant {
    meshes: Vec<Arc<Mesh>>,
    objects: Vec<Object>,
}

impl Plant {
    fn put(&mut self, part: Part, at: DVec3, quarters: u32) {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarters);
        let placement = Placement { rotation: DQuat::from_rotation_y(turn), ..Placement::at(at) };
        self.objects.push(Object { mesh: part as u32, placement });
    }

    /// An object with a mesh of its own.
    fn put_own(&mut self, mesh: Mesh, at: DVec3, quarters: u32) {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(quarters);
        let placement = Placement { rotation: DQuat::from_rotation_y(turn), ..Placement::at(at) };
        self.objects.push(Object { mesh: self.meshes.len() as u32, placement });
        self.meshes.push(Arc::new(mesh));
    }

    /// The 79 objects of the bay whose lower corner is `corner`.
    fn bay(&mut self, corner: DVec3, shape: &mut Stream, place: &mut Stream) {
        let at = |x: f64, y: f64, z: f64| corner + DVec3::new(x, y, z);
        self.put(Part::Slab, at(0.0, -0.4, 0.0), 0);
        self.put(Part::Roof, at(0.0, HEIGHT, 0.0), 0);
        // Walls on the lower sides; every one across the long axis has a doorway.
        self.put(Part::Wall, at(0.0, 0.0, 0.0), 0);
        self.put(Part::Doorway, at(0.0, 0.0, BAY), 1);
        self.put(Part::Boiler, at(9.0, 0.0, 21.0), 0);
        self.put(Part::Turbine, at(17.0, 2.6, 6.0), 0);
        for rack in 0..12 {
            let level = LEVELS[rack / 3] - 3.0;
            let z = [3.0, 13.0, 25.0][rack % 3] + place.range(-0.5, 0.5);
            self.put_own(parts::rack(shape), at(0.5, level, z), 0);
        }
        for riser in 0..6 {
            let x = 16.0 + 2.2 * f64::from(riser) + place.range(-0.3, 0.3);
            self.put_own(parts::riser(shape), at(x, 0.0, 28.0), 0);
        }
        for level in LEVELS {
            for (x, z) in [(15.0, 12.0), (21.0, 12.0), (15.0, 18.0), (1.0, 8.0)] {
                self.put(Part::Grating, at(x, level, z), 0);
            }
        }
        for (flight, y) in (0..6).zip([0.0, 4.0, 8.0, 12.0, 16.0, 20.0]) {
            let (x, quarters) = if flight % 2 == 0 { (22.0, 0) } else { (28.0, 2) };
            self.put(Part::Stairs, at(x, y, 24.0 + f64::from(flight % 2)), quarters);
        }
        for x in [1.0, 10.0, 19.0, 29.0] {
            self.put(Part::Frame, at(x, 0.0, 0.0), 0);
        }
        let mut scatter = |plant: &mut Self, part: Part, count: u32, heights: &[f64]| {
            for _ in 0..count {
                let y = heights[place.below(heights.len() as u32) as usize];
                let spot = at(place.range(14.0, 28.0), y, place.range(2.0, 24.0));
                plant.put(part, spot, place.below(4));
            }
        };
        let floors: Vec<f64> = std::iter::once(0.0).chain(LEVELS).collect();
        scatter(self, Part::Valve, 10, &floors);
        scatter(self, Part::Pump, 4, &[0.0]);
        scatter(self, Part::Tank, 3, &[0.0, LEVELS[1]]);
        scatter(self, Part::Duct, 4, &[LEVELS[0] + 2.0, LEVELS[2] + 2.0]);
        scatter(self, Part::Cabinet, 4, &floors);
        scatter(self, Part::Lamp, 4, &[6.0, 14.0, 22.0]);
    }
}

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let bays =
        if chosen.full_size { FULL_BAYS } else { (BAYS * chosen.scale).round().max(1.0) as u32 };
    let row = (f64::from(bays) * ASPECT).sqrt().round().max(1.0) as u32;
    let mut shape = Stream::new(chosen.seed, "shape");
    let mut place = Stream::new(chosen.seed, "placement");
    let mut plant = Plant { meshes: shelf(), objects: Vec::new() };
    for bay in 0..bays {
        let corner = DVec3::new(f64::from(bay % row), 0.0, f64::from(bay / row)) * BAY;
        plant.bay(corner, &mut shape, &mut place);
    }
    if !chosen.full_size && BAYS * chosen.scale < 1.0 {
        let kept = (OBJECTS * BAYS * chosen.scale).round().max(FEWEST_OBJECTS);
        plant.objects.truncate(kept as usize);
        let used = plant.objects.iter().map(|o| o.mesh as usize + 1).max().unwrap_or(0);
        plant.meshes.truncate(used.max(Part::Lamp as usize + 1));
    }
    Ok(Scene {
        name: "powerplant".to_owned(),
        seed: chosen.seed,
        meshes: plant.meshes,
        objects: plant.objects,
        cameras: vec![fly_through(row, bays.div_ceil(row), chosen.frames)],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects::default(),
    })
}

/// From an overview through a doorway, between the boilers, up the levels, out at the far end, past a
/// look at nothing, and back over the roof: open and crowded views in turn.
fn fly_through(bays_x: u32, bays_z: u32, frames: u32) -> CameraPath {
    let (x, z) = (f64::from(bays_x) * BAY, f64::from(bays_z) * BAY);
    // The doorways stand in the middle of each bay's side.
    let door = (f64::from(bays_z / 2) + 0.5) * BAY;
    let pose = |eye: [f64; 3], target: [f64; 3]| CameraPose {
        eye: DVec3::from_array(eye),
        target: DVec3::from_array(target),
    };
    let poses = vec![
        pose([-0.6 * x - 40.0, 60.0, -0.4 * z - 30.0], [0.5 * x, 15.0, 0.5 * z]),
        pose([-30.0, 14.0, door - 12.0], [0.5 * x, 12.0, door]),
        pose([-4.0, 3.0, door], [0.5 * x, 4.0, door + 1.0]),
        pose([14.0, 4.0, door], [x, 8.0, door + 2.0]),
        pose([0.3 * x, 11.0, door - 4.0], [x, 16.0, 0.8 * z]),
        pose([0.5 * x, 20.0, 0.5 * z], [0.7 * x, 24.0, z + 20.0]),
        pose([0.7 * x, 30.0, 0.4 * z], [x, 6.0, 0.7 * z]),
        pose([x - 8.0, 14.0, door], [x + 40.0, 12.0, door + 4.0]),
        pose([x + 30.0, 25.0, door + 10.0], [0.8 * x, 10.0, z + 60.0]),
        pose([x + 40.0, 50.0, z + 40.0], [0.5 * x, 10.0, 0.5 * z]),
    ];
    CameraPath {
        poses,
        duration: frames,
        travel: Travel::Glide,
        lens: Lens::perspective(1.0),
        near: 0.1,
        far: 3.0 * (x + z) + 300.0,
    }
}
