//! Both levels as one tree: nodes of the scene's index, and nodes of the objects' own trees under
//! their objects' transforms (Kovalčík & Sochor 2006, Figure 1 and section 3.3). What the three
//! cullers of the paper share: boxes in clip space, the expansion of a visible node, drawing.

use std::sync::Arc;

use super::{CullerSetup, Pen, ProxyKind, Situation, View};
use crate::index::{Index, NodeId};
use crate::math::{self, Aabb, ClipBox, ClipError, Outline, PixelRectangle, Projection, Volume};
use crate::oracle::Proxy;
use crate::part::{ObjectId, PartId, Partition};

/// A node of either level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// A node of the index.
    Scene(NodeId),
    /// A node of an object's own tree, by its place in the tree.
    Object(ObjectId, u32),
}

/// Levels below a node whose boxes may stand for it (the paper's d_max).
const TIGHTER_LEVELS: usize = 3;
/// How much larger their surface may be together (the paper's s_max).
const TIGHTER_SURFACE: f64 = 1.4;

/// How a culler wants the two levels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneryKnobs {
    /// Take the tight boxes of nodes whose contents stand still.
    pub tighten: bool,
    /// Objects without a tree are items of their own, to be asked about, instead of being drawn with
    /// their node as in the paper.
    pub treeless_items: bool,
}

/// What drawing everything at and below a node would take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Weight {
    /// Parts.
    pub parts: u64,
    /// Their triangles.
    pub triangles: u64,
}

/// What a culler remembers of a node from frame to frame; the default is for a node that nothing is
/// known of.
pub trait NodeHistory: Clone + Default {
    /// A node that the index made anew takes over what is known of one below it: it was visible if that
    /// was. What was hidden is not passed on: it says nothing of the whole.
    fn inherit(&mut self, below: &Self);
}

/// Nothing.
impl NodeHistory for () {
    fn inherit(&mut self, (): &Self) {}
}

/// One more than the last frame in which the node was visible; 0 for never.
impl NodeHistory for u32 {
    fn inherit(&mut self, below: &Self) {
        *self = (*self).max(*below);
    }
}

/// The two levels, with the bounds that a frame needs.
pub struct Scenery {
    index: Box<dyn Index>,
    partition: Arc<Partition>,
    proxy: ProxyKind,
    knobs: SceneryKnobs,
    /// First slot of each object's tree nodes in a flat history; an object without a tree has one.
    first_slot: Vec<u32>,
    /// Slots of all objects; those of scene nodes follow, whose number may grow.
    object_slots: u32,
    /// Largest error of anything at or below each index node, renewed every frame.
    node_error: Vec<ClipError>,
    /// The weight of each index node, renewed every frame.
    node_weight: Vec<Weight>,
}

impl Weight {
    fn add(&mut self, other: Self) {
        self.parts += other.parts;
        self.triangles += other.triangles;
    }
}

/// How a box appears this frame.
#[derive(Clone, Copy, Debug)]
pub enum Appearance {
    /// On no sample.
    Nowhere,
    /// Visible without a question.
    Certain,
    /// To be asked about.
    Ask {
        /// Where it can be.
        rectangle: PixelRectangle,
        /// How near it can be, between the planes.
        depth: f32,
        /// What to ask about.
        proxy: Proxy,
    },
}

impl Scenery {
    /// Takes the index and numbers every node of both levels.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: SceneryKnobs) -> Self {
        let CullerSetup { partition, index, proxy, cost: _ } = setup;
        let mut object_slots = 0;
        let mut first_slot = Vec::with_capacity(partition.object_count() as usize);
        for object in (0..partition.object_count()).map(ObjectId) {
            first_slot.push(object_slots);
            object_slots +=
                partition.mesh(object).tree.as_ref().map_or(1, |t| t.nodes.len() as u32);
        }
        Self {
            index,
            partition,
            proxy,
            knobs,
            first_slot,
            object_slots,
            node_error: Vec::new(),
            node_weight: Vec::new(),
        }
    }

    /// The index.
    #[must_use]
    pub fn index(&self) -> &dyn Index {
        self.index.as_ref()
    }

    /// How many nodes both levels have together; may grow from frame to frame.
    #[must_use]
    pub fn slot_count(&self) -> usize {
        (self.object_slots + self.index.node_count()) as usize
    }

    /// The number of a node among all of both levels.
    #[must_use]
    pub fn slot(&self, item: Item) -> usize {
        (match item {
            Item::Scene(node) => self.object_slots + node.0,
            Item::Object(object, node) => self.first_slot[object.0 as usize] + node,
        }) as usize
    }

    /// The largest error that counts for anything at or below a node of the index, in the latest frame.
    #[must_use]
    pub fn node_error(&self, node: NodeId) -> ClipError {
        self.node_error[node.0 as usize]
    }

    /// Whether objects without a tree are items of their own; else they are drawn with their node.
    #[must_use]
    pub fn treeless_items(&self) -> bool {
        self.knobs.treeless_items
    }

    /// Notes what became of the scene tree in this frame.
    pub(super) fn note_update(&self, pen: &mut Pen<'_>) {
        if !self.index.rebuilt().is_empty() {
            pen.reached(Situation::Rebuilt);
        }
        if self.index.crossed_root() {
            pen.reached(Situation::CrossedRoot);
        }
    }

    /// Relinks what moved, renews the bounds of inner nodes, and makes `history` fit: as many entries
    /// as there are slots; nodes that the index made anew inherit from what is below them.
    pub fn begin_frame<H: NodeHistory>(&mut self, view: &View<'_>, history: &mut Vec<H>) {
        self.index.update(view.moves);
        self.index.refine(view.moves.boxes, &Volume::new(&view.clip_from_world, view.depth));
        history.resize(self.slot_count(), H::default());
        self.pass_on(history);
        let count = self.index.node_count() as usize;
        self.node_error.clear();
        self.node_error.resize(count, ClipError::ZERO);
        self.node_weight.clear();
        self.node_weight.resize(count, Weight::default());
        for &node in self.index.top_down().iter().rev() {
            let number = node.0 as usize;
            for &object in self.index.node(node).objects {
                let error = &view.objects[object.0 as usize].error;
                self.node_error[number] = self.node_error[number].max(error);
                let whole = self.object_weight(object, 0);
                self.node_weight[number].add(whole);
            }
            if let Some(parent) = self.index.parent(node) {
                let (error, weight) = (self.node_error[number], self.node_weight[number]);
                let parent = parent.0 as usize;
                self.node_error[parent] = self.node_error[parent].max(&error);
                self.node_weight[parent].add(weight);
            }
        }
    }

    /// Forgets what was remembered under the numbers of nodes that the index made anew, and takes over
    /// what is known of the objects in them.
    fn pass_on<H: NodeHistory>(&self, history: &mut [H]) {
        let rebuilt = self.index.rebuilt();
        if rebuilt.is_empty() {
            return;
        }
        let mut anew = vec![false; self.index.node_count() as usize];
        for &node in rebuilt {
            anew[node.0 as usize] = true;
            history[self.slot(Item::Scene(node))] = H::default();
        }
        for &node in self.index.top_down().iter().rev() {
            let slot = self.slot(Item::Scene(node));
            if anew[node.0 as usize] {
                for &object in self.index.node(node).objects {
                    let below = history[self.slot(Item::Object(object, 0))].clone();
                    history[slot].inherit(&below);
                }
            }
            if let Some(parent) = self.index.parent(node).filter(|p| anew[p.0 as usize]) {
                let below = history[slot].clone();
                history[self.slot(Item::Scene(parent))].inherit(&below);
            }
        }
    }

    fn object_weight(&self, object: ObjectId, node: u32) -> Weight {
        let mesh = self.partition.mesh(object);
        let (first, end) = mesh.tree.as_ref().map_or((0, 1), |tree| {
            let node = &tree.nodes[node as usize];
            (node.first_part, node.end_part)
        });
        let triangles = self.partition.triangles_between(object, first, end);
        Weight { parts: u64::from(end - first), triangles }
    }

    /// What drawing everything at and below a node would take.
    #[must_use]
    pub fn weight(&self, item: Item) -> Weight {
        match item {
            Item::Scene(node) => self.node_weight[node.0 as usize],
            Item::Object(object, node) => self.object_weight(object, node),
        }
    }

    /// The same, without what is certainly outside the frustum; parts that reach into it count whole.
    pub(super) fn weight_inside(&self, view: &View<'_>, item: Item) -> Weight {
        match self.clip_box(view, item) {
            Some(clip) if clip.outside_frustum() => return Weight::default(),
            Some(clip) if clip.inside_frustum() => return self.weight(item),
            _ if self.is_part(item) => return self.weight(item),
            _ => {}
        }
        let mut sum = Weight::default();
        let mut add = |item| sum.add(self.weight_inside(view, item));
        match item {
            Item::Scene(node) => {
                let mut children = Vec::with_capacity(2);
                self.index.children(node, view.camera.eye, &mut children);
                children.into_iter().map(Item::Scene).for_each(&mut add);
                let objects = self.index.node(node).objects.iter();
                objects.map(|&object| Item::Object(object, 0)).for_each(&mut add);
            }
            Item::Object(object, node) => {
                let tree = self.partition.mesh(object).tree.as_ref();
                let children = tree.and_then(|tree| tree.nodes[node as usize].children);
                children.into_iter().flatten().for_each(|child| add(Item::Object(object, child)));
            }
        }
        sum
    }

    /// Whether the node stands for one part.
    #[must_use]
    pub fn is_part(&self, item: Item) -> bool {
        match item {
            Item::Scene(_) => false,
            Item::Object(object, node) => self
                .partition
                .mesh(object)
                .tree
                .as_ref()
                .is_none_or(|tree| tree.nodes[node as usize].children.is_none()),
        }
    }

    /// The node's box in clip space; `None` where its contents may stick out of it.
    #[must_use]
    pub fn clip_box(&self, view: &View<'_>, item: Item) -> Option<ClipBox> {
        Some(match item {
            Item::Scene(node) => {
                let this = self.index.node(node);
                let tight = this.tight_box.filter(|_| self.knobs.tighten);
                let aabb = tight.or(this.query_box)?;
                ClipBox::new(
                    &aabb,
                    &view.clip_from_world,
                    &self.node_error[node.0 as usize],
                    view.depth,
                )
            }
            Item::Object(object, node) => {
                let seen = &view.objects[object.0 as usize];
                ClipBox::new(
                    &self.object_box(object, node),
                    &seen.clip_from_object,
                    &seen.error,
                    view.depth,
                )
            }
        })
    }

    fn object_box(&self, object: ObjectId, node: u32) -> Aabb {
        let mesh = self.partition.mesh(object);
        mesh.tree.as_ref().map_or(mesh.bounds, |tree| tree.nodes[node as usize].bounds)
    }

    /// Whether the node holds nothing, or nothing of it can be inside the frustum.
    #[must_use]
    pub fn outside(&self, view: &View<'_>, item: Item) -> bool {
        if let Item::Scene(node) = item
            && self.index.node(node).subtree_objects == 0
        {
            return true;
        }
        self.clip_box(view, item).is_some_and(|clip| clip.outside_frustum())
    }

    /// What there is to ask about a node.
    #[must_use]
    pub fn appearance(&self, view: &View<'_>, item: Item) -> Appearance {
        if let Item::Scene(node) = item
            && self.index.node(node).subtree_objects == 0
        {
            return Appearance::Nowhere;
        }
        let Some(clip) = self.clip_box(view, item) else { return Appearance::Certain };
        match clip.project(view.viewport.width, view.viewport.height) {
            Projection::Nowhere => Appearance::Nowhere,
            Projection::Unbounded => Appearance::Certain,
            Projection::Within { rectangle, depth } => {
                let boxed = || self.node_box_proxy(view, item);
                match self.stand_in(view, &clip, (rectangle, depth), boxed) {
                    Some(proxy) => Appearance::Ask { rectangle, depth, proxy },
                    None => Appearance::Nowhere,
                }
            }
        }
    }

    /// What to ask about in the place of `proxy`, the node's own: the boxes below it, at most
    /// [`TIGHTER_LEVELS`] down, while their surface together is within [`TIGHTER_SURFACE`] of the
    /// node's (Mattausch, Bittner & Wimmer 2008, section 4.2). Where any of them cannot be asked about,
    /// `proxy` stays. Appends nothing where none of them can be on any sample.
    pub fn tighter_proxies(&self, view: &View<'_>, item: Item, proxy: Proxy, out: &mut Vec<Proxy>) {
        let Item::Object(object, node) = item else { return out.push(proxy) };
        let Some(tree) = &self.partition.mesh(object).tree else { return out.push(proxy) };
        let surface = |node: u32| {
            let size = tree.nodes[node as usize].bounds.size();
            size.x * size.y + size.y * size.z + size.z * size.x
        };
        let allowed = surface(node) * TIGHTER_SURFACE;
        let mut level = vec![node];
        for _ in 0..TIGHTER_LEVELS {
            let below =
                |&node: &u32| tree.nodes[node as usize].children.map_or(vec![node], Vec::from);
            let next: Vec<u32> = level.iter().flat_map(below).collect();
            if next.iter().map(|&node| surface(node)).sum::<f64>() > allowed {
                break;
            }
            level = next;
        }
        let boxes = level.iter().map(|&node| tree.nodes[node as usize].bounds);
        self.push_boxes(view, object, boxes, proxy, out);
    }

    /// What to ask about in the place of `proxy`, that of a part: the part's several boxes, neighbours
    /// taken together until there are at most `most`. For what is no part, as `tighter_proxies`.
    pub fn tightest_proxies(
        &self,
        view: &View<'_>,
        item: Item,
        (proxy, most): (Proxy, usize),
        out: &mut Vec<Proxy>,
    ) {
        let Item::Object(object, node) = item else { return out.push(proxy) };
        if !self.is_part(item) {
            return self.tighter_proxies(view, item, proxy, out);
        }
        let mesh = self.partition.mesh(object);
        let part = mesh.tree.as_ref().map_or(0, |tree| tree.nodes[node as usize].first_part);
        let boxes = mesh.boxes_of(part);
        let together = boxes.len().div_ceil(most.max(1)).max(1).next_power_of_two();
        let union = |run: &[Aabb]| run.iter().fold(Aabb::EMPTY, |all, aabb| all.union(aabb));
        self.push_boxes(view, object, boxes.chunks(together).map(union), proxy, out);
    }

    /// Appends the proxies of boxes in an object's space, or `instead` where one of them cannot be asked
    /// about.
    fn push_boxes(
        &self,
        view: &View<'_>,
        object: ObjectId,
        mut boxes: impl Iterator<Item = Aabb>,
        instead: Proxy,
        out: &mut Vec<Proxy>,
    ) {
        let from = out.len();
        if !boxes.all(|aabb| self.push_box(view, object, &aabb, out)) {
            out.truncate(from);
            out.push(instead);
        }
    }

    /// Appends the proxy of a box in an object's space, if it can be on any sample; false where it
    /// cannot be asked about.
    fn push_box(
        &self,
        view: &View<'_>,
        object: ObjectId,
        aabb: &Aabb,
        out: &mut Vec<Proxy>,
    ) -> bool {
        let seen = &view.objects[object.0 as usize];
        let clip = ClipBox::new(aabb, &seen.clip_from_object, &seen.error, view.depth);
        match clip.project(view.viewport.width, view.viewport.height) {
            Projection::Nowhere => true,
            Projection::Unbounded => false,
            Projection::Within { rectangle, depth } => {
                let boxed = || Self::box_proxy(view, object, aabb);
                out.extend(self.stand_in(view, &clip, (rectangle, depth), boxed));
                true
            }
        }
    }

    /// What to ask about in place of a box that is within `rectangle` and nowhere nearer than `depth`;
    /// the rectangle where no other can be formed. `None` where no sample can be within.
    fn stand_in(
        &self,
        view: &View<'_>,
        clip: &ClipBox,
        (rectangle, depth): (PixelRectangle, f32),
        boxed: impl FnOnce() -> Option<Proxy>,
    ) -> Option<Proxy> {
        let PixelRectangle { min, max } = rectangle;
        let plain = Proxy::Rectangle { min, max, depth };
        Some(match self.proxy {
            ProxyKind::Rectangle => plain,
            ProxyKind::Hull => {
                let pixels = (view.viewport.width, view.viewport.height);
                match clip.outline(pixels, (rectangle, depth)) {
                    Outline::Nowhere => return None,
                    Outline::Rectangle => plain,
                    Outline::Within { hull, depth } => Proxy::Hull { hull, min, max, depth },
                }
            }
            ProxyKind::Box => boxed().unwrap_or(plain),
        })
    }

    /// The inflated box of an object's node; scene nodes keep the rectangle.
    fn node_box_proxy(&self, view: &View<'_>, item: Item) -> Option<Proxy> {
        let Item::Object(object, node) = item else { return None };
        Self::box_proxy(view, object, &self.object_box(object, node))
    }

    /// The inflated box; `None` where it cannot be inflated.
    fn box_proxy(view: &View<'_>, object: ObjectId, aabb: &Aabb) -> Option<Proxy> {
        let seen = &view.objects[object.0 as usize];
        let pixels = (view.viewport.width, view.viewport.height);
        let grown =
            math::inflated_box(aabb, &seen.clip_from_object, &seen.error, pixels, view.depth)?;
        Some(Proxy::Box {
            clip_from_box: math::rounded_clip_matrix(&seen.clip_from_object),
            min: grown.min.to_array().map(|c| c as f32),
            max: grown.max.to_array().map(|c| c as f32),
        })
    }

    /// Algorithm 4, `ProcessVisibleNode`: draws what the node holds itself and appends what is to be
    /// looked at next, front to back: the nearer child, the objects with trees sorted by the distance
    /// of their boxes' centres, the farther child.
    pub(super) fn expand(
        &self,
        view: &View<'_>,
        item: Item,
        pen: &mut Pen<'_>,
        out: &mut Vec<Item>,
    ) {
        pen.opens(item);
        match item {
            Item::Scene(node) => self.expand_scene(view, node, pen, out),
            Item::Object(object, node) => self.expand_object(view, object, node, pen, out),
        }
    }

    fn expand_scene(&self, view: &View<'_>, node: NodeId, pen: &mut Pen<'_>, out: &mut Vec<Item>) {
        let mut children = Vec::with_capacity(2);
        let before = self.index.children(node, view.camera.eye, &mut children);
        out.extend(children[..before].iter().map(|&child| Item::Scene(child)));
        let mut objects: Vec<(f64, ObjectId)> = Vec::new();
        for &object in self.index.node(node).objects {
            let mesh = self.partition.mesh(object);
            if mesh.tree.is_some() || self.knobs.treeless_items {
                let center = view.objects[object.0 as usize].bounds.center();
                objects.push((center.distance_squared(view.camera.eye), object));
            } else if !view.object_outside_frustum(object.0) {
                pen.draw(self.partition.first_part(object));
            }
        }
        objects.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        out.extend(objects.iter().map(|&(_, object)| Item::Object(object, 0)));
        out.extend(children[before..].iter().map(|&child| Item::Scene(child)));
    }

    fn expand_object(
        &self,
        view: &View<'_>,
        object: ObjectId,
        node: u32,
        pen: &mut Pen<'_>,
        out: &mut Vec<Item>,
    ) {
        let Some(tree) = &self.partition.mesh(object).tree else {
            return pen.draw(self.partition.first_part(object));
        };
        let this = &tree.nodes[node as usize];
        let Some([low, high]) = this.children else {
            let first = self.partition.first_part(object);
            return pen.draw(PartId(first.0 + this.first_part));
        };
        let (axis, at) = this.plane;
        let near_low = view.objects[object.0 as usize].eye[axis as usize] <= f64::from(at);
        let order = if near_low { [low, high] } else { [high, low] };
        out.extend(order.map(|child| Item::Object(object, child)));
    }

    /// The invariants of the index.
    ///
    /// # Errors
    /// The first broken one.
    pub fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        self.index.check(boxes)
    }
}
