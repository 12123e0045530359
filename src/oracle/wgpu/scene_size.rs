//! How much of llvmpipe's memory a submission may take, bounded from above, and where a batch is cut so that
//! no occlusion query begins or ends in a full scene. It must not know wgpu.
//!
//! llvmpipe bins what it is told into a *scene*: a list of commands for each tile of 64 × 64 pixels and
//! the data that they point to. A scene ends with a submission, with a change of the targets, at a barrier,
//! and **where it is full** (`LP_SCENE_MAX_SIZE`). The last is harmless while triangles are binned: the
//! triangle is binned again in the next scene. It is not where a query begins or ends. Both put a command
//! into every tile, and where the memory runs out among them, some tiles have it and some do not; the scene is
//! drawn as it is and the command is put into every tile of the next scene. What ends a scene also ends the
//! queries that are still open, in every tile, by adding all samples that passed in the tile since the scene
//! began, less those at the query's begin; a tile whose end had been binned, or whose begin had not, has no
//! such begin, and adds the samples of **every question before it**. An empty question comes back with
//! millions of samples. (Mesa 22.3.6: `lp_setup_begin_query`, `lp_setup_end_query`, `lp_rast_tile_end`. The
//! error is towards "visible" alone. A scene that is used again keeps the fill of its first data block, so that
//! where it becomes full, and which question is hit, depends on which scenes were free: the answers of two
//! equal runs differ.) `tests/driver/full_scene.rs` shows it without plainsight.
//!
//! So a submission with questions is sent before the estimate of what it holds passes a limit. Draws alone may
//! fill as many scenes as they like; a question does not share a submission with more than the limit.
//!
//! Every figure below is a size in the driver's source or follows from one. An allocation that does not fit the
//! rest of a data block leaves that rest unused: after a state up to its own size, hence twice; after anything
//! else less than 1 %. That, vertices which rounding moves across a plane, and whatever a later version
//! adds are what half of the limit is left for.

use crate::math::Aabb;
use crate::part::{Part, PartedMesh};
use crate::scene::Viewport;

/// `LP_SCENE_MAX_SIZE`: bytes of a full scene.
const DRIVER_SCENE_BYTES: u64 = 36 << 20;
/// Most bytes of a submission with questions, by the estimate.
pub(super) const SCENE_BYTES: u64 = DRIVER_SCENE_BYTES / 2;
/// `TILE_SIZE`: pixels along a tile.
const TILE: f64 = 64.0;
/// `struct cmd_block`: 29 bytes of commands (32 with padding), 29 arguments of 16, a count, a pointer.
const BLOCK_BYTES: u64 = 32 + COMMANDS_IN_BLOCK * 16 + 8 + 8;
/// `CMD_BLOCK_MAX`: commands in a block; each tile has blocks of its own.
const COMMANDS_IN_BLOCK: u64 = 29;
/// `struct lp_rast_state`: 16 constants and 32 buffers of 16 bytes, 128 textures of 224, 32 samplers of 32,
/// 64 images of 40, 56 more, and the shader.
const STATE_BYTES: u64 = (16 + 32) * 16 + 128 * 224 + 32 * 32 + 64 * 40 + 56 + 8;
/// What a question or a draw of a part stores before its triangles: one state, which is never found equal to
/// the one before (`try_update_scene_state` compares a pointer that only the stored one has), the rest of the
/// data block of 64 KiB that it did not fit into, and an object's 80 bytes of push constants.
const EVENT_BYTES: u64 = 2 * STATE_BYTES + 128;
/// `struct lp_rast_triangle` of position alone: 16, three coefficients of 16, three edges of 24; aligned to 16.
const TRIANGLE_BYTES: u64 = (16 + 3 * 16 + 3 * 24_u64).next_multiple_of(16);
/// The same with an edge of 24 more for each side of the viewport, which a clipped triangle may get.
const CLIPPED_TRIANGLE_BYTES: u64 = (16 + 3 * 16 + 7 * 24_u64).next_multiple_of(16);
/// How far a corner may be drawn from where it is computed here: both keep 24 bits of a place in the window,
/// which is at most 2¹⁴ wide.
const SLACK_PIXELS: f64 = 1.0;

/// Tiles of the picture that a rectangle of pixels touches; both ends may lie outside.
fn tiles_between(low: [f64; 2], high: [f64; 2], viewport: Viewport) -> u64 {
    let along = |axis: usize, side: u32| {
        let last = (f64::from(side) - 1.0).max(0.0);
        let tile = |place: f64| (place.clamp(0.0, last) / TILE).floor();
        (tile(high[axis]) - tile(low[axis])) as u64 + 1
    };
    along(0, viewport.width) * along(1, viewport.height)
}

/// Tiles of the whole picture.
fn all_tiles(viewport: Viewport) -> u64 {
    let Viewport { width, height } = viewport;
    tiles_between([0.0; 2], [f64::from(width), f64::from(height)], viewport)
}

/// Bytes of so many commands, but for the last block of each tile, which [`empty_scene`] has.
fn command_bytes(commands: u64) -> u64 {
    commands.saturating_mul(BLOCK_BYTES).div_ceil(COMMANDS_IN_BLOCK)
}

/// What any scene holds: a clear in every tile, and in every tile a block that is not full.
fn empty_scene(viewport: Viewport) -> u64 {
    all_tiles(viewport) * BLOCK_BYTES + command_bytes(all_tiles(viewport)) + EVENT_BYTES
}

/// Where a set of points in clip space, depth from 0 to w, may show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    /// Planes of the view that some of it lies beyond, at most six. A triangle that is clipped by so many
    /// becomes at most so many more.
    crossed: u64,
    /// Tiles of the rectangle around what shows.
    tiles: u64,
    /// Smallest w, where that is positive.
    nearest: Option<f64>,
}

impl Reach {
    /// Of the convex hull of `corners`.
    pub(super) fn of(corners: impl IntoIterator<Item = [f64; 4]>, viewport: Viewport) -> Self {
        let mut beyond = [false; 6];
        let mut nearest = f64::INFINITY;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let half = [viewport.width, viewport.height].map(|side| f64::from(side) * 0.5);
        for [x, y, z, w] in corners {
            let inside = [x + w, w - x, y + w, w - y, z, w - z];
            // What is no number lies beyond.
            let out = inside.map(|by| by < 0.0 || by.is_nan());
            beyond.iter_mut().zip(out).for_each(|(beyond, out)| *beyond = *beyond || out);
            nearest = if w > 0.0 { nearest.min(w) } else { 0.0 };
            let window = [half[0] + half[0] * x / w, half[1] - half[1] * y / w];
            for axis in 0..2 {
                low[axis] = low[axis].min(window[axis] - SLACK_PIXELS);
                high[axis] = high[axis].max(window[axis] + SLACK_PIXELS);
            }
        }
        let nearest = (nearest > 0.0).then_some(nearest);
        // Where some of it is at or behind the eye, the rest may be anywhere.
        let tiles = match nearest {
            Some(_) => tiles_between(low, high, viewport),
            None => all_tiles(viewport),
        };
        Self { crossed: beyond.into_iter().filter(|&out| out).count() as u64, tiles, nearest }
    }

    /// Of whole pixels, columns `min[0]..max[0]`, rows `min[1]..max[1]`, between the planes.
    pub(super) fn within(min: [u32; 2], max: [u32; 2], viewport: Viewport) -> Self {
        let last = max.map(|end| f64::from(end) - 1.0);
        let tiles = tiles_between(min.map(f64::from), last, viewport);
        Self { crossed: 0, tiles, nearest: Some(1.0) }
    }

    /// Of a box by a matrix.
    pub(super) fn of_box(
        clip: &[f32; 16],
        min: [f64; 3],
        max: [f64; 3],
        viewport: Viewport,
    ) -> Self {
        let corners = (0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min } else { max }[axis];
            let at = [pick(0), pick(1), pick(2), 1.0];
            let sum = |row: usize| (0..4).map(|i| f64::from(clip[i * 4 + row]) * at[i]).sum();
            std::array::from_fn(sum)
        });
        Self::of(corners, viewport)
    }

    /// Bytes of so many triangles within it that put at most `commands` into tiles before they are clipped:
    /// each piece of a clipped one lies within the rectangle around the whole.
    fn bytes(&self, triangles: u64, commands: u64) -> u64 {
        let pieces = 1 + self.crossed;
        let size = if self.crossed == 0 { TRIANGLE_BYTES } else { CLIPPED_TRIANGLE_BYTES };
        let commands = commands.min(triangles.saturating_mul(self.tiles));
        // One more in each tile sets the state.
        pieces * triangles * size + command_bytes(pieces.saturating_mul(commands) + self.tiles)
    }
}

/// What of a part's shape decides how many tiles its triangles touch together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shape {
    triangles: u64,
    /// Sum of their longest edges, in the object's units.
    lengths: f64,
    /// Sum of the squares of these.
    squares: f64,
}

impl Shape {
    /// Of one part of a mesh.
    pub(super) fn of(mesh: &PartedMesh, part: &Part) -> Self {
        let positions = mesh.positions_of(part);
        let mut shape = Self::default();
        for triangle in mesh.triangles_of(part).0 {
            let [a, b, c] = triangle.map(|corner| positions[corner as usize].map(f64::from));
            let square = |p: [f64; 3], q: [f64; 3]| -> f64 {
                (0..3).map(|axis| (p[axis] - q[axis]) * (p[axis] - q[axis])).sum()
            };
            let longest = square(a, b).max(square(b, c)).max(square(c, a));
            shape.triangles += 1;
            shape.lengths += longest.sqrt();
            shape.squares += longest;
        }
        shape
    }

    /// Most tiles that its triangles touch together, each counted by itself.
    ///
    /// A rectangle w pixels wide touches fewer than w/64 + 2 columns of tiles. Where no point is nearer than
    /// w₀, a step in the object moves x/w by at most its length times (|∇x| + |∇w|)/w₀ as long as |x/w| ≤ 1,
    /// which holds for all that is left after clipping; so no triangle is wider than its longest edge times
    /// that times half the viewport. The sum of (x + 2)(y + 2) over all of them needs the sums of edges and of
    /// their squares alone.
    fn commands(&self, clip: &[f32; 16], nearest: f64, viewport: Viewport) -> u64 {
        let steepness = |row: usize| {
            let square = |column: usize| f64::from(clip[column * 4 + row]).powi(2);
            (0..3).map(square).sum::<f64>().sqrt()
        };
        let tiles_per_unit = |row: usize, side: u32| {
            (steepness(row) + steepness(3)) / nearest * f64::from(side) * 0.5 / TILE
        };
        let (x, y) = (tiles_per_unit(0, viewport.width), tiles_per_unit(1, viewport.height));
        let all = x * y * self.squares + 2.0 * (x + y) * self.lengths;
        // Saturates where it is not finite.
        (4 * self.triangles).saturating_add(all.ceil() as u64)
    }

    /// Bytes of a draw of it by a matrix whose depth runs from 0 to w.
    pub(super) fn draw_bytes(&self, bounds: &Aabb, clip: &[f32; 16], viewport: Viewport) -> u64 {
        let reach = Reach::of_box(clip, bounds.min.into(), bounds.max.into(), viewport);
        let commands = match reach.nearest {
            Some(nearest) => self.commands(clip, nearest, viewport),
            None => u64::MAX,
        };
        EVENT_BYTES.saturating_add(reach.bytes(self.triangles, commands))
    }
}

/// Bytes of a question about proxies: each with its reach and how many triangles it has. Begin and end are two
/// commands in every tile.
pub(super) fn question_bytes(
    proxies: impl IntoIterator<Item = (Reach, u64)>,
    viewport: Viewport,
) -> u64 {
    let own = EVENT_BYTES + command_bytes(2 * all_tiles(viewport));
    let of = |(reach, triangles): (Reach, u64)| reach.bytes(triangles, u64::MAX);
    proxies.into_iter().map(of).fold(own, u64::saturating_add)
}

/// Something that is binned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Binned {
    Draw,
    Question,
}

/// What a submission holds so far, and whether the next event still goes with it.
#[derive(Clone, Debug)]
pub(super) struct Filling {
    limit: u64,
    empty: u64,
    bytes: u64,
    questions: bool,
    draws: bool,
}

impl Filling {
    /// With nothing in it.
    pub(super) fn new(limit: u64, viewport: Viewport) -> Self {
        let empty = empty_scene(viewport);
        Self { limit, empty, bytes: empty, questions: false, draws: false }
    }

    /// Whether what is there must be sent before an event of so many bytes: both together pass the limit, and
    /// there is a question among them. A question that passes it by itself goes alone.
    #[must_use]
    pub(super) fn is_full_for(&self, event: Binned, bytes: u64) -> bool {
        let shared = match event {
            Binned::Draw => self.questions,
            Binned::Question => self.questions || self.draws,
        };
        shared && self.bytes.saturating_add(bytes) > self.limit
    }

    /// Adds an event.
    pub(super) fn add(&mut self, event: Binned, bytes: u64) {
        self.bytes = self.bytes.saturating_add(bytes);
        match event {
            Binned::Draw => self.draws = true,
            Binned::Question => self.questions = true,
        }
    }

    /// Everything was sent.
    pub(super) fn clear(&mut self) {
        (self.bytes, self.questions, self.draws) = (self.empty, false, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWPORT: Viewport = Viewport { width: 1280, height: 1024 };
    const IDENTITY: [f32; 16] =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

    /// As the structures stand in the driver's source.
    #[test]
    fn sizes_are_those_of_the_driver() {
        assert_eq!((BLOCK_BYTES, STATE_BYTES), (512, 33_088));
        assert_eq!((TRIANGLE_BYTES, CLIPPED_TRIANGLE_BYTES), (144, 240));
        assert_eq!(SCENE_BYTES, 18_874_368);
        assert_eq!(all_tiles(VIEWPORT), 20 * 16);
        assert_eq!(all_tiles(Viewport { width: 65, height: 64 }), 2);
        assert_eq!(all_tiles(Viewport { width: 1, height: 1 }), 1);
    }

    fn filling(limit: u64) -> Filling {
        Filling::new(empty_scene(VIEWPORT) + limit, VIEWPORT)
    }

    /// Sends events one after another and says before which of them something was sent.
    fn cuts(limit: u64, events: &[(Binned, u64)]) -> Vec<usize> {
        let mut filling = filling(limit);
        let mut before = Vec::new();
        for (place, &(event, bytes)) in events.iter().enumerate() {
            if filling.is_full_for(event, bytes) {
                filling.clear();
                before.push(place);
            }
            filling.add(event, bytes);
        }
        before
    }

    #[test]
    fn a_submission_is_cut_over_the_limit_and_not_at_it() {
        let all = [(Binned::Draw, 40), (Binned::Question, 10), (Binned::Question, 10)];
        assert_eq!(cuts(61, &all), [0; 0]);
        assert_eq!(cuts(60, &all), [0; 0]);
        assert_eq!(cuts(59, &all), [2]);
        assert_eq!(cuts(50, &all), [2]);
        assert_eq!(cuts(49, &all), [1]);
        assert_eq!(cuts(u64::MAX / 2, &all), [0; 0]);
    }

    #[test]
    fn draws_between_questions_count() {
        let (draw, ask) = ((Binned::Draw, 30), (Binned::Question, 10));
        assert_eq!(cuts(80, &[ask, draw, draw, ask, draw, ask]), [4]);
        assert_eq!(cuts(79, &[ask, draw, draw, ask, draw, ask]), [3]);
    }

    #[test]
    fn draws_alone_are_never_cut_and_share_nothing_with_a_question_when_they_are_too_many() {
        let (draw, huge, ask) = ((Binned::Draw, 30), (Binned::Draw, 500), (Binned::Question, 10));
        assert_eq!(cuts(100, &[draw; 9]), [0; 0]);
        assert_eq!(cuts(100, &[draw, huge, draw, huge]), [0; 0]);
        assert_eq!(cuts(100, &[huge, ask]), [1], "a question after a huge draw");
        assert_eq!(cuts(100, &[ask, huge]), [1], "a huge draw after a question");
        assert_eq!(cuts(100, &[ask, huge, draw, ask]), [1, 3], "draws go with the huge one");
        assert_eq!(cuts(100, &[draw, draw, draw, draw, ask, ask]), [4]);
    }

    #[test]
    fn a_question_over_the_limit_goes_alone() {
        let (draw, huge, ask) =
            ((Binned::Draw, 30), (Binned::Question, 500), (Binned::Question, 10));
        assert_eq!(cuts(100, &[huge]), [0; 0]);
        assert_eq!(cuts(100, &[draw, huge, huge, draw, ask]), [1, 2, 3]);
        assert_eq!(cuts(0, &[ask, ask, draw, ask]), [1, 2, 3], "none with a limit of nothing");
        let mut overflowing = filling(100);
        overflowing.add(Binned::Draw, u64::MAX);
        assert!(overflowing.is_full_for(Binned::Question, u64::MAX));
    }

    /// Tiles that a triangle of clip space touches by its rectangle of pixels, clipped: what the driver visits.
    fn touched(triangle: [[f64; 4]; 3]) -> u64 {
        let mut polygon: Vec<[f64; 4]> = triangle.to_vec();
        let planes: [fn([f64; 4]) -> f64; 6] = [
            |[x, _, _, w]| x + w,
            |[x, _, _, w]| w - x,
            |[_, y, _, w]| y + w,
            |[_, y, _, w]| w - y,
            |[_, _, z, _]| z,
            |[_, _, z, w]| w - z,
        ];
        for plane in planes {
            let mut kept = Vec::new();
            for (place, &b) in polygon.iter().enumerate() {
                let a = polygon[(place + polygon.len() - 1) % polygon.len()];
                let (from, to) = (plane(a), plane(b));
                if (from < 0.0) != (to < 0.0) {
                    let t = from / (from - to);
                    kept.push(std::array::from_fn(|i| a[i] + t * (b[i] - a[i])));
                }
                if to >= 0.0 {
                    kept.push(b);
                }
            }
            polygon = kept;
        }
        let pixels = |axis: usize, side: u32| {
            let half = f64::from(side) * 0.5;
            let all = polygon.iter().map(move |p| half + half * p[axis] / p[3]);
            let (low, high) = all.fold((f64::INFINITY, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
            let tile = |x: f64| (x.clamp(0.0, f64::from(side) - 1.0) / TILE).floor();
            (tile(high) - tile(low)) as u64 + 1
        };
        if polygon.is_empty() { 0 } else { pixels(0, VIEWPORT.width) * pixels(1, VIEWPORT.height) }
    }

    /// Random parts in random views, some around the eye: no triangle list touches more tiles, in no more
    /// pieces, than the estimate says.
    #[test]
    fn no_draw_takes_more_than_its_estimate() {
        let mut stream = crate::scene::Stream::new(1, "scene size");
        let (mut clipped, mut near, mut tight) = (0, 0, 0.0_f64);
        for _ in 0..400 {
            let size = 10.0_f64.powf(stream.range(-2.0, 1.0));
            let at: [f64; 3] = std::array::from_fn(|_| stream.range(-3.0, 3.0));
            let ahead = stream.range(0.0, 12.0);
            // Perspective with near plane 0.1 and far plane 100, depth from 0 to w, over a shifted object.
            let (a, b) = (100.0 / 99.9, -10.0 / 99.9);
            let clip = [
                [0.8, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, a, 1.0],
                [0.8 * at[0], at[1], a * ahead + b, ahead],
            ];
            let mut point = || -> [f64; 3] { std::array::from_fn(|_| stream.range(-size, size)) };
            let triangles: Vec<[[f64; 3]; 3]> = (0..20)
                .map(|_| {
                    let (corner, reach) = (point(), 0.2);
                    [corner, point().map(|x| x * reach), point()].map(|p| {
                        std::array::from_fn(|axis| corner[axis] + (p[axis] - corner[axis]) * reach)
                    })
                })
                .collect();
            let mut bounds = Aabb::EMPTY;
            let mut shape = Shape::default();
            let mut tiles = 0;
            for triangle in &triangles {
                for &p in triangle {
                    bounds = bounds.union(&Aabb::new(p.into(), p.into()));
                }
                let square = |i: usize, j: usize| -> f64 {
                    (0..3).map(|k| (triangle[i][k] - triangle[j][k]).powi(2)).sum()
                };
                let longest = square(0, 1).max(square(1, 2)).max(square(2, 0));
                shape.triangles += 1;
                shape.lengths += longest.sqrt();
                shape.squares += longest;
                tiles += touched(triangle.map(|p| {
                    std::array::from_fn(|row| {
                        (0..3).map(|i| clip[i][row] * p[i]).sum::<f64>() + clip[3][row]
                    })
                }));
            }
            let flat: [f32; 16] = std::array::from_fn(|i| clip[i / 4][i % 4] as f32);
            let reach = Reach::of_box(&flat, bounds.min.into(), bounds.max.into(), VIEWPORT);
            let commands = reach
                .nearest
                .map_or(u64::MAX, |w| shape.commands(&flat, w, VIEWPORT))
                .min(20 * reach.tiles);
            assert!(tiles <= commands, "{tiles} tiles are touched, {commands} are thought of");
            clipped += u32::from(reach.crossed > 0);
            near += u32::from(reach.nearest.is_none());
            tight = tight.max(tiles as f64 / commands as f64);
            assert!(
                shape.draw_bytes(&bounds, &flat, VIEWPORT) >= EVENT_BYTES + 20 * TRIANGLE_BYTES
            );
        }
        assert!(
            clipped > 40 && clipped < 360 && near > 20,
            "{clipped} clipped, {near} around the eye"
        );
        assert!(tight > 0.3, "the bound is no worse than it must be: {tight}");
    }

    #[test]
    fn a_box_is_clipped_by_the_planes_that_it_crosses() {
        let of = |min: f64, max: f64| Reach::of_box(&IDENTITY, [min; 3], [max; 3], VIEWPORT);
        assert_eq!(of(0.1, 0.2).crossed, 0);
        assert_eq!(of(-1.0, 1.0).crossed, 1, "before the near plane");
        assert_eq!(of(0.5, 1.5).crossed, 3);
        assert_eq!(of(-9.0, 9.0), Reach { crossed: 6, tiles: 320, nearest: Some(1.0) });
        let mut behind = IDENTITY;
        (behind[11], behind[15]) = (1.0, 0.0);
        let around = Reach::of_box(&behind, [-0.01; 3], [0.01; 3], VIEWPORT);
        assert_eq!((around.tiles, around.nearest), (320, None), "w is 0 within it");
        assert_eq!(Reach::within([0, 0], [64, 64], VIEWPORT).tiles, 1);
        assert_eq!(Reach::within([63, 0], [65, 65], VIEWPORT).tiles, 4);
    }

    /// What the driver takes for each, as measured: a question about one rectangle is a block of 64 KiB and
    /// more, so that some 200 fit half of the limit.
    #[test]
    fn questions_about_rectangles_fit_by_the_hundred() {
        let whole = Reach::within([0, 0], [1280, 1024], VIEWPORT);
        let bytes = question_bytes([(whole, 2)], VIEWPORT);
        assert!(bytes > 65_536 + 2 * 320 * 512 / 29 + 2 * 320 * 512 / 29);
        let fit = (SCENE_BYTES - empty_scene(VIEWPORT)) / bytes;
        assert!((150..250).contains(&fit), "{fit}");
        let more = question_bytes([(whole, 2), (whole, 2)], VIEWPORT);
        assert_eq!(more - bytes, bytes - question_bytes([], VIEWPORT));
    }
}
