//! Both levels as one tree: nodes of the scene's index, and nodes of the objects' own trees under
//! their objects' transforms (Kovalčík & Sochor 2006, Figure 1 and section 3.3). What the three
//! cullers of the paper share: boxes in clip space, the expansion of a visible node, drawing.

use std::sync::Arc;

use super::{CullerSetup, Pen, ProxyKind, View};
use crate::index::{Index, NodeId};
use crate::math::{self, Aabb, ClipBox, ClipError, PixelRectangle, Projection};
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

/// The two levels, with the bounds that a frame needs.
pub struct Scenery {
    index: Box<dyn Index>,
    partition: Arc<Partition>,
    proxy: ProxyKind,
    /// First slot of each object's tree nodes in a flat history; scene nodes come before them.
    first_slot: Vec<u32>,
    slot_count: u32,
    /// Largest error of anything at or below each index node, renewed every frame.
    node_error: Vec<ClipError>,
}

/// How a box appears this frame.
#[derive(Clone, Copy, Debug)]
pub(super) enum Appearance {
    /// On no sample.
    Nowhere,
    /// Visible without a question.
    Certain,
    /// To be asked about.
    Ask(PixelRectangle, Proxy),
}

impl Scenery {
    /// Takes the index and numbers every node of both levels.
    #[must_use]
    pub fn new(setup: CullerSetup) -> Self {
        let CullerSetup { partition, index, proxy } = setup;
        let mut slot_count = index.node_count();
        let mut first_slot = Vec::with_capacity(partition.object_count() as usize);
        for object in (0..partition.object_count()).map(ObjectId) {
            first_slot.push(slot_count);
            slot_count += partition.mesh(object).tree.as_ref().map_or(0, |t| t.nodes.len() as u32);
        }
        Self { index, partition, proxy, first_slot, slot_count, node_error: Vec::new() }
    }

    /// How many nodes both levels have together.
    #[must_use]
    pub fn slot_count(&self) -> u32 {
        self.slot_count
    }

    /// The number of a node among all of both levels.
    #[must_use]
    pub fn slot(&self, item: Item) -> usize {
        (match item {
            Item::Scene(node) => node.0,
            Item::Object(object, node) => self.first_slot[object.0 as usize] + node,
        }) as usize
    }

    /// Relinks what moved and renews the bounds of inner nodes.
    pub fn begin_frame(&mut self, view: &View<'_>) {
        self.index.update(view.moves);
        self.node_error.clear();
        self.node_error.resize(self.index.node_count() as usize, ClipError::ZERO);
        // Children have larger numbers than parents, so one pass from the back reaches the root.
        for number in (0..self.index.node_count()).rev() {
            let node = NodeId(number);
            let own = self
                .index
                .node(node)
                .objects
                .iter()
                .fold(self.node_error[number as usize], |error, object| {
                    error.max(&view.objects[object.0 as usize].error)
                });
            self.node_error[number as usize] = own;
            if let Some(parent) = self.index.parent(node) {
                let slot = &mut self.node_error[parent.0 as usize];
                *slot = slot.max(&own);
            }
        }
    }

    /// The node's box in clip space; `None` where its contents may stick out of it.
    fn clip_box(&self, view: &View<'_>, item: Item) -> Option<ClipBox> {
        Some(match item {
            Item::Scene(node) => {
                let aabb = self.index.node(node).query_box?;
                ClipBox::new(&aabb, &view.clip_from_world, &self.node_error[node.0 as usize])
            }
            Item::Object(object, node) => {
                let seen = &view.objects[object.0 as usize];
                ClipBox::new(&self.object_box(object, node), &seen.clip_from_object, &seen.error)
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
    pub(super) fn appearance(&self, view: &View<'_>, item: Item) -> Appearance {
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
                let PixelRectangle { min, max } = rectangle;
                let plain = Proxy::Rectangle { min, max, depth };
                let proxy = match self.proxy {
                    ProxyKind::Rectangle => plain,
                    ProxyKind::Box => self.box_proxy(view, item).unwrap_or(plain),
                };
                Appearance::Ask(rectangle, proxy)
            }
        }
    }

    /// The inflated box of an object's node; scene nodes keep the rectangle.
    fn box_proxy(&self, view: &View<'_>, item: Item) -> Option<Proxy> {
        let Item::Object(object, node) = item else { return None };
        let seen = &view.objects[object.0 as usize];
        let aabb = self.object_box(object, node);
        let pixels = (view.viewport.width, view.viewport.height);
        let grown = math::inflated_box(&aabb, &seen.clip_from_object, &seen.error, pixels)?;
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
            if mesh.tree.is_some() {
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
        let tree = self.partition.mesh(object).tree.as_ref().expect("only trees have nodes");
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
    pub fn check(&self) -> Result<(), String> {
        self.index.check()
    }
}
