//! Layers: nodes that nothing is known of, as in a first frame or after a turn, are asked about the
//! nearest first. They hide the others, which would be asked about in vain.

/// Nodes that nothing is known of which a batch asks about where hardly anything is drawn, where nothing else
/// is said.
pub(super) const FIRST_LAYER: usize = 64;

/// Parts `nodes` into those of the next batch and those that stay for later, both in their order.
/// `new_depth`: how near a node can be that nothing is known of, `None` for others, which never stay.
/// A batch takes as many new nodes as parts are drawn, and at least `first` (at least 1), so that layers
/// double.
pub(super) fn next_layer<T>(
    mut nodes: Vec<T>,
    (first, drawn_parts): (usize, usize),
    new_depth: impl Fn(&T) -> Option<f32>,
) -> (Vec<T>, Vec<T>) {
    let most = first.max(drawn_parts);
    let mut depths: Vec<f32> = nodes.iter().filter_map(&new_depth).collect();
    if depths.len() <= most {
        return (nodes, Vec::new());
    }
    let (_, &mut farthest, _) = depths.select_nth_unstable_by(most - 1, f32::total_cmp);
    let later = nodes.extract_if(.., |node| new_depth(node).is_some_and(|depth| depth > farthest));
    let later = later.collect();
    (nodes, later)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_come_first_and_what_is_known_never_waits() {
        // 100 new nodes, farther and farther in a scattered order, each followed by a known one.
        let nodes: Vec<(u32, bool)> =
            (0..100).flat_map(|i| [(i * 37 % 100, true), (i, false)]).collect();
        let depth = |&(depth, new): &(u32, bool)| new.then_some(depth as f32);
        let (now, later) = next_layer(nodes.clone(), (FIRST_LAYER, 0), depth);
        assert_eq!((now.len(), later.len()), (164, 36));
        assert!(now.iter().all(|&(depth, new)| !new || depth < 64));
        assert!(later.iter().all(|&(depth, new)| new && depth >= 64));
        let (now, later) = next_layer(nodes.clone(), (FIRST_LAYER, 100), depth);
        assert_eq!((now, later), (nodes, Vec::new()));
    }

    #[test]
    fn equally_near_ones_go_together() {
        let (now, later) = next_layer(vec![1.0; 200], (FIRST_LAYER, 0), |&depth| Some(depth));
        assert_eq!((now.len(), later.len()), (200, 0));
    }
}
