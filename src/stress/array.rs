//! An orthogonal array of strength two over seeds: of any two axes every pair of levels comes up exactly once
//! in every block of [`BLOCK`] seeds (Bose 1938, *On the application of the properties of Galois fields to
//! the construction of hyper-Graeco-Latin squares*; for tests Mandl 1985, *Orthogonal Latin squares: an
//! application of experiment design to compiler testing*). Chance alone leaves some pair of members out for
//! thousands of seeds. A seed is a world by itself all the same: its levels are a function of it alone.

use crate::scene::Stream;

/// Levels of each axis, a prime: there are as many axes.
const LEVELS: u64 = 23;
/// Seeds in which every pair of levels comes up once.
pub(super) const BLOCK: u64 = LEVELS * LEVELS;
/// Seeds that follow one another differ on most axes: the rows of a block are gone through in steps of this,
/// which has no factor in common with [`BLOCK`] and is about its golden section.
const STRIDE: u64 = 327;

/// A concern that a world picks something for, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Axis(pub(super) u8);

/// The level of an axis for a seed, below `members`, at least 1: each as often as another over `members`
/// blocks, and about as often within one.
pub(super) fn level(seed: u64, Axis(axis): Axis, members: usize) -> usize {
    let (block, row) = (seed / BLOCK, seed % BLOCK * STRIDE % BLOCK);
    let (high, low) = (row / LEVELS, row % LEVELS);
    let level = (high + u64::from(axis) * low) % LEVELS;
    // Another order of the levels for each block and axis, and another that comes up once more.
    let mut order = Stream::new(block, &format!("axis {axis}"));
    let (factor, first) = (u64::from(1 + order.below(22)), u64::from(order.below(23)));
    let level = (level * factor + first) % LEVELS;
    let members = members.max(1) as u64;
    // Blocks may be as many as there are seeds: the product wraps where sums of it do.
    ((level + block % members * (LEVELS % members)) % members) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_levels_comes_up_once_a_block() {
        for (a, b) in [(0, 1), (3, 17), (22, 21), (5, 0)] {
            for block in [0, 7] {
                let mut times = vec![0; BLOCK as usize];
                for seed in block * BLOCK..(block + 1) * BLOCK {
                    let [a, b] = [a, b].map(|axis| level(seed, Axis(axis), LEVELS as usize));
                    times[a * LEVELS as usize + b] += 1;
                }
                assert!(times.iter().all(|&times| times == 1), "axes {a} and {b}");
            }
        }
    }

    /// Lists that do not divide the levels are even over as many blocks as they have members.
    #[test]
    fn members_come_up_alike() {
        for members in [1, 2, 7, 10, 20, 29] {
            let mut times = vec![0_u64; members];
            let seeds = BLOCK * members as u64;
            (0..seeds).for_each(|seed| times[level(seed, Axis(4), members)] += 1);
            assert!(times.iter().all(|&times| times == BLOCK), "{members}: {times:?}");
        }
        assert!(level(u64::MAX, Axis(3), 5) < 5, "the last seed has levels too");
    }
}
