//! The part of a scene file that says how things move: paths of objects, and figures with their limbs.

use std::sync::Arc;

use glam::DVec3;
use serde::Deserialize;

use super::{Articulated, Figure, Joint, Limb, Path};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InlineReflect {
    velocity: [f64; 3],
    min: [f64; 3],
    max: [f64; 3],
    #[serde(default)]
    spin: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InlineCircuit {
    corners: Vec<[f64; 3]>,
    speed: f64,
    #[serde(default)]
    start: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InlineLap {
    center: [f64; 3],
    half: [f64; 2],
    round: f64,
    speed: f64,
    #[serde(default)]
    start: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InlineFigure {
    reflect: Option<InlineReflect>,
    circuit: Option<InlineCircuit>,
    lap: Option<InlineLap>,
    #[serde(default)]
    at: [f64; 3],
    #[serde(default)]
    pace: f64,
    #[serde(default)]
    phase: f64,
    limbs: Vec<InlineLimb>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlineLimb {
    object: u32,
    #[serde(default)]
    joints: Vec<InlineJoint>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlineJoint {
    hinge: [f64; 3],
    #[serde(default)]
    swing: f64,
    #[serde(default)]
    phase: f64,
}

fn finite<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> bool {
    numbers.into_iter().all(|number| number.is_finite())
}

/// The one path of the three that is there; `place` is what the user calls who goes along it.
pub(super) fn path(
    place: &str,
    reflect: Option<InlineReflect>,
    circuit: Option<InlineCircuit>,
    lap: Option<InlineLap>,
) -> Result<Option<Path>, String> {
    match (reflect, circuit, lap) {
        (None, None, None) => Ok(None),
        (Some(InlineReflect { velocity, min, max, spin }), None, None) => {
            if !finite([velocity, min, max].as_flattened().iter().chain([&spin])) {
                return Err(format!("{place}: its motion must be finite"));
            }
            let [velocity, min, max] = [velocity, min, max].map(DVec3::from);
            Ok(Some(Path::Reflect { velocity, min, max, spin }))
        }
        (None, Some(InlineCircuit { corners, speed, start }), None) => {
            if corners.len() < 2 || !finite(corners.as_flattened().iter().chain([&speed, &start])) {
                return Err(format!(
                    "{place}: a circuit has at least two corners and finite numbers"
                ));
            }
            let corners = corners.into_iter().map(DVec3::from).collect();
            Ok(Some(Path::Circuit { corners, speed, start }))
        }
        (None, None, Some(InlineLap { center, half, round, speed, start })) => {
            let sound = finite(center.iter().chain(&half).chain([&round, &speed, &start]));
            if !(sound && half.iter().all(|&side| side > 0.0) && round > 0.0) {
                return Err(format!(
                    "{place}: a lap has finite numbers, and half sides and a round above 0"
                ));
            }
            Ok(Some(Path::Lap { center: center.into(), half, round, speed, start }))
        }
        _ => Err(format!("{place}: keep one of reflect, circuit and lap")),
    }
}

/// The figures over `objects` objects, of which `moving` have a path of their own; `None` without any.
pub(super) fn articulated(
    figures: Vec<InlineFigure>,
    objects: usize,
    moving: &[u32],
) -> Result<Option<Articulated>, String> {
    let mut taken = moving.to_vec();
    let mut read = Vec::with_capacity(figures.len());
    for (number, figure) in figures.into_iter().enumerate() {
        let place = format!("figure {number}");
        let path = path(&place, figure.reflect, figure.circuit, figure.lap)?
            .ok_or(format!("{place}: needs one of reflect, circuit and lap"))?;
        if !finite(figure.at.iter().chain([&figure.pace, &figure.phase])) {
            return Err(format!("{place}: at, pace and phase must be finite"));
        }
        let mut limbs = Vec::with_capacity(figure.limbs.len());
        for InlineLimb { object, joints } in figure.limbs {
            if object as usize >= objects || taken.contains(&object) {
                return Err(format!(
                    "{place}: object {object} does not exist, moves by itself or is another limb"
                ));
            }
            taken.push(object);
            let joint = |InlineJoint { hinge, swing, phase }| {
                let sound = finite(hinge.iter().chain([&swing, &phase]));
                sound.then_some(Joint { hinge: hinge.into(), swing, phase })
            };
            let joints: Option<Arc<[Joint]>> = joints.into_iter().map(joint).collect();
            let joints = joints.ok_or(format!("{place}: joints must be finite"))?;
            limbs.push(Limb { object, joints });
        }
        let (start, pace, phase) = (figure.at.into(), figure.pace, figure.phase);
        read.push(Figure { path, start, pace, phase, limbs });
    }
    Ok((!read.is_empty()).then_some(Articulated { figures: read }))
}
