//! One line a lane: as JSON and in the table.

use serde::Serialize;

use super::memory::{MemoryFigures, memory_table};
use crate::check::{Gate, Ruling};
use crate::oracle::MIB;
use crate::run::{Trace, World};

/// Version of the JSON line; it grows when a field changes its meaning or goes.
pub const JSON_SCHEMA: u32 = 2;

/// One lane's result. Counts are sums over the frames.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// [`JSON_SCHEMA`].
    pub schema: u32,
    /// The scene's name.
    pub scene: String,
    /// Its seed.
    pub seed: u64,
    /// Frames run.
    pub frames: u32,
    /// Views of each frame, each drawn and judged by itself.
    pub views: u32,
    /// The culler's name.
    pub culler: String,
    /// The oracle's name.
    pub oracle: String,
    /// The adapter's name; null where no device drew.
    pub device: Option<String>,
    /// Objects of the scene.
    pub objects: u32,
    /// Parts of all objects.
    pub parts: u32,
    /// Triangles of all objects, before any is cut.
    pub triangles: u64,
    /// Triangles after the cut.
    pub fragments: u32,
    /// Samples of frame 0 at which the cut scene shows another source triangle than the uncut one.
    pub partition_difference_pixels: u64,
    /// Parts that must be visible on the lane's device and were not drawn.
    pub must_missed: u64,
    /// Parts that the exact truth shows, a device within the tolerance need not show, and that were not
    /// drawn. None where the lane's device is exact.
    pub may_missed: u64,
    /// Whether the reference's images of the drawn parts equal those of all parts, wherever the
    /// tolerance leaves no doubt.
    pub image_equal: bool,
    /// Whether the device's images do; null where no device drew.
    pub device_image_equal: Option<bool>,
    /// Parts drawn.
    pub drawn_parts: u64,
    /// Parts visible.
    pub visible_parts: u64,
    /// Questions asked.
    pub queries: u64,
    /// Times the culler waited for answers.
    pub round_trips: u64,
    /// Wall time of the culler's frames, device included, milliseconds. Never compared.
    pub wall_ms: f64,
    /// MiB of geometry that the lane's device may hold; left out where it holds all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_budget_mib: Option<f64>,
    /// What came of that; left out where the oracle draws on no device or memory is not limited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory: Option<MemoryFigures>,
    /// Hash of all that must repeat, 16 hexadecimal digits.
    pub trace_hash: String,
    /// `held`, `held late(k)`, `failed`, `device not repeatable` or `device lost`.
    pub verdict: String,
    /// What the gate says where it is not held, a line each; left out where it is.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
}

impl Row {
    /// Gathers one lane.
    #[must_use]
    pub fn new(
        world: &World,
        trace: &Trace,
        gate: &Gate,
        partition_difference_pixels: u64,
    ) -> Self {
        let counts = gate.counts.total();
        Self {
            schema: JSON_SCHEMA,
            scene: world.scene.name.clone(),
            seed: world.scene.seed,
            frames: trace.frames.len() as u32 / world.views(),
            views: world.views(),
            culler: trace.lane.culler.clone(),
            oracle: trace.lane.oracle.to_owned(),
            device: trace.lane.device.clone(),
            objects: world.partition.object_count(),
            parts: world.partition.part_count(),
            triangles: world.scene.triangle_count(),
            fragments: world.partition.fragment_count(),
            partition_difference_pixels,
            must_missed: gate.conservative.misses().len() as u64,
            may_missed: gate.conservative.may_missed(),
            image_equal: gate.image.differences().is_empty(),
            device_image_equal: gate.device_image.equal(),
            drawn_parts: gate.excess.drawn(),
            visible_parts: gate.excess.visible(),
            queries: counts.queries,
            round_trips: counts.round_trips,
            wall_ms: trace.sum(|frame| frame.wall_ns) as f64 / 1e6,
            memory_budget_mib: world.memory.map(|m| m.budget_bytes as f64 / MIB as f64),
            memory: MemoryFigures::of(&trace.frames),
            trace_hash: format!("{:016x}", trace.hash()),
            verdict: gate.word(),
            failures: gate.failures(),
        }
    }

    /// What the lane came to.
    #[must_use]
    pub fn ruling(&self) -> Ruling {
        Ruling::of(&self.verdict).unwrap_or(Ruling::Failed)
    }

    /// Views of all frames.
    fn shots(&self) -> u32 {
        self.frames * self.views
    }

    fn cells(&self) -> [String; 9] {
        let shots = f64::from(self.shots().max(1));
        let per_frame = |sum: u64| format!("{:.1}", sum as f64 / shots);
        [
            self.scene.clone(),
            self.culler.clone(),
            self.oracle.clone(),
            per_frame(self.drawn_parts),
            per_frame(self.visible_parts),
            per_frame(self.queries),
            per_frame(self.round_trips),
            format!("{:.1}", self.wall_ms / shots),
            self.verdict.to_owned(),
        ]
    }
}

/// The rows as a table, figures per frame; below it, where memory is limited, a table of that.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let head =
        ["scene", "culler", "oracle", "drawn", "visible", "queries", "trips", "ms", "verdict"];
    let mut lines = vec![head.map(str::to_owned)];
    lines.extend(rows.iter().map(Row::cells));
    let width = |column: usize| lines.iter().map(|cells| cells[column].len()).max().unwrap_or(0);
    let widths: [usize; 9] = std::array::from_fn(width);
    let mut text = String::new();
    for cells in &lines {
        for (column, cell) in cells.iter().enumerate() {
            // Words stand left, figures right.
            let wide = widths[column];
            text += &match column {
                0..=2 => format!("{cell:<wide$}  "),
                8 => format!(" {cell}"),
                _ => format!("{cell:>wide$} "),
            };
        }
        text.truncate(text.trim_end().len());
        text.push('\n');
    }
    let memory = |row: &Row| {
        let name = format!("{} {} {}", row.scene, row.culler, row.oracle);
        (name, row.shots() as usize, row.memory)
    };
    text + &memory_table(&rows.iter().map(memory).collect::<Vec<_>>())
}
