//! Objects that jump from place to place with nothing between, as after a respawn or a cut in a film:
//! what was remembered of them, and any bound on their step, is void in the frame of a jump.

use glam::DVec3;

use crate::scene::{Jumps, Teleport};

/// The declared jumps, by object.
#[derive(Debug)]
pub(super) struct TeleportEffect {
    jumping: Vec<u32>,
    jumps: Vec<Jumps>,
}

impl TeleportEffect {
    pub(super) fn new(teleport: &Teleport) -> Self {
        let mut jumpers = teleport.jumpers.clone();
        jumpers.sort_by_key(|&(object, _)| object);
        let (jumping, jumps) = jumpers.into_iter().unzip();
        Self { jumping, jumps }
    }

    pub(super) fn jumping(&self) -> &[u32] {
        &self.jumping
    }

    /// What is added to the object's place at frame `t`.
    pub(super) fn offset(&self, object: u32, t: u32) -> DVec3 {
        let place = self.jumping.binary_search(&object).ok();
        let jumps = place.map(|place| &self.jumps[place]).filter(|jumps| !jumps.offsets.is_empty());
        jumps.map_or(DVec3::ZERO, |jumps| {
            let turn = t / jumps.period.max(1);
            jumps.offsets[turn as usize % jumps.offsets.len()]
        })
    }

    /// The largest coordinate that is ever added.
    pub(super) fn extent(&self, object: u32) -> f64 {
        let place = self.jumping.binary_search(&object).ok();
        let offsets = place.map_or(&[][..], |place| &self.jumps[place].offsets);
        offsets.iter().fold(0.0, |most, offset| most.max(offset.abs().max_element()))
    }

    /// Whether the object is elsewhere than in the frame before.
    pub(super) fn jumped(&self, object: u32, t: u32) -> bool {
        t > 0 && self.offset(object, t) != self.offset(object, t - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_take_turns() {
        let jumps = Jumps { offsets: vec![DVec3::ZERO, DVec3::X], period: 3 };
        let effect = TeleportEffect::new(&Teleport { jumpers: vec![(7, jumps)] });
        let places: Vec<f64> = (0..8).map(|t| effect.offset(7, t).x).collect();
        assert_eq!(places, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
        let jumped: Vec<u32> = (0..8).filter(|&t| effect.jumped(7, t)).collect();
        assert_eq!(jumped, [3, 6]);
        assert!(!effect.jumped(6, 3) && effect.offset(6, 3) == DVec3::ZERO);
    }
}
