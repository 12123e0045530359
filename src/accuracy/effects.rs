//! What each effect of a scene costs: the scene as it is, without one effect after the other, and at rest.

use serde::Serialize;

use super::knob::settings;
use super::{Point, Worlds, measure};
use crate::effect::{EFFECTS, EffectKind};
use crate::oracle::CostModel;
use crate::run::{RunError, price_states};
use crate::scene::Scene;

/// A scene with some of its effects.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct EffectPoint {
    /// The scene.
    pub scene: String,
    /// Which effects it has here.
    pub effects: Vec<&'static str>,
    /// Frames times views.
    pub frames: u32,
    /// How often each effect was evaluated, in the order of [`EFFECTS`].
    pub evaluations: Vec<u64>,
    /// Matrices and boxes of objects made anew.
    pub boxes: u64,
    /// Moves that the index was told of.
    pub moves: u64,
    /// Wall nanoseconds for the states of all frames: least, median, most. Never compared.
    pub state_wall_ns: [u64; 3],
    /// The frames as `full` draws them.
    pub run: Point,
}

/// The scene as it is first, then without each of its effects, then without all of them where it has
/// several. One point alone for a scene at rest.
///
/// # Errors
/// As [`measure`].
///
/// # Panics
/// Never: the default setting is always there.
pub fn effects(
    worlds: &Worlds<'_>,
    cost: &CostModel,
    rounds: u32,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<EffectPoint>, RunError> {
    let scene = worlds.scene();
    let declared: Vec<&EffectKind> = EFFECTS.iter().filter(|kind| (kind.declared)(scene)).collect();
    let without = |kinds: &[&EffectKind]| {
        let mut scene = scene.clone();
        kinds.iter().for_each(|kind| (kind.take_out)(&mut scene));
        scene
    };
    let mut variants = vec![scene.clone()];
    variants.extend(declared.iter().map(|&kind| without(&[kind])));
    if declared.len() > 1 {
        variants.push(without(&declared));
    }
    let default = &settings(&[]).expect("no knob is named")[..1];
    let point = |scene: &Scene| {
        let worlds = worlds.told(scene.clone());
        let run = measure(&worlds, cost, rounds, default, tick)?;
        let price = price_states(&worlds.usual(), scene.frames, rounds);
        let there = EFFECTS.iter().filter(|kind| (kind.declared)(scene)).map(|kind| kind.name);
        Ok(EffectPoint {
            scene: scene.name.clone(),
            effects: there.collect(),
            frames: run[0].frames,
            evaluations: EFFECTS.iter().map(|kind| (kind.work)(&price.work.effects)).collect(),
            boxes: price.work.boxes,
            moves: price.work.moves,
            state_wall_ns: price.wall_ns,
            run: run.into_iter().next().expect("one setting, one point"),
        })
    };
    variants.iter().map(point).collect()
}
