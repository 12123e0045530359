//! A scene with its parts and effects, and its state at one frame: matrices, boxes, moves.

use std::ops::Add;
use std::sync::Arc;
use std::time::Instant;

use glam::{DMat4, DVec3};
use plainsight_reference::Image;
use plainsight_reference::fast::Options;

use super::{Canary, Moment};
use crate::cull::{ObjectView, View};
use crate::effect;
use crate::index::{Entry, Moves};
use crate::math::{Aabb, ClipError, rounded_clip_matrix};
use crate::oracle::{MemoryKnobs, OracleError, Stage, least_budget};
use crate::part::{Cache, Made, ObjectId, PartedMesh, Partition, PartitionKnobs};
use crate::scene::{Camera, Object, Scene};

/// How far the box of a moved object may be from where exact arithmetic puts it, relative to the largest
/// numbers it is made of: a position takes some ten f64 operations, a box is rounded outward by
/// [`TRANSFORM_MARGIN`](crate::math::TRANSFORM_MARGIN) of the same; 2⁻⁴⁰ is a thousand times both.
const BOUND_SLACK: f64 = 1.0 / (1_u64 << 40) as f64;

/// A scene ready to run: cut into parts, its declared effects built.
pub struct World {
    /// The description.
    pub scene: Arc<Scene>,
    /// The parts.
    pub partition: Arc<Partition>,
    /// How the reference draws; nothing that is compared depends on it.
    pub render: Options,
    /// The memory that each lane's device has for meshes; `None` holds all of them.
    pub memory: Option<MemoryKnobs>,
    /// Whether the meshes were cut or read.
    pub made: Made,
    /// Wall time that cutting or reading the meshes took, seconds; a figure for reports.
    pub build_seconds: f64,
    /// What is wrong on purpose with every lane over it: for trials of the bench itself.
    pub canary: Option<Canary>,
    effects: effect::World,
    /// By object, where it stands if no effect moves it.
    rest: Vec<Rest>,
}

/// An object where it stands: what does not change while it does not move.
#[derive(Clone, Copy)]
struct Rest {
    world_from_object: DMat4,
    object_from_world: DMat4,
    bounds: Aabb,
}

impl Rest {
    fn of(world_from_object: DMat4, partition: &Partition, object: ObjectId) -> Self {
        let bounds = partition.mesh(object).bounds.transformed(&world_from_object);
        Self { world_from_object, object_from_world: world_from_object.inverse(), bounds }
    }
}

impl World {
    /// Cuts the scene's meshes and builds its effects.
    #[must_use]
    pub fn new(scene: Scene, knobs: PartitionKnobs) -> Self {
        Self::make(scene, knobs, None, &|_, _| {})
    }

    /// The same, with cut meshes kept in `cache`, and `progress` told as [`Partition::make`] says.
    #[must_use]
    pub fn make(
        scene: Scene,
        knobs: PartitionKnobs,
        cache: Option<&Cache>,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> Self {
        // Wall time is reported and never compared.
        let start = Instant::now();
        let (partition, made) = Partition::make(&scene, knobs, cache, progress);
        let build_seconds = start.elapsed().as_secs_f64();
        Self { made, build_seconds, ..Self::over(scene, Arc::new(partition)) }
    }

    /// Over meshes that are cut already: those of a scene with the same meshes and objects, which may call
    /// for other effects.
    ///
    /// # Panics
    /// Where the scene has other objects.
    #[must_use]
    pub fn over(scene: Scene, partition: Arc<Partition>) -> Self {
        let objects = (0..).map(ObjectId).zip(&scene.objects);
        assert!(
            scene.objects.len() == partition.object_count() as usize
                && objects.into_iter().all(|(id, o)| o.mesh == partition.mesh_index(id)),
            "the partition is that of other objects"
        );
        let scene = Arc::new(scene);
        let effects = effect::World::new(&scene);
        let (render, memory) = (Options::default(), None);
        let rest = Self::at_rest(&scene, &partition);
        let (made, build_seconds, canary) = (Made::default(), 0.0, None);
        Self { scene, partition, render, memory, made, build_seconds, canary, effects, rest }
    }

    fn at_rest(scene: &Scene, partition: &Partition) -> Vec<Rest> {
        let rest = |(id, object): (u32, &Object)| {
            Rest::of(object.placement.world_from_object(), partition, ObjectId(id))
        };
        (0..).zip(&scene.objects).map(rest).collect()
    }

    /// The same, with the reference drawing in another way.
    #[must_use]
    pub fn rendered(self, render: Options) -> Self {
        Self { render, ..self }
    }

    /// With every lane wrong on purpose: for trials of the bench itself.
    #[must_use]
    pub fn with_canary(self, canary: Option<Canary>) -> Self {
        Self { canary, ..self }
    }

    /// The same with every cut mesh altered: for trials of the bench itself.
    #[must_use]
    pub fn altered(self, alter: fn(&mut PartedMesh)) -> Self {
        let partition = Arc::new(self.partition.altered(alter));
        let rest = Self::at_rest(&self.scene, &partition);
        Self { partition, rest, ..self }
    }

    /// The same, out of core: devices hold no more geometry than this.
    ///
    /// # Errors
    /// [`OracleError::Budget`] where some mesh alone is larger.
    pub fn within(self, memory: MemoryKnobs) -> Result<Self, OracleError> {
        let (budget, least) = (memory.budget_bytes, least_budget(&self.partition));
        if budget < least {
            return Err(OracleError::Budget { budget, least });
        }
        Ok(Self { memory: Some(memory), ..self })
    }

    /// How many views each frame has.
    #[must_use]
    pub fn views(&self) -> u32 {
        self.scene.cameras.len() as u32
    }

    /// How many objects some effect moves.
    #[must_use]
    pub fn moving_count(&self) -> usize {
        self.effects.moving().len()
    }

    /// Ids of the objects that some effect moves, ascending.
    pub(super) fn moving(&self) -> &[u32] {
        self.effects.moving()
    }

    /// World boxes of all objects where nothing moves them, by id.
    pub(super) fn boxes_at_rest(&self) -> impl Iterator<Item = Aabb> {
        self.rest.iter().map(|rest| rest.bounds)
    }

    /// The world box of an object at that tick of its effects.
    pub(super) fn bounds_of(&self, id: ObjectId, tick: u32, work: &mut effect::Work) -> Aabb {
        let placed = self.effects.placement(id.0, tick, work).world_from_object();
        self.partition.mesh(id).bounds.transformed(&placed)
    }

    /// Whether an object may have gone farther to that tick than its step bound.
    pub(super) fn jumps(&self, id: ObjectId, tick: u32) -> bool {
        self.effects.jumped(id.0, tick)
    }

    /// Where an object stands at frame `t`: the affine matrix from its space to the world.
    ///
    /// # Panics
    /// For an object that does not exist.
    #[must_use]
    pub fn world_from_object(&self, object: ObjectId, t: u32) -> DMat4 {
        let placement =
            self.effects.placement(object.0, self.scene.start + t, &mut effect::Work::default());
        placement.world_from_object()
    }

    /// A cleared image of the scene's size and depth order.
    #[must_use]
    pub fn image(&self) -> Image {
        Image::ordered(self.scene.viewport, self.scene.depth)
    }

    /// What its oracles work on.
    #[must_use]
    pub fn stage(&self) -> Stage {
        let partition = self.partition.clone();
        let (viewport, depth) = (self.scene.viewport, self.scene.depth);
        Stage { partition, viewport, depth, render: self.render, memory: self.memory }
    }

    /// What an index is built from: the boxes of frame 0.
    #[must_use]
    pub fn entries(&self) -> Vec<Entry> {
        let first = super::Boxes::first(self);
        (0..)
            .zip(first.moves().boxes.iter().copied())
            .map(|(object, bounds)| self.entry(object, bounds))
            .collect()
    }

    fn entry(&self, object: u32, bounds: Aabb) -> Entry {
        let own = self.partition.mesh(ObjectId(object)).bounds;
        if own.is_empty() {
            return Entry { bounds, step_bound: 0.0, reach: 0.0 };
        }
        let rest = self.rest[object as usize].world_from_object;
        let middle = rest.transform_vector3(own.center()).length();
        // However it turns, no corner is farther from the middle than in the scene's own placement.
        let reach = if self.effects.turns(object) {
            let arm = |corner: DVec3| rest.transform_vector3(corner - own.center()).length();
            own.corners().into_iter().map(arm).fold(0.0, f64::max)
        } else {
            bounds.size().max_element() * 0.5
        };
        let step = self.effects.step_bound(object, middle);
        let slack = (reach + middle + step + self.effects.extent(object)) * BOUND_SLACK;
        // What turns in place has a middle that moves by rounding alone.
        let moves = step > 0.0 || self.effects.turns(object);
        let step_bound = if moves { step + slack } else { 0.0 };
        Entry { bounds, step_bound, reach: reach + slack }
    }
}

/// Everything about one view of a frame that does not depend on a culler; a pure function of
/// (scene, t, view).
pub struct FrameState {
    /// Which frame and view.
    pub moment: Moment,
    /// The camera.
    pub camera: Camera,
    /// Clip from world.
    pub clip_from_world: DMat4,
    /// Objects as cullers see them.
    pub objects: Vec<ObjectView>,
    /// Object-to-clip matrices as renderers take them.
    pub matrices: Vec<[f32; 16]>,
    /// World boxes of the objects, by id.
    pub boxes: Vec<Aabb>,
    /// Objects that are not where they were at t − 1, ascending; none at t = 0.
    pub moved: Vec<ObjectId>,
    /// Those of them that jumped.
    pub jumped: Vec<ObjectId>,
    /// What effects took to get here; nothing in a scene without any.
    pub work: FrameWork,
}

/// What the declared effects of a scene take in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameWork {
    /// How often each was evaluated.
    pub effects: effect::Work,
    /// Matrices, inverses and boxes of objects made anew.
    pub boxes: u64,
    /// Moves that indexes were told of.
    pub moves: u64,
}

impl Add for FrameWork {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let effects = self.effects + other.effects;
        Self { effects, boxes: self.boxes + other.boxes, moves: self.moves + other.moves }
    }
}

impl FrameState {
    /// The state of `world` at that frame, seen by that camera.
    ///
    /// # Panics
    /// For a view that the scene does not have.
    #[must_use]
    pub fn at(world: &World, moment: Moment) -> Self {
        let t = moment.frame;
        let tick = world.scene.start + t;
        let camera = world.scene.cameras[moment.view as usize].at(tick);
        let clip_from_world = camera.clip_from_world(world.scene.viewport, world.scene.depth);
        let mut work = FrameWork::default();
        let mut moving = world.effects.moving().iter().peekable();
        let view = |(id, rest): (u32, &Rest)| {
            // Nothing is evaluated for what no effect moves.
            let placed = match moving.next_if_eq(&&id) {
                None => *rest,
                Some(_) => {
                    work.boxes += 1;
                    let placement = world.effects.placement(id, tick, &mut work.effects);
                    Rest::of(placement.world_from_object(), &world.partition, ObjectId(id))
                }
            };
            let bounds = world.partition.mesh(ObjectId(id)).bounds;
            let reach = if bounds.is_empty() { DVec3::ZERO } else { bounds.max_abs() };
            ObjectView {
                bounds: placed.bounds,
                clip_from_object: clip_from_world * placed.world_from_object,
                eye: placed.object_from_world.transform_point3(camera.eye),
                error: ClipError::of(&clip_from_world, &placed.world_from_object, reach),
            }
        };
        let objects: Vec<ObjectView> = (0..).zip(&world.rest).map(view).collect();
        let boxes = objects.iter().map(|object| object.bounds).collect();
        // Things at rest between two moves are not named: boxes tighten about them.
        let mut differs = |&&object: &&u32| {
            let mut at = |tick: u32| world.effects.placement(object, tick, &mut work.effects);
            at(tick) != at(tick - 1)
        };
        let moving = if t == 0 { &[] } else { world.effects.moving() };
        let moved: Vec<ObjectId> =
            moving.iter().filter(&mut differs).map(|&object| ObjectId(object)).collect();
        let jumps = |id: &&ObjectId| world.effects.jumped(id.0, tick);
        let jumped = moved.iter().filter(jumps).copied().collect();
        work.moves = moved.len() as u64;
        let matrices = objects.iter().map(|o| rounded_clip_matrix(&o.clip_from_object)).collect();
        Self { moment, camera, clip_from_world, objects, matrices, boxes, moved, jumped, work }
    }

    /// The first view of frame 0.
    #[must_use]
    pub fn first(world: &World) -> Self {
        Self::at(world, Moment { frame: 0, view: 0 })
    }

    /// As an index sees it.
    #[must_use]
    pub fn moves(&self) -> Moves<'_> {
        Moves { boxes: &self.boxes, moved: &self.moved, jumped: &self.jumped }
    }

    /// As a culler sees it.
    #[must_use]
    pub fn view<'a>(&'a self, world: &'a World) -> View<'a> {
        View {
            frame: self.moment.frame,
            view: self.moment.view,
            viewport: world.scene.viewport,
            depth: world.scene.depth,
            camera: self.camera,
            clip_from_world: self.clip_from_world,
            objects: &self.objects,
            moves: self.moves(),
            partition: &world.partition,
        }
    }
}
