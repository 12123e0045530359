//! Faults of hierarchical z: the real oracle by broken rules, asked by two-pass culling as in engines.

use super::{Fault, Rig, two_pass};
use crate::oracle::hierarchical_z::{HierarchicalZ, PyramidRules, Sound};

/// The level below which no more than one texel is looked at: the logarithm rounded down.
struct FloorLevel;

impl PyramidRules for FloorLevel {
    fn level(first: [u32; 2], last: [u32; 2]) -> usize {
        let longest = (0..2).map(|axis| last[axis] - first[axis] + 1).max().unwrap_or(1);
        longest.ilog2() as usize
    }

    fn looks(first: usize, _: usize) -> [usize; 2] {
        [first; 2]
    }
}

/// Levels of odd size lose their last row and column.
struct OddIsLost;

impl PyramidRules for OddIsLost {
    fn halved(size: usize) -> usize {
        size / 2
    }
}

/// The pyramid is a power of two, and the view's own size scales the rectangle.
struct WrongRatio;

impl PyramidRules for WrongRatio {
    fn span(size: usize, first: u32, last: u32) -> (u32, u32) {
        let pyramid = size.next_power_of_two() / 2;
        let scaled = |sample: u32| (sample as usize * pyramid / size) as u32;
        (scaled(first), scaled(last))
    }
}

/// The rectangle's size is halved once more before its level is chosen.
struct ScaledTwice;

impl PyramidRules for ScaledTwice {
    fn level(first: [u32; 2], last: [u32; 2]) -> usize {
        let half: [u32; 2] =
            std::array::from_fn(|axis| first[axis] + (last[axis] - first[axis]) / 4);
        Sound::level(first, half)
    }
}

/// Level 0 through a sampler that mixes neighbours: a far sample beside a near one is no longer far.
struct Filtered;

impl PyramidRules for Filtered {
    fn level_0(width: usize, depths: Vec<f32>) -> Vec<f32> {
        let height = depths.len() / width;
        let at =
            |x: usize, y: usize| f64::from(depths[y.min(height - 1) * width + x.min(width - 1)]);
        let mixed = |i: usize| {
            let (x, y) = (i % width, i / width);
            ((at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1)) * 0.25) as f32
        };
        (0..depths.len()).map(mixed).collect()
    }
}

/// The depth that is asked is still the one of the frame before.
struct LastFrame;

impl PyramidRules for LastFrame {
    const ASKS_LAST_FRAME: bool = true;
}

/// Occluders in a buffer of a quarter of the columns and rows: one sample stands for sixteen.
struct LowResolution;

impl PyramidRules for LowResolution {
    fn level_0(width: usize, depths: Vec<f32>) -> Vec<f32> {
        let coarse = |i: usize| depths[i / width / 4 * 4 * width + i % width / 4 * 4];
        (0..depths.len()).map(coarse).collect()
    }
}

/// Occluders in a buffer of half the columns and rows, a quarter of the pixels: a texel is covered where
/// any of its samples is.
struct QuarterCoverage;

impl PyramidRules for QuarterCoverage {
    fn level_0(width: usize, depths: Vec<f32>) -> Vec<f32> {
        let height = depths.len() / width;
        let covered = |i: usize| {
            let (x, y) = (i % width / 2 * 2, i / width / 2 * 2);
            let at = |dx: usize, dy: usize| {
                depths[(y + dy).min(height - 1) * width + (x + dx).min(width - 1)]
            };
            at(0, 0).min(at(1, 0)).min(at(0, 1)).min(at(1, 1))
        };
        (0..depths.len()).map(covered).collect()
    }
}

/// Samples that one thread writes.
const BAND: usize = 16_384;
/// How far the next thread is off.
const WRONG_OFFSET: usize = 8;

/// Every second thread writes a few samples too early; an image of one thread is right.
struct ThreadOffset;

impl PyramidRules for ThreadOffset {
    fn level_0(_: usize, depths: Vec<f32>) -> Vec<f32> {
        let shifted = |i: usize| {
            let off = if i / BAND % 2 == 1 { WRONG_OFFSET } else { 0 };
            depths[(i + off).min(depths.len() - 1)]
        };
        (0..depths.len()).map(shifted).collect()
    }
}

macro_rules! by {
    ($rules:ident) => {
        Rig {
            oracle: |stage| Box::new(HierarchicalZ::<$rules>::by_rules(stage)),
            ..two_pass::PYRAMID
        }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("floor-level", 1),
        "the level by the logarithm rounded down, and one look where the rectangle covers more",
        &["hard/layers", "hard/orthographic", "hard/pinholes"],
        (two_pass::PYRAMID, by!(FloorLevel)),
    ),
    Fault::drops(
        ("odd-is-lost", 2),
        "levels of odd size lose their last row and column",
        &["hard/last-column"],
        (two_pass::PYRAMID, by!(OddIsLost)),
    ),
    Fault::drops(
        ("wrong-ratio", 3),
        "the rectangle is scaled by the wrong ratio of pyramid to view",
        &["hard/layers", "hard/orthographic"],
        (two_pass::PYRAMID, by!(WrongRatio)),
    ),
    Fault::drops(
        ("scaled-twice", 4),
        "the rectangle's size is scaled twice, and four looks miss its middle",
        &["hard/pinholes", "hard/orthographic"],
        (two_pass::PYRAMID, by!(ScaledTwice)),
    ),
    Fault::drops(
        ("filtered", 5),
        "level 0 through a filtering sampler: holes are no longer as deep as they are",
        &["hard/pinholes", "hard/grazing"],
        (two_pass::PYRAMID, by!(Filtered)),
    ),
    Fault::drops(
        ("stale-source", 6),
        "the depth asked is still the one of the frame before",
        &["hard/ping-pong", "hard/teleports"],
        (two_pass::PYRAMID, by!(LastFrame)),
    ),
    Fault::drops(
        ("low-resolution", 27),
        "a coarse occlusion buffer closes thin gaps",
        &["hard/pinholes", "hard/grazing"],
        (two_pass::PYRAMID, by!(LowResolution)),
    ),
    Fault::drops(
        ("thread-offset", 29),
        "every second thread writes at a wrong offset, in large images alone",
        &["hard/orthographic", "hard/pinholes"],
        (two_pass::PYRAMID, by!(ThreadOffset)),
    ),
    Fault::drops(
        ("quarter-coverage", 69),
        "occluders at a quarter of the pixels cover all of a texel that they touch",
        &["hard/pinholes", "hard/grazing"],
        (two_pass::PYRAMID, by!(QuarterCoverage)),
    ),
];
