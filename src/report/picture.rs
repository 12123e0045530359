//! Pictures of a frame: depth and part colours of an image, and the scene from above with the frustum
//! and what was drawn, visible and culled, drawn by tiny-skia.

use glam::{DVec2, DVec3};
use image::{ImageEncoder, RgbImage};
use plainsight_reference::Image;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

use crate::math::Aabb;
use crate::part::{ObjectId, PartId};
use crate::run::{FrameState, Truth, World};
use crate::scene::{Camera, Lens, Viewport};
use crate::survey::Look;

/// Pixels from the edge of the top view to what it shows.
const MARGIN: f32 = 16.0;
/// Colours of the top view: drawn and visible, drawn in vain, culled, missed.
const FATES: [[u8; 3]; 4] = [[46, 160, 67], [227, 160, 8], [150, 158, 168], [218, 30, 40]];

/// What a culler drew, for the top view.
pub struct Shown<'a> {
    /// Parts drawn.
    pub drawn: &'a [PartId],
    /// The truth.
    pub truth: &'a Truth,
}

/// Depth as grey: near is light, nothing is black. Depth crowds near 1, so the fourth root of the
/// distance from the far plane is shown, stretched over what the image holds.
#[must_use]
pub fn depth_picture(image: &Image) -> RgbImage {
    let [_, far] = image.order().range();
    // 1 at the near plane in either order, and about near over distance.
    let shade = |depth: f32| libm::sqrt(libm::sqrt(f64::from(far) - f64::from(depth)));
    let depths = image.depths();
    let drawn = || depths.iter().copied().filter(|&depth| depth < far).map(shade);
    let (low, high) = drawn().fold((f64::INFINITY, 0.0_f64), |(l, h), s| (l.min(s), h.max(s)));
    let span = if high > low { high - low } else { 1.0 };
    paint(image, |sample| {
        let depth = image.depth(sample);
        if depth >= far {
            return [0; 3];
        }
        [(40.0 + 215.0 * (shade(depth) - low) / span) as u8; 3]
    })
}

/// Each part in a colour of its own; nothing is black.
#[must_use]
pub fn part_picture(world: &World, image: &Image) -> RgbImage {
    paint(image, |sample| {
        image.draw_index(sample).map_or([0; 3], |draw| {
            // Knuth's multiplicative hash spreads neighbouring ids over the colours.
            let hash = (world.partition.part_of_draw(draw).0 + 1).wrapping_mul(2_654_435_761);
            [24, 16, 8].map(|shift| 55 + ((hash >> shift) as u8 as f32 * 0.78) as u8)
        })
    })
}

/// Where an image differs from the truth: red on the truth's parts, dimmed to grey.
#[must_use]
pub fn difference_picture(world: &World, truth: &Image, image: &Image) -> RgbImage {
    paint(truth, |sample| {
        if truth.word(sample) != image.word(sample) {
            return [235, 30, 30];
        }
        truth.draw_index(sample).map_or([0; 3], |draw| {
            let part = world.partition.part_of_draw(draw).0;
            [60 + ((part + 1).wrapping_mul(2_654_435_761) >> 25) as u8; 3]
        })
    })
}

fn paint(image: &Image, color: impl Fn(usize) -> [u8; 3]) -> RgbImage {
    let viewport = image.viewport();
    let bytes = (0..image.sample_count()).flat_map(color).collect();
    RgbImage::from_raw(viewport.width, viewport.height, bytes).expect("three bytes a sample")
}

/// The scene from above (x to the right, z down): boxes of objects by their fate, the camera and its
/// frustum. Green: drawn and visible; amber: drawn, not visible; grey: culled; red: visible and not
/// drawn. Objects in one column of space are painted over each other, missed ones last.
#[must_use]
pub fn top_view(world: &World, state: &FrameState, shown: &Shown<'_>, side: u32) -> RgbImage {
    let mut pixmap = Pixmap::new(side.max(64), side.max(64)).expect("a picture has pixels");
    pixmap.fill(Color::WHITE);
    let mut low = DVec2::new(state.camera.eye.x, state.camera.eye.z);
    let mut high = low;
    for object in state.objects.iter().filter(|o| !o.bounds.is_empty()) {
        low = low.min(DVec2::new(object.bounds.min.x, object.bounds.min.z));
        high = high.max(DVec2::new(object.bounds.max.x, object.bounds.max.z));
    }
    let reach = (high - low).max_element().max(1e-9);
    let scale = f64::from(side.max(64) as f32 - 2.0 * MARGIN) / reach;
    let place = |p: DVec3| {
        let at = (DVec2::new(p.x, p.z) - low) * scale;
        (at.x as f32 + MARGIN, at.y as f32 + MARGIN)
    };
    let mut boxes: Vec<(usize, u32)> =
        (0..state.objects.len() as u32).map(|o| (fate(world, shown, o), o)).collect();
    boxes.sort_by_key(|&(fate, object)| ([2, 1, 0, 3].iter().position(|&f| f == fate), object));
    for (fate, object) in boxes {
        let bounds = state.objects[object as usize].bounds;
        if bounds.is_empty() {
            continue;
        }
        let ((x0, y0), (x1, y1)) = (place(bounds.min), place(bounds.max));
        let Some(rect) = Rect::from_ltrb(x0, y0, x1.max(x0 + 1.0), y1.max(y0 + 1.0)) else {
            continue;
        };
        let [r, g, b] = FATES[fate];
        let mut paint = Paint::default();
        paint.set_color_rgba8(r, g, b, 90);
        pixmap.fill_rect(rect, &paint, Transform::identity(), None);
        paint.set_color_rgba8(r, g, b, 255);
        let path = PathBuilder::from_rect(rect);
        pixmap.stroke_path(&path, &paint, &Stroke::default(), Transform::identity(), None);
    }
    frustum(&mut pixmap, (&state.camera, world.scene.viewport), reach * 1.5, &place);
    let rgb = pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    RgbImage::from_raw(pixmap.width(), pixmap.height(), rgb).expect("three bytes a pixel")
}

/// A crowd from above (x to the right, z down), as Figures 5.3 to 5.5 of Wortel 2011: what was found, black
/// where it meets the view volume and amber where it does not, within the space of all; the camera and its
/// frustum as far as it sees.
#[must_use]
pub fn found_view(look: &Look, viewport: Viewport, side: u32) -> RgbImage {
    let mut pixmap = Pixmap::new(side.max(64), side.max(64)).expect("a picture has pixels");
    pixmap.fill(Color::WHITE);
    let full = look.boxes.iter().filter(|aabb| !aabb.is_empty());
    let space = full.fold(Aabb::EMPTY, |all, aabb| all.union(aabb));
    let reach = space.size().x.max(space.size().z).max(1e-9);
    let scale = f64::from(side.max(64) as f32 - 2.0 * MARGIN) / reach;
    let place = |p: DVec3| {
        let at = (p - space.min) * scale;
        (at.x as f32 + MARGIN, at.z as f32 + MARGIN)
    };
    let mut dots = |ids: &mut dyn Iterator<Item = ObjectId>, [r, g, b]: [u8; 3]| {
        let mut paint = Paint { anti_alias: false, ..Paint::default() };
        paint.set_color_rgba8(r, g, b, 255);
        for id in ids {
            let (x, y) = place(look.boxes[id.0 as usize].center());
            if let Some(dot) = Rect::from_xywh(x, y, 1.5, 1.5) {
                pixmap.fill_rect(dot, &paint, Transform::identity(), None);
            }
        }
    };
    let known = |id: &ObjectId| !look.boxes[id.0 as usize].is_empty();
    let meets = |id: &ObjectId| look.actual.binary_search(id).is_ok();
    dots(&mut look.found.iter().copied().filter(|id| known(id) && !meets(id)), FATES[1]);
    dots(&mut look.found.iter().copied().filter(|id| known(id) && meets(id)), [20; 3]);
    let ((x0, y0), (x1, y1)) = (place(space.min), place(space.max));
    if let Some(rect) = Rect::from_ltrb(x0, y0, x1.max(x0 + 1.0), y1.max(y0 + 1.0)) {
        let mut paint = Paint::default();
        paint.set_color_rgba8(160, 160, 160, 255);
        let path = PathBuilder::from_rect(rect);
        pixmap.stroke_path(&path, &paint, &Stroke::default(), Transform::identity(), None);
    }
    frustum(&mut pixmap, (&look.camera, viewport), look.camera.far.min(reach * 1.5), &place);
    let rgb = pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    RgbImage::from_raw(pixmap.width(), pixmap.height(), rgb).expect("three bytes a pixel")
}

/// Which of [`FATES`] an object has: the worst of its parts'.
fn fate(world: &World, shown: &Shown<'_>, object: u32) -> usize {
    let visible = |part: PartId| shown.truth.visible_pixels[part.0 as usize] > 0;
    let mut seen = [false; 4];
    for part in world.partition.parts_of(ObjectId(object)) {
        seen[match (shown.drawn.contains(&part), visible(part)) {
            (true, true) => 0,
            (true, false) => 1,
            (false, false) => 2,
            (false, true) => 3,
        }] = true;
    }
    [3, 0, 1, 2].into_iter().find(|&fate| seen[fate]).unwrap_or(2)
}

fn frustum(
    pixmap: &mut Pixmap,
    (camera, viewport): (&Camera, Viewport),
    far: f64,
    place: &dyn Fn(DVec3) -> (f32, f32),
) {
    let aspect = f64::from(viewport.width) / f64::from(viewport.height);
    // The middle of a shifted frustum leans away from the view direction.
    let lean = match camera.lens {
        Lens::Perspective { shift, .. } => shift[0],
        Lens::Orthographic { .. } => 0.0,
    };
    let right = camera.forward.cross(DVec3::Y).normalize_or_zero();
    let edge = |side: f64, distance: f64| {
        let half = camera.lens.height_at(distance) * 0.5 * aspect;
        camera.eye + camera.forward * distance + right * ((side + lean) * half)
    };
    let mut path = PathBuilder::new();
    let (ex, ey) = place(camera.eye);
    for side in [-1.0, 1.0] {
        let ((from_x, from_y), (x, y)) = (place(edge(side, 0.0)), place(edge(side, far)));
        path.move_to(from_x, from_y);
        path.line_to(x, y);
    }
    path.push_circle(ex, ey, 5.0);
    let Some(path) = path.finish() else { return };
    let mut paint = Paint::default();
    paint.set_color_rgba8(30, 60, 200, 255);
    let stroke = Stroke { width: 2.0, ..Stroke::default() };
    pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    if let Some(dot) = PathBuilder::from_circle(ex, ey, 4.0) {
        pixmap.fill_path(&dot, &paint, FillRule::Winding, Transform::identity(), None);
    }
}

/// The picture as a PNG file's bytes.
#[must_use]
pub fn picture_png(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    image::codecs::png::PngEncoder::new(&mut bytes)
        .write_image(picture, picture.width(), picture.height(), image::ExtendedColorType::Rgb8)
        .expect("writing to memory does not fail");
    bytes
}
