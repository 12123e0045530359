//! `calibrate`: measures designed work on an oracle, fits a cost model to it and writes the file that
//! `--cost` reads.

use serde_json::json;

use super::args::{CalibrateArgs, PartsArg, ProxyArg, SceneArgs};
use super::progress::progress_bar;
use super::run::{Named, Oracles, StagedOracles, pick_cache, pick_index};
use super::signals::{catch_interrupt, interrupted};
use super::target::is_stream;
use super::{CliError, EXIT_HELD, Outputs, Streams};
use crate::oracle::{CostModel, FitError, Measurement};
use crate::run::{Bench, World, frames_to_measure, measure, workloads};

/// The small parts have a leaf size that is this much smaller: with the default one a hundred
/// triangles, of which a device's price for a part is some tenths.
const FINER: u32 = 32;

/// What of the arguments would be measured otherwise than it says.
fn refused(args: &CalibrateArgs) -> Option<String> {
    let scene = &args.scene_args;
    if args.oracle == "always" {
        return Some("--oracle always takes no time; name hardware, pyramid or sim".to_owned());
    }
    if scene.memory.is_some() {
        return Some("--memory: a cost model has no price for loading; leave it out".to_owned());
    }
    if scene.proxy != ProxyArg::Rectangle {
        return Some(
            "--proxy: rectangles are measured, whose samples are known; leave it out".to_owned(),
        );
    }
    (scene.cost != "lavapipe").then(|| "--cost: a model is written here, none is read".to_owned())
}

pub(super) fn calibrate(
    args: &CalibrateArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let name = std::slice::from_ref(&args.oracle);
    Oracles::known(name)?;
    if let Some(what) = refused(args) {
        return Err(CliError::Usage(what));
    }
    // The index decides nothing here, but a misspelt one is not passed over.
    pick_index(&args.scene_args.index)?;
    let named = Named::open(&args.scene, &args.scene_args)?;
    let out = outputs.file("--out", &args.out)?;
    let oracles = Oracles::open(name, args.scene_args.adapter.as_deref(), streams)?;
    catch_interrupt();
    let bar = progress_bar();
    let measured = worlds(args, &named, &bar, streams).and_then(|worlds| {
        let (device, measurements) = measure_on(args, &oracles, &worlds, &bar)?;
        Ok((worlds, device, measurements))
    });
    bar.finish_and_clear();
    let (worlds, device, measurements) = measured?;
    let model = fitted(args, &worlds, &device, &measurements);
    let error = model.error_over(&measurements);
    let text = toml::to_string(&model).expect("a model is plain data");
    out.finish(text.as_bytes())?;
    if args.json {
        let line = json!({
            "schema": crate::report::JSON_SCHEMA,
            "device": device,
            "oracle": args.oracle,
            "scene": worlds[0].scene.name,
            "measurements": measurements.len(),
            "rounds": args.rounds,
            "model": model,
            "error_median": error.median,
            "error_p95": error.p95,
            "file": args.out.display().to_string(),
        });
        writeln!(streams.out, "{line}")?;
    } else {
        tell(args, &device, &model, error, &measurements, streams)?;
    }
    Ok(EXIT_HELD)
}

/// The scene in parts of the size that the user chose and in small ones; the second at size 1 at most
/// where the first is at full size, and with triangles whole: so many cuts would multiply them.
fn worlds(
    args: &CalibrateArgs,
    named: &Named,
    bar: &indicatif::ProgressBar,
    streams: &mut Streams<'_>,
) -> Result<[World; 2], CliError> {
    let cache = pick_cache(&args.scene_args)?;
    let coarse = &args.scene_args;
    let leaf = Some((coarse.leaf_triangles(named.scene()) / FINER).max(1));
    let fine = SceneArgs { leaf, parts: PartsArg::Whole, full_size: false, ..coarse.clone() };
    let again = Named::open(&args.scene, &fine)?;
    let mut world =
        |named: &Named, args: &SceneArgs| named.world(args, cache.as_ref(), bar, streams);
    Ok([world(named, coarse)?, world(&again, &fine)?])
}

/// The device's name, or the oracle's where none draws, and what was measured.
fn measure_on(
    args: &CalibrateArgs,
    oracles: &Oracles,
    [coarse, fine]: &[World; 2],
    bar: &indicatif::ProgressBar,
) -> Result<(String, Vec<Measurement>), CliError> {
    let stages = [
        oracles.stage(&coarse.stage(), coarse.scene.seed)?,
        oracles.stage(&fine.stage(), fine.scene.seed)?,
    ];
    let bench = |world, stage: &StagedOracles<'_>, stream, count| {
        let (oracle, works) = (stage.make(&args.oracle)?, workloads(world, stream, count));
        Ok::<Bench<'_>, CliError>(Bench { world, oracle, works })
    };
    let half = args.workloads / 2;
    let mut benches = [
        bench(coarse, &stages[0], "calibration, large parts", args.workloads - half)?,
        bench(fine, &stages[1], "calibration, small parts", half)?,
    ];
    let oracle = &benches[0].oracle;
    let device = oracle.device().unwrap_or_else(|| oracle.name().to_owned());
    bar.set_length(frames_to_measure(&benches, args.rounds));
    bar.set_message(args.scene.clone());
    let mut tick = || {
        bar.inc(1);
        !interrupted()
    };
    let measurements = measure(&mut benches, args.rounds, &mut tick)?;
    Ok((device, measurements))
}

fn fitted(
    args: &CalibrateArgs,
    [world, fine]: &[World; 2],
    device: &str,
    measurements: &[Measurement],
) -> CostModel {
    let stem = args.out.file_stem().filter(|_| !is_stream(&args.out));
    let name = stem.map_or("calibration".into(), |stem| stem.to_string_lossy()).into_owned();
    let model = CostModel::fitted(name, String::new(), measurements);
    let error = model.error_over(measurements);
    let source = format!(
        "fitted to {} workloads, median of {} each, oracle {} on {device}, {} x {}, {} seed {} ({} triangles in {} parts, {} in {}); off by {:.1} % in the median, {:.1} % at the 95th percentile",
        measurements.len(),
        args.rounds,
        args.oracle,
        world.scene.viewport.width,
        world.scene.viewport.height,
        world.scene.name,
        world.scene.seed,
        world.partition.fragment_count(),
        world.partition.part_count(),
        fine.partition.fragment_count(),
        fine.partition.part_count(),
        error.median * 100.0,
        error.p95 * 100.0,
    );
    CostModel { source, ..model }
}

fn tell(
    args: &CalibrateArgs,
    device: &str,
    model: &CostModel,
    error: FitError,
    measurements: &[Measurement],
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    let prices = [
        ("frame", model.frame_ns),
        ("part", model.part_ns),
        ("triangle", model.triangle_ns),
        ("query", model.query_ns),
        ("proxy", model.proxy_ns),
        ("pixel", model.pixel_ns),
        ("trip", model.trip_ns),
    ];
    writeln!(streams.out, "{:<10} {:>14}", "price of a", "ns")?;
    for (what, ns) in prices {
        writeln!(streams.out, "{what:<10} {ns:>14.3}")?;
    }
    let times = || measurements.iter().map(|m| m.ns / 1e6);
    writeln!(
        streams.out,
        "measured: {} workloads of {:.3} to {:.1} ms, median of {} each, oracle {} on {device}",
        measurements.len(),
        times().fold(f64::INFINITY, f64::min),
        times().fold(0.0, f64::max),
        args.rounds,
        args.oracle,
    )?;
    writeln!(
        streams.out,
        "the model is off by {:.1} % in the median, {:.1} % at the 95th percentile, of the measurements it was fitted to",
        error.median * 100.0,
        error.p95 * 100.0,
    )?;
    if is_stream(&args.out) {
        writeln!(streams.out, "written to standard output; use it as a file, by --cost FILE.toml")?;
    } else {
        writeln!(streams.out, "written: {0}; use it by --cost {0}", args.out.display())?;
    }
    Ok(())
}
