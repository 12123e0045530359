//! Depth and draw indices of an image, as one ordered word a sample, and questions about it.

/// Pixels of an image; both sides at least 1 and at most [`Viewport::MAX_SIDE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Viewport {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Viewport {
    /// The longest side: the guard band must reach beyond it on both sides.
    pub const MAX_SIDE: u32 = 16_384;
}

/// A sample without a fragment: depth 1 and no draw index. Bits of non-negative floats order like the
/// numbers, so the smaller word is the nearer fragment, then the lower draw index.
const CLEAR: u64 = (1.0_f32.to_bits() as u64) << 32;

/// A z-buffer with draw indices.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    viewport: Viewport,
    samples: Vec<u64>,
}

impl Image {
    /// A cleared image.
    ///
    /// # Panics
    /// For a side of 0 or above [`Viewport::MAX_SIDE`].
    #[must_use]
    pub fn new(viewport: Viewport) -> Self {
        let Viewport { width, height } = viewport;
        let legal = 1..=Viewport::MAX_SIDE;
        assert!(legal.contains(&width) && legal.contains(&height), "{width}×{height} pixels");
        Self { viewport, samples: vec![CLEAR; width as usize * height as usize] }
    }

    /// Its size.
    #[must_use]
    pub fn viewport(&self) -> Viewport {
        self.viewport
    }

    /// Forgets every fragment.
    pub fn clear(&mut self) {
        self.samples.fill(CLEAR);
    }

    /// One word a sample, row by row from the top: depth bits, then draw index plus one.
    #[must_use]
    pub fn samples(&self) -> &[u64] {
        &self.samples
    }

    pub(crate) fn samples_mut(&mut self) -> &mut [u64] {
        &mut self.samples
    }

    /// Depth at a sample (row × width + column).
    #[must_use]
    pub fn depth(&self, sample: usize) -> f32 {
        f32::from_bits((self.samples[sample] >> 32) as u32)
    }

    /// All depths, row by row.
    pub fn depths(&self) -> impl Iterator<Item = f32> + '_ {
        self.samples.iter().map(|&word| f32::from_bits((word >> 32) as u32))
    }

    /// Draw index at a sample; `None` where nothing was drawn.
    #[must_use]
    pub fn draw_index(&self, sample: usize) -> Option<u32> {
        (self.samples[sample] as u32).checked_sub(1)
    }

    /// A hash of size and samples: FNV-1a over whole words with a rotation, the same everywhere.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let size = u64::from(self.viewport.width) << 32 | u64::from(self.viewport.height);
        self.samples.iter().fold(size ^ 0xcbf2_9ce4_8422_2325, |hash, &word| {
            (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29)
        })
    }

    fn rows(&self, min: [u32; 2], max: [u32; 2]) -> impl Iterator<Item = &[u64]> {
        let Viewport { width, height } = self.viewport;
        let (x0, x1) = (min[0].min(width) as usize, max[0].min(width) as usize);
        let rows = min[1].min(height) as usize..max[1].min(height) as usize;
        rows.map(move |y| {
            let row = &self.samples[y * width as usize..(y + 1) * width as usize];
            &row[x0.min(x1)..x1]
        })
    }

    /// How many samples of the half-open rectangle have `depth` ≤ their own. Parts outside the image
    /// count nothing.
    #[must_use]
    pub fn count_rectangle(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> u64 {
        let passes = |word: &&u64| depth <= f32::from_bits((**word >> 32) as u32);
        self.rows(min, max).map(|row| row.iter().filter(passes).count() as u64).sum()
    }

    /// Whether [`Image::count_rectangle`] is above zero.
    #[must_use]
    pub fn any_rectangle(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        let passes = |word: &u64| depth <= f32::from_bits((word >> 32) as u32);
        self.rows(min, max).any(|row| row.iter().any(passes))
    }
}
