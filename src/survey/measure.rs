//! A contender run over a scene's frames: everything moves, the index is updated, what the camera may see
//! is found, and now and then drawn (Wortel 2011, section 4.3). Each contender runs by itself, so that none
//! finds the caches as another left them.

use std::time::Instant;

use plainsight_reference::fast;
use serde::Serialize;

use super::Contender;
use crate::index::Work;
use crate::math::{Aabb, Volume, rounded_clip_matrix};
use crate::oracle::part_instance;
use crate::part::ObjectId;
use crate::run::{Boxes, World};
use crate::scene::Camera;

/// How a survey goes.
#[derive(Clone, Copy, Debug)]
pub struct SurveyKnobs {
    /// Frames of each run.
    pub frames: u32,
    /// What is found is drawn every so many frames; 0 for never.
    pub render_every: u32,
    /// What is found is held against a look at every box every so many frames; 0 for never.
    pub check_every: u32,
}

/// What a contender took and found, over all frames.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Survey {
    /// The scene.
    pub scene: String,
    /// The contender.
    pub contender: &'static str,
    /// Its knobs in words.
    pub knobs: String,
    /// Objects.
    pub objects: u32,
    /// Of which some effect moves so many.
    pub moving: u32,
    /// Frames.
    pub frames: u32,
    /// Objects found, over all frames.
    pub found: u64,
    /// Objects whose boxes meet the volume, over all frames.
    pub actual: u64,
    /// Operations.
    #[serde(serialize_with = "counts")]
    pub work: Work,
    /// Nodes in the last frame.
    pub nodes: u32,
    /// Bytes on the heap in the last frame.
    pub heap_bytes: u64,
    /// Wall nanoseconds of all frames: boxes made anew, on all threads. Never compared.
    pub move_ns: u64,
    /// The index updated.
    pub update_ns: u64,
    /// What is visible found.
    pub find_ns: u64,
    /// Update and finding together, in the median frame.
    pub median_ns: u64,
    /// What was found drawn, of so many frames, by the fast reference renderer.
    pub render_ns: u64,
    /// Frames drawn.
    pub rendered: u32,
}

fn counts<S: serde::Serializer>(work: &Work, serializer: S) -> Result<S::Ok, S::Error> {
    let Work { ok, updates, steps, node_checks, object_checks, lowered } = *work;
    serializer.collect_map([
        ("object_ok", ok),
        ("tree_updates", updates),
        ("traversal_steps", steps),
        ("node_checks", node_checks),
        ("object_checks", object_checks),
        ("lowered", lowered),
    ])
}

/// Runs a contender; `tick` is called after each frame and stops by returning false: then there is nothing.
///
/// # Panics
/// Where the index breaks its promise and finds less than a look at every box.
#[must_use]
pub fn survey(
    world: &World,
    contender: &Contender,
    knobs: &SurveyKnobs,
    tick: &mut dyn FnMut() -> bool,
) -> Option<Survey> {
    let mut boxes = Boxes::first(world);
    let mut index = contender.build(&world.entries());
    let mut renderer = Renderer::new(world);
    let mut found: Vec<ObjectId> = Vec::new();
    let mut this = Survey {
        scene: world.scene.name.clone(),
        contender: contender.name,
        knobs: contender.words(),
        objects: world.partition.object_count(),
        moving: world.moving_count() as u32,
        frames: knobs.frames,
        found: 0,
        actual: 0,
        work: Work::default(),
        nodes: 0,
        heap_bytes: 0,
        move_ns: 0,
        update_ns: 0,
        find_ns: 0,
        median_ns: 0,
        render_ns: 0,
        rendered: 0,
    };
    let mut each = Vec::with_capacity(knobs.frames as usize);
    let timed = |run: &mut dyn FnMut()| {
        let start = Instant::now();
        run();
        start.elapsed().as_nanos() as u64
    };
    for frame in 0..knobs.frames {
        let volume = volume_at(world, frame);
        let due = |every: u32| every > 0 && frame % every == every / 2;
        if frame > 0 {
            this.move_ns += timed(&mut || boxes.advance(world));
        }
        let moves = boxes.moves();
        let update = if frame > 0 { timed(&mut || index.update(moves)) } else { 0 };
        found.clear();
        let find = timed(&mut || index.find(moves.boxes, &volume, &mut found));
        (this.update_ns, this.find_ns) = (this.update_ns + update, this.find_ns + find);
        each.push(update + find);
        this.found += found.len() as u64;
        let meets = |id: &ObjectId| volume.touches(moves.bounds(*id));
        let exact: Vec<ObjectId> = (0..this.objects).map(ObjectId).filter(meets).collect();
        this.actual += exact.len() as u64;
        if due(knobs.check_every) {
            found.sort_unstable();
            let missed = exact.iter().find(|id| found.binary_search(id).is_err());
            assert!(missed.is_none(), "{} missed {missed:?} in frame {frame}", contender.name);
        }
        if due(knobs.render_every) {
            this.rendered += 1;
            this.render_ns += timed(&mut || renderer.draw(frame, &found));
        }
        if !tick() {
            return None;
        }
    }
    each.sort_unstable();
    this.median_ns = each[each.len() / 2];
    (this.work, this.nodes) = (index.work(), index.top_down().len() as u32);
    this.heap_bytes = index.heap_bytes() as u64;
    Some(this)
}

/// What a contender finds in one frame.
#[derive(Clone, Debug)]
pub struct Look {
    /// World boxes, by id.
    pub boxes: Vec<Aabb>,
    /// What it finds, ascending.
    pub found: Vec<ObjectId>,
    /// What meets the volume, ascending.
    pub actual: Vec<ObjectId>,
    /// Who looks.
    pub camera: Camera,
}

/// Runs a contender up to a frame.
#[must_use]
pub fn look(world: &World, contender: &Contender, frame: u32) -> Look {
    let mut boxes = Boxes::first(world);
    let mut index = contender.build(&world.entries());
    let mut found = Vec::new();
    for at in 0..=frame {
        if at > 0 {
            boxes.advance(world);
            index.update(boxes.moves());
        }
        found.clear();
        index.find(boxes.moves().boxes, &volume_at(world, at), &mut found);
    }
    found.sort_unstable();
    let (boxes, volume) = (boxes.moves().boxes.to_vec(), volume_at(world, frame));
    let meets = |id: &ObjectId| volume.touches(&boxes[id.0 as usize]);
    let actual = (0..boxes.len() as u32).map(ObjectId).filter(meets).collect();
    let camera = world.scene.cameras[0].at(world.scene.start + frame);
    Look { boxes, found, actual, camera }
}

/// What the scene's first camera sees in a frame.
pub(super) fn volume_at(world: &World, frame: u32) -> Volume {
    let scene = &world.scene;
    let camera = scene.cameras[0].at(scene.start + frame);
    Volume::new(&camera.clip_from_world(scene.viewport, scene.depth), scene.depth)
}

/// Draws what was found.
struct Renderer<'a> {
    world: &'a World,
    matrices: Vec<[f32; 16]>,
    image: plainsight_reference::Image,
}

impl<'a> Renderer<'a> {
    fn new(world: &'a World) -> Self {
        let matrices = vec![[0.0; 16]; world.partition.object_count() as usize];
        Self { world, matrices, image: world.image() }
    }

    fn draw(&mut self, frame: u32, found: &[ObjectId]) {
        let (world, scene) = (self.world, &self.world.scene);
        let camera = scene.cameras[0].at(scene.start + frame);
        let clip_from_world = camera.clip_from_world(scene.viewport, scene.depth);
        for &id in found {
            let clip_from_object = clip_from_world * world.world_from_object(id, frame);
            self.matrices[id.0 as usize] = rounded_clip_matrix(&clip_from_object);
        }
        let parts = found.iter().flat_map(|&id| world.partition.parts_of(id));
        let instance = |part| part_instance(&world.partition, part, &self.matrices);
        let instances: Vec<fast::Instance<'_>> = parts.map(instance).collect();
        self.image.clear();
        fast::render(&mut self.image, &instances, world.render);
    }
}
