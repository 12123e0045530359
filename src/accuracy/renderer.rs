//! Renderers with less or more arithmetic than the reference, on some frames of a scene: the price of each
//! digit of the picture itself.

use plainsight_reference::approximate::Interpolation;
use serde::Serialize;

use super::Worlds;
use super::measure::Difference;
use crate::part::PartId;
use crate::run::{Arithmetic, FrameState, Moment, Truth, render_approximately};

/// What a renderer's pictures differ by, over all frames looked at.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct RendererPoint {
    /// The scene.
    pub scene: String,
    /// How depth is interpolated.
    pub interpolation: &'static str,
    /// How vertices are transformed.
    pub transform: &'static str,
    /// Frames looked at.
    pub frames: u32,
    /// Samples of all of them.
    pub samples: u64,
    /// Samples that show another triangle than the truth's.
    pub wrong_pixels: u64,
    /// Samples whose depth has other bits.
    pub other_depths: u64,
    /// The largest difference of depth at a sample.
    pub depth_error: f64,
    /// Parts that show in the truth and not here, once a frame.
    pub missed_parts: u64,
    /// Samples at which a depth was computed.
    pub fragments: u64,
    /// Wall nanoseconds: the least, the median, the most of the rounds. Never compared.
    pub wall_ns: [u64; 3],
}

/// Most frames looked at: one thread draws every triangle.
const MOST_FRAMES: u32 = 4;

const RENDERERS: [(&str, Interpolation, &str, bool); 6] = [
    ("exact", Interpolation::Exact, "f32", false),
    ("f64 plane", Interpolation::PlaneF64, "f32", false),
    ("f32 plane", Interpolation::PlaneF32, "f32", false),
    ("exact", Interpolation::Exact, "f64", true),
    ("f64 plane", Interpolation::PlaneF64, "f64", true),
    ("f32 plane", Interpolation::PlaneF32, "f64", true),
];

/// Every renderer over a few frames of the scene, spread over its run, `rounds` times each. `tick` is called
/// after each picture and stops, with what there is, by returning false.
#[must_use]
pub fn renderers(
    worlds: &Worlds<'_>,
    rounds: u32,
    tick: &mut dyn FnMut() -> bool,
) -> Vec<RendererPoint> {
    let (scene, world) = (worlds.scene(), worlds.usual());
    let frames = scene.frames.min(MOST_FRAMES);
    let moment = |i: u32| Moment { frame: i * scene.frames / frames.max(1), view: 0 };
    let mut image = world.image();
    let mut points = Vec::new();
    for (interpolation, how, transform, double_transform) in RENDERERS {
        let mut point = RendererPoint {
            scene: scene.name.clone(),
            interpolation,
            transform,
            frames,
            samples: u64::from(frames) * image.sample_count() as u64,
            wrong_pixels: 0,
            other_depths: 0,
            depth_error: 0.0,
            missed_parts: 0,
            fragments: 0,
            wall_ns: [0; 3],
        };
        for i in 0..frames {
            let state = FrameState::at(&world, moment(i));
            let truth = Truth::of(&world, &state);
            let arithmetic = Arithmetic { interpolation: how, double_transform };
            let mut walls = Vec::new();
            for round in 0..rounds.max(1) {
                let rendering = render_approximately(&world, &state, arithmetic, &mut image);
                walls.push(rendering.wall_ns);
                point.fragments += if round == 0 { rendering.fragments } else { 0 };
                if !tick() {
                    return points;
                }
            }
            walls.sort_unstable();
            let picked = [walls[0], walls[(walls.len() - 1) / 2], walls[walls.len() - 1]];
            point.wall_ns.iter_mut().zip(picked).for_each(|(sum, wall)| *sum += wall);
            let differs = Difference::of(&truth.image, &image);
            point.wrong_pixels += differs.triangles;
            let depths = truth.image.depths().into_iter().zip(image.depths());
            point.other_depths += depths.filter(|(a, b)| a != b).count() as u64;
            point.depth_error = point.depth_error.max(differs.depth_error);
            let mut shows = vec![false; truth.visible_pixels.len()];
            image.draw_indices().flatten().for_each(|draw| {
                let PartId(part) = world.partition.part_of_draw(draw);
                shows[part as usize] = true;
            });
            let pairs = truth.visible_pixels.iter().zip(shows);
            point.missed_parts +=
                pairs.filter(|(pixels, shows)| **pixels > 0 && !shows).count() as u64;
        }
        points.push(point);
    }
    points
}
