//! `run`: scenes × cullers × oracles, side by side under one truth.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use super::args::{RunArgs, SceneArgs, quoted};
use super::judge::{failure_lines, junit_case};
use super::progress::{counting_triangles, progress_bar};
use super::{CliError, EXIT_FAILED, EXIT_HELD, OutFile, Streams};
use crate::check::Gate;
use crate::cull::{Culler, CullerKind, CullerSetup, PerView};
use crate::index::{Entry, INDEXES, IndexKind};
use crate::oracle::wgpu::{Gpu, GpuStage, Hardware};
use crate::oracle::{
    Always, Approximate, CostModel, HierarchicalZ, Oracle, OracleError, Questions, Schedule, Sim,
    Simulated, Stage, Tables,
};
use crate::part::{Cache, PartId};
use crate::report::{Row, junit, table};
use crate::run::{
    FrameRecord, FrameTrace, Lane, LaneInfo, Moment, Observer, Repeat, RunError, Trace, World,
    partition_difference, run as run_lanes,
};
use crate::scene::{Scene, generate};

/// What is run a second time to see that it repeats.
pub(super) const REPEAT: Repeat = Repeat::first(1);
/// The scenes of the default run.
const DEFAULT_SCENES: [&str; 4] = ["bunnies", "city", "rooms", "soup"];
/// Frames of the default run: 24 at full size take over two minutes on two cores, and the default
/// is to answer within one. Naming a scene or `--frames` lifts the cut.
const DEFAULT_RUN_FRAMES: u32 = 6;
/// How many of the cullers the default run takes.
const DEFAULT_CULLERS: usize = 3;

/// Set by Ctrl-C; a run looks at it after every frame of every lane.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Whether the user asked to stop.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// The oracles of one invocation; the device is opened once.
pub(super) struct Oracles {
    names: Vec<String>,
    gpu: Option<Arc<Gpu>>,
    /// What the simulated device costs and does.
    simulated: (CostModel, Schedule),
}

impl Oracles {
    /// Whether every name is one of an oracle.
    pub(super) fn known(names: &[String]) -> Result<(), CliError> {
        let known: Vec<&str> =
            ["sim", "hierarchical-z", "tables", "simulated", "last-frame", "always"]
                .into_iter()
                .chain(Questions::ALL.map(Questions::name))
                .collect();
        names.iter().find(|name| !known.contains(&name.as_str())).map_or(Ok(()), |name| {
            let what = format!("no oracle is called '{name}'; there are {}", known.join(", "));
            Err(CliError::Usage(what))
        })
    }

    /// Opens what the names need. Without names: `sim`, and `hardware` where there is a device.
    pub(super) fn open(
        names: &[String],
        adapter: Option<&str>,
        streams: &mut Streams<'_>,
    ) -> Result<Self, CliError> {
        let wanted = names.is_empty() || names.iter().any(|name| on_device(name));
        let found =
            if wanted { Gpu::open(adapter) } else { Err(OracleError::NoDevice(String::new())) };
        let asked_for = !names.is_empty() || adapter.is_some();
        let mut names = if names.is_empty() {
            vec!["sim".to_owned(), "hardware".to_owned()]
        } else {
            names.to_vec()
        };
        let simulated = (CostModel::lavapipe(), Schedule::default());
        match found {
            Ok(gpu) => Ok(Self { names, gpu: Some(gpu), simulated }),
            Err(error) if wanted && asked_for => Err(error.into()),
            Err(error) => {
                if wanted {
                    writeln!(streams.talk, "WARNING: {error}")?;
                    writeln!(
                        streams.talk,
                        "WARNING: no hardware queries are judged; the simulated device runs alone"
                    )?;
                }
                names.retain(|name| !on_device(name));
                Ok(Self { names, gpu: None, simulated })
            }
        }
    }

    /// The same with a simulated device of that cost, which does what the flags say.
    pub(super) fn simulating(self, cost: &CostModel, args: &SceneArgs) -> Self {
        Self { simulated: (cost.clone(), args.schedule()), ..self }
    }

    /// One oracle a name for `stage`, made anew for each lane; the geometry on the device is shared. The
    /// simulated device has its streams from `seed`.
    pub(super) fn stage(&self, stage: &Stage, seed: u64) -> Result<StagedOracles<'_>, OracleError> {
        let (cost, schedule) = self.simulated.clone();
        Ok(StagedOracles {
            names: &self.names,
            simulated: (cost, Schedule { seed, ..schedule }),
            stage: stage.clone(),
            gpu: self.gpu.as_ref().map(|gpu| GpuStage::new(gpu, stage)).transpose()?,
        })
    }
}

/// Whether the oracle of that name asks a real device.
fn on_device(name: &str) -> bool {
    Questions::of(name).is_some()
}

/// The oracles of one invocation over one scene.
pub(super) struct StagedOracles<'a> {
    names: &'a [String],
    simulated: (CostModel, Schedule),
    stage: Stage,
    gpu: Option<Arc<GpuStage>>,
}

impl StagedOracles<'_> {
    /// One of that name.
    pub(super) fn make(&self, name: &str) -> Result<Box<dyn Oracle>, OracleError> {
        match name {
            "sim" => Ok(Box::new(Sim::new(self.stage.clone()))),
            "hierarchical-z" => Ok(Box::new(HierarchicalZ::new(self.stage.clone()))),
            "tables" => Ok(Box::new(Tables::new(self.stage.clone()))),
            "simulated" => {
                let (cost, schedule) = self.simulated.clone();
                Ok(Box::new(Simulated::new(self.stage.clone(), cost, schedule)))
            }
            "last-frame" => Ok(Box::new(Approximate::last_frame(self.stage.clone()))),
            "always" => Ok(Box::<Always>::default()),
            _ => {
                let stage = self.gpu.as_ref().expect("hardware is named only where it was opened");
                let questions = Questions::of(name).expect("names are checked before");
                Ok(Box::new(Hardware::new(stage, questions)?))
            }
        }
    }
}

/// The cullers of `names`, or the first three.
pub(super) fn pick_cullers(
    names: &[String],
    cullers: &[CullerKind],
) -> Result<Vec<CullerKind>, CliError> {
    if names.is_empty() {
        return Ok(cullers.iter().take(DEFAULT_CULLERS).copied().collect());
    }
    let pick = |name: &String| {
        cullers.iter().find(|c| c.name == name).copied().ok_or_else(|| {
            let known: Vec<&str> = cullers.iter().map(|c| c.name).collect();
            CliError::Usage(format!("no culler is called '{name}'; there are {}", known.join(", ")))
        })
    };
    names.iter().map(pick).collect()
}

/// The index of that name.
pub(super) fn pick_index(name: &str) -> Result<IndexKind, CliError> {
    INDEXES.iter().find(|i| i.name == name).copied().ok_or_else(|| {
        let known: Vec<&str> = INDEXES.iter().map(|i| i.name).collect();
        CliError::Usage(format!("no index is called '{name}'; there are {}", known.join(", ")))
    })
}

/// The scenes that names with `*` stand for.
pub(super) fn matching(names: &[&str]) -> Result<Vec<String>, CliError> {
    let each = names.iter().map(|name| Ok(generate::matching(name)?));
    Ok(each.collect::<Result<Vec<_>, CliError>>()?.concat())
}

/// A scene as the user named it. All are opened before any device, so that bad input is the first and
/// only thing said.
pub(super) struct Named {
    name: String,
    scene: Scene,
}

impl Named {
    /// The scene of that name or file.
    pub(super) fn open(name: &str, args: &SceneArgs) -> Result<Self, CliError> {
        Ok(Self { name: name.to_owned(), scene: generate::open(name, &args.knobs())? })
    }

    /// The description.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether `--mesh` decides what is seen in it.
    pub(super) fn takes_a_mesh(&self) -> bool {
        self.scene.name == "bunnies" || self.scene.name.starts_with("model-")
    }

    /// The scene cut into parts; says what was wrong with files of the cache.
    ///
    /// # Errors
    /// Where a device of `--memory` could not hold some mesh.
    pub(super) fn world(
        &self,
        args: &SceneArgs,
        cache: Option<&Cache>,
        bar: &ProgressBar,
        streams: &mut Streams<'_>,
    ) -> Result<World, CliError> {
        let message = format!("{}: object trees", self.name);
        let world = counting_triangles(bar, message, |progress| {
            World::make(self.scene.clone(), args.partition(&self.scene), cache, progress)
        });
        let world = world.rendered(args.render());
        bar.suspend(|| {
            let warnings = &world.made.warnings;
            warnings.iter().try_for_each(|line| writeln!(streams.talk, "WARNING: {line}"))
        })?;
        let Some(memory) = args.memory() else { return Ok(world) };
        world
            .within(memory)
            .map_err(|error| CliError::Usage(format!("--memory, {}: {error}", self.name)))
    }
}

/// One scene's lanes, run.
pub(super) struct Finished {
    pub(super) world: World,
    pub(super) traces: Vec<Trace>,
    pub(super) gates: Vec<Gate>,
}

/// Keeps what was drawn at one moment.
struct DrawnAt(Moment, Vec<PartId>);

impl Observer for DrawnAt {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        if record.state.moment == self.0 {
            self.1 = record.drawn.to_vec();
        }
    }
}

/// A lane's gate, and who else looks.
struct Watched<'a, 'b> {
    gate: &'a mut Gate,
    lane: usize,
    watch: &'a RefCell<&'b mut Watch<'b>>,
}

/// Sees a frame of a lane, by the lane's number.
pub(super) type Watch<'a> = dyn FnMut(usize, &FrameRecord<'_>) + 'a;

impl Observer for Watched<'_, '_> {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        self.gate.frame(record);
        (self.watch.borrow_mut())(self.lane, record);
    }

    fn repeated(&mut self, first: &FrameTrace, again: &FrameTrace) {
        self.gate.repeated(first, again);
    }
}

/// Everything that stays the same from scene to scene.
pub(super) struct Plan<'a> {
    pub(super) cullers: Vec<CullerKind>,
    pub(super) index: IndexKind,
    pub(super) oracles: Oracles,
    pub(super) cost: CostModel,
    /// Where cut meshes are kept, if anywhere.
    pub(super) cache: Option<Cache>,
    pub(super) repeat: Repeat,
    /// Whether each device is measured as well on the visible parts alone.
    pub(super) with_bound: bool,
    pub(super) args: &'a SceneArgs,
}

/// The cost model of that name or file.
pub(super) fn pick_cost(args: &SceneArgs) -> Result<CostModel, CliError> {
    CostModel::open(&args.cost).map_err(CliError::Usage)
}

/// The cache of that folder, made if it is not there.
pub(super) fn pick_cache(args: &SceneArgs) -> Result<Option<Cache>, CliError> {
    Ok(args.cache.as_deref().map(Cache::open).transpose()?)
}

impl Plan<'_> {
    /// Runs every lane of one scene.
    pub(super) fn run(
        &self,
        named: &Named,
        bar: &ProgressBar,
        streams: &mut Streams<'_>,
    ) -> Result<Finished, CliError> {
        self.run_after(named, bar, streams, &mut |_, _| Ok(()))
    }

    /// The same; `built` sees the world before anything is run on it.
    pub(super) fn run_after(
        &self,
        named: &Named,
        bar: &ProgressBar,
        streams: &mut Streams<'_>,
        built: &mut dyn FnMut(&World, &mut Streams<'_>) -> std::io::Result<()>,
    ) -> Result<Finished, CliError> {
        self.run_watched(named, bar, streams, built, &mut |_, _| {})
    }

    /// The same; `watch` sees every frame of every lane, by the lane's number.
    pub(super) fn run_watched(
        &self,
        named: &Named,
        bar: &ProgressBar,
        streams: &mut Streams<'_>,
        built: &mut dyn FnMut(&World, &mut Streams<'_>) -> std::io::Result<()>,
        watch: &mut dyn FnMut(usize, &FrameRecord<'_>),
    ) -> Result<Finished, CliError> {
        let name = &named.name;
        let world = named.world(self.args, self.cache.as_ref(), bar, streams)?;
        bar.suspend(|| built(&world, streams))?;
        let frames = world.scene.frames;
        let stage = world.stage();
        let staged = self.oracles.stage(&stage, world.scene.seed)?;
        let entries = world.entries();
        let mut gates: Vec<Gate> = Vec::new();
        let lanes: Vec<(&str, CullerKind)> = staged
            .names
            .iter()
            .flat_map(|oracle| self.cullers.iter().map(move |&culler| (oracle.as_str(), culler)))
            .collect();
        gates.resize_with(lanes.len(), || Gate::forgiving(self.args.late));
        let watch = RefCell::new(watch);
        let watched = |(lane, gate)| Watched { gate, lane, watch: &watch };
        let mut observers: Vec<Watched<'_, '_>> =
            gates.iter_mut().enumerate().map(watched).collect();
        let shots = (u64::from(frames) + self.repeat.total(frames)) * u64::from(world.views());
        bar.inc_length(shots * lanes.len() as u64);
        let mut running: Vec<Lane<'_>> = Vec::new();
        for (&(oracle, kind), observer) in lanes.iter().zip(&mut observers) {
            let oracle = staged.make(oracle)?;
            let replay = self.replay_line(name, &world, kind.name, oracle.name());
            let info = LaneInfo::of(kind.name, oracle.as_ref(), replay);
            let culler = self.factory(kind, &world, &entries);
            let first = running.iter().all(|lane| lane.info.oracle != info.oracle);
            let with_bound = self.with_bound && first;
            running.push(Lane { info, culler, oracle, observer, with_bound, audited: false });
        }
        bar.set_message(name.clone());
        let mut tick = || {
            bar.inc(1);
            !INTERRUPTED.load(Ordering::Relaxed)
        };
        let traces = run_lanes(&world, frames, self.repeat, &mut running, &mut tick)?;
        drop(running);
        drop(observers);
        Ok(Finished { world, traces, gates })
    }

    /// What the first lane draws at that moment, after all frames before it.
    pub(super) fn drawn_in(
        &self,
        world: &World,
        moment: Moment,
        bar: &ProgressBar,
    ) -> Result<Vec<PartId>, CliError> {
        let stage = world.stage();
        let staged = self.oracles.stage(&stage, world.scene.seed)?;
        let entries = world.entries();
        let mut seen = DrawnAt(moment, Vec::new());
        let oracle = staged.make(&staged.names[0])?;
        let info = LaneInfo::of(self.cullers[0].name, oracle.as_ref(), String::new());
        let culler = self.factory(self.cullers[0], world, &entries);
        let lane =
            Lane { info, culler, oracle, observer: &mut seen, with_bound: false, audited: false };
        let frames = moment.frame + 1;
        bar.inc_length(u64::from(frames) * u64::from(world.views()));
        let mut tick = || {
            bar.inc(1);
            !INTERRUPTED.load(Ordering::Relaxed)
        };
        run_lanes(world, frames, Repeat::NONE, &mut [lane], &mut tick)?;
        Ok(seen.1)
    }

    /// Lends the first lane's culler and oracle, new ones, to `work`.
    pub(super) fn with_lane<T>(
        &self,
        world: &World,
        work: impl FnOnce(&mut dyn Culler, &mut dyn Oracle) -> Result<T, RunError>,
    ) -> Result<T, CliError> {
        let stage = world.stage();
        let staged = self.oracles.stage(&stage, world.scene.seed)?;
        let mut oracle = staged.make(&staged.names[0])?;
        let entries = world.entries();
        let mut culler = self.factory(self.cullers[0], world, &entries)();
        Ok(work(culler.as_mut(), oracle.as_mut())?)
    }

    fn factory<'a>(
        &'a self,
        kind: CullerKind,
        world: &'a World,
        entries: &'a [Entry],
    ) -> Box<dyn Fn() -> Box<dyn Culler> + 'a> {
        Box::new(move || {
            PerView::over(world.views(), || {
                (kind.make)(CullerSetup {
                    partition: world.partition.clone(),
                    index: (self.index.build)(entries),
                    proxy: self.args.proxy.into(),
                    cost: self.cost.clone(),
                })
            })
        })
    }

    fn replay_line(&self, name: &str, world: &World, culler: &str, oracle: &str) -> String {
        format!(
            "plainsight replay --scene {} --seed {} --frames {} --culler {culler} --oracle {oracle}{}",
            quoted(name),
            world.scene.seed,
            world.scene.frames,
            self.args.replay_flags()
        )
    }
}

/// Lets Ctrl-C end the run at the next frame. A second handler in one process changes nothing.
pub(super) fn catch_interrupt() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            // Asked twice: at once.
            std::process::exit(i32::from(super::EXIT_INTERRUPTED));
        }
    });
}

pub(super) fn run(
    args: &RunArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let out = args.out.as_deref().map(OutFile::create).transpose()?;
    let junit_file = args.junit.as_deref().map(OutFile::create).transpose()?;
    let names: Vec<&str> = if args.scene.is_empty() {
        DEFAULT_SCENES.to_vec()
    } else {
        args.scene.iter().map(String::as_str).collect()
    };
    let names = matching(&names)?;
    let mut scene_args = args.scene_args.clone();
    if args.scene.is_empty() {
        scene_args.frames = scene_args.frames.or(Some(DEFAULT_RUN_FRAMES));
    }
    let open = |name: &String| Named::open(name, &scene_args);
    let (chosen, index) =
        (pick_cullers(&args.culler, cullers)?, pick_index(&args.scene_args.index)?);
    Oracles::known(&args.oracle)?;
    let scenes = names.iter().map(open).collect::<Result<Vec<Named>, CliError>>()?;
    let adapter = args.scene_args.adapter.as_deref();
    let cost = pick_cost(&scene_args)?;
    let plan = Plan {
        cullers: chosen,
        index,
        cache: pick_cache(&scene_args)?,
        oracles: Oracles::open(&args.oracle, adapter, streams)?.simulating(&cost, &scene_args),
        cost,
        repeat: REPEAT,
        with_bound: false,
        args: &scene_args,
    };
    catch_interrupt();
    let bar = progress_bar();
    let (mut rows, mut lines, mut failed) = (Vec::new(), String::new(), false);
    let mut cases = Vec::new();
    for named in &scenes {
        let finished = plan.run(named, &bar, streams);
        if finished.is_err() {
            bar.finish_and_clear();
        }
        let finished = finished?;
        let difference = partition_difference(&finished.world);
        for (trace, gate) in finished.traces.iter().zip(&finished.gates) {
            let row = Row::new(&finished.world, trace, gate, difference);
            let line = serde_json::to_string(&row).expect("a row is plain data");
            if args.json {
                bar.suspend(|| writeln!(streams.out, "{line}"))?;
            }
            lines += &format!("{line}\n");
            cases.push(junit_case(&row, failure_lines(gate, trace)));
            rows.push(row);
            failed |= !gate.held();
            bar.suspend(|| tell_failures(gate, trace, streams))?;
        }
    }
    bar.finish_and_clear();
    if !args.json {
        let cut = args.scene.is_empty() && args.scene_args.frames.is_none();
        tell_table(&rows, cut, streams)?;
    }
    if let Some(out) = out {
        out.finish(lines.as_bytes())?;
    }
    if let Some(file) = junit_file {
        file.finish(junit(&cases).as_bytes())?;
    }
    Ok(if failed { EXIT_FAILED } else { EXIT_HELD })
}

fn tell_table(rows: &[Row], cut: bool, streams: &mut Streams<'_>) -> Result<(), CliError> {
    write!(streams.out, "{}", table(rows))?;
    let mut said = Vec::new();
    for row in rows {
        if !said.contains(&&row.scene) {
            said.push(&row.scene);
            writeln!(
                streams.out,
                "{}: seed {}, {} frames{}, {} objects, {} triangles cut into {} in {} parts ({} pixels differ from the uncut scene)",
                row.scene,
                row.seed,
                row.frames,
                if row.views > 1 { format!(" of {} views", row.views) } else { String::new() },
                row.objects,
                row.triangles,
                row.fragments,
                row.parts,
                row.partition_difference_pixels
            )?;
        }
    }
    if let Some(device) = rows.iter().find_map(|row| row.device.as_ref()) {
        writeln!(streams.out, "hardware: {device}")?;
    }
    for row in rows.iter().filter(|row| row.may_missed > 0) {
        writeln!(
            streams.out,
            "tolerance: {} {} {}: {} times a part was not drawn that shows exactly and need not show on the device",
            row.scene, row.culler, row.oracle, row.may_missed
        )?;
    }
    if cut {
        writeln!(
            streams.out,
            "frames: cut to {DEFAULT_RUN_FRAMES} of 24 to answer within a minute; --frames 24 runs them all"
        )?;
    }
    let held = rows.iter().filter(|row| row.verdict != "failed").count();
    let word = if held == rows.len() { "held" } else { "FAILED" };
    writeln!(
        streams.out,
        "verdict: {word} ({held} of {} lanes held; figures per frame)",
        rows.len()
    )?;
    Ok(())
}

/// What failed, and the line that replays it.
pub(super) fn tell_failures(
    gate: &Gate,
    trace: &Trace,
    streams: &mut Streams<'_>,
) -> std::io::Result<()> {
    if !gate.held() {
        let lane = &trace.lane;
        writeln!(streams.talk, "FAILED: {} on {}", lane.culler, lane.oracle)?;
        gate.failures().iter().try_for_each(|line| writeln!(streams.talk, "  {line}"))?;
        writeln!(streams.talk, "  replay: {} --expect {:016x}", lane.replay, trace.hash())?;
        let lane = lane.replay.strip_prefix("plainsight replay ");
        if let (Some(lane), Some(miss)) = (lane, gate.conservative.misses().first()) {
            let Moment { frame, view } = miss.moment;
            let view = if view > 0 { format!(" --view {view}") } else { String::new() };
            let part = miss.part.0;
            writeln!(
                streams.talk,
                "  why: plainsight why {lane} --frame {frame}{view} --part {part}"
            )?;
        }
    }
    Ok(())
}

/// The plan for one culler and one oracle on one scene.
pub(super) fn one_lane<'a>(
    (scene, culler, oracle): (&str, &String, &String),
    args: &'a SceneArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<(Plan<'a>, Named), CliError> {
    let oracle = std::slice::from_ref(oracle);
    let chosen = pick_cullers(std::slice::from_ref(culler), cullers)?;
    let index = pick_index(&args.index)?;
    Oracles::known(oracle)?;
    let named = Named::open(scene, args)?;
    let (cost, cache) = (pick_cost(args)?, pick_cache(args)?);
    let oracles = Oracles::open(oracle, args.adapter.as_deref(), streams)?.simulating(&cost, args);
    let (cullers, repeat) = (chosen, REPEAT);
    Ok((Plan { cullers, index, oracles, cost, cache, repeat, with_bound: false, args }, named))
}
