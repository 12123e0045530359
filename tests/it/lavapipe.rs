//! The reference beside lavapipe, pixel by pixel: coverage triangle by triangle (layers would hide
//! it) by class, then ids and depth apart. The figures stand in a snapshot and aim at zero.
//!
//! What is left, and why: lavapipe clips in its own order and against its own guard band, so vertices
//! made by clipping at a side of the screen land elsewhere by a sub-pixel; and it evaluates depth from
//! a plane in f32, where the reference divides exact barycentric sums, so depth differs by the plane's
//! rounding, most on slivers. Where depths of two parts are within that difference, ids differ.

use std::sync::Arc;

use glam::{DMat4, DVec3};
use plainsight::math::rounded_clip_matrix;
use plainsight::oracle::Questions;
use plainsight::oracle::wgpu::{GpuStage, Hardware};
use plainsight::oracle::{FrameView, Oracle, Stage, part_draw};
use plainsight::part::{PartId, Partition, PartitionKnobs};
use plainsight::run::{FrameState, Truth};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Camera, DepthOrder, Lens, Mesh, Object, Placement, Stream, Viewport};
use plainsight_reference::{Image, naive};

use crate::common::{gpu, world};

const CLASSES: [&str; 4] = ["inside", "side", "near", "far"];
/// Triangles of each class.
const TRIANGLES: usize = 400;
const VIEWPORT: Viewport = Viewport { width: 97, height: 71 };

fn clip_from_view() -> DMat4 {
    let (eye, forward) = (DVec3::ZERO, DVec3::NEG_Z);
    Camera { eye, forward, lens: Lens::perspective(1.2), near: 1.0, far: 20.0 }
        .clip_from_world(VIEWPORT, DepthOrder::Forward)
}

/// Which planes the corners are beyond; `None` for a triangle that crosses two kinds, or nothing.
fn class(corners: &[[f32; 3]; 3]) -> Option<usize> {
    let clip = corners.map(|p| clip_from_view() * DVec3::from_array(p.map(f64::from)).extend(1.0));
    let some = |beyond: &dyn Fn(&glam::DVec4) -> bool| clip.iter().any(beyond);
    let all = |beyond: &dyn Fn(&glam::DVec4) -> bool| clip.iter().all(beyond);
    let near = some(&|c| c.z < 0.0);
    let far = some(&|c| c.z > c.w);
    let side = some(&|c| c.x.abs() > c.w || c.y.abs() > c.w);
    let gone = all(&|c| c.z < 0.0) || all(&|c| c.z > c.w);
    match (near, far, side, gone) {
        (false, false, false, false) => Some(0),
        (false, false, true, false) => Some(1),
        (true, false, _, false) => Some(2),
        (false, true, false, false) => Some(3),
        _ => None,
    }
}

fn triangles(wanted: usize) -> Vec<[[f32; 3]; 3]> {
    let mut stream = Stream::new(11, CLASSES[wanted]);
    let mut found = Vec::new();
    while found.len() < TRIANGLES {
        let depth = -stream.range(0.5, 24.0);
        let size = 10.0_f64.powf(stream.range(-1.0, 1.2));
        let center = [stream.range(-1.0, 1.0) * depth, stream.range(-0.8, 0.8) * depth, depth];
        let corners = [0; 3].map(|_| center.map(|c| (c + stream.range(-size, size)) as f32));
        if class(&corners) == Some(wanted) {
            found.push(corners);
        }
    }
    found
}

/// Distance in units in the last place between two non-negative floats.
fn ulps(a: f32, b: f32) -> u32 {
    a.to_bits().abs_diff(b.to_bits())
}

#[test]
fn coverage_and_depth_by_class() {
    let mut lines = Vec::new();
    for (number, name) in CLASSES.iter().enumerate() {
        let triangles = triangles(number);
        let mut scene = build("soup", &Knobs { scale: Some(0.001), ..Knobs::default() }).unwrap();
        scene.viewport = VIEWPORT;
        scene.effects.motion = None;
        let mesh = |corners: &[[f32; 3]; 3]| {
            Arc::new(Mesh::new("triangle", corners.to_vec(), vec![[0, 1, 2]]).unwrap())
        };
        scene.meshes = triangles.iter().map(mesh).collect();
        let object = |mesh| Object { mesh, placement: Placement::IDENTITY };
        scene.objects = (0..triangles.len() as u32).map(object).collect();
        let partition = Arc::new(Partition::new(&scene, PartitionKnobs::default()));
        let stage = Stage::new(partition.clone(), VIEWPORT);
        let mut device =
            Hardware::new(&GpuStage::new(gpu(), &stage).unwrap(), Questions::Queries).unwrap();
        let matrices = vec![rounded_clip_matrix(&clip_from_view()); triangles.len()];
        device.begin_frame(&FrameView { frame: 0, clip_from_object: &matrices }).unwrap();
        let (mut samples, mut differ) = (0_u32, 0_u32);
        let mut decades = [0_u32; 8];
        for part in (0..partition.part_count()).map(PartId) {
            let mut image = Image::new(VIEWPORT);
            naive::draw(&mut image, &part_draw(&partition, part, &matrices));
            let there = device.redraw(&[part]).unwrap().unwrap();
            let ids = there.parts.unwrap();
            for (sample, &id) in ids.iter().enumerate() {
                let (ours, theirs) = (image.draw_index(sample).is_some(), id != 0);
                samples += u32::from(ours);
                differ += u32::from(ours != theirs);
                if ours && theirs {
                    let off = ulps(image.depth(sample), there.depth[sample]);
                    decades[(32 - off.leading_zeros()).div_ceil(4).min(7) as usize] += 1;
                }
            }
        }
        assert!(samples > 10_000, "{name}: {samples} samples prove little");
        lines.push(format!(
            "{name:<7} {samples:>7} samples, coverage differs at {differ}, depth ulps 0: {}, under 16: {}, under 256: {}, under 4096: {}, more: {}",
            decades[0], decades[1], decades[2], decades[3], decades[4..].iter().sum::<u32>()
        ));
    }
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn ids_and_depth_of_whole_scenes() {
    let mut lines = Vec::new();
    for scene in crate::common::SCENES {
        let world = world(scene, 1, 0.05, 1);
        let state = FrameState::first(&world);
        let truth = Truth::of(&world, &state);
        let mut device = crate::common::oracle("hardware", &world);
        device.begin_frame(&FrameView { frame: 0, clip_from_object: &state.matrices }).unwrap();
        let all: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
        let there = device.redraw(&all).unwrap().unwrap();
        let ids = there.parts.unwrap();
        let samples = truth.image.sample_count();
        let ours = |i: usize| truth.part_at(&world, i).map_or(0, |part| part.0 + 1);
        let differ = (0..samples).filter(|&i| ours(i) != ids[i]).count();
        let drawn = (0..samples).filter(|&i| ours(i) != 0).count();
        let same = |i: &usize| truth.image.depth(*i).to_bits() == there.depth[*i].to_bits();
        let depth = (0..samples).filter(|i| !same(i)).count();
        lines.push(format!(
            "{scene:<8} {drawn:>6} samples, part ids differ at {differ}, depth at {depth}"
        ));
        // The device's answer for the whole does not depend on how much was drawn before.
        assert_eq!(device.redraw(&all).unwrap().unwrap().parts.unwrap(), ids);
    }
    insta::assert_snapshot!(lines.join("\n"));
}
