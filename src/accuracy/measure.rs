//! A setting run over the frames of a scene.

use plainsight_reference::Image;
use serde::Serialize;

use super::Worlds;
use super::knob::{Setting, Tuning};
use crate::check::Gate;
use crate::cull::{CullerSetup, PerView};
use crate::oracle::{Approximate, CostModel, Oracle, Schedule, Simulated};
use crate::part::PartitionKnobs;
use crate::run::{
    FrameRecord, Lane, LaneInfo, Observer, Repeat, Repetition, RunError, Stop, Trace, World,
    render, run,
};
use crate::scene::Scene;

/// What a setting lost and what it took, over all frames.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Point {
    /// The scene.
    pub scene: String,
    /// The knob, or the pair; `default` for none turned.
    pub knob: String,
    /// Its value.
    pub value: String,
    /// Frames times views.
    pub frames: u32,
    /// Samples of all of them.
    pub samples: u64,
    /// Parts that show and were not drawn, once a frame.
    pub missed_parts: u64,
    /// Samples that show them.
    pub missed_pixels: u64,
    /// Samples of the picture that are not as they should be.
    pub wrong_pixels: u64,
    /// The largest error of depth at a sample, from 0 to 1.
    pub depth_error: f64,
    /// For how many frames a part that shows was missing at most.
    pub late: u32,
    /// Parts drawn that do not show.
    pub excess_parts: u64,
    /// Parts that show.
    pub visible_parts: u64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Questions asked.
    pub queries: u64,
    /// Pixels of the rectangles and hulls asked about.
    pub query_pixels: u64,
    /// Times that answers were waited for.
    pub trips: u64,
    /// Virtual nanoseconds by the simulated device's clock.
    pub virtual_ns: u64,
    /// Nanoseconds of these that were spent waiting.
    pub waited_ns: u64,
    /// Samples of the first frame that show another triangle than the uncut scene does.
    pub cut_pixels: u64,
    /// Wall nanoseconds: the least, the median, the most of the rounds. Never compared.
    pub wall_ns: [u64; 3],
    /// Whether nothing may be lost.
    pub sound: bool,
    /// The gate's word; see [`Gate::word`].
    pub verdict: String,
    /// What the gate said, a line each: of what was lost where nothing may be, and of what must not happen in
    /// any setting.
    pub failures: Vec<String>,
}

/// Looks at what a lane loses.
#[derive(Default)]
struct Meter {
    gate: Gate,
    image: Option<Image>,
    /// By view and part, for how many frames it has been missing.
    missing: Vec<Vec<u32>>,
    missed_parts: u64,
    missed_pixels: u64,
    wrong_pixels: u64,
    depth_error: f64,
    late: u32,
    sound: bool,
}

impl Observer for Meter {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        if self.sound {
            self.gate.frame(record);
        }
        let truth = record.truth;
        let view = record.state.moment.view as usize;
        if self.missing.len() <= view {
            self.missing.resize(view + 1, vec![0; truth.visible_pixels.len()]);
        }
        let mut drawn = vec![false; truth.visible_pixels.len()];
        record.drawn.iter().for_each(|part| drawn[part.0 as usize] = true);
        let mut lost = false;
        for ((&pixels, drawn), frames) in
            truth.visible_pixels.iter().zip(drawn).zip(&mut self.missing[view])
        {
            if pixels == 0 || drawn {
                *frames = 0;
                continue;
            }
            lost = true;
            *frames += 1;
            self.late = self.late.max(*frames);
            self.missed_parts += 1;
            self.missed_pixels += u64::from(pixels);
        }
        // Where all that shows was drawn, the picture is the truth: it is a minimum over fragments.
        if !lost {
            return;
        }
        let image = self.image.get_or_insert_with(|| record.world.image());
        render(record.world, record.state, record.drawn, image);
        let differs = Difference::of(&truth.image, image);
        self.wrong_pixels += differs.samples;
        self.depth_error = self.depth_error.max(differs.depth_error);
    }

    fn repeated(&mut self, repetition: &Repetition<'_>) {
        self.gate.repeated(repetition);
    }

    fn stopped(&mut self, stop: &Stop) {
        self.gate.stopped(stop);
    }
}

/// By what an image is not the truth.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Difference {
    /// Samples that differ at all.
    pub(super) samples: u64,
    /// Those of them that show another triangle.
    pub(super) triangles: u64,
    /// The largest difference of depth.
    pub(super) depth_error: f64,
}

impl Difference {
    pub(super) fn of(truth: &Image, other: &Image) -> Self {
        let mut found = Self::default();
        for (sample, (a, b)) in truth.depths().into_iter().zip(other.depths()).enumerate() {
            if truth.word(sample) != other.word(sample) {
                found.samples += 1;
                let shown = [truth, other].map(|image| image.draw_index(sample));
                found.triangles += u64::from(shown[0] != shown[1]);
                found.depth_error = found.depth_error.max((f64::from(a) - f64::from(b)).abs());
            }
        }
        found
    }
}

fn knobs(tuning: &Tuning, scene: &Scene) -> PartitionKnobs {
    let leaf = (f64::from(scene.leaf_triangles) * tuning.leaf).round().max(1.0) as u32;
    PartitionKnobs { leaf_triangles: leaf, crossing: tuning.crossing }
}

/// Runs every setting over the frames of the scene, `rounds` times, all on the simulated device of `cost`.
/// Settings that cut the meshes alike run side by side, on the same truth. `tick` is called after each
/// frame of each setting and stops by returning false.
///
/// # Errors
/// [`RunError::Interrupted`] where `tick` says so.
pub fn measure(
    worlds: &Worlds<'_>,
    cost: &CostModel,
    rounds: u32,
    settings: &[Setting],
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<Point>, RunError> {
    let scene = worlds.scene();
    let mut points: Vec<Option<Point>> = vec![None; settings.len()];
    while let Some(first) = points.iter().position(Option::is_none) {
        let knobs_of = |place: usize| knobs(&settings[place].tuning, scene);
        let partition = knobs_of(first);
        let here: Vec<usize> = (first..settings.len())
            .filter(|&place| points[place].is_none() && knobs_of(place) == partition)
            .collect();
        let world = worlds.world(partition);
        let cut_pixels = worlds.cut_pixels(&world);
        let entries = world.entries();
        let mut meters: Vec<Meter> = here
            .iter()
            .map(|&place| Meter { sound: settings[place].tuning.is_sound(), ..Meter::default() })
            .collect();
        let mut lanes: Vec<Lane<'_>> = Vec::new();
        for (&place, meter) in here.iter().zip(&mut meters) {
            let (tuning, world) = (&settings[place].tuning, &world);
            let entries = &entries;
            let culler = move || {
                PerView::over(world.views(), || {
                    tuning.culler(CullerSetup {
                        partition: world.partition.clone(),
                        index: (tuning.index().build)(entries),
                        proxy: tuning.proxy,
                        cost: cost.clone(),
                    })
                })
            };
            let oracle = device(world, tuning, cost);
            let info = LaneInfo::of(settings[place].knob, oracle.as_ref(), String::new());
            let culler = Box::new(culler);
            lanes.push(Lane {
                info,
                culler,
                oracle,
                observer: meter,
                with_bound: false,
                audited: false,
            });
        }
        let repeat = Repeat { frames: u32::MAX, rounds: rounds.saturating_sub(1) };
        let traces = run(&world, scene.frames, repeat, &mut lanes, tick)?;
        drop(lanes);
        for ((place, meter), trace) in here.into_iter().zip(meters).zip(&traces) {
            points[place] = Some(point(&world, &settings[place], meter, trace, cut_pixels));
        }
    }
    Ok(points.into_iter().flatten().collect())
}

fn device(world: &World, tuning: &Tuning, cost: &CostModel) -> Box<dyn Oracle> {
    let (stage, seed) = (world.stage(), world.scene.seed);
    let schedule = Schedule { seed, latency: tuning.latency, ..Schedule::default() };
    Box::new(if tuning.is_sound() {
        Simulated::new(stage, cost.clone(), schedule)
    } else {
        let buffer = Box::new(Approximate::new(stage.clone(), tuning.buffer));
        // A smaller buffer has fewer pixels to ask.
        let share = f64::from(tuning.buffer.divisor).powi(2);
        let cost = CostModel { pixel_ns: cost.pixel_ns / share, ..cost.clone() };
        Simulated::over(buffer, stage, cost, schedule)
    })
}

fn point(world: &World, setting: &Setting, meter: Meter, trace: &Trace, cut_pixels: u64) -> Point {
    let frames = trace.frames.len() as u32;
    let image = world.image();
    let clock = trace.frames.iter().filter_map(|frame| frame.clock).next_back().unwrap_or_default();
    let visible = trace.sum(|frame| u64::from(frame.visible_parts));
    let drawn = trace.sum(|frame| u64::from(frame.drawn_parts));
    let [least, most] = [0, 1].map(|end| trace.sum(|frame| frame.wall_range_ns[end]));
    Point {
        scene: world.scene.name.clone(),
        knob: setting.knob.to_owned(),
        value: setting.value.to_owned(),
        frames,
        samples: u64::from(frames) * image.sample_count() as u64,
        missed_parts: meter.missed_parts,
        missed_pixels: meter.missed_pixels,
        wrong_pixels: meter.wrong_pixels,
        depth_error: meter.depth_error,
        late: meter.late,
        excess_parts: drawn + meter.missed_parts - visible,
        visible_parts: visible,
        triangles: trace.sum(|frame| frame.counts.triangles),
        queries: trace.sum(|frame| frame.counts.queries),
        query_pixels: trace.sum(|frame| frame.amounts().pixels),
        trips: trace.sum(|frame| frame.amounts().trips),
        virtual_ns: clock.now_ns,
        waited_ns: clock.waited_ns,
        cut_pixels,
        wall_ns: [least, trace.sum(|frame| frame.wall_ns), most],
        sound: meter.sound,
        verdict: meter.gate.word(),
        // Of a setting that may lose something the gate was shown no frame: that it repeats and comes to its
        // end is asked of every one.
        failures: meter.gate.failures(),
    }
}
