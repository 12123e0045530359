//! *Nothing in plain sight may be culled.* plainsight is a deterministic test bench for visibility
//! culling in dynamic 3D scenes: a bit-exact CPU z-buffer (the crate `plainsight-reference`) computes
//! which parts of a seeded scene are visible in each frame, cullers run beside it, and the checks
//! prove frame by frame that none of them dropped anything visible.
//!
//! # The map
//! A room may import only rooms that stand **above** it; `tests/tidy.rs` holds the borders.
//!
//! | room | holds | must not know |
//! |---|---|---|
//! | `plainsight_reference` | the truth: raster rules, naive and fast renderer, image hash | anything of plainsight |
//! | [`math`] | boxes, planes, frustum, projection with error bounds, deterministic trigonometry | scenes |
//! | [`scene`] | description, scene file, seed streams, generators, import | effects' state, cullers |
//! | [`part`] | meshes cut into parts, object trees and a cache of them, stable ids | moving indexes, oracles |
//! | [`effect`] | one effect per file: (scene, t) to placements | indexes, oracles |
//! | [`index`] | one structure over objects per file, behind one trait | scenes |
//! | [`oracle`] | answers "would this contribute?", one oracle per file behind one trait | indexes, cullers |
//! | [`cull`] | one frame loop per file behind one trait | the truth |
//! | [`run`] | scene + culler + oracle to a trace, observed frame by frame | the checks |
//! | [`check`] | observers of a run, one property per file | reports |
//! | [`fault`] | real bug classes seeded in cullers, oracles, indexes and math; trials of the gate | reports |
//! | [`stress`] | worlds picked by seeds, run and judged by the thousand; shrinking what fails | reports |
//! | [`accuracy`] | what each knob loses and what it takes, beside the exact run | reports |
//! | [`survey`] | what indexes over moving objects cost, beside the thesis that compared them | reports |
//! | [`foreign`] | what cullers of other engines are told and what they answer | how it is judged, reports |
//! | [`report`] | tables and pictures | |
//! | [`cli`] | verbs; wires checks to runs | |
//!
//! A frame is a pure function of (scene, t). Nothing that is compared sees a clock, a hash order, an
//! address or the timing of a thread.

pub mod accuracy;
pub mod check;
pub mod cli;
pub mod cull;
pub mod effect;
pub mod fault;
pub mod foreign;
pub mod index;
pub mod math;
pub mod oracle;
pub mod part;
pub mod report;
pub mod run;
pub mod scene;
pub mod stress;
pub mod survey;
