//! Temporal bounding volumes (Sudarsky & Gotsman 1999, *Dynamic scene occlusion culling*; Wortel 2011,
//! section 2.2) over any index: what is hung in it is not an object but a volume that the object cannot
//! leave for some frames, so that nothing is done for it until the volume expires or is looked at.
//!
//! 1. A volume is the cube around the middle of the box that holds the object however it turns and
//!    wherever it goes within its life.
//! 2. Adaptive lives: a volume that expires without having been met by a view is followed by one of twice
//!    the life, up to the longest; one that was met is followed in the next update by one of the
//!    shortest. The source uses the object itself where it is visible; a short life is the same but for
//!    a little room, at a part of the updates.
//! 3. Finding: of what the index within finds by volumes, those whose own boxes meet the view.
//!
//! Cost: an update O(volumes that expire) times the index's own; finding that of the index, plus a look at
//! each object that it finds. It loses where no bounds on steps are known, and where most objects are in
//! view. It must not know scenes or cameras, nor which index it wraps.

use std::borrow::Cow;

use glam::DVec3;

use super::checklist::{Checklists, Due};
use super::{Entry, Index, MIDDLE_ROUNDING, Moves, Node, NodeId, VolumeKnobs, Work, rounded_up};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;

/// What is known of an object.
#[derive(Clone, Copy, Debug)]
struct Fellow {
    reach: f32,
    step: f32,
    due: Due,
    /// Frames that its volume lasts, from when it was made.
    life: u16,
    /// Whether a view met its volume.
    met: bool,
}

/// What is added to the half side of a volume around a middle that is so far from the origin: the roundings
/// of the middle, wherever it goes within the volume, and of the volume's corners.
fn rounding(far: f64, half: f64) -> f64 {
    (far + 2.0 * half) * MIDDLE_ROUNDING
}

/// An index over volumes.
pub struct TemporalVolumes {
    name: &'static str,
    knobs: VolumeKnobs,
    within: Box<dyn Index>,
    /// By object; empty for one with an empty box.
    volumes: Vec<Aabb>,
    fellows: Vec<Fellow>,
    lists: Checklists,
    /// Objects with new volumes in this update.
    renewed: Vec<ObjectId>,
    /// What the index within found.
    candidates: Vec<ObjectId>,
    object_checks: u64,
}

impl TemporalVolumes {
    /// Over the objects of frame 0, with volumes in an index that `build` makes.
    #[must_use]
    pub fn new(
        name: &'static str,
        knobs: VolumeKnobs,
        entries: &[Entry],
        build: impl FnOnce(&[Entry]) -> Box<dyn Index>,
    ) -> Self {
        let fellow = |(number, entry): (usize, &Entry)| Fellow {
            reach: rounded_up(entry.reach),
            step: rounded_up(entry.step_bound),
            due: Due::NEVER,
            // Not all in one frame.
            life: (knobs.shortest + (number % usize::from((knobs.longest / 8).max(1))) as u16)
                .min(knobs.longest),
            met: false,
        };
        let mut all = Self {
            name,
            knobs,
            within: Box::new(super::List::new(&[])),
            volumes: vec![Aabb::EMPTY; entries.len()],
            fellows: entries.iter().enumerate().map(fellow).collect(),
            lists: Checklists::new(u32::from(knobs.longest) + 2),
            renewed: Vec::new(),
            candidates: Vec::new(),
            object_checks: 0,
        };
        for (id, entry) in (0..).map(ObjectId).zip(entries) {
            all.renew(id, &entry.bounds);
        }
        let whole = all.volumes.iter().fold(Aabb::EMPTY, |whole, one| whole.union(one));
        let far = if whole.is_empty() { 0.0 } else { whole.max_abs().max_element() };
        let held = |(fellow, &bounds): (&Fellow, &Aabb)| {
            let way = f64::from(fellow.step) * f64::from(knobs.longest);
            let half = f64::from(fellow.reach) + way;
            // With the rounding of a volume that is anywhere within its index, half a space around included.
            Entry { bounds, step_bound: way, reach: half + rounding(2.0 * far, half) }
        };
        let held: Vec<Entry> = all.fellows.iter().zip(&all.volumes).map(held).collect();
        all.within = build(&held);
        all
    }

    /// Makes the volume of an object anew, for the life that it has.
    fn renew(&mut self, id: ObjectId, bounds: &Aabb) {
        let fellow = &mut self.fellows[id.0 as usize];
        fellow.met = false;
        if bounds.is_empty() {
            fellow.due = Due::NEVER;
            self.volumes[id.0 as usize] = Aabb::EMPTY;
            return;
        }
        let (step, at) = (f64::from(fellow.step), bounds.center());
        let way = step * f64::from(fellow.life);
        let half = f64::from(fellow.reach) + way;
        let half = half + rounding(at.abs().max_element(), half);
        self.volumes[id.0 as usize] = Aabb::new(at, at).grown(DVec3::splat(half));
        self.lists.put(id, &mut fellow.due, way, step);
    }

    /// Notes that a view met the volumes of the candidates: those that would last long are made anew in the
    /// next update.
    fn meet(&mut self) {
        for &id in &self.candidates {
            let fellow = &mut self.fellows[id.0 as usize];
            let first = !std::mem::replace(&mut fellow.met, true);
            if first && fellow.life > self.knobs.shortest && fellow.step > 0.0 {
                self.lists.put_next(id, &mut fellow.due);
            }
        }
    }
}

impl Index for TemporalVolumes {
    fn name(&self) -> &'static str {
        self.name
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.renewed.clear();
        self.renewed.extend_from_slice(moves.jumped);
        let due = self.lists.next();
        let is_due = |id: &&ObjectId| self.lists.is_due(self.fellows[id.0 as usize].due);
        self.renewed.extend(due.iter().filter(is_due));
        self.lists.recycle(due);
        self.renewed.sort_unstable();
        self.renewed.dedup();
        let renewed = std::mem::take(&mut self.renewed);
        let VolumeKnobs { shortest, longest } = self.knobs;
        for &id in &renewed {
            let fellow = &mut self.fellows[id.0 as usize];
            fellow.life = if fellow.met { shortest } else { (fellow.life * 2).min(longest) };
            self.renew(id, moves.bounds(id));
        }
        self.within.update(Moves { boxes: &self.volumes, moved: &renewed, jumped: &renewed });
        self.renewed = renewed;
    }

    fn refine(&mut self, _: &[Aabb], volume: &Volume) {
        self.candidates.clear();
        let Self { within, volumes, candidates, .. } = self;
        within.find(volumes, volume, candidates);
        self.meet();
    }

    /// Exactly what meets the volume.
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.refine(boxes, volume);
        self.object_checks += self.candidates.len() as u64;
        let meets = |id: &&ObjectId| volume.touches(&boxes[id.0 as usize]);
        found.extend(self.candidates.iter().filter(meets));
    }

    fn work(&self) -> Work {
        let within = self.within.work();
        Work { object_checks: within.object_checks + self.object_checks, ..within }
    }

    fn heap_bytes(&self) -> usize {
        self.within.heap_bytes()
            + self.volumes.capacity() * size_of::<Aabb>()
            + self.fellows.capacity() * size_of::<Fellow>()
            + (self.renewed.capacity() + self.candidates.capacity()) * size_of::<ObjectId>()
            + self.lists.heap_bytes()
    }

    fn rebuilt(&self) -> &[NodeId] {
        self.within.rebuilt()
    }

    fn crossed_root(&self) -> bool {
        self.within.crossed_root()
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        self.within.top_down()
    }

    fn node_count(&self) -> u32 {
        self.within.node_count()
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        self.within.node(node)
    }

    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        self.within.children(node, eye, out)
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.within.parent(node)
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        let out = boxes.iter().zip(&self.volumes).position(|(own, volume)| !volume.contains(own));
        if let Some(object) = out {
            return Err(format!("object {object} has left its volume"));
        }
        for (number, (own, volume)) in (0..).zip(boxes.iter().zip(&self.volumes)) {
            let fellow = &self.fellows[number as usize];
            if own.is_empty() {
                continue;
            }
            // How much farther its middle may go without a corner of it reaching the volume's side.
            let gone = (own.center() - volume.center()).abs().max_element();
            let room = volume.size().min_element() * 0.5 - f64::from(fellow.reach) - gone;
            let far = volume.max_abs().max_element();
            let known = (room, f64::from(fellow.step), rounding(far, room.abs()));
            self.lists.check((ObjectId(number), fellow.due), known)?;
        }
        self.within.check(&self.volumes)
    }
}

#[cfg(test)]
mod tests {
    use plainsight_reference::DepthOrder;

    use super::super::List;
    use super::*;

    fn at(x: f64) -> Aabb {
        Aabb::new(DVec3::splat(x - 0.1), DVec3::splat(x + 0.1))
    }

    /// A volume in view is made anew soon and every few frames; one out of view ever more rarely; that of
    /// what stands still never.
    #[test]
    fn lives_adapt_to_what_is_seen() {
        let entry = |x: f64, step_bound| Entry { bounds: at(x), step_bound, reach: 0.1 + 1e-12 };
        let entries = [entry(0.5, 1e-5), entry(50.0, 1e-5), entry(0.2, 0.0)];
        let boxes = entries.map(|entry| entry.bounds);
        let mut index = TemporalVolumes::new("test", VolumeKnobs::default(), &entries, |held| {
            Box::new(List::new(held))
        });
        let volume = Volume::new(&glam::DMat4::IDENTITY, DepthOrder::Forward);
        let mut renewals = [0; 3];
        for _ in 0..600 {
            let mut found = Vec::new();
            index.find(&boxes, &volume, &mut found);
            assert_eq!(found, [ObjectId(0), ObjectId(2)]);
            index.update(Moves { boxes: &boxes, moved: &[], jumped: &[] });
            index.check(&boxes).unwrap();
            index.renewed.iter().for_each(|id| renewals[id.0 as usize] += 1);
        }
        // The one in view: after its first life of four, then every four updates. The other after 5, 10, 20,
        // 40, 80, 160 and 256 updates.
        assert_eq!(renewals, [150, 7, 0]);
    }
}
