//! The outline of a box on the screen: the convex hull of its projected corners, dilated, on the grid
//! of sub-pixels. With the box's nearest depth it is the second proxy, tighter than the rectangle
//! wherever a box does not stand upright before the eye.
//!
//! # How it is made
//! 1. Each corner goes to the nearest place of a grid of 1/256 pixel, as two integers; from here on all
//!    is exact but for step 4.
//! 2. It is dilated under the max norm by M, the margin rounded up to the grid with half a step for
//!    step 1: the corner becomes a square of half-side M, in sub-pixels, on each axis its own.
//! 3. The convex hull of the squares is the Minkowski sum of the corners' hull (Andrew 1979, *Another
//!    efficient algorithm for convex hulls in two dimensions*) and one square.
//! 4. It is cut by the sides of the box's pixel rectangle (Sutherland & Hodgman 1974), so that it never
//!    covers a sample that the rectangle does not, and never leaves the viewport. New corners go to the
//!    nearest place of the grid.
//!
//! At most 12 corners are left: the corners' hull has at most 8 edges, the square and the rectangle add
//! edges in the same four directions, and a convex polygon has one edge in each.
//!
//! # Why it is conservative
//! Let p be the middle of a pixel that a triangle of the contents covers, δ the largest that a corner of
//! such a triangle may be displaced on either axis (transform bound, window arithmetic and snapping: see
//! `clip_box`), and H the hull of the exact corners. The projection of a convex box before the eye is H,
//! so p is within δ of H in the max norm. Let Q be the polygon of step 3, m its dilation and Q∩R that of
//! step 4 before rounding.
//! - p is at least m − δ inside Q in the max norm: the square of that half-side about p is within H
//!   dilated by m. p is in the rectangle R, and half a pixel inside its sides, which are edges of pixels.
//! - Let Q′ be what is drawn: the corners of Q∩R, each displaced by at most d ([`HULL_DILATION_PIXELS`]
//!   says of what d is made), joined in the same order. Every point of its outline is within d of the
//!   outline of Q∩R, and so is every outline between the two as the corners slide from there to here.
//!   With d < m − δ and d < ½ none of them passes through p, so that the outline Q′ goes round p once, as
//!   that of Q∩R does. Whether Q′ is still convex does not matter.
//! - The windings of the triangles of a fan add up to that of the outline. So one of them goes round p.
//!   The top-left rule is the same as taking p an infinitely small step to one side, the same for all
//!   triangles, so that an inner edge through p belongs to one of the two beside it, and the sum holds
//!   on edges as well. Both faces count. So p is covered.
//!
//! Its depth is the rectangle's, less [`FLAT_DEPTH_STEP`].

use plainsight_reference::DepthOrder;

use super::clip_box::{ClipBox, PixelRectangle, floor_f32};
use super::{Margins, RECTANGLE_DILATION_PIXELS};

/// Dilation of a hull beyond its transform bound. [`RECTANGLE_DILATION_PIXELS`] of it are the contents'
/// side, δ. The other eighth of a pixel is twice d, the hull's own displacement: a corner made by the
/// rectangle is rounded by 2⁻⁹ pixel, four times at most on one edge (2⁻⁷); clip coordinates and window
/// arithmetic stay under 2⁻⁹, for viewports of up to 16384 pixels; a device snaps by 2⁻⁵ at most, the
/// reference not at all, for corners are on its grid. Together they are under 2⁻⁴.
pub const HULL_DILATION_PIXELS: f64 = RECTANGLE_DILATION_PIXELS + 0.125;
/// What the depth of a hull stands before the rectangle's: 8 units of 2⁻²⁴; where depth is reversed, that
/// share of it.
///
/// Its vertices have one depth z and w = 1. Interpolated as a plane, by differences of depths, that is
/// z exactly, for the differences are zero. The reference adds e₀z + e₁z + e₂z in f64 and divides by the
/// area: off by 4·2⁻⁵³·z at most, which f32 rounds back to z. A device that adds three products of z
/// and weights in f32 rounds each weight twice (an area over an area), the product once and the sum
/// twice: γ₅, and one more for the sum of the weights; 8 units hold them.
pub const FLAT_DEPTH_STEP: f64 = 8.0 * (f32::EPSILON as f64 / 2.0);
/// Most corners of a hull, as derived above.
pub const MOST_HULL_CORNERS: usize = 12;
/// Places of the grid along a pixel, as many as the reference snaps to.
pub const HULL_SUBPIXELS: i32 = 256;
/// Farthest place of a corner from the window's origin, sub-pixels: 2²⁰ pixels. Differences of dilated
/// corners stay within 2³⁰ and their products within i64, and f64 knows such a place to 2⁻³¹ pixel.
const FARTHEST: f64 = (1 << 28) as f64;

/// A convex polygon in the window: its corners in order round it, clockwise on the screen, in units of
/// 1/256 pixel from the top left corner of the viewport, rows going down. It lies within the viewport and
/// has at least three corners; it may cover no sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hull {
    corners: [[i32; 2]; MOST_HULL_CORNERS],
    len: u32,
}

impl Hull {
    /// Its corners: column and row in sub-pixels.
    #[must_use]
    pub fn corners(&self) -> &[[i32; 2]] {
        &self.corners[..self.len as usize]
    }

    /// Twice its area, square sub-pixels, whichever way round it goes.
    #[must_use]
    pub fn twice_area(&self) -> u64 {
        let corners = self.corners();
        let next = corners.iter().cycle().skip(1);
        let term = |(a, b): (&[i32; 2], &[i32; 2])| {
            i64::from(a[0]) * i64::from(b[1]) - i64::from(a[1]) * i64::from(b[0])
        };
        corners.iter().zip(next).map(term).sum::<i64>().unsigned_abs()
    }

    /// Whether a place, in sub-pixels, is within or on an edge.
    #[must_use]
    pub fn holds(&self, [x, y]: [i32; 2]) -> bool {
        let corners = self.corners();
        let next = corners.iter().cycle().skip(1);
        let wide = |from: i32, to: i32| i64::from(to) - i64::from(from);
        corners
            .iter()
            .zip(next)
            .all(|(a, b)| wide(a[0], b[0]) * wide(a[1], y) >= wide(a[1], b[1]) * wide(a[0], x))
    }

    const EMPTY: Self = Self { corners: [[0; 2]; MOST_HULL_CORNERS], len: 0 };

    /// Appends a corner that is not the last one again; false where there is no room.
    fn push(&mut self, corner: [i32; 2]) -> bool {
        if self.corners().last() == Some(&corner) {
            return true;
        }
        let room = (self.len as usize) < MOST_HULL_CORNERS;
        if room {
            self.corners[self.len as usize] = corner;
            self.len += 1;
        }
        room
    }

    /// What of it is on the side of `at` along an axis that `keeps` says; `None` where there is no room.
    fn cut(&self, axis: usize, at: i32, keeps: impl Fn(i32) -> bool) -> Option<Self> {
        let mut kept = Self::EMPTY;
        let Some(&last) = self.corners().last() else { return Some(kept) };
        let mut from = last;
        for &to in self.corners() {
            if keeps(from[axis]) != keeps(to[axis]) && !kept.push(crossing(from, to, axis, at)) {
                return None;
            }
            if keeps(to[axis]) && !kept.push(to) {
                return None;
            }
            from = to;
        }
        if kept.len > 1 && kept.corners[0] == kept.corners[kept.len as usize - 1] {
            kept.len -= 1;
        }
        Some(kept)
    }
}

/// Where the edge meets the line, to the nearest place of the grid; its ends are not on one side.
fn crossing(a: [i32; 2], b: [i32; 2], axis: usize, at: i32) -> [i32; 2] {
    let other = 1 - axis;
    let along = |from: i32, to: i32| i64::from(to) - i64::from(from);
    let (mut rise, mut run) = (along(a[other], b[other]), along(a[axis], b[axis]));
    if run < 0 {
        (rise, run) = (-rise, -run);
    }
    let steps = along(a[axis], at) * rise;
    let mut place = [at; 2];
    place[other] = a[other] + (2 * steps + run).div_euclid(2 * run) as i32;
    place
}

/// What can be said of a box's outline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// No sample can be within.
    Nowhere,
    /// The rectangle stands in: a corner is too far out for the grid, or the outline holds as many samples.
    Rectangle,
    /// Tighter than the rectangle.
    Within {
        /// The outline, within the rectangle.
        hull: Hull,
        /// Depth of all of it, between the planes.
        depth: f32,
    },
}

impl ClipBox {
    /// The outline of a box that [`ClipBox::project`] finds within `rectangle` and nowhere nearer than
    /// `depth`.
    #[must_use]
    pub fn outline(&self, viewport: (u32, u32), within: (PixelRectangle, f32)) -> Outline {
        self.outline_with(viewport, within, &Margins::PROVEN)
    }

    /// The same with other margins than the proven ones.
    #[must_use]
    pub fn outline_with(
        &self,
        (width, height): (u32, u32),
        (rectangle, depth): (PixelRectangle, f32),
        margins: &Margins,
    ) -> Outline {
        let Some(window) = self.window(width, height) else { return Outline::Rectangle };
        let subpixels = f64::from(HULL_SUBPIXELS);
        let half =
            window.bound.map(|bound| ((bound + margins.hull_pixels) * subpixels + 0.5).ceil());
        let mut middles = [[0; 2]; 8];
        for (place, corner) in middles.iter_mut().zip(&window.corners) {
            let middle = corner.map(|at| (at * subpixels).round());
            // Written so that NaN gives up.
            if !(0..2).all(|axis| middle[axis].abs() + half[axis] <= FARTHEST) {
                return Outline::Rectangle;
            }
            *place = middle.map(|at| at as i32);
        }
        let PixelRectangle { min, max } = rectangle;
        let edge = |pixel: u32| pixel as i32 * HULL_SUBPIXELS;
        let mut cut = Some(dilated_hull(&mut middles, half.map(|half| half as i32)));
        for axis in 0..2 {
            let (low, high) = (edge(min[axis]), edge(max[axis]));
            cut = cut
                .and_then(|hull| hull.cut(axis, low, |at| at >= low))
                .and_then(|hull| hull.cut(axis, high, |at| at <= high));
        }
        let Some(hull) = cut else { return Outline::Rectangle };
        if hull.len < 3 {
            return Outline::Nowhere;
        }
        // A convex polygon that holds the middles of the pixels in all four corners holds all others.
        let [columns, rows] = [0, 1].map(|axis| {
            let middle = HULL_SUBPIXELS / 2;
            [edge(min[axis]) + middle, edge(max[axis]) - middle]
        });
        if columns.into_iter().all(|x| rows.into_iter().all(|y| hull.holds([x, y]))) {
            return Outline::Rectangle;
        }
        let depth = f64::from(depth);
        let step = match self.order {
            DepthOrder::Forward => margins.flat_depth,
            DepthOrder::Reversed => margins.flat_depth * -depth,
        };
        // Adding zero turns −0 into +0.
        let depth = floor_f32(depth - step).max(self.order.range()[0]) + 0.0;
        Outline::Within { hull, depth }
    }
}

/// The convex hull of eight squares, in fact rectangles of half-sides `half` ≥ 1 about `middles`: the
/// Minkowski sum of the middles' hull and one of them. No three corners are in a line, and the first is
/// the leftmost, of those the topmost.
///
/// The edges of such a sum are those of both, in the order of their directions, and edges of one direction
/// become one (de Berg, Cheong, van Kreveld & Overmars 2008, *Computational Geometry*, section 13.3). So
/// eight places are sorted, not thirty-two.
fn dilated_hull(middles: &mut [[i32; 2]; 8], half: [i32; 2]) -> Hull {
    let inner = convex_hull(middles);
    let square =
        [[2 * half[0], 0], [0, 2 * half[1]], [-2 * half[0], 0], [0, -2 * half[1]]].into_iter();
    let mut square = square.zip([1, 3, 5, 7]).peekable();
    let first = inner.corners[0];
    let mut at = [first[0] - half[0], first[1] - half[1]];
    let mut sum = Hull::EMPTY;
    let mut edge = |along: [i32; 2]| {
        // Eight and four at most.
        let room = sum.push(at);
        debug_assert!(room, "a hull of eight places and a square have twelve edges");
        at = [at[0] + along[0], at[1] + along[1]];
    };
    let corners = inner.corners();
    let ends = corners.iter().cycle().skip(1);
    // One place alone has no edges.
    for (from, to) in corners.iter().zip(ends).take_while(|(from, to)| from != to) {
        let mut along = [to[0] - from[0], to[1] - from[1]];
        let octant = octant(along);
        while let Some((side, _)) = square.next_if(|&(_, at)| at < octant) {
            edge(side);
        }
        if let Some((side, _)) = square.next_if(|&(_, at)| at == octant) {
            along = [along[0] + side[0], along[1] + side[1]];
        }
        edge(along);
    }
    square.for_each(|(side, _)| edge(side));
    sum
}

/// Where a direction stands on the way round that starts, and ends, at [0, −1]: odd for the axes, even
/// between them.
fn octant([x, y]: [i32; 2]) -> u32 {
    match (x.signum(), y.signum()) {
        (1, -1) => 0,
        (1, 0) => 1,
        (1, _) => 2,
        (0, 1) => 3,
        (-1, 1) => 4,
        (-1, 0) => 5,
        (-1, _) => 6,
        (_, _) => 7,
    }
}

/// The convex hull of `places`, which are sorted for it; no three corners in a line, the least first. One
/// or two corners where the places are one or in a line.
fn convex_hull(places: &mut [[i32; 2]; 8]) -> Hull {
    places.sort_unstable();
    let turns = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
        let along = |i: usize, to: [i32; 2]| i64::from(to[i]) - i64::from(a[i]);
        along(0, b) * along(1, c) - along(1, b) * along(0, c) > 0
    };
    // The chain of one side from the first place to the last, then that of the other side back.
    let (mut chain, mut len) = ([[0; 2]; 16], 0);
    let mut side = |place: [i32; 2], first: usize| {
        while len >= first + 2 && !turns(chain[len - 2], chain[len - 1], place) {
            len -= 1;
        }
        chain[len] = place;
        len += 1;
        len
    };
    let mut turn = 0;
    for &place in &*places {
        turn = side(place, 0) - 1;
    }
    for &place in places.iter().rev().skip(1) {
        side(place, turn);
    }
    // The first place ends the second chain as well.
    let mut hull = Hull::EMPTY;
    for &corner in &chain[..len - 1] {
        hull.push(corner);
    }
    hull
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DVec3};
    use proptest::prelude::*;

    use super::*;
    use crate::math::{Aabb, ClipError};

    fn plain(min: [f64; 3], max: [f64; 3], matrix: &DMat4, order: DepthOrder) -> ClipBox {
        let aabb = Aabb::new(DVec3::from_array(min), DVec3::from_array(max));
        ClipBox::new(&aabb, matrix, &ClipError::ZERO, order)
    }

    fn all(side: u32) -> PixelRectangle {
        PixelRectangle { min: [0, 0], max: [side, side] }
    }

    #[test]
    fn constants_are_those_of_the_derivation() {
        assert_eq!(FLAT_DEPTH_STEP, 8.0 * libm::pow(2.0, -24.0));
        assert_eq!(HULL_DILATION_PIXELS, 0.25);
    }

    #[test]
    fn a_square_has_its_area_and_room_for_twelve_corners() {
        let mut square = dilated_hull(&mut [[7, 9]; 8], [3, 5]);
        assert_eq!(square.corners(), [[4, 4], [10, 4], [10, 14], [4, 14]]);
        assert_eq!(square.twice_area(), 120);
        let pushed: Vec<bool> = (0..9).map(|i| square.push([i, -i])).collect();
        assert_eq!(pushed.iter().filter(|pushed| **pushed).count(), 8);
        assert!(!pushed[8] && square.corners().len() == MOST_HULL_CORNERS);
    }

    /// Corners on the line of the cut come once, the first and the last too.
    #[test]
    fn a_cut_leaves_no_corner_twice() {
        let square = dilated_hull(&mut [[0, 0]; 8], [8, 8]);
        let side = square.cut(1, 8, |at| at >= 8).unwrap();
        assert_eq!(side.corners(), [[-8, 8], [8, 8]]);
        let half = square.cut(1, 0, |at| at >= 0).unwrap();
        assert_eq!(half.corners().len(), 4);
        let mut middles = [[0, 0]; 8];
        middles[0] = [100, 50];
        let tip = dilated_hull(&mut middles, [1, 1]).cut(0, 101, |at| at >= 101).unwrap();
        assert_eq!(tip.corners(), [[101, 49], [101, 51]]);
        let triangle = Hull { corners: [[0; 2]; MOST_HULL_CORNERS], len: 1 };
        assert_eq!(triangle.cut(0, 0, |at| at >= 0).unwrap().corners(), [[0, 0]]);
    }

    /// A quarter of a pixel is 64 sub-pixels, and half a one of the grid is rounded up.
    #[test]
    fn the_dilation_is_rounded_up_to_the_grid() {
        let point = plain([0.0, 0.0, 0.5], [0.0, 0.0, 0.5], &DMat4::IDENTITY, DepthOrder::Forward);
        match point.outline((8, 8), (all(8), 0.5)) {
            Outline::Within { hull, .. } => {
                assert_eq!(hull.corners(), [[959, 959], [1089, 959], [1089, 1089], [959, 1089]]);
            }
            other => panic!("{other:?}"),
        }
    }

    /// A corner whose square reaches beyond the farthest place has no outline.
    #[test]
    fn the_farthest_place_holds_the_whole_square() {
        let at = |subpixels: f64| {
            // Of a picture two pixels wide: one pixel a unit, from the middle.
            let x = subpixels / f64::from(HULL_SUBPIXELS) - 1.0;
            let point = plain([x, 0.0, 0.5], [x, 0.0, 0.5], &DMat4::IDENTITY, DepthOrder::Forward);
            point.outline((2, 2), (all(2), 0.5))
        };
        assert_eq!(at(FARTHEST - 60.0), Outline::Rectangle);
        assert_eq!(at(FARTHEST - 70.0), Outline::Nowhere, "it is beside the picture");
    }

    /// The corner of a rectangle within a slanted edge leaves a triangle, which can show.
    #[test]
    fn three_corners_are_an_outline() {
        let turned = DMat4::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let diamond = plain([-0.5, -0.5, 0.5], [0.5, 0.5, 0.5], &turned, DepthOrder::Forward);
        let corner = PixelRectangle { min: [66, 66], max: [100, 100] };
        match diamond.outline((100, 100), (corner, 0.5)) {
            Outline::Within { hull, .. } => assert_eq!(hull.corners().len(), 3),
            other => panic!("{other:?}"),
        }
    }

    /// Forward a step, reversed a share of the depth; never −0.
    #[test]
    fn the_depth_of_an_outline_is_before_the_rectangles() {
        let depth_of = |depth: f32, order: DepthOrder| {
            let z = f64::from(depth);
            let z = if order == DepthOrder::Forward { z } else { z.min(-1e-6) };
            let point = plain([0.0, 0.0, z], [0.0, 0.0, z], &DMat4::IDENTITY, order);
            match point.outline((8, 8), (all(8), depth)) {
                Outline::Within { depth, .. } => depth,
                other => panic!("{other:?}"),
            }
        };
        let forward = floor_f32(0.75 - FLAT_DEPTH_STEP);
        assert_eq!(depth_of(0.75, DepthOrder::Forward), forward);
        let reversed = floor_f32(-0.125 - 0.125 * FLAT_DEPTH_STEP);
        assert_eq!(depth_of(-0.125, DepthOrder::Reversed), reversed);
        assert_eq!(depth_of(-0.0, DepthOrder::Reversed).to_bits(), 0);
    }

    proptest! {
        /// All that makes it the hull of the squares: it holds each of their corners, has no others, and
        /// turns one way at every one. Places on a small grid fall together and in lines often.
        #[test]
        fn a_dilated_hull_is_that_of_the_squares(
            middles in proptest::array::uniform8((-3_i32..4, -3_i32..4)),
            spread in prop_oneof![Just(1), Just(1000), Just(1 << 26)],
            half in (1_i32..5, 1_i32..5),
        ) {
            let middles = middles.map(|(x, y)| [x * spread, y * spread]);
            let half = [half.0, half.1];
            let hull = dilated_hull(&mut middles.clone(), half);
            let signs = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
            let places: Vec<[i32; 2]> = middles
                .iter()
                .flat_map(|at| signs.map(|s| [at[0] + s[0] * half[0], at[1] + s[1] * half[1]]))
                .collect();
            let corners = hull.corners();
            prop_assert_eq!(corners.first(), places.iter().min());
            for (i, &b) in corners.iter().enumerate() {
                prop_assert!(places.contains(&b), "{b:?} is no corner of a square");
                let (a, c) = (
                    corners[(i + corners.len() - 1) % corners.len()],
                    corners[(i + 1) % corners.len()],
                );
                let along = |axis: usize, from: [i32; 2], to: [i32; 2]| {
                    i64::from(to[axis]) - i64::from(from[axis])
                };
                prop_assert!(
                    along(0, a, b) * along(1, b, c) > along(1, a, b) * along(0, b, c),
                    "no turn at {b:?} of {corners:?}"
                );
            }
            for place in places {
                prop_assert!(hull.holds(place), "{place:?} is outside of {corners:?}");
            }
        }
    }
}
