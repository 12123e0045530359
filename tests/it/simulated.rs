//! The simulated device: its clock, its legal moods and what no device may do. That every culler holds on
//! it under every legal schedule is `stress`'s to show.

use plainsight::oracle::{
    CostModel, FrameView, Latency, Misbehaviour, Oracle, OracleError, Proxy, QueryId, Schedule,
    Simulated,
};
use plainsight::part::PartitionKnobs;
use plainsight::run::{FrameState, World};
use plainsight::scene::generate::{Knobs, build};

/// A rectangle over everything, at a depth that shows or does not.
fn rectangle(depth: f32) -> Proxy {
    Proxy::Rectangle { min: [0, 0], max: [160, 120], depth }
}

fn device(schedule: Schedule) -> Simulated {
    let scene = build("swarm", &Knobs { seed: Some(1), ..Knobs::default() }).unwrap();
    let world = World::new(scene, PartitionKnobs::default());
    let mut device = Simulated::new(world.stage(), CostModel::lavapipe(), schedule);
    let state = FrameState::first(&world);
    let view = FrameView { frame: 0, clip_from_object: &state.matrices };
    device.begin_frame(&view).unwrap();
    device
}

/// Asks `batches` batches of one hidden question each before it collects any.
fn hidden(device: &mut Simulated, batches: usize) -> Result<Vec<bool>, OracleError> {
    for _ in 0..batches {
        // Behind the far plane nothing shows.
        device.ask(&[rectangle(1.5)]);
        device.submit()?;
    }
    let mut answers = Vec::new();
    for _ in 0..batches {
        device.collect(&mut answers)?;
    }
    let first = answers[0].query.0;
    assert!(answers.iter().zip(first..).all(|(a, number)| a.query == QueryId(number)));
    Ok(answers.iter().map(|answer| answer.visible).collect())
}

#[test]
fn the_clock_runs_by_the_cost_model() {
    let mut device = device(Schedule::default());
    let model = CostModel::lavapipe();
    let start = device.clock().unwrap().now_ns;
    assert_eq!(start, model.frame_ns as u64);
    assert_eq!(hidden(&mut device, 1).unwrap(), [false]);
    let question = model.query_ns + model.proxy_ns + model.pixel_ns * 160.0 * 120.0;
    let clock = device.clock().unwrap();
    assert_eq!(clock.now_ns, start + question as u64 + model.trip_ns as u64);
    assert_eq!(clock.waited_ns, clock.now_ns - start);
    // Batches follow one another on the device, but answers of both are waited for at once.
    hidden(&mut device, 2).unwrap();
    let twice = device.clock().unwrap().now_ns - clock.now_ns;
    assert_eq!(twice, 2 * (question as u64) + model.trip_ns as u64);
}

#[test]
fn later_batches_overtake_and_answers_stay_in_order() {
    for latency in [Latency::Even, Latency::Jittery, Latency::Spiky] {
        let mut device = device(Schedule { seed: 3, latency, ..Schedule::default() });
        assert!(hidden(&mut device, 40).unwrap().iter().all(|visible| !visible));
        assert_eq!(device.clock().unwrap().overtakes > 0, latency != Latency::Even, "{latency:?}");
    }
}

#[test]
fn doubt_errs_towards_visible_alone() {
    let mut device = device(Schedule { doubt: 0.25, ..Schedule::default() });
    let visible = hidden(&mut device, 400).unwrap().iter().filter(|visible| **visible).count();
    assert!((60..140).contains(&visible), "{visible} of 400");
    assert_eq!(device.clock().unwrap().false_visible as usize, visible);
    device.ask(&[rectangle(0.0)]);
    device.submit().unwrap();
    let mut answers = Vec::new();
    device.collect(&mut answers).unwrap();
    assert!(answers[0].visible, "never towards hidden");
}

#[test]
fn what_no_device_may_do_ends_in_an_error_or_in_visible() {
    let with =
        |misbehaviour| device(Schedule { misbehaviour: Some(misbehaviour), ..Schedule::default() });
    let mut lost = with(Misbehaviour::Lost(3));
    assert!(hidden(&mut lost, 3).is_ok());
    let error = hidden(&mut lost, 1).unwrap_err().to_string();
    assert!(error.contains("went away"), "{error}");
    assert!(lost.read_back().is_err() && lost.collect(&mut Vec::new()).is_err(), "for good");
    let mut hangs = with(Misbehaviour::Hangs(2));
    assert!(hidden(&mut hangs, 2).is_ok());
    let error = hidden(&mut hangs, 1).unwrap_err().to_string();
    assert!(error.contains("no answer for 2 s"), "{error}");
    assert!(hangs.submit().is_err(), "for good");
    let mut unwritten = with(Misbehaviour::Unwritten(1));
    assert_eq!(hidden(&mut unwritten, 3).unwrap(), [false, true, false]);
    assert_eq!(unwritten.clock().unwrap().unwritten, 1);
}
