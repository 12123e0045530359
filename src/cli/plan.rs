//! What verbs that run lanes share: scenes as the user named them, the cullers, index, oracles and cost model
//! that flags pick, and every culler on every oracle before gates of their own.

use std::cell::RefCell;

use indicatif::ProgressBar;

use super::args::{SceneArgs, quoted};
use super::oracles::Oracles;
use super::progress::counting_triangles;
use super::repeat::RepeatArgs;
use super::signals::{interrupted, stoppable};
use super::{CliError, Streams};
use crate::check::{Gate, Ruling};
use crate::cull::{Culler, CullerKind, CullerSetup, PerView};
use crate::index::{Entry, INDEXES, IndexKind};
use crate::oracle::{CostModel, Oracle};
use crate::part::{Cache, PartId};
use crate::run::{
    FrameRecord, Lane, LaneInfo, Moment, Observer, Repeat, Repetition, RunError, Stop, Trace,
    World, caught, run as run_lanes,
};
use crate::scene::{Scene, generate};

/// How many of the cullers are taken where none is named.
const DEFAULT_CULLERS: usize = 3;

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

    /// Its name or file, as the user wrote it.
    pub(super) fn name(&self) -> &str {
        &self.name
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
        let make = |progress: &(dyn Fn(u64, u64) + Sync)| {
            World::make(self.scene.clone(), args.partition(&self.scene), cache, progress)
        };
        let made = caught(|| stoppable(|| counting_triangles(bar, message, make)));
        let world = made.map_err(|said| CliError::Panicked {
            place: format!("{}, while its parts were made", self.name),
            said,
        })??;
        let world = world.rendered(args.render()).with_canary(args.canary);
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
    /// Of each lane the line that says why, up to the part.
    pub(super) whys: Vec<String>,
}

impl Finished {
    /// Each lane's gate, trace and line that says why.
    pub(super) fn lanes(&self) -> impl Iterator<Item = (&Gate, &Trace, &str)> {
        let gates = self.gates.iter().zip(&self.traces).zip(&self.whys);
        gates.map(|((gate, trace), why)| (gate, trace, why.as_str()))
    }

    /// What the worst lane came to.
    pub(super) fn ruling(&self) -> Ruling {
        self.gates.iter().map(Gate::ruling).max().unwrap_or_default()
    }
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

    fn repeated(&mut self, repetition: &Repetition<'_>) {
        self.gate.repeated(repetition);
    }

    fn stopped(&mut self, stop: &Stop) {
        self.gate.stopped(stop);
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
    pub(super) repeat: RepeatArgs,
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
        let repeat = self.repeat.repeat();
        let shots = (u64::from(frames) + repeat.total(frames)) * u64::from(world.views());
        bar.inc_length(shots * lanes.len() as u64);
        let (mut running, mut whys): (Vec<Lane<'_>>, _) = (Vec::new(), Vec::new());
        for (&(oracle, kind), observer) in lanes.iter().zip(&mut observers) {
            let oracle = staged.make(oracle)?;
            let flags = self.lane_flags(name, &world, kind.name, oracle.name());
            let replay = format!("plainsight replay {flags}{}", self.repeat.replay_flags());
            whys.push(format!("plainsight why {flags}"));
            let info = LaneInfo::of(kind.name, oracle.as_ref(), replay);
            let culler = self.factory(kind, &world, &entries);
            let first = running.iter().all(|lane| lane.info.oracle != info.oracle);
            let with_bound = self.with_bound && first;
            running.push(Lane { info, culler, oracle, observer, with_bound, audited: false });
        }
        bar.set_message(name.clone());
        let mut tick = || {
            bar.inc(1);
            !interrupted()
        };
        let traces = run_lanes(&world, frames, repeat, &mut running, &mut tick)?;
        drop(running);
        drop(observers);
        Ok(Finished { world, traces, gates, whys })
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
            !interrupted()
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

    /// What picks a lane, for any verb that runs one.
    fn lane_flags(&self, name: &str, world: &World, culler: &str, oracle: &str) -> String {
        let (name, flags) = (quoted(name), self.args.replay_flags(&world.scene));
        format!("--scene {name} --culler {culler} --oracle {oracle}{flags}")
    }
}

/// The plan for one culler and one oracle on one scene.
pub(super) fn one_lane<'a>(
    (scene, culler, oracle): (&str, &String, &String),
    (args, repeat): (&'a SceneArgs, RepeatArgs),
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
    let cullers = chosen;
    Ok((Plan { cullers, index, oracles, cost, cache, repeat, with_bound: false, args }, named))
}
