//! The knobs: for each its values, the first of which is the one that all other knobs are turned beside.

use crate::cull::{CULLERS, Culler, CullerSetup, Full, FullKnobs, Postponement, ProxyKind};
use crate::index::{INDEXES, IndexKind};
use crate::oracle::{BufferKnobs, DepthFormat, Latency};
use crate::part::Crossing;

/// Everything that can be turned.
#[derive(Clone, Debug)]
pub struct Tuning {
    /// Another culler than `full`, by name; the knobs of `full` then do nothing.
    pub culler: Option<&'static str>,
    /// The knobs of `full`.
    pub full: FullKnobs,
    /// What is asked about.
    pub proxy: ProxyKind,
    /// The index, by its place in the list of them.
    pub index: usize,
    /// The scene's own leaf size by this many.
    pub leaf: f64,
    /// What becomes of triangles between two parts.
    pub crossing: Crossing,
    /// What the depth buffer lacks.
    pub buffer: BufferKnobs,
    /// When answers come.
    pub latency: Latency,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            culler: None,
            full: FullKnobs::default(),
            proxy: ProxyKind::Rectangle,
            index: 0,
            leaf: 1.0,
            crossing: Crossing::Split,
            buffer: BufferKnobs::default(),
            latency: Latency::Even,
        }
    }
}

impl Tuning {
    /// Whether it takes nothing from the truth: then nothing visible may be missing.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.buffer == BufferKnobs::default()
    }

    /// The index.
    #[must_use]
    pub fn index(&self) -> IndexKind {
        INDEXES[self.index]
    }

    /// Makes the culler.
    ///
    /// # Panics
    /// Where no culler has its name.
    #[must_use]
    pub fn culler(&self, setup: CullerSetup) -> Box<dyn Culler> {
        match self.culler {
            None => Box::new(Full::new(setup, self.full.clone())),
            Some(name) => {
                let kind = CULLERS.iter().find(|kind| kind.name == name);
                (kind.expect("knobs name cullers that there are").make)(setup)
            }
        }
    }
}

/// One value of a knob.
pub type Value = (&'static str, fn(&mut Tuning));

/// What can be turned, and how.
#[derive(Clone, Copy, Debug)]
pub struct Knob {
    /// Its name.
    pub name: &'static str,
    /// What it does, in a line.
    pub summary: &'static str,
    /// Its values. The first is the default.
    pub values: &'static [Value],
}

fn same(_: &mut Tuning) {}

/// Every knob there is.
pub const KNOBS: &[Knob] = &[
    Knob {
        name: "resolution",
        summary: "pixels of the depth buffer along a side, of the view's",
        values: &[
            ("1", same),
            ("1/2", |t| t.buffer.divisor = 2),
            ("1/4", |t| t.buffer.divisor = 4),
            ("1/8", |t| t.buffer.divisor = 8),
        ],
    },
    Knob {
        name: "format",
        summary: "how the buffer stores depth",
        values: &[
            ("f32", same),
            ("unorm24", |t| t.buffer.format = DepthFormat::Unorm24),
            ("unorm16", |t| t.buffer.format = DepthFormat::Unorm16),
        ],
    },
    Knob {
        name: "threshold",
        summary: "pixels that something may show and still count as hidden",
        values: &[
            ("0", same),
            ("1", |t| t.buffer.threshold = 1),
            ("4", |t| t.buffer.threshold = 4),
            ("16", |t| t.buffer.threshold = 16),
            ("64", |t| t.buffer.threshold = 64),
        ],
    },
    Knob {
        name: "staleness",
        summary: "how many frames old the depth is that is asked",
        values: &[
            ("0", same),
            ("1", |t| t.buffer.age = 1),
            ("2", |t| t.buffer.age = 2),
            ("4", |t| t.buffer.age = 4),
        ],
    },
    Knob {
        name: "proxy",
        summary: "what is asked about in the place of geometry",
        values: &[
            ("rectangle", same),
            ("hull", |t| t.proxy = ProxyKind::Hull),
            ("box", |t| t.proxy = ProxyKind::Box),
        ],
    },
    Knob {
        name: "tightening",
        summary: "whether nodes whose contents stand still have tight boxes",
        values: &[("on", same), ("off", |t| t.full.tighten = false)],
    },
    Knob {
        name: "postponement",
        summary: "how long visible nodes are not asked about",
        values: &[
            ("figure 3", same),
            ("never", |t| t.full.postponement = Postponement::Never),
            ("seldom", |t| t.full.postponement = Postponement::Seldom),
        ],
    },
    Knob {
        name: "batch",
        summary: "most questions on their way together",
        values: &[
            ("1024", same),
            ("128", |t| t.full.most_in_flight = 128),
            ("16", |t| t.full.most_in_flight = 16),
            ("1", |t| t.full.most_in_flight = 1),
        ],
    },
    Knob {
        name: "group",
        summary: "most nodes in one question",
        values: &[
            ("as full", same),
            ("1", |t| t.full.most_together = 1),
            ("64", |t| t.full.most_together = 64),
        ],
    },
    Knob {
        name: "parts",
        summary: "triangles between two parts are split or go whole to one",
        values: &[("split", same), ("whole", |t| t.crossing = Crossing::Whole)],
    },
    Knob {
        name: "leaf",
        summary: "most triangles in a part, of the scene's own figure",
        values: &[("1", same), ("1/4", |t| t.leaf = 0.25), ("4", |t| t.leaf = 4.0)],
    },
    Knob {
        name: "index",
        summary: "the structure over the objects",
        values: &[("two-level-bsp", same), ("list", |t| t.index = 1)],
    },
    Knob {
        name: "latency",
        summary: "when answers come back",
        values: &[
            ("even", same),
            ("jittery", |t| t.latency = Latency::Jittery),
            ("spiky", |t| t.latency = Latency::Spiky),
        ],
    },
    Knob {
        name: "culler",
        summary: "the algorithm",
        values: &[
            ("full", same),
            ("full-adaptive", |t| t.culler = Some("full-adaptive")),
            ("full-trusting", |t| t.culler = Some("full-trusting")),
            ("simple", |t| t.culler = Some("simple")),
            ("chc++", |t| t.culler = Some("chc++")),
            ("vfc", |t| t.culler = Some("vfc")),
            ("draw-all", |t| t.culler = Some("draw-all")),
        ],
    },
];

/// Pairs whose effects may not add up.
pub const PAIRS: &[(&str, Value)] = &[
    ("resolution x threshold", ("1/2 x 4", |t| (t.buffer.divisor, t.buffer.threshold) = (2, 4))),
    ("resolution x threshold", ("1/4 x 16", |t| (t.buffer.divisor, t.buffer.threshold) = (4, 16))),
    (
        "resolution x format",
        ("1/4 x unorm16", |t| {
            (t.buffer.divisor, t.buffer.format) = (4, DepthFormat::Unorm16);
        }),
    ),
    ("staleness x threshold", ("1 x 4", |t| (t.buffer.age, t.buffer.threshold) = (1, 4))),
    ("staleness x resolution", ("1 x 1/2", |t| (t.buffer.age, t.buffer.divisor) = (1, 2))),
    (
        "postponement x batch",
        ("never x 16", |t| {
            (t.full.postponement, t.full.most_in_flight) = (Postponement::Never, 16);
        }),
    ),
    (
        "parts x proxy",
        ("whole x hull", |t| (t.crossing, t.proxy) = (Crossing::Whole, ProxyKind::Hull)),
    ),
    (
        "latency x batch",
        ("spiky x 16", |t| (t.latency, t.full.most_in_flight) = (Latency::Spiky, 16)),
    ),
];

/// A knob at one of its values.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The knob, or the pair.
    pub knob: &'static str,
    /// Its value.
    pub value: &'static str,
    /// Whether it is the knob's default: the same run for every knob.
    pub is_default: bool,
    /// All that follows.
    pub tuning: Tuning,
}

/// Every setting of the knobs of those names (of all, and all pairs, for none): the default once and
/// first, then each knob at its other values.
///
/// # Errors
/// A name that no knob has, with those that there are.
pub fn settings(names: &[String]) -> Result<Vec<Setting>, String> {
    for name in names {
        if !KNOBS.iter().any(|knob| knob.name == name) {
            let known: Vec<&str> = KNOBS.iter().map(|knob| knob.name).collect();
            return Err(format!("no knob is called '{name}'; there are {}", known.join(", ")));
        }
    }
    let made = |knob: &'static str, (value, turn): Value| {
        let mut tuning = Tuning::default();
        turn(&mut tuning);
        Setting { knob, value, is_default: false, tuning }
    };
    let default =
        Setting { knob: "default", value: "", is_default: true, tuning: Tuning::default() };
    let mut settings = vec![default];
    let wanted = |knob: &&Knob| names.is_empty() || names.iter().any(|name| name == knob.name);
    for knob in KNOBS.iter().filter(wanted) {
        settings.extend(knob.values[1..].iter().map(|&value| made(knob.name, value)));
    }
    if names.is_empty() {
        settings.extend(PAIRS.iter().map(|&(pair, value)| made(pair, value)));
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first value is the default, the others differ from it, and names are told apart.
    #[test]
    fn every_value_does_something() {
        let default = format!("{:?}", Tuning::default());
        for knob in KNOBS {
            assert!(!knob.summary.is_empty() && knob.values.len() >= 2, "{}", knob.name);
            let all = settings(&[knob.name.to_owned()]).unwrap();
            assert_eq!(all.len(), knob.values.len());
            assert!(all[0].is_default && format!("{:?}", all[0].tuning) == default);
            for setting in &all[1..] {
                assert_ne!(format!("{:?}", setting.tuning), default, "{setting:?}");
            }
        }
        let all = settings(&[]).unwrap();
        let names: Vec<_> = all.iter().map(|s| (s.knob, s.value)).collect();
        let mut once = names.clone();
        once.sort_unstable();
        once.dedup();
        assert_eq!(once.len(), names.len());
        assert!(settings(&["speed".to_owned()]).unwrap_err().contains("resolution, format"));
    }
}
