//! Counts per scene × culler × oracle: a change in what a culler spends is seen.

use plainsight::cull::{CULLERS, ProxyKind};
use plainsight::index::INDEXES;

use crate::common::{SCENES, gate, world};

#[test]
fn counts() {
    let mut lines = Vec::new();
    for scene in SCENES {
        let world = world(scene, 1, 0.05, 6);
        for &culler in CULLERS {
            for oracle in ["sim", "hardware"] {
                let (_, gate) = gate(&world, culler, INDEXES[0], oracle, ProxyKind::Rectangle);
                assert!(gate.held(), "{scene} {} {oracle}: {:?}", culler.name, gate.failures());
                let counts = gate.counts.total();
                lines.push(format!(
                    "{scene:<8} {:<9} {oracle:<9} drawn {:>5} visible {:>5} queries {:>5} trips {:>5}",
                    culler.name,
                    gate.excess.drawn(),
                    gate.excess.visible(),
                    counts.queries,
                    counts.round_trips
                ));
            }
        }
    }
    insta::assert_snapshot!(lines.join("\n"));
}
