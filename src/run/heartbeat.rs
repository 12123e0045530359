//! Heartbeats: which lanes are within a frame of theirs, and since when, so that a watchdog beside the run
//! can name a culler that does not come back. A lane beats when its frame begins and is forgotten when it
//! ends. Nothing that is compared sees it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::{LaneInfo, Moment, World};

/// A lane within a frame.
#[derive(Clone, Debug)]
pub struct Beat {
    /// The scene and its seed.
    pub scene: Arc<(String, u64)>,
    /// The lane.
    pub lane: Arc<LaneInfo>,
    /// The frame; `None` while the culler is made.
    pub moment: Option<Moment>,
    since: Instant,
}

impl Beat {
    /// How long the frame has taken so far.
    #[must_use]
    pub fn age(&self) -> Duration {
        self.since.elapsed()
    }
}

/// All lanes of the process that are within a frame, by the number of their beat.
static BEATS: Mutex<BTreeMap<u64, Beat>> = Mutex::new(BTreeMap::new());
/// The number of the next beat.
static NEXT: AtomicU64 = AtomicU64::new(0);

/// The map is whole at every moment: a thread that panicked left it so.
fn beats() -> MutexGuard<'static, BTreeMap<u64, Beat>> {
    BEATS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The lane that has been within one frame for the longest, over all threads of this process; `None` where
/// none is.
#[must_use]
pub fn oldest_beat() -> Option<Beat> {
    beats().values().min_by_key(|beat| beat.since).cloned()
}

/// The lanes of one run.
pub(super) struct Pulse {
    scene: Arc<(String, u64)>,
    lanes: Vec<Arc<LaneInfo>>,
}

/// Forgets its beat when dropped.
pub(super) struct Beating(u64);

impl Drop for Beating {
    fn drop(&mut self) {
        beats().remove(&self.0);
    }
}

impl Pulse {
    pub(super) fn new<'a>(world: &World, lanes: impl Iterator<Item = &'a LaneInfo>) -> Self {
        let scene = Arc::new((world.scene.name.clone(), world.scene.seed));
        Self { scene, lanes: lanes.map(|lane| Arc::new(lane.clone())).collect() }
    }

    /// Marks the lane of that number as within a frame until the result is dropped.
    pub(super) fn begin(&self, lane: usize, moment: Option<Moment>) -> Beating {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let (scene, lane) = (self.scene.clone(), self.lanes[lane].clone());
        beats().insert(number, Beat { scene, lane, moment, since: Instant::now() });
        Beating(number)
    }
}
