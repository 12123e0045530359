//! The account of one part in one frame: what the truth says of it, and what made a culler draw it or not.
//! The culler is run from frame 0 with a journal; what it does not write, its own levels are asked for.

use plainsight_reference::Image;

use super::{FrameState, Moment, RunError, Truth, World, render};
use crate::cull::{Appearance, Culler, Item, Journal, Pen, Question, Scenery, View};
use crate::index::NodeId;
use crate::math::{ClipBox, FrustumPlane};
use crate::oracle::{FrameView, Oracle};
use crate::part::{ObjectId, PartId};

/// What the truth says of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartTruth {
    /// It shows.
    Visible {
        /// In so many samples.
        pixels: u32,
        /// Column and row of the first of them, row 0 on top.
        first: [u32; 2],
    },
    /// It covers samples and shows in none.
    Hidden {
        /// How many samples it covers.
        samples: u32,
        /// Column and row of the sample where it comes nearest.
        nearest: [u32; 2],
        /// Its depth there.
        depth: f32,
        /// The part that stands before it there.
        by: PartId,
        /// That part's depth.
        by_depth: f32,
    },
    /// It covers no sample: outside the picture, or between the samples.
    NoSample,
}

/// What was made of a node.
#[derive(Clone, Debug, PartialEq)]
pub enum Made {
    /// The walk did not come here.
    NotReached,
    /// Wholly beyond a plane of the frustum.
    Outside(FrustumPlane),
    /// Within the frustum and between the samples, or empty.
    OnNoSample,
    /// Walked into without a question: it reaches the near plane, holds the eye, or its contents may
    /// stick out of its box.
    Certain,
    /// Walked into for what was known of it. A question may have followed, whose answer counts later.
    Remembered(Option<Question>),
    /// Asked about and waited for.
    Asked(Question),
    /// Drawn with the scene node that holds its object.
    WithNode,
    /// Left out without a word that the journal has.
    LeftOut,
}

/// A node on the way to the part.
#[derive(Clone, Debug)]
pub struct Step {
    /// Which.
    pub item: Item,
    /// What was made of it.
    pub made: Made,
    /// Whether it stands for one part: walking into it draws that.
    pub is_part: bool,
    /// The latest earlier frame that had an answer about it alone, or "hidden" about it with others.
    pub latest: Option<(u32, bool)>,
    /// What the culler says that it remembers of it.
    pub recall: Option<String>,
}

/// The account.
pub struct Account {
    /// Whether the part was drawn.
    pub drawn: bool,
    /// From the root to the part's own node; empty for a culler without levels.
    pub steps: Vec<Step>,
    /// What the truth says.
    pub truth: PartTruth,
    /// The frame.
    pub state: FrameState,
    /// The truth's image.
    pub image: Image,
    /// The part alone.
    pub alone: Image,
}

impl Account {
    /// The step that decided: the last that the walk came to.
    #[must_use]
    pub fn decisive(&self) -> Option<&Step> {
        self.steps.iter().rev().find(|step| step.made != Made::NotReached)
    }
}

/// Runs `culler` beside `oracle` from frame 0 to `moment` and accounts for `part` there. `tick` is called
/// after each view and stops the run by returning false.
///
/// # Errors
/// [`RunError::Oracle`] where the oracle gives up, [`RunError::Interrupted`] where `tick` says so.
///
/// # Panics
/// For a part or view that the scene does not have.
pub fn account(
    world: &World,
    (moment, part): (Moment, PartId),
    culler: &mut dyn Culler,
    oracle: &mut dyn Oracle,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Account, RunError> {
    let mut latest: Vec<Option<(u32, bool)>> = Vec::new();
    for at in Moment::all(world, moment.frame + 1) {
        let state = FrameState::at(world, at);
        let mut journal = Journal::default();
        let frame = FrameView { frame: at.frame, clip_from_object: &state.matrices };
        oracle.begin_frame(&frame)?;
        let mut pen = Pen::new(oracle, &world.partition).writing(&mut journal);
        culler.frame(&state.view(world), &mut pen)?;
        let drawn = pen.finish()?.drawn;
        if !tick() {
            return Err(RunError::Interrupted);
        }
        if at == moment {
            let steps = steps(&state.view(world), culler, &journal, (part, &drawn), &latest);
            return Ok(conclude(world, state, part, drawn.contains(&part), steps));
        }
        if at.view == moment.view
            && let Some(scenery) = culler.scenery(at.view)
        {
            remember(scenery, &journal, at.frame, &mut latest);
        }
    }
    unreachable!("the last moment of the run is the one asked for");
}

/// Takes over a frame's answers, by slot.
fn remember(
    scenery: &Scenery,
    journal: &Journal,
    frame: u32,
    latest: &mut Vec<Option<(u32, bool)>>,
) {
    latest.resize(scenery.slot_count(), None);
    for &node in scenery.index().rebuilt() {
        latest[scenery.slot(Item::Scene(node))] = None;
    }
    for question in &journal.questions {
        let Some(visible) = question.visible else { continue };
        // Which of several shows, the answer does not say.
        if question.items.len() == 1 || !visible {
            for &item in &question.items {
                latest[scenery.slot(item)] = Some((frame, visible));
            }
        }
    }
}

/// The nodes from the root to the part's own.
fn chain(view: &View<'_>, scenery: &Scenery, part: PartId) -> Vec<Item> {
    let (object, local) = view.partition.locate(part);
    let index = scenery.index();
    let holds = |node: &&NodeId| index.node(**node).objects.contains(&object);
    let mut at = index.top_down().iter().find(holds).copied();
    let mut nodes = Vec::new();
    while let Some(node) = at {
        nodes.push(Item::Scene(node));
        at = index.parent(node);
    }
    nodes.reverse();
    nodes.push(Item::Object(object, 0));
    if let Some(tree) = &view.partition.mesh(object).tree {
        let mut children = tree.nodes[0].children;
        while let Some(pair) = children {
            let below = |&&child: &&u32| {
                let node = &tree.nodes[child as usize];
                (node.first_part..node.end_part).contains(&local)
            };
            let Some(&child) = pair.iter().find(below) else { break };
            nodes.push(Item::Object(object, child));
            children = tree.nodes[child as usize].children;
        }
    }
    nodes
}

fn steps(
    view: &View<'_>,
    culler: &dyn Culler,
    journal: &Journal,
    (part, drawn): (PartId, &[PartId]),
    latest: &[Option<(u32, bool)>],
) -> Vec<Step> {
    let Some(scenery) = culler.scenery(view.view) else { return Vec::new() };
    let mut above = true;
    let mut steps = Vec::new();
    let chain = chain(view, scenery, part);
    for (place, &item) in chain.iter().enumerate() {
        let opened = journal.opened.contains(&item);
        let last = place + 1 == chain.len();
        let made = if last && !opened && drawn.contains(&part) {
            Made::WithNode
        } else {
            made(view, scenery, journal, item, (above, opened))
        };
        above = opened;
        let slot = scenery.slot(item);
        steps.push(Step {
            item,
            made,
            is_part: scenery.is_part(item),
            latest: latest.get(slot).copied().flatten(),
            recall: culler.recall(view, item),
        });
    }
    steps
}

fn made(
    view: &View<'_>,
    scenery: &Scenery,
    journal: &Journal,
    item: Item,
    (above, opened): (bool, bool),
) -> Made {
    match journal.about(item) {
        Some((question, true)) => return Made::Remembered(Some(question.clone())),
        Some((question, false)) => return Made::Asked(question.clone()),
        None => {}
    }
    let asks = || matches!(scenery.appearance(view, item), Appearance::Ask { .. });
    if opened {
        return if asks() { Made::Remembered(None) } else { Made::Certain };
    }
    if !above {
        return Made::NotReached;
    }
    if let Some(plane) = scenery.clip_box(view, item).and_then(|clip| clip.beyond()) {
        return Made::Outside(plane);
    }
    if let Item::Object(object, 0) = item
        && let Some(plane) = beyond_by_world_box(view, object)
    {
        return Made::Outside(plane);
    }
    if matches!(scenery.appearance(view, item), Appearance::Nowhere) {
        return Made::OnNoSample;
    }
    Made::LeftOut
}

/// Objects that are drawn with their node are tested by their boxes in the world.
fn beyond_by_world_box(view: &View<'_>, object: ObjectId) -> Option<FrustumPlane> {
    let seen = &view.objects[object.0 as usize];
    ClipBox::new(&seen.bounds, &view.clip_from_world, &seen.error, view.depth).beyond()
}

fn conclude(
    world: &World,
    state: FrameState,
    part: PartId,
    drawn: bool,
    steps: Vec<Step>,
) -> Account {
    let truth = Truth::of(world, &state);
    let mut alone = world.image();
    render(world, &state, &[part], &mut alone);
    let width = world.scene.viewport.width;
    let place = |sample: usize| [sample as u32 % width, sample as u32 / width];
    let covered = || (0..alone.sample_count()).filter(|&i| alone.draw_index(i).is_some());
    let shows = |&sample: &usize| truth.part_at(world, sample) == Some(part);
    let nearest = covered().min_by(|&a, &b| alone.depth(a).total_cmp(&alone.depth(b)));
    let said = match (covered().find(shows), nearest) {
        (Some(first), _) => {
            let pixels = truth.visible_pixels[part.0 as usize];
            PartTruth::Visible { pixels, first: place(first) }
        }
        (None, Some(nearest)) => PartTruth::Hidden {
            samples: covered().count() as u32,
            nearest: place(nearest),
            depth: alone.depth(nearest),
            by: truth.part_at(world, nearest).expect("a covered sample shows a part"),
            by_depth: truth.image.depth(nearest),
        },
        (None, None) => PartTruth::NoSample,
    };
    Account { drawn, steps, truth: said, state, image: truth.image, alone }
}
