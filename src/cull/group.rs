//! One question about several nodes: the *multiqueries* of Mattausch, Bittner & Wimmer 2008 (CHC++,
//! section 4.3). Nodes that have long been hidden will hardly all come into view at once; if the
//! answer is "hidden", one question did for all, and if it is "visible", each is asked again.

/// The chance that a node hidden in the last `frames` frames stays hidden, as measured in the paper:
/// 0.99 − 0.7·e^(−n).
#[must_use]
pub fn chance_of_staying_hidden(frames: u32) -> f64 {
    0.99 - 0.7 * libm::exp(-f64::from(frames))
}

/// Cuts `chances` into runs to ask about together: each run grows while that raises its value, nodes
/// saved ÷ expected questions, where a run of n questions costs 1, and n more with the chance that any
/// of them shows. Returns the ends of the runs; a run never has more than `most`. Either the surest
/// come first, as in the paper, or neighbours stand together: they come into view together.
#[must_use]
pub fn runs(chances: &[f64], most: usize) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut start = 0;
    while start < chances.len() {
        let (mut all_hidden, mut best, mut end) = (1.0, 0.0, start + 1);
        for (place, chance) in chances.iter().enumerate().skip(start).take(most.max(1)) {
            all_hidden *= chance;
            let size = (place + 1 - start) as f64;
            let expected = if size == 1.0 { 1.0 } else { 1.0 + (1.0 - all_hidden) * size };
            let value = size / expected;
            if value <= best {
                break;
            }
            (best, end) = (value, place + 1);
        }
        ends.push(end);
        start = end;
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unsure_nodes_stay_alone_and_sure_ones_go_together() {
        assert_eq!(runs(&[0.3; 4], 16), [1, 2, 3, 4]);
        let sure = runs(&[chance_of_staying_hidden(50); 30], 16);
        // 10 ÷ (1 + 10·(1 − 0.99¹⁰)) = 5.112, 11 ÷ (1 + 11·(1 − 0.99¹¹)) = 5.113, twelve 5.10.
        assert_eq!(sure, [11, 22, 30]);
        assert_eq!(runs(&[0.99; 9], 4), [4, 8, 9]);
        assert!(runs(&[], 4).is_empty());
    }

    #[test]
    fn certainty_grows_with_time() {
        let chances: Vec<f64> = (0..20).map(chance_of_staying_hidden).collect();
        assert!(chances.is_sorted() && (chances[0] - 0.29).abs() < 1e-12 && chances[19] < 0.99);
    }
}
