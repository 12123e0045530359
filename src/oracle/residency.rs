//! Out of core: which meshes are in a device's memory. A frame begins with no mesh resident but those
//! drawn in the last frame and those expected next, within a budget; what a draw finds missing is loaded
//! late, what the predicted path leads to is loaded ahead. The conclusion of Kovalčík & Sochor 2006 asks
//! for it, after Correa, Klosowski & Silva 2003 (iWalk: prefetching by predicted visibility).
//!
//! This is bookkeeping alone, a pure function of the frames' matrices and the stream of draws, so that
//! the simulated and the real device load the same meshes at the same points; `wgpu` carries the steps
//! out with real buffers. It must not know cullers, and no picture depends on it. What the checks need
//! of a device (its redraws) is not counted: that is the bench's memory, not the culler's.
//!
//! Prediction: each object's matrix goes on as it went over the last two frames, linearly; expected is
//! the mesh of an object whose box it brings into the frustum, hidden or not. Loading ahead takes only
//! memory that is free once the frame has let go of the rest: it throws out nothing that was drawn or is
//! expected, so that it cannot churn. A late load throws out whatever was used least recently, where
//! that must be in the middle of a frame.
//!
//! It loses where one mesh is most of the scene (a mesh is loaded whole), and where a frame draws more
//! than the budget holds: the least recently used is then what the next frame draws first.

use super::FrameView;
use crate::math::Aabb;
use crate::part::{ObjectId, PartedMesh, Partition};

/// How many frames ahead objects are looked for: near ones first, doubling.
const AHEAD: [u32; 4] = [1, 2, 4, 8];

/// How much geometry may be in a device's memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryKnobs {
    /// Bytes of meshes resident at any time, at least [`least_budget`].
    pub budget_bytes: u64,
    /// Bytes loaded ahead a frame; 0 loads nothing ahead. A mesh larger than what is left of them is
    /// loaded all the same, and the frames after it load the less: over any frames no more than so
    /// many bytes each, and one mesh.
    pub prefetch_bytes: u64,
}

impl MemoryKnobs {
    /// Loaded ahead in a frame where nothing else is said: what a SATA disk reads in a sixtieth of a
    /// second (500 MB/s ÷ 60), in whole MiB.
    pub const PREFETCH_BYTES: u64 = 8 << 20;
}

/// What memory traffic a frame caused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Most bytes resident at any time in the frame.
    pub most_bytes: u64,
    /// Meshes that a draw had to wait for.
    pub late_loads: u64,
    /// Their bytes.
    pub late_bytes: u64,
    /// Meshes loaded ahead before the frame.
    pub prefetches: u64,
    /// Their bytes.
    pub prefetched_bytes: u64,
    /// Meshes that were drawn for the first time since they were loaded ahead.
    pub prefetches_used: u64,
    /// Meshes thrown out.
    pub evictions: u64,
}

impl Memory {
    /// The figures in a fixed order, for hashes.
    #[must_use]
    pub fn words(&self) -> [u64; 7] {
        [
            self.most_bytes,
            self.late_loads,
            self.late_bytes,
            self.prefetches,
            self.prefetched_bytes,
            self.prefetches_used,
            self.evictions,
        ]
    }
}

/// Bytes that drawing a mesh takes on a device: 16 a vertex (position and part), 12 a triangle. An
/// empty mesh has buffers of 16 bytes each.
#[must_use]
pub fn mesh_bytes(mesh: &PartedMesh) -> u64 {
    let run = |items: usize, bytes: u64| if items == 0 { 16 } else { items as u64 * bytes };
    run(mesh.positions.len(), 16) + run(mesh.triangles.len(), 12)
}

/// The smallest budget with which every mesh can be drawn: the largest mesh's bytes, 0 without meshes.
#[must_use]
pub fn least_budget(partition: &Partition) -> u64 {
    partition.meshes().iter().map(|mesh| mesh_bytes(mesh)).max().unwrap_or(0)
}

/// Something to carry out, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Throw a mesh out.
    Evict(u32),
    /// Load a mesh.
    Load(u32),
}

/// What is known of a mesh.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    bytes: u64,
    resident: bool,
    /// Loaded ahead and not yet drawn.
    ahead: bool,
    /// When it was used last; later is larger.
    used: u64,
    /// One more than the last frame that drew it; 0 for none.
    drawn_after: u32,
}

/// The books of one lane.
#[derive(Clone, Debug)]
pub struct Residency {
    knobs: MemoryKnobs,
    meshes: Vec<Held>,
    /// Mesh and box of each object.
    objects: Vec<(u32, Aabb)>,
    /// Matrices of the last frame and of the one before it.
    last: Vec<[f32; 16]>,
    before: Vec<[f32; 16]>,
    frame: u32,
    clock: u64,
    bytes: u64,
    /// Bytes loaded ahead beyond the share of the frames so far.
    debt: u64,
    counts: Memory,
}

impl Residency {
    /// Nothing is resident.
    ///
    /// # Panics
    /// Where the budget is less than [`least_budget`]: some mesh could never be drawn.
    #[must_use]
    pub fn new(partition: &Partition, knobs: MemoryKnobs) -> Self {
        assert!(knobs.budget_bytes >= least_budget(partition), "every mesh must fit the budget");
        let held = |bytes| Held { bytes, ..Held::default() };
        let object = |object: u32| {
            let object = ObjectId(object);
            (partition.mesh_index(object), partition.mesh(object).bounds)
        };
        Self {
            knobs,
            meshes: partition.meshes().iter().map(|mesh| held(mesh_bytes(mesh))).collect(),
            objects: (0..partition.object_count()).map(object).collect(),
            last: Vec::new(),
            before: Vec::new(),
            frame: 0,
            clock: 0,
            bytes: 0,
            debt: 0,
            counts: Memory::default(),
        }
    }

    /// Begins a frame. Frame 0 begins with nothing resident, uncounted; before any other, what was not
    /// drawn in the last frame and is not expected is thrown out, and what is expected is loaded ahead.
    /// Appends what is to be carried out.
    pub fn begin_frame(&mut self, view: &FrameView<'_>, steps: &mut Vec<Step>) {
        self.counts = Memory { most_bytes: self.bytes, ..Memory::default() };
        if view.frame == 0 {
            self.throw_out(steps, |_, _| true);
            self.counts = Memory::default();
            self.last.clear();
            self.debt = 0;
        } else {
            let expected = self.expected();
            let mut is_expected = vec![false; self.meshes.len()];
            expected.iter().for_each(|&mesh| is_expected[mesh as usize] = true);
            let last = self.frame + 1;
            self.throw_out(steps, |mesh, held| !is_expected[mesh] && held.drawn_after != last);
            self.load_ahead(&expected, steps);
        }
        self.before = std::mem::replace(&mut self.last, view.clip_from_object.to_vec());
        self.frame = view.frame;
    }

    /// A draw needs `mesh` now. Appends what is to be carried out before it; returns whether it is
    /// late.
    ///
    /// # Panics
    /// For a mesh that does not exist.
    pub fn need(&mut self, mesh: u32, steps: &mut Vec<Step>) -> bool {
        let late = !self.meshes[mesh as usize].resident;
        if late {
            let bytes = self.meshes[mesh as usize].bytes;
            while self.bytes + bytes > self.knobs.budget_bytes {
                let victim = self.least_recent().expect("every mesh fits the budget");
                self.evict(victim, steps);
            }
            self.load(mesh, steps);
            self.counts.late_loads += 1;
            self.counts.late_bytes += bytes;
        }
        self.clock += 1;
        let held = &mut self.meshes[mesh as usize];
        self.counts.prefetches_used += u64::from(std::mem::take(&mut held.ahead));
        held.used = self.clock;
        held.drawn_after = self.frame + 1;
        late
    }

    /// The frame's traffic so far.
    #[must_use]
    pub fn counts(&self) -> Memory {
        self.counts
    }

    /// Bytes resident now; never more than the budget.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The resident mesh that was used least recently.
    fn least_recent(&self) -> Option<u32> {
        let resident = self.meshes.iter().enumerate().filter(|(_, held)| held.resident);
        resident.min_by_key(|(_, held)| held.used).map(|(mesh, _)| mesh as u32)
    }

    /// Throws out every resident mesh of which `which` says so.
    fn throw_out(&mut self, steps: &mut Vec<Step>, which: impl Fn(usize, &Held) -> bool) {
        for mesh in 0..self.meshes.len() {
            let held = &self.meshes[mesh];
            if held.resident && which(mesh, held) {
                self.evict(mesh as u32, steps);
            }
        }
    }

    fn evict(&mut self, mesh: u32, steps: &mut Vec<Step>) {
        let held = &mut self.meshes[mesh as usize];
        debug_assert!(held.resident);
        *held = Held { bytes: held.bytes, ..Held::default() };
        self.bytes -= held.bytes;
        self.counts.evictions += 1;
        steps.push(Step::Evict(mesh));
    }

    fn load(&mut self, mesh: u32, steps: &mut Vec<Step>) {
        let held = &mut self.meshes[mesh as usize];
        debug_assert!(!held.resident);
        held.resident = true;
        self.bytes += held.bytes;
        assert!(self.bytes <= self.knobs.budget_bytes, "the budget is held");
        self.counts.most_bytes = self.counts.most_bytes.max(self.bytes);
        steps.push(Step::Load(mesh));
    }

    /// Loads what is `expected`, in that order, as far as the frame's share and free memory go.
    fn load_ahead(&mut self, expected: &[u32], steps: &mut Vec<Step>) {
        let mut share = self.knobs.prefetch_bytes.saturating_sub(self.debt);
        self.debt = self.debt.saturating_sub(self.knobs.prefetch_bytes);
        for &mesh in expected {
            let Held { resident, bytes, .. } = self.meshes[mesh as usize];
            if share == 0 {
                break;
            }
            if resident || self.bytes + bytes > self.knobs.budget_bytes {
                continue;
            }
            self.debt += bytes.saturating_sub(share);
            share = share.saturating_sub(bytes);
            self.load(mesh, steps);
            self.clock += 1;
            let held = &mut self.meshes[mesh as usize];
            (held.ahead, held.used) = (true, self.clock);
            self.counts.prefetches += 1;
            self.counts.prefetched_bytes += bytes;
        }
    }

    /// Meshes of objects that the predicted paths bring into the frustum, each once, the soonest first
    /// and among these the nearest.
    fn expected(&self) -> Vec<u32> {
        let mut found: Vec<(u32, f32, u32)> = Vec::new();
        for (number, &(mesh, bounds)) in self.objects.iter().enumerate() {
            if bounds.is_empty() {
                continue;
            }
            let Some(last) = self.last.get(number) else { continue };
            let before = self.before.get(number).unwrap_or(last);
            let after = |frames: u32| -> [f32; 16] {
                std::array::from_fn(|i| last[i] + (last[i] - before[i]) * frames as f32)
            };
            let first = AHEAD
                .into_iter()
                .find_map(|frames| Some((frames, nearest_inside(&after(frames), &bounds)?, mesh)));
            found.extend(first);
        }
        found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut taken = vec![false; self.meshes.len()];
        let fresh = |&mesh: &u32| !std::mem::replace(&mut taken[mesh as usize], true);
        found.into_iter().map(|(_, _, mesh)| mesh).filter(fresh).collect()
    }
}

/// A device's memory as the steps leave it: what a real device would hold that carried them out. It notes
/// the first step that no device could take, and the first draw of a mesh that it does not hold.
#[derive(Clone, Debug)]
pub(super) struct Replayed {
    budget_bytes: u64,
    /// By mesh: its bytes, and whether it is held.
    meshes: Vec<(u64, bool)>,
    bytes: u64,
    broken: Option<String>,
}

impl Replayed {
    pub(super) fn new(partition: &Partition, knobs: MemoryKnobs) -> Self {
        let meshes = partition.meshes().iter().map(|mesh| (mesh_bytes(mesh), false)).collect();
        Self { budget_bytes: knobs.budget_bytes, meshes, bytes: 0, broken: None }
    }

    /// Carries the steps out.
    pub(super) fn follow(&mut self, steps: &[Step]) {
        for &step in steps {
            let (mesh, loads) = match step {
                Step::Evict(mesh) => (mesh, false),
                Step::Load(mesh) => (mesh, true),
            };
            let (bytes, held) = &mut self.meshes[mesh as usize];
            let twice = std::mem::replace(held, loads) == loads;
            self.bytes = match (twice, loads) {
                (true, _) => self.bytes,
                (false, true) => self.bytes + *bytes,
                (false, false) => self.bytes - *bytes,
            };
            if twice {
                self.note(|| format!("mesh {mesh} is loaded or thrown out twice"));
            }
            if self.bytes > self.budget_bytes {
                self.note(|| format!("mesh {mesh} is loaded beyond the budget"));
            }
        }
    }

    /// Draws a mesh.
    pub(super) fn draws(&mut self, mesh: u32) {
        if !self.meshes[mesh as usize].1 {
            self.note(|| format!("mesh {mesh} is drawn and not in memory"));
        }
    }

    fn note(&mut self, what: impl FnOnce() -> String) {
        self.broken.get_or_insert_with(what);
    }

    /// Whether all steps could be carried out, and the books say what is held.
    pub(super) fn check(&self, books: &Residency) -> Result<(), String> {
        if let Some(broken) = &self.broken {
            return Err(broken.clone());
        }
        let most = books.counts().most_bytes;
        if books.bytes() != self.bytes || most > self.budget_bytes || most < self.bytes {
            let (said, most) = (books.bytes(), most);
            let held = self.bytes;
            return Err(format!("{held} bytes are held, {said} and at most {most} booked"));
        }
        let other = |(held, (_, there)): (&Held, &(u64, bool))| held.resident != *there;
        match books.meshes.iter().zip(&self.meshes).position(other) {
            Some(mesh) => Err(format!("the books are wrong about mesh {mesh}")),
            None => Ok(()),
        }
    }
}

/// The least w of a box's corners, where the box may be inside the frustum. A guess: f32 without
/// margins, since nothing but the time of a load depends on it.
fn nearest_inside(clip: &[f32; 16], bounds: &Aabb) -> Option<f32> {
    let mut outside = [true; 6];
    let mut nearest = f32::INFINITY;
    for corner in 0..8_u32 {
        let pick = |axis: usize| {
            let from = if corner >> axis & 1 == 0 { bounds.min } else { bounds.max };
            from[axis] as f32
        };
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| {
            clip[row] * pick(0) + clip[row + 4] * pick(1) + clip[row + 8] * pick(2) + clip[row + 12]
        });
        let beyond = [x < -w, x > w, y < -w, y > w, z < 0.0, z > w];
        outside.iter_mut().zip(beyond).for_each(|(all, this)| *all &= this);
        nearest = nearest.min(w);
    }
    (!outside.contains(&true)).then_some(nearest)
}
