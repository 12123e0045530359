//! Named seed streams: one ChaCha stream per concern, so that switching one effect off, or drawing
//! one number more for placement, does not move another concern's numbers.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A stream of numbers that depends on (seed, name) alone.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of the concern `name` under `seed`. The name is folded into ChaCha's 64-bit stream
    /// number by FNV-1a, so two names share a key but never a sequence.
    #[must_use]
    pub fn new(seed: u64, name: &str) -> Self {
        let number = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number);
        Self(rng)
    }

    /// Uniform in [0, 1), a multiple of 2⁻⁵³.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform in [low, high); `low` where the two are equal.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// One of several, all as likely.
    ///
    /// # Panics
    /// For none to choose from.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u32) as usize]
    }

    /// Uniform in 0..count by Lemire's multiply-shift; the bias is below count / 2⁶⁴.
    ///
    /// # Panics
    /// For a count of zero.
    pub fn below(&mut self, count: u32) -> u32 {
        assert!(count > 0, "a choice needs something to choose from");
        ((u128::from(self.0.next_u64()) * u128::from(count)) >> 64) as u32
    }
}
