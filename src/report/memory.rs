//! Out-of-core figures of a lane, for every report that tells them. A lane whose device holds all of
//! its geometry has none, and nothing is said of it.

use serde::Serialize;

use crate::oracle::{MIB, Memory};
use crate::run::FrameTrace;

/// Names of [`MemoryFigures::csv`], each after a comma.
pub(super) const CSV_HEAD: &str = ",most_resident_bytes,late_loads,late_bytes,prefetches,prefetched_bytes,prefetches_used,evictions";

/// Memory traffic of some frames of a lane: sums, but for the most that was resident.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MemoryFigures {
    /// Most MiB of meshes resident at any time.
    pub most_resident_mib: f64,
    /// Meshes that a draw had to wait for.
    pub late_loads: u64,
    /// Their MiB.
    pub late_mib: f64,
    /// Meshes loaded ahead.
    pub prefetches: u64,
    /// Their MiB.
    pub prefetched_mib: f64,
    /// Meshes loaded ahead that were drawn before they were thrown out.
    pub prefetches_used: u64,
    /// Meshes thrown out.
    pub evictions: u64,
}

fn mib(bytes: u64) -> f64 {
    bytes as f64 / MIB as f64
}

impl MemoryFigures {
    /// Of `frames`; `None` where there is none or memory is not limited.
    #[must_use]
    pub fn of(frames: &[FrameTrace]) -> Option<Self> {
        let memory: Vec<Memory> = frames.iter().filter_map(|frame| frame.memory).collect();
        let sum = |figure: fn(&Memory) -> u64| memory.iter().map(figure).sum::<u64>();
        Some(Self {
            most_resident_mib: mib(memory.iter().map(|m| m.most_bytes).max()?),
            late_loads: sum(|m| m.late_loads),
            late_mib: mib(sum(|m| m.late_bytes)),
            prefetches: sum(|m| m.prefetches),
            prefetched_mib: mib(sum(|m| m.prefetched_bytes)),
            prefetches_used: sum(|m| m.prefetches_used),
            evictions: sum(|m| m.evictions),
        })
    }

    /// As a clause of the line of one frame.
    #[must_use]
    pub fn clause(&self) -> String {
        format!(
            "{:.1} MiB resident at most, {} loaded late ({:.1} MiB), {} ahead ({:.1} MiB), {} of these used, {} thrown out",
            self.most_resident_mib,
            self.late_loads,
            self.late_mib,
            self.prefetches,
            self.prefetched_mib,
            self.prefetches_used,
            self.evictions
        )
    }

    /// The figures of a frame in the order of [`CSV_HEAD`], each after a comma.
    pub(super) fn csv(memory: &Memory) -> String {
        memory.words().iter().map(|word| format!(",{word}")).collect()
    }
}

/// A table of the lanes that have figures, per frame, under a head; empty where none has. A lane is
/// its name, its frames and its figures.
pub(super) fn memory_table(lanes: &[(String, usize, Option<MemoryFigures>)]) -> String {
    let wide = lanes.iter().map(|(name, ..)| name.len()).max().unwrap_or(0).max("memory".len());
    let mut text = String::new();
    for (name, frames, figures) in lanes {
        let Some(figures) = figures else { continue };
        if text.is_empty() {
            text = format!(
                "{:<wide$}  {:>8} {:>9} {:>8} {:>9} {:>9} {:>9} {:>10}\n",
                "memory",
                "most MiB",
                "late",
                "late MiB",
                "ahead",
                "ahead MiB",
                "used",
                "thrown out"
            );
        }
        let frames = (*frames).max(1) as f64;
        text += &format!(
            "{name:<wide$}  {:>8.1} {:>9.1} {:>8.1} {:>9.1} {:>9.1} {:>9.1} {:>10.1}\n",
            figures.most_resident_mib,
            figures.late_loads as f64 / frames,
            figures.late_mib / frames,
            figures.prefetches as f64 / frames,
            figures.prefetched_mib / frames,
            figures.prefetches_used as f64 / frames,
            figures.evictions as f64 / frames,
        );
    }
    text
}
