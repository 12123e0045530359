//! Which way depth runs, and the integers by which depths are compared and stored.

/// Which way depth runs from near to far. The nearer of two depths is the lower one in either order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthOrder {
    /// From 0 at the near plane to 1 at the far one.
    #[default]
    Forward,
    /// From −1 at the near plane to 0 at the far one: what a device with a reversed buffer (1 at the
    /// near plane, cleared to 0, the *greater* depth wins) stores, with its sign turned. Negation is
    /// exact and rounding the same on both sides of zero, so this is that device to the bit, floats near
    /// zero at the far end and all; and what compares, bounds or sorts depths need not know of it.
    Reversed,
}

/// The bits of 1.0: the key of the far plane, and of a cleared sample.
pub(crate) const FARTHEST: u32 = 1.0_f32.to_bits();
/// All bits of a float but its sign.
pub(crate) const MAGNITUDE: u32 = 0x7fff_ffff;

impl DepthOrder {
    /// Depth at the near plane and at the far one.
    #[must_use]
    pub const fn range(self) -> [f32; 2] {
        match self {
            Self::Forward => [0.0, 1.0],
            Self::Reversed => [-1.0, 0.0],
        }
    }

    /// Every depth between the planes as a whole number that orders like it: 0 at the near plane, the
    /// bits of 1.0 at the far one, neighbours one apart. −0 and +0 are one depth.
    #[must_use]
    #[inline(always)]
    pub const fn key(self, depth: f32) -> u32 {
        match self {
            // Bits of floats that are not negative order like the numbers.
            Self::Forward => depth.to_bits(),
            Self::Reversed => FARTHEST - (depth.to_bits() & MAGNITUDE),
        }
    }

    /// The depth of a key, or of the first beyond the far plane, which is behind every depth; never −0.
    #[must_use]
    #[inline(always)]
    pub const fn depth(self, key: u32) -> f32 {
        match self {
            Self::Forward => f32::from_bits(key),
            Self::Reversed if key < FARTHEST => -f32::from_bits(FARTHEST - key),
            Self::Reversed => f32::from_bits(key - FARTHEST),
        }
    }

    /// What a device stores for a depth, and, being its own inverse, the depth that it stored.
    #[must_use]
    pub fn on_device(self, depth: f32) -> f32 {
        match self {
            Self::Forward => depth,
            // Zero less −0 is +0.
            Self::Reversed => 0.0 - depth,
        }
    }
}

/// A depth order known when code is compiled, so that inner loops do not ask for it.
pub(crate) trait Order: Copy + Send + Sync {
    const ORDER: DepthOrder;
}

/// [`DepthOrder::Forward`].
#[derive(Clone, Copy)]
pub(crate) struct Forward;

/// [`DepthOrder::Reversed`].
#[derive(Clone, Copy)]
pub(crate) struct Reversed;

impl Order for Forward {
    const ORDER: DepthOrder = DepthOrder::Forward;
}

impl Order for Reversed {
    const ORDER: DepthOrder = DepthOrder::Reversed;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_order_like_depths() {
        for order in [DepthOrder::Forward, DepthOrder::Reversed] {
            let [near, far] = order.range();
            assert_eq!((order.key(near), order.key(far)), (0, FARTHEST));
            assert!(order.depth(FARTHEST + 1) > far);
            let keys = (0..FARTHEST).step_by(99_991).chain([0, 1, FARTHEST - 1, FARTHEST]);
            for key in keys {
                let depth = order.depth(key);
                assert!((near..=far).contains(&depth) && depth.to_bits() != (-0.0_f32).to_bits());
                assert_eq!(order.key(depth), key);
                assert!(key == 0 || order.depth(key - 1) < depth);
                assert!(order.depth(key + 1) > depth);
                assert_eq!(order.on_device(order.on_device(depth)), depth);
            }
        }
        assert_eq!(DepthOrder::Reversed.key(-0.0), FARTHEST);
        assert_eq!(DepthOrder::Reversed.on_device(0.0).to_bits(), 0);
    }
}
