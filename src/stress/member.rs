//! Members: what a world picked of each family, by name, so that a sweep can say how often each was drawn and
//! how often each two of them together. What nothing was picked of, as a latency where no device has one, has
//! no member.

use super::{Choice, Device};
use crate::part::Crossing;
use crate::scene::DepthOrder;

/// Every member comes up at least once in so many worlds.
pub const RAREST_MEMBER_ONE_IN: u64 = 100;
/// Every pair of members of two families comes up at least once in so many worlds.
pub const RAREST_PAIR_ONE_IN: u64 = 1500;

/// Families of which a member is picked only where another family's allows it: the family, the other, and the
/// beginnings of the names of those of the other that leave it out.
const LEFT_OUT: [(&str, &str, &[&str]); 4] = [
    ("latency", "device", AT_ONCE),
    ("doubt", "device", AT_ONCE),
    ("misbehaviour", "device", AT_ONCE),
    ("limits", "culler", &["vfc", "draw-all", "simple", "chc "]),
];
/// Devices without a clock.
const AT_ONCE: &[&str] = &["Sim", "HierarchicalZ", "Tables", "hardware", "pyramid", "read-back"];

/// The family and the member of a name that has both.
fn parted(name: &str) -> (&str, &str) {
    const TWO_WORDS: [&str; 2] = ["index beside", "index knobs"];
    let family = TWO_WORDS.into_iter().find(|family| name.starts_with(family));
    let family = family.or_else(|| name.split(' ').next()).unwrap_or(name);
    (family, name[family.len()..].trim_start())
}

/// Whether one world may pick both members.
pub(super) fn may_meet(one: &str, other: &str) -> bool {
    let [one, other] = [one, other].map(parted);
    let leaves_out = |(family, _): (&str, &str), (by, member): (&str, &str)| {
        LEFT_OUT.iter().any(|(left, other, members)| {
            (*left, *other) == (family, by)
                && members.iter().any(|begin| format!("{member} ").starts_with(begin))
        })
    };
    // Large worlds are few: what they are to meet comes up in turn.
    let large = |one: (&str, &str), other: (&str, &str)| {
        one.0 == "size" && !["culler", "index"].contains(&other.0)
    };
    if large(one, other) || large(other, one) {
        return false;
    }
    one.0 != other.0 && !leaves_out(one, other) && !leaves_out(other, one)
}

impl Choice {
    /// The names of what it picked: the family before the member.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        let name = |(family, member)| format!("{family} {member}");
        self.members().into_iter().map(name).collect()
    }

    /// The family and the member of each, in the order of the families.
    #[must_use]
    pub fn members(&self) -> Vec<(&'static str, String)> {
        let mut members = vec![
            ("culler", self.culler.name.to_owned()),
            ("index", self.index.name.to_owned()),
            ("index beside", self.beside.name.to_owned()),
            ("proxy", format!("{:?}", self.proxy).to_lowercase()),
        ];
        let device = match self.device {
            Device::Plain(source) => format!("{source:?}"),
            Device::Simulated(source, _) => format!("simulated over {source:?}"),
            Device::Real(questions) => questions.name().to_owned(),
        };
        members.push(("device", device));
        if let Device::Simulated(_, schedule) = self.device {
            members.push(("latency", schedule.latency.name().to_owned()));
            members.push(("doubt", schedule.doubt.to_string()));
            let wrong = schedule.misbehaviour.map_or("none".to_owned(), |wrong| {
                let said = wrong.to_string();
                said.split('=').next().unwrap_or_default().to_owned()
            });
            members.push(("misbehaviour", wrong));
        }
        let memory = self.memory.map_or("all".to_owned(), |(room, _)| format!("{room:?}"));
        members.push(("memory", memory.to_lowercase()));
        let word = |tiny: bool| if tiny { "drawn" } else { "usual" }.to_owned();
        if super::Policy::of(0, self.culler.name).is_some() {
            members.push(("limits", word(self.policy.is_some())));
        }
        members.push(("index knobs", word(self.index_knobs.is_some())));
        members.push(("cost", self.cost.name.clone()));
        let parts = if self.partition.crossing == Crossing::Split { "split" } else { "whole" };
        members.push(("parts", parts.to_owned()));
        let depth = if self.depth == DepthOrder::Forward { "forward" } else { "reversed" };
        members.push(("depth", depth.to_owned()));
        // A large world has a picture, a length and leaves of its own.
        if self.is_large() {
            members.push(("size", "large".to_owned()));
        } else {
            members.push(("picture", format!("{}x{}", self.viewport.width, self.viewport.height)));
            members.push(("frames", self.frames.to_string()));
            members.push(("leaf", self.partition.leaf_triangles.to_string()));
        }
        members
    }
}
