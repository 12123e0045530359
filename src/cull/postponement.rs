//! How recent answers postpone the next question: the curve of Figure 3 of Kovalčík & Sochor 2006, as
//! named policies.

/// When a node that was visible is asked about again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Postponement {
    /// In every frame.
    Never,
    /// The more "visible" answers in a row, the more frames to wait. The paper draws the curve without
    /// numbers; this one doubles, less one, up to thirty-one frames:
    /// so the plant asks as seldom, beside `simple`, as the paper's culler does (Table 1).
    #[default]
    Figure3,
    /// Long from the first answer on, for devices on which a question is dear: fewer questions, more
    /// drawn in vain. As long as can be without drawing more parts in the bunnies, beside `simple`,
    /// than the paper's culler does (Table 1: 2.42 times as many).
    Seldom,
}

impl Postponement {
    /// Frames to pass over before the next question, after `streak` "visible" answers in a row before
    /// the present one.
    #[must_use]
    pub fn wait(self, streak: u8) -> u32 {
        let curve: &[u32] = match self {
            Self::Never => &[0],
            Self::Figure3 => &[0, 1, 3, 7, 15, 31],
            Self::Seldom => &[14, 62],
        };
        curve[usize::from(streak).min(curve.len() - 1)]
    }
}

/// A number that scatters neighbouring slots, so that nodes which came into view together are not all
/// asked about together (Knuth's multiplicative hashing).
pub(super) fn scatter(slot: usize) -> u32 {
    (slot as u32).wrapping_mul(2_654_435_769)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longer_streaks_wait_no_less() {
        for policy in [Postponement::Never, Postponement::Figure3, Postponement::Seldom] {
            let waits: Vec<u32> = (0..=u8::MAX).map(|streak| policy.wait(streak)).collect();
            assert!(waits.is_sorted(), "{policy:?}");
        }
        assert_eq!(Postponement::Never.wait(200), 0);
        assert_eq!((Postponement::Figure3.wait(0), Postponement::Figure3.wait(99)), (0, 31));
    }
}
