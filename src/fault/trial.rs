//! A trial: a fault's broken rig and the sound one side by side over the same frames, each before a gate of
//! its own. What the gate says of the broken rig is the evidence, what it says of the sound one a false
//! alarm.

use super::{Fault, Harm, Rig};
use crate::check::{Check, Gate, Ruling};
use crate::cull::{CullerSetup, PerView, ProxyKind};
use crate::index::Entry;
use crate::oracle::CostModel;
use crate::part::PartitionKnobs;
use crate::run::{
    Canary, Lane, LaneInfo, Moment, Repeat, RunError, World, partition_difference, run,
};
use crate::scene::generate::{Knobs, build};
use crate::scene::{Scene, SceneError};

/// What is run a second time, as for any culler.
const REPEAT: Repeat = Repeat::first(1);

/// A scene and seed to try rigs in.
pub struct Trial {
    world: World,
    /// The same, its meshes altered as a broken rig has them.
    altered: Option<World>,
}

/// What a trial showed.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The checks that noticed, in the order of the gate; none where the fault got through.
    pub checks: Vec<&'static str>,
    /// Frames and views that something was noticed of; all of them where it is of sums.
    pub bad_moments: u32,
    /// Frames and views that were run.
    pub moments: u32,
    /// Where the picture changed first, and in how many pixels.
    pub picture: Option<(Moment, u32)>,
    /// Parts drawn, by the sound rig and by the broken one.
    pub drawn: [u64; 2],
    /// Questions asked, by the sound rig and by the broken one.
    pub queries: [u64; 2],
    /// What the gate says of the broken rig, a line each.
    pub lines: Vec<String>,
    /// What the gate says of the sound rig, and of the broken one that is not its doing (a wrong truth, a lost
    /// device): false alarms.
    pub false_alarms: Vec<String>,
    /// What these come to.
    pub alarm: Ruling,
}

impl Evidence {
    /// Whether the bench noticed.
    #[must_use]
    pub fn caught(&self) -> bool {
        !self.checks.is_empty()
    }
}

/// The world of that scene and seed, at most `frames` of it.
///
/// # Errors
/// For a scene that there is not.
pub fn world(scene: &str, seed: u64, frames: Option<u32>) -> Result<World, SceneError> {
    let scene = build(scene, &Knobs { seed: Some(seed), ..Knobs::default() })?;
    let frames = frames.map_or(scene.frames, |most| scene.frames.min(most));
    let leaf_triangles = scene.leaf_triangles;
    let scene = Scene { frames, ..scene };
    Ok(World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() }))
}

impl Trial {
    /// Of a fault in that scene.
    ///
    /// # Errors
    /// For a scene that there is not.
    pub fn new(
        fault: &Fault,
        scene: &str,
        seed: u64,
        frames: Option<u32>,
    ) -> Result<Self, SceneError> {
        let make = || world(scene, seed, frames);
        let altered = fault.broken.alter.map(|alter| make().map(|world| world.altered(alter)));
        Ok(Self { world: make()?, altered: altered.transpose()? })
    }

    /// The same with the sound rig, or both where nothing of the meshes is altered, wrong on purpose.
    #[must_use]
    pub fn with_canary(self, canary: Option<Canary>) -> Self {
        Self { world: self.world.with_canary(canary), ..self }
    }

    /// Of a fault in a scene that is at hand, cut so.
    #[must_use]
    pub fn of(fault: &Fault, scene: &Scene, knobs: PartitionKnobs) -> Self {
        let make = || World::new(scene.clone(), knobs);
        Self { world: make(), altered: fault.broken.alter.map(|alter| make().altered(alter)) }
    }

    /// Frames and views of a run of both rigs, for a progress bar.
    #[must_use]
    pub fn shots(&self) -> u64 {
        2 * u64::from(self.world.scene.frames + REPEAT.frames) * u64::from(self.world.views())
    }

    /// Runs both rigs of `fault`, which this trial was made for.
    ///
    /// # Errors
    /// [`RunError::Interrupted`] where `tick` says so.
    pub fn run(&self, fault: &Fault, tick: &mut dyn FnMut() -> bool) -> Result<Evidence, RunError> {
        let Some(altered) = &self.altered else {
            let gates = gates(&self.world, &[audited(fault.sound), unaudited(fault.broken)], tick)?;
            return Ok(self.evidence(fault, &gates[0], &gates[1]));
        };
        let sound = gates(&self.world, &[audited(fault.sound)], tick)?;
        let broken = gates(altered, &[unaudited(fault.broken)], tick)?;
        let mut evidence = self.evidence(fault, &sound[0], &broken[0]);
        let [before, after] = [&self.world, altered].map(partition_difference);
        if after > before {
            evidence.checks.push("partition");
            evidence.bad_moments = 1;
            evidence.picture = Some((Moment { frame: 0, view: 0 }, (after - before) as u32));
            evidence.lines.push(format!(
                "partition: {after} pixels differ from the uncut scene in frame 0; {before} by the sound cut"
            ));
        }
        Ok(evidence)
    }

    fn evidence(&self, fault: &Fault, sound: &Gate, broken: &Gate) -> Evidence {
        let findings = broken.findings();
        // A broken oracle may answer otherwise when it is run again: that is its fault.
        let own = |check: Check| !matches!(check, Check::Truth | Check::Lost);
        let noticed = broken.checks().into_iter().filter(|&check| own(check));
        let mut checks: Vec<&'static str> = noticed.map(Check::name).collect();
        let mut bad: Vec<Moment> = Vec::new();
        bad.extend(broken.conservative.misses().iter().map(|miss| miss.moment));
        bad.extend(broken.image.differences().iter().map(|difference| difference.moment));
        bad.extend(findings.iter().filter(|f| own(f.check)).filter_map(|failure| failure.moment));
        bad.sort_unstable();
        bad.dedup();
        let others = findings.into_iter().filter(|failure| !own(failure.check));
        let alarms: Vec<_> = sound.findings().into_iter().chain(others).collect();
        let alarm = alarms.iter().map(|failure| failure.check.ruling()).max().unwrap_or_default();
        let mut note = |check, noticed: bool| {
            if noticed {
                checks.push(check);
            }
        };
        let drawn = [sound, broken].map(|gate| gate.excess.drawn());
        let queries = [sound, broken].map(|gate| gate.counts.total().queries);
        let moments = self.world.scene.frames * self.world.views();
        let mut bad_moments = bad.len() as u32;
        let mut lines = broken.failures();
        if fault.harm == Harm::Overdraws {
            // Sums are held by snapshots; here the sound rig's are beside them.
            note("excess", drawn[1] > drawn[0]);
            note("counts", queries[1] != queries[0]);
            if drawn[1] > drawn[0] || queries[1] != queries[0] {
                bad_moments = moments;
            }
            lines.push(format!(
                "excess: {} parts drawn and {} questions; the sound rig draws {} and asks {}",
                drawn[1], queries[1], drawn[0], queries[0]
            ));
        }
        let first = broken.image.differences().first();
        Evidence {
            checks,
            bad_moments,
            moments,
            picture: first.map(|difference| (difference.moment, difference.pixels)),
            drawn,
            queries,
            lines,
            false_alarms: alarms.into_iter().map(|failure| failure.line).collect(),
            alarm,
        }
    }
}

/// What the gate says of sound rigs over `world`, a line each with the rig's name: false alarms; and what
/// they come to.
///
/// # Errors
/// [`RunError::Interrupted`] where `tick` says so.
pub fn false_alarms(
    world: &World,
    rigs: &[Rig],
    tick: &mut dyn FnMut() -> bool,
) -> Result<(Vec<String>, Ruling), RunError> {
    let audited: Vec<_> = rigs.iter().map(|&rig| audited(rig)).collect();
    let gates = gates(world, &audited, tick)?;
    let lines = rigs.iter().zip(&gates).flat_map(|(rig, gate)| {
        gate.failures().into_iter().map(|line| format!("{} {}: {line}", rig.name, world.scene.name))
    });
    Ok((lines.collect(), gates.iter().map(Gate::ruling).max().unwrap_or_default()))
}

/// When a rig fails first in `world`; `None` where it holds.
///
/// # Errors
/// [`RunError::Interrupted`] where `tick` says so.
pub fn first_failure(
    world: &World,
    rig: Rig,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Option<Moment>, RunError> {
    Ok(gates(world, &[unaudited(rig)], tick)?[0].first_failure())
}

/// A sound rig, which is held to every promise.
fn audited(rig: Rig) -> (Rig, bool) {
    (rig, true)
}

/// A rig that may be broken: the checks of pictures must notice alone.
fn unaudited(rig: Rig) -> (Rig, bool) {
    (rig, false)
}

/// Each rig before a gate of its own.
fn gates(
    world: &World,
    rigs: &[(Rig, bool)],
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<Gate>, RunError> {
    let entries: Vec<Entry> = world.entries();
    let mut gates: Vec<Gate> = Vec::new();
    gates.resize_with(rigs.len(), Gate::default);
    let mut lanes: Vec<Lane<'_>> = Vec::new();
    for ((rig, audited), gate) in rigs.iter().zip(&mut gates) {
        let oracle = (rig.oracle)(world.stage());
        let make = || {
            (rig.culler)(CullerSetup {
                partition: world.partition.clone(),
                index: (rig.index)(&entries),
                proxy: ProxyKind::Rectangle,
                cost: CostModel::lavapipe(),
            })
        };
        let info = LaneInfo::of(rig.name, oracle.as_ref(), String::new());
        let views = if rig.keeps_views { 1 } else { world.views() };
        let culler = Box::new(move || PerView::over(views, make));
        lanes.push(Lane {
            info,
            culler,
            oracle,
            observer: gate,
            with_bound: false,
            audited: *audited,
        });
    }
    run(world, world.scene.frames, REPEAT, &mut lanes, tick)?;
    drop(lanes);
    Ok(gates)
}
