//! Canaries: lanes made wrong on purpose, in one way each, to see that the failure arrives where it must: at
//! the gate, in the report, in the exit code. They act on what a run hands to its observers, beside any culler
//! and oracle: each check that looks at it must fail, and no other. It must not know the checks.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use plainsight_reference::{Draw, Faces, Image, naive};

use super::{FrameTrace, Moment, Truth, World};
use crate::cull::Event;
use crate::oracle::{OracleError, ReadBack};
use crate::part::PartId;

/// What is wrong with every lane over a world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Canary {
    /// In every frame, of the parts that show and were drawn that with the fewest samples is not told as
    /// drawn; the picture is told as whole.
    Set,
    /// In every frame one sample of the picture of what was drawn is wrong.
    Image,
    /// In every frame one sample of the device's own depth is wrong; where no device draws, one that draws as
    /// the reference does is made up.
    DeviceImage,
    /// A frame that is run again ends in one more draw.
    Determinism,
    /// In every frame there is one more answer than questions.
    Counts,
    /// In every frame one sample of the truth is wrong.
    Truth,
    /// A panic in frame 1.
    Panic,
    /// In a frame that is run again the last answer is another, or the image where nothing was asked.
    Unrepeatable,
    /// The device is lost in frame 1.
    Lost,
    /// As `Set` in frame 0; then the device is lost in frame 1.
    SetThenLost,
    /// Frame 1 never ends, where the scene's seed is odd: so some worlds of a sweep end before.
    Hang,
}

impl Canary {
    /// All there are.
    pub const ALL: [Self; 11] = [
        Self::Set,
        Self::Image,
        Self::DeviceImage,
        Self::Determinism,
        Self::Counts,
        Self::Truth,
        Self::Panic,
        Self::Unrepeatable,
        Self::Lost,
        Self::SetThenLost,
        Self::Hang,
    ];

    /// Its name in flags.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Set => "set",
            Self::Image => "image",
            Self::DeviceImage => "device-image",
            Self::Determinism => "determinism",
            Self::Counts => "counts",
            Self::Truth => "truth",
            Self::Panic => "panic",
            Self::Unrepeatable => "unrepeatable",
            Self::Lost => "lost",
            Self::SetThenLost => "set-then-lost",
            Self::Hang => "hang",
        }
    }

    /// Whether it acts only where a frame is run again.
    #[must_use]
    pub const fn wants_repetition(self) -> bool {
        matches!(self, Self::Determinism | Self::Unrepeatable)
    }
}

impl fmt::Display for Canary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Canary {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|canary| canary.name() == text).ok_or_else(|| {
            format!("'{text}' is none: write one of {}", Self::ALL.map(Self::name).join(", "))
        })
    }
}

/// A frame as observers are about to see it, in the place of what was so.
#[derive(Default)]
pub(super) struct Spoilt {
    /// Parts drawn.
    pub(super) drawn: Option<Vec<PartId>>,
    /// The picture of what was drawn.
    pub(super) reference: Option<Image>,
    /// What the device drew: its own, and everything.
    pub(super) device: Option<[ReadBack; 2]>,
    /// Answers that were "visible".
    pub(super) visible_answers: Option<u64>,
}

/// Of the drawn parts that show, that with the fewest samples.
fn least_visible(truth: &Truth, drawn: &[PartId]) -> Option<PartId> {
    let pixels = |part: &PartId| truth.visible_pixels[part.0 as usize];
    drawn.iter().filter(|part| pixels(part) > 0).min_by_key(|part| (pixels(part), part.0)).copied()
}

/// Has the first sample show the first triangle of all, at the near plane's depth.
pub(super) fn spoil(image: &mut Image) {
    let [width, height] = [image.viewport().width, image.viewport().height].map(|side| side as f32);
    let [depth, _] = image.order().range();
    // A triangle about the sample's middle that reaches less than half a pixel to each side.
    let place = |x: f32, y: f32| [2.0 * x / width - 1.0, 1.0 - 2.0 * y / height, depth];
    let positions = [place(0.25, 0.25), place(0.25, 0.75), place(0.75, 0.5)];
    let identity = glam::Mat4::IDENTITY.to_cols_array();
    naive::draw(
        image,
        &Draw {
            positions: &positions,
            triangles: &[[0, 1, 2]],
            ranks: &[0],
            first_draw: 0,
            clip_from_object: identity,
            faces: Faces::Both,
        },
    );
}

/// What a canary makes of a frame of some lane.
pub(super) fn spoilt(
    world: &World,
    truth: &Truth,
    (moment, drawn, queries): (Moment, &[PartId], u64),
) -> Spoilt {
    let mut spoilt = Spoilt::default();
    match world.canary {
        Some(Canary::SetThenLost) if moment.frame > 0 => {}
        Some(Canary::Set | Canary::SetThenLost) => {
            let missing = least_visible(truth, drawn);
            let rest = drawn.iter().copied().filter(|&part| Some(part) != missing);
            spoilt.drawn = Some(rest.collect());
            spoilt.reference = Some(truth.image.clone());
        }
        Some(Canary::Image) => {
            let mut image = truth.image.clone();
            spoil(&mut image);
            spoilt.reference = Some(image);
        }
        Some(Canary::DeviceImage) => {
            let part = |draw: Option<u32>| match draw {
                None => 0,
                Some(draw) => world.partition.part_of_draw(draw).0 + 1,
            };
            let parts = Some(truth.image.draw_indices().map(part).collect());
            let all = ReadBack { depth: truth.image.depths(), parts };
            let mut own = ReadBack { depth: all.depth.clone(), parts: None };
            own.depth[0] = f32::from_bits(own.depth[0].to_bits() ^ 1);
            spoilt.device = Some([own, all]);
        }
        Some(Canary::Counts) => spoilt.visible_answers = Some(queries + 1),
        _ => {}
    }
    spoilt
}

/// Ends a frame of a lane before it begins, where the world's canary says so.
pub(super) fn strike(world: &World, moment: Moment) -> Result<(), OracleError> {
    if moment != (Moment { frame: 1.min(world.scene.frames - 1), view: 0 }) {
        return Ok(());
    }
    match world.canary {
        // Nobody need be told of it on standard error.
        Some(Canary::Panic) => std::panic::resume_unwind(Box::new("a canary, on purpose")),
        Some(Canary::Lost | Canary::SetThenLost) => {
            Err(OracleError::Lost("a canary, on purpose".to_owned()))
        }
        Some(Canary::Hang) if world.scene.seed % 2 == 1 => loop {
            std::thread::sleep(Duration::from_secs(1));
        },
        _ => Ok(()),
    }
}

/// Alters the trace of a frame that was run again.
pub(super) fn alter(world: &World, again: &mut FrameTrace) {
    match world.canary {
        Some(Canary::Determinism) => again.events.push(Event::draw(PartId(0))),
        Some(Canary::Unrepeatable) => {
            match again.events.iter_mut().rev().find_map(Event::other_answer) {
                Some((event, other)) => *event = other,
                None => again.image_hash ^= 1,
            }
        }
        _ => return,
    }
    again.events_hash = Event::hash(&again.events);
}

#[cfg(test)]
mod tests {
    use plainsight_reference::DepthOrder;

    use super::*;
    use crate::scene::Viewport;

    #[test]
    fn names_read_back() {
        for canary in Canary::ALL {
            assert_eq!(canary.to_string().parse(), Ok(canary));
        }
        assert!("cat".parse::<Canary>().unwrap_err().contains("device-image"));
    }

    #[test]
    fn one_sample_is_spoilt() {
        for order in [DepthOrder::Forward, DepthOrder::Reversed] {
            for (width, height) in [(1, 1), (97, 61), (1280, 1024), (4, 16384)] {
                let mut image = Image::ordered(Viewport { width, height }, order);
                spoil(&mut image);
                let shown: Vec<_> = image.draw_indices().collect();
                assert_eq!(shown[0], Some(0), "{width}x{height}");
                assert!(shown[1..].iter().all(Option::is_none), "{width}x{height}");
            }
        }
    }
}
