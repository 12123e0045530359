//! The arguments of every verb.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use plainsight_reference::fast::{Options, SimdLevel};

use super::accuracy::AccuracyArgs;
use super::export::ExportArgs;
use super::faults::FaultsArgs;
use super::files::Files;
use super::judge::JudgeArgs;
use super::repeat::RepeatArgs;
use super::report::ReportArgs;
use super::stress::StressArgs;
use super::thesis::TuneArgs;
use super::watchdog::FrameLimit;
use super::why::WhyArgs;
use crate::cull::ProxyKind;
use crate::oracle::{Latency, MIB, MemoryKnobs, Misbehaviour, Schedule};
use crate::part::{Crossing, PartitionKnobs};
use crate::run::{CalibrationKnobs, Canary};
use crate::scene::generate::{CameraMode, Knobs};
use crate::scene::{DepthOrder, Scene, Viewport};

/// A test bench for visibility culling: nothing in plain sight may be culled.
#[derive(Parser)]
#[command(
    name = "plainsight",
    version,
    about,
    after_help = "Exit codes: 0 all held, 1 a check \
failed, 2 bad usage or input, 3 a device was lost, did not repeat, or was missing where one was required; 130, 143 \
and 129 stopped by Ctrl-C, SIGTERM and SIGHUP, what was finished is written; 141 the reader of the results went away. \
`-` as an output file is standard output."
)]
pub(super) struct Cli {
    #[command(subcommand)]
    pub(super) verb: Option<Verb>,
}

#[derive(Subcommand)]
pub(super) enum Verb {
    /// Run cullers beside the truth and judge every frame (the default).
    Run(RunArgs),
    /// Run one lane again, frame by frame; what a failure's last line calls.
    Replay(ReplayArgs),
    /// Draw a frame: the truth, the culled image and the view from above, as PNG.
    Picture(PictureArgs),
    /// Set cullers beside Table 1 and Figures 6 to 9 of Kovalčík & Sochor 2006, on the same frames; with
    /// --thesis, indexes beside the figures of Wortel 2011.
    Compare(CompareArgs),
    /// Measure what work costs a device and write the file that `--cost` reads.
    Calibrate(CalibrateArgs),
    /// Write a scene for cullers of other engines: meshes, frames, part ids.
    Export(ExportArgs),
    /// Judge what a culler of another engine drew.
    Judge(JudgeArgs),
    /// Say what decided over one part in one frame, and draw it.
    Why(WhyArgs),
    /// Put the gate itself on trial: every seeded fault must be caught.
    Faults(FaultsArgs),
    /// Run worlds by the thousand, each picked by its seed, each judged by every check.
    Stress(StressArgs),
    /// What accuracy costs in time: every knob in turn, what it loses beside what it takes.
    Accuracy(AccuracyArgs),
    /// One HTML page of what runs came to, with charts, and pictures of every frame to scrub through.
    Report(ReportArgs),
    /// Search for the knobs of the trees of Wortel 2011 by its rule: found is about 1.1 times actual.
    Tune(TuneArgs),
    /// List scenes, cullers, oracles, indexes and devices.
    List,
}

/// `run` without arguments, for the default verb.
#[derive(Parser)]
struct BareRun {
    #[command(flatten)]
    args: RunArgs,
}

impl Default for Verb {
    fn default() -> Self {
        Self::Run(BareRun::parse_from(["plainsight"]).args)
    }
}

/// What is run, shared by all verbs that run something.
#[derive(Args, Clone)]
pub(super) struct SceneArgs {
    /// Seed of every random stream (default 1, or the scene file's).
    #[arg(long)]
    pub(super) seed: Option<u64>,
    /// Frames to run (default 24, or what the scene says).
    #[arg(long)]
    pub(super) frames: Option<u32>,
    /// Size of generated scenes: 1 is a million triangles and more.
    #[arg(long)]
    pub(super) scale: Option<f64>,
    /// The size that the scene's source gives: powerplant 1,185 objects and 13 million triangles,
    /// bunnies 300 meshes of 70,000.
    #[arg(long, conflicts_with = "scale")]
    pub(super) full_size: bool,
    /// Pixels, WIDTHxHEIGHT (default 1280x1024, or what the scene says).
    #[arg(long, value_parser = viewport)]
    pub(super) viewport: Option<Viewport>,
    /// Which way depth runs (default forward, or what the scene says).
    #[arg(long, value_enum)]
    pub(super) depth: Option<DepthArg>,
    /// A model (.obj, .gltf, .glb, .ply): in the place of the blob in bunnies, or the scene `model` itself.
    #[arg(long, value_name = "FILE")]
    pub(super) mesh: Option<PathBuf>,
    /// Where the camera of the scene `model` goes.
    #[arg(long, value_enum)]
    pub(super) camera: Option<CameraArg>,
    /// Most triangles in a part (default 3072, or what the scene says).
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) leaf: Option<u32>,
    /// What becomes of a triangle between two parts.
    #[arg(long, value_enum, default_value_t = PartsArg::Split)]
    pub(super) parts: PartsArg,
    /// Which spatial index over the objects.
    #[arg(long, default_value = "two-level-bsp")]
    pub(super) index: String,
    /// What is asked about in the place of geometry.
    #[arg(long, value_enum, default_value_t = ProxyArg::Rectangle)]
    pub(super) proxy: ProxyArg,
    /// What work costs the device, for adaptive cullers and virtual time: lavapipe, lavapipe-read-back,
    /// h100, or a file that `calibrate` wrote.
    #[arg(long, value_name = "NAME|FILE.toml", default_value = "lavapipe")]
    pub(super) cost: String,
    /// When the simulated device's answers come.
    #[arg(long, value_enum, default_value_t = LatencyArg::Even)]
    pub(super) latency: LatencyArg,
    /// Share of hidden answers that the simulated device tells as visible, from 0 to 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    pub(super) doubt: f64,
    /// What the simulated device does wrong, once: lost=N or hangs=N (a submit, counted from 0 over the run and
    /// its repetitions), unwritten=N or flips=N (a question).
    #[arg(long, value_name = "WHAT=N")]
    pub(super) misbehave: Option<Misbehaviour>,
    /// Frames in a row for which a part that shows may be missing: for policies that trust a stale "hidden".
    /// The verdict is then "held late(k)", and pictures are not compared.
    #[arg(long, value_name = "FRAMES", default_value_t = 0)]
    pub(super) late: u32,
    /// Out of core: the MiB of geometry that each lane's device may hold (default: all of it).
    #[arg(long, value_name = "MIB", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) memory: Option<u32>,
    /// Out of core: the MiB that may be loaded ahead of each frame; 0 loads nothing ahead.
    #[arg(long, value_name = "MIB", requires = "memory")]
    pub(super) prefetch: Option<u32>,
    /// Keeps object trees in this folder, one file a mesh, and reads them back where mesh and knobs
    /// are the same. No result depends on it. Nothing is kept without it.
    #[arg(long, value_name = "FOLDER")]
    pub(super) cache: Option<PathBuf>,
    /// Vector instructions of the reference renderer (default: the widest of this machine). No
    /// result depends on it.
    #[arg(long, value_name = "LEVEL", value_parser = simd)]
    pub(super) simd: Option<SimdLevel>,
    /// Has the reference renderer process every triangle, also of clusters that are strictly behind
    /// what is already drawn. No result depends on it.
    #[arg(long)]
    pub(super) every_triangle: bool,
    /// Part of the name of the Vulkan adapter to use (default: a CPU adapter such as lavapipe).
    #[arg(long)]
    pub(super) adapter: Option<String>,
    #[command(flatten)]
    pub(super) frame_limit: FrameLimit,
    /// Makes every lane wrong on purpose, to see that the failure arrives: set, image, device-image,
    /// determinism, counts, truth, panic, unrepeatable, lost, set-then-lost or hang.
    #[arg(long, value_name = "CHECK")]
    pub(super) canary: Option<Canary>,
}

#[derive(Args, Clone)]
pub(super) struct RunArgs {
    /// Scenes by name (`hard/*`: all that begin so), or scene files (default: bunnies city rooms soup).
    #[arg(long, value_name = "NAME|FILE.toml", num_args = 1.., value_delimiter = ',')]
    pub(super) scene: Vec<String>,
    /// Cullers (default: full simple vfc).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    pub(super) culler: Vec<String>,
    /// Oracles: sim, hierarchical-z, tables, simulated, last-frame, hardware, pyramid,
    /// read-back, always (default: sim, and hardware where a Vulkan device is found).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    pub(super) oracle: Vec<String>,
    #[command(flatten)]
    pub(super) scene_args: SceneArgs,
    #[command(flatten)]
    pub(super) repeat: RepeatArgs,
    /// One JSON object a line on standard output in place of the table.
    #[arg(long)]
    pub(super) json: bool,
    /// Also write the JSON lines to this file; `-` is standard output, and the table goes to standard error.
    #[arg(long, value_name = "FILE|-")]
    pub(super) out: Option<PathBuf>,
    /// Also write the results as JUnit XML to this file, or to standard output for `-`.
    #[arg(long, value_name = "FILE.xml|-")]
    pub(super) junit: Option<PathBuf>,
}

#[derive(Args, Clone)]
pub(super) struct CompareArgs {
    /// Scenes by name, or scene files (default: powerplant bunnies).
    #[arg(long, value_name = "NAME|FILE.toml", num_args = 1.., value_delimiter = ',')]
    pub(super) scene: Vec<String>,
    /// Cullers (default: full full-adaptive full-trusting simple vfc).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    pub(super) culler: Vec<String>,
    /// Oracles: sim, hierarchical-z, tables, simulated, last-frame, hardware, pyramid,
    /// read-back, always (default: sim, and hardware where a Vulkan device is found).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    pub(super) oracle: Vec<String>,
    /// Leaf sizes to compare, most triangles in a part (default: --leaf; at full size those that the
    /// paper's text and table lead to).
    #[arg(long, num_args = 1.., value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) leaves: Vec<u32>,
    #[command(flatten)]
    pub(super) scene_args: SceneArgs,
    #[command(flatten)]
    pub(super) repeat: RepeatArgs,
    /// One JSON object a lane on standard output in place of the tables.
    #[arg(long)]
    pub(super) json: bool,
    /// Folder for the figures (SVG and PNG) and the series (CSV).
    #[arg(long, value_name = "FOLDER", default_value = "comparison")]
    pub(super) out: PathBuf,
    /// The trees of Wortel 2011 instead, on its scenes city250k and spheres200k: what updating and finding
    /// cost, beside its Table 5.1 and Figures 5.1 to 5.9.
    #[arg(long, conflicts_with_all = ["culler", "oracle", "leaves"])]
    pub(super) thesis: bool,
    /// With --thesis: the knobs that the thesis gives for its scenes, not those tuned for these.
    #[arg(long, requires = "thesis")]
    pub(super) thesis_knobs: bool,
    /// With --thesis: also the indexes of its related work and the options of its future work.
    #[arg(long, requires = "thesis")]
    pub(super) beyond: bool,
}

#[derive(Args, Clone)]
pub(super) struct ReplayArgs {
    /// The scene, by name or file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub(super) scene: String,
    /// The culler.
    #[arg(long, default_value = "full")]
    pub(super) culler: String,
    /// The oracle.
    #[arg(long, default_value = "sim")]
    pub(super) oracle: String,
    #[command(flatten)]
    pub(super) scene_args: SceneArgs,
    #[command(flatten)]
    pub(super) repeat: RepeatArgs,
    /// The trace hash that must come out.
    #[arg(long, value_name = "HASH")]
    pub(super) expect: Option<String>,
    /// One JSON object a frame in place of the table.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Args, Clone)]
pub(super) struct PictureArgs {
    /// The scene, by name or file.
    #[arg(long, default_value = "bunnies", value_name = "NAME|FILE.toml")]
    pub(super) scene: String,
    /// The culler.
    #[arg(long, default_value = "full")]
    pub(super) culler: String,
    /// The oracle: sim or hardware.
    #[arg(long, default_value = "sim")]
    pub(super) oracle: String,
    #[command(flatten)]
    pub(super) scene_args: SceneArgs,
    /// Which frame, from 0; the frames before it are run too.
    #[arg(long, default_value_t = 0)]
    pub(super) frame: u32,
    /// Which of the frame's views, from 0.
    #[arg(long, default_value_t = 0)]
    pub(super) view: u32,
    /// What to draw.
    #[arg(long, value_enum, default_value_t = Layer::Parts)]
    pub(super) layer: Layer,
    /// The PNG file (default: SCENE-FRAME-LAYER.png), or `-` for standard output.
    #[arg(long, value_name = "FILE.png|-")]
    pub(super) out: Option<PathBuf>,
}

#[derive(Args, Clone)]
pub(super) struct CalibrateArgs {
    /// The scene whose parts are drawn, by name or file.
    #[arg(long, default_value = "powerplant", value_name = "NAME|FILE.toml")]
    pub(super) scene: String,
    /// The oracle that is measured: hardware, pyramid or sim.
    #[arg(long, default_value = "hardware")]
    pub(super) oracle: String,
    /// Different workloads to measure.
    #[arg(long, default_value_t = CalibrationKnobs::default().workloads,
        value_parser = clap::value_parser!(u32)
            .range(i64::from(CalibrationKnobs::LEAST_WORKLOADS)..=100_000))]
    pub(super) workloads: u32,
    /// How often each is measured; the median counts.
    #[arg(long, default_value_t = CalibrationKnobs::default().rounds,
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(super) rounds: u32,
    #[command(flatten)]
    pub(super) scene_args: SceneArgs,
    /// One JSON object on standard output in place of the table.
    #[arg(long)]
    pub(super) json: bool,
    /// The calibration file; its stem becomes the model's name. `-` is standard output, and the table goes
    /// to standard error.
    #[arg(long, value_name = "FILE.toml|-", default_value = "calibration.toml")]
    pub(super) out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Layer {
    /// The truth, each part in a colour of its own.
    Parts,
    /// The truth's depth, near is light.
    Depth,
    /// The reference's image of what the culler drew.
    Culled,
    /// From above: frustum; green drawn and visible, amber drawn in vain, grey culled, red missed.
    Top,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum CameraArg {
    /// Through its middle at eye height.
    Inside,
    /// Round it.
    Orbit,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum LatencyArg {
    /// As the cost model has it.
    Even,
    /// From nothing to four times that.
    Jittery,
    /// One batch in eight fifty times as late.
    Spiky,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum DepthArg {
    /// From 0 near to 1 far: the lesser is the nearer.
    Forward,
    /// From 1 near to 0 far, as devices call it: the greater is the nearer.
    Reversed,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PartsArg {
    /// It is split: parts do not overlap, triangles become more.
    Split,
    /// It goes whole to one of them: no new triangles, parts overlap.
    Whole,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum ProxyArg {
    /// The projected corners' rectangle at the nearest depth.
    Rectangle,
    /// The convex hull of the projected corners at that depth.
    Hull,
    /// The inflated box with interpolated depth.
    Box,
}

impl From<ProxyArg> for ProxyKind {
    fn from(proxy: ProxyArg) -> Self {
        match proxy {
            ProxyArg::Rectangle => Self::Rectangle,
            ProxyArg::Hull => Self::Hull,
            ProxyArg::Box => Self::Box,
        }
    }
}

impl RunArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(&self.scene, &self.scene_args)
            .writing("--out", self.out.as_deref())
            .writing("--junit", self.junit.as_deref())
            .json(self.json)
    }
}

impl CompareArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(&self.scene, &self.scene_args)
    }
}

impl PictureArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(std::slice::from_ref(&self.scene), &self.scene_args)
            .writing("--out", self.out.as_deref())
    }
}

impl CalibrateArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(std::slice::from_ref(&self.scene), &self.scene_args)
            .writing("--out", Some(&self.out))
            .json(self.json)
    }
}

fn viewport(text: &str) -> Result<Viewport, String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let legal = |side: &u32| (1..=Viewport::MAX_SIDE).contains(side);
    match sides {
        Some((width, height)) if legal(&width) && legal(&height) => Ok(Viewport { width, height }),
        _ => Err("write WIDTHxHEIGHT, each from 1 to 16384, as in 1280x1024".to_owned()),
    }
}

fn share(text: &str) -> Result<f64, String> {
    let share = text.parse().ok().filter(|share| (0.0..=1.0).contains(share));
    share.ok_or_else(|| "write a number from 0 to 1".to_owned())
}

fn simd(text: &str) -> Result<SimdLevel, String> {
    let here = SimdLevel::available();
    let level = text.parse()?;
    if here.contains(&level) {
        return Ok(level);
    }
    let names: Vec<String> = here.iter().map(SimdLevel::to_string).collect();
    Err(format!("this machine has {}", names.join(", ")))
}

impl SceneArgs {
    /// Most triangles in a part of `scene`.
    pub(super) fn leaf_triangles(&self, scene: &Scene) -> u32 {
        self.leaf.unwrap_or(scene.leaf_triangles)
    }

    /// How the meshes of `scene` become parts.
    pub(super) fn partition(&self, scene: &Scene) -> PartitionKnobs {
        let crossing = match self.parts {
            PartsArg::Split => Crossing::Split,
            PartsArg::Whole => Crossing::Whole,
        };
        PartitionKnobs { leaf_triangles: self.leaf_triangles(scene), crossing }
    }

    /// How the reference renderer draws.
    pub(super) fn render(&self) -> Options {
        let default = Options::default();
        Options {
            level: self.simd.unwrap_or(default.level),
            skip_hidden: default.skip_hidden && !self.every_triangle,
        }
    }

    /// What the simulated device does; its seed is the scene's.
    pub(super) fn schedule(&self) -> Schedule {
        let latency = match self.latency {
            LatencyArg::Even => Latency::Even,
            LatencyArg::Jittery => Latency::Jittery,
            LatencyArg::Spiky => Latency::Spiky,
        };
        let misbehaviour = self.misbehave;
        Schedule { latency, doubt: self.doubt, misbehaviour, ..Schedule::default() }
    }

    /// The memory of each lane's device.
    pub(super) fn memory(&self) -> Option<MemoryKnobs> {
        let bytes = |mib: u32| u64::from(mib) * MIB;
        self.memory.map(|budget| MemoryKnobs {
            budget_bytes: bytes(budget),
            prefetch_bytes: self.prefetch.map_or(MemoryKnobs::PREFETCH_BYTES, bytes),
        })
    }

    /// As the generators take them.
    pub(super) fn knobs(&self) -> Knobs {
        Knobs {
            seed: self.seed,
            scale: self.scale,
            frames: self.frames,
            viewport: self.viewport,
            depth: self.depth.map(|depth| match depth {
                DepthArg::Forward => DepthOrder::Forward,
                DepthArg::Reversed => DepthOrder::Reversed,
            }),
            mesh: self.mesh.clone(),
            full_size: self.full_size,
            camera: self.camera.map(|camera| match camera {
                CameraArg::Inside => CameraMode::Inside,
                CameraArg::Orbit => CameraMode::Orbit,
            }),
        }
    }

    /// The flags that lead to this scene again, each with a space before it; defaults are left out but for
    /// the seed and the frames. Those that no result depends on are told as well: where a failure shows that
    /// one does depend on them, it must be there.
    pub(super) fn replay_flags(&self, scene: &Scene) -> String {
        let mut flags = format!(" --seed {} --frames {}", scene.seed, scene.frames);
        let mut switch = |name: &str, on: bool| {
            if on {
                flags += &format!(" --{name}");
            }
        };
        switch("full-size", self.full_size);
        switch("every-triangle", self.every_triangle);
        let mut add = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                flags += &format!(" --{name} {}", quoted(&value));
            }
        };
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        add("scale", self.scale.map(|s| s.to_string()));
        add("viewport", self.viewport.map(|v| format!("{}x{}", v.width, v.height)));
        add("depth", self.depth.map(word));
        add("mesh", path(&self.mesh));
        add("camera", self.camera.map(word));
        add("leaf", self.leaf.map(|leaf| leaf.to_string()));
        add("parts", (self.parts != PartsArg::Split).then(|| word(self.parts)));
        add("index", (self.index != "two-level-bsp").then(|| self.index.clone()));
        add("proxy", (self.proxy != ProxyArg::Rectangle).then(|| word(self.proxy)));
        add("cost", (self.cost != "lavapipe").then(|| self.cost.clone()));
        add("latency", (self.latency != LatencyArg::Even).then(|| word(self.latency)));
        add("doubt", (self.doubt > 0.0).then(|| self.doubt.to_string()));
        add("misbehave", self.misbehave.map(|what| what.to_string()));
        add("late", (self.late > 0).then(|| self.late.to_string()));
        add("memory", self.memory.map(|mib| mib.to_string()));
        add("prefetch", self.prefetch.map(|mib| mib.to_string()));
        add("cache", path(&self.cache));
        add("simd", self.simd.map(|level| level.to_string()));
        add("adapter", self.adapter.clone());
        add("canary", self.canary.map(|canary| canary.to_string()));
        flags + &self.frame_limit.replay_flags()
    }
}

/// The word of a value that a flag chooses from.
fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// A word as a POSIX shell takes it back.
pub(super) fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/+:,=".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use clap::Command;

    use super::*;
    use crate::scene::generate::build;

    /// A value of each flag that is not its default.
    const VALUES: [(&str, &str); 24] = [
        ("seed", "9"),
        ("frames", "5"),
        ("scale", "0.25"),
        ("viewport", "97x61"),
        ("depth", "reversed"),
        ("mesh", "a model.obj"),
        ("camera", "inside"),
        ("leaf", "77"),
        ("parts", "whole"),
        ("index", "list"),
        ("proxy", "hull"),
        ("cost", "h100"),
        ("latency", "spiky"),
        ("doubt", "0.5"),
        ("misbehave", "flips=7"),
        ("late", "2"),
        ("memory", "64"),
        ("prefetch", "3"),
        ("cache", "trees"),
        ("simd", "scalar"),
        ("adapter", "llvm pipe"),
        ("frame-limit", "2.5"),
        ("canary", "panic"),
        ("rounds", "3"),
    ];

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        scene: SceneArgs,
        #[command(flatten)]
        repeat: RepeatArgs,
    }

    fn line(words: &[String]) -> Line {
        let words = ["plainsight".to_owned()].into_iter().chain(words.iter().cloned());
        Line::try_parse_from(words).unwrap_or_else(|error| panic!("{error}"))
    }

    fn flags(of: &Line) -> String {
        let knobs = Knobs { seed: of.scene.seed, frames: of.scene.frames, ..Knobs::default() };
        of.scene.replay_flags(&build("soup", &knobs).unwrap()) + &of.repeat.replay_flags()
    }

    /// A line as a shell splits it.
    fn words(line: &str) -> Vec<String> {
        let pieces = line.split('\'').enumerate();
        let words = pieces.flat_map(|(place, piece)| match place % 2 {
            1 => vec![piece.to_owned()],
            _ => piece.split_whitespace().map(str::to_owned).collect(),
        });
        words.collect()
    }

    /// Every flag that there is, by clap's own list, is told by the replay line and read back to the same.
    #[test]
    fn replay_lines_carry_every_flag() {
        let command = RepeatArgs::augment_args(SceneArgs::augment_args(Command::new("plainsight")));
        for arg in command.get_arguments() {
            let name = arg.get_long().expect("every flag has a long name");
            let flag = format!("--{name}");
            let mut given = vec![flag.clone()];
            if arg.get_action().takes_values() {
                let value = VALUES.iter().find(|(flag, _)| *flag == name);
                let value = value.or(Some(&("repeat", "4")).filter(|_| name == "repeat"));
                let (_, value) = value.unwrap_or_else(|| panic!("no value is known for {flag}"));
                given.push((*value).to_owned());
            }
            if name == "prefetch" {
                given.extend(["--memory".to_owned(), "64".to_owned()]);
            }
            let told = flags(&line(&given));
            let said = words(&told);
            let place = said.iter().position(|word| *word == flag);
            let place = place.unwrap_or_else(|| panic!("{flag} is lost in{told}"));
            assert_eq!(said.get(place + 1), given.get(1).or(said.get(place + 1)), "{told}");
            assert_eq!(flags(&line(&said)), told);
        }
        assert_eq!(flags(&line(&[])), " --seed 1 --frames 24");
    }
}
