//! The convex hull of a projected box: a tighter place for its contents than the rectangle, at the same
//! constant depth.
//!
//! # Why the hull is conservative
//! 1. Let every window coordinate of the contents be within a margin (mₓ, m_y) of a point of the exact
//!    projection: the transform bound of [`ClipBox`](super::ClipBox), as for the rectangle, and what window
//!    arithmetic and snapping add to the contents, under 2⁻⁷ + 2⁻⁵ pixel each way. In front of the eye the
//!    exact projection of a convex box is the hull of its projected corners, so the contents lie in that
//!    hull, grown by a rectangle of half sides (mₓ, m_y): a Minkowski sum, which is the hull of the corners
//!    with four points about each.
//! 2. The hull is itself drawn as triangles: its corners are rounded to f32 (2⁻¹¹ pixel within 2¹⁴), go
//!    through window arithmetic (2⁻⁷) and are snapped (2⁻⁵ at most). Corners that move by at most δ along
//!    each axis leave a polygon that holds everything of the old one but a band of δ, so the margin takes
//!    in δ once more. All four together are under 5 · 2⁻⁶; with [`HULL_DILATION_PIXELS`] 3 · 2⁻⁶ are left for
//!    step 3, and a covered sample is strictly inside, so that no rule of edges can lose it. The triangles
//!    of the fan share their inner edges bit for bit: each sample of those belongs to one of them.
//! 3. Hull and clipping are computed in f64. Corners are at most [`MOST_WINDOW`] = 2²⁰ pixels off, so a
//!    cross product of two differences is right within 2⁻⁵⁰ · 2⁴³; edges are at least 2 · 2⁻³ long, so no
//!    point is farther outside of the computed hull than 2⁻⁵ pixel. Clipping to the rectangle moves a new
//!    corner by less than 2⁻³⁰. Beyond that, or with too many corners, the rectangle stands in.
//! 4. Every corner has the same depth and w = 1: interpolation has no slope to err by.

use super::PixelRectangle;

/// Growth of a projected hull beyond its transform bound, derived above.
pub const HULL_DILATION_PIXELS: f64 = 0.125;
/// The farthest corner of a hull from the picture's corner, pixels; see step 3.
const MOST_WINDOW: f64 = 1_048_576.0;
/// Most corners that a hull has. A box shows at most six; growing makes four more, and each side of the
/// rectangle that it is clipped to one more.
pub const MOST_CORNERS: usize = 14;

/// A convex polygon in window space: pixels, row 0 on top. At least three corners, in order, all within the
/// picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hull {
    corners: [[f32; 2]; MOST_CORNERS],
    count: u8,
}

impl Hull {
    /// The hull of `points` grown by `margin` pixels along each axis, within `rectangle`, which holds all
    /// that it may leave out. `None` where a point is too far off or not finite, or there are too many or
    /// too few corners.
    #[must_use]
    pub fn new(points: &[[f64; 2]], margin: [f64; 2], rectangle: &PixelRectangle) -> Option<Self> {
        let near = |c: &f64| c.abs() <= MOST_WINDOW;
        let mut grown = Vec::with_capacity(points.len() * 4);
        for &[x, y] in points {
            for [sx, sy] in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]] {
                grown.push([x + sx * margin[0], y + sy * margin[1]]);
            }
        }
        // Written so that what is no number gives up.
        if !grown.iter().flatten().all(near) {
            return None;
        }
        let mut polygon = convex(grown);
        let PixelRectangle { min, max } = rectangle;
        for axis in 0..2 {
            polygon = clipped(&polygon, |p| p[axis] - f64::from(min[axis]));
            polygon = clipped(&polygon, |p| f64::from(max[axis]) - p[axis]);
        }
        if !(3..=MOST_CORNERS).contains(&polygon.len()) {
            return None;
        }
        let mut corners = [[0.0; 2]; MOST_CORNERS];
        for (corner, point) in corners.iter_mut().zip(&polygon) {
            *corner = point.map(|c| c as f32);
        }
        Some(Self { corners, count: polygon.len() as u8 })
    }

    /// The corners, in order.
    #[must_use]
    pub fn corners(&self) -> &[[f32; 2]] {
        &self.corners[..usize::from(self.count)]
    }

    /// The area, pixels.
    #[must_use]
    pub fn area(&self) -> f64 {
        let wide = |p: [f32; 2]| p.map(f64::from);
        let corners = self.corners();
        let next = corners.iter().cycle().skip(1);
        let twice: f64 = corners
            .iter()
            .zip(next)
            .map(|(&a, &b)| {
                let ([ax, ay], [bx, by]) = (wide(a), wide(b));
                ax * by - bx * ay
            })
            .sum();
        twice.abs() * 0.5
    }

    /// The pixels whose middles are inside or on an edge, row by row: row, first column, one beyond the
    /// last. Rows without any are left out.
    pub fn rows(&self) -> impl Iterator<Item = (u32, u32, u32)> + '_ {
        let ys = || self.corners().iter().map(|corner| f64::from(corner[1]));
        let (low, high) = (ys().fold(f64::INFINITY, f64::min), ys().fold(0.0, f64::max));
        // Within the picture, so not negative.
        let (first, end) = ((low - 0.5).ceil().max(0.0) as u32, (high + 0.5).floor() as u32);
        (first..end).filter_map(move |row| {
            let (x0, x1) = self.span(f64::from(row) + 0.5)?;
            let (from, to) = ((x0 - 0.5).ceil().max(0.0) as u32, (x1 + 0.5).floor() as u32);
            (from < to).then_some((row, from, to))
        })
    }

    /// Where the line at height `y` is inside.
    fn span(&self, y: f64) -> Option<(f64, f64)> {
        let corners = self.corners();
        let mut span: Option<(f64, f64)> = None;
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            let ([ax, ay], [bx, by]) = (a.map(f64::from), b.map(f64::from));
            if y < ay.min(by) || y > ay.max(by) {
                continue;
            }
            let (x0, x1) = if ay == by {
                (ax.min(bx), ax.max(bx))
            } else {
                let x = ax + (bx - ax) * ((y - ay) / (by - ay));
                (x, x)
            };
            span = Some(span.map_or((x0, x1), |(low, high)| (low.min(x0), high.max(x1))));
        }
        span
    }

    /// The smallest rectangle of pixels that holds [`Hull::rows`]; `None` where there are none.
    #[must_use]
    pub fn rectangle(&self) -> Option<PixelRectangle> {
        self.rows().fold(None, |all: Option<PixelRectangle>, (row, from, to)| {
            let (min, max) = ([from, row], [to, row + 1]);
            Some(all.map_or(PixelRectangle { min, max }, |all| PixelRectangle {
                min: [all.min[0].min(from), all.min[1]],
                max: [all.max[0].max(to), row + 1],
            }))
        })
    }
}

/// The convex hull, by Andrew's monotone chain (1979).
fn convex(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let turn = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| {
        (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while let [.., o, a] = chain[..]
                && turn(o, a, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

/// What of a convex polygon is where `inside` is not negative (Sutherland & Hodgman 1974).
fn clipped(polygon: &[[f64; 2]], inside: impl Fn(&[f64; 2]) -> f64) -> Vec<[f64; 2]> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (da, db) = (inside(a), inside(b));
        if da >= 0.0 {
            kept.push(*a);
        }
        if (da < 0.0) != (db < 0.0) {
            let t = da / (da - db);
            kept.push([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const PICTURE: PixelRectangle = PixelRectangle { min: [0, 0], max: [64, 48] };

    fn inside(hull: &Hull, x: f64, y: f64, slack: f64) -> bool {
        let corners = hull.corners();
        corners.iter().zip(corners.iter().cycle().skip(1)).all(|(a, b)| {
            let ([ax, ay], [bx, by]) = (a.map(f64::from), b.map(f64::from));
            let length = (bx - ax).hypot(by - ay).max(1e-9);
            ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / length >= -slack
        })
    }

    proptest! {
        /// Every point of the exact hull, moved by anything within the margin, is inside; and no pixel
        /// stands in it that is farther off than the margin.
        #[test]
        fn it_holds_what_it_must(
            points in proptest::collection::vec((-80.0..150.0_f64, -80.0..120.0_f64), 1..9),
            weights in proptest::collection::vec(0.0..1.0_f64, 9),
            (mx, my) in (0.125..3.0_f64, 0.125..3.0_f64),
            (dx, dy) in (-1.0..1.0_f64, -1.0..1.0_f64),
        ) {
            let points: Vec<[f64; 2]> = points.iter().map(|&(x, y)| [x, y]).collect();
            let Some(hull) = Hull::new(&points, [mx, my], &PICTURE) else { return Ok(()) };
            let sum: f64 = points.iter().zip(&weights).map(|(_, w)| w + 1e-3).sum();
            let at = |axis: usize| {
                points.iter().zip(&weights).map(|(p, w)| p[axis] * (w + 1e-3)).sum::<f64>() / sum
            };
            let (x, y) = (at(0) + dx * mx, at(1) + dy * my);
            if (0.0..=64.0).contains(&x) && (0.0..=48.0).contains(&y) {
                // Corners are rounded to f32.
                prop_assert!(inside(&hull, x, y, 1e-5), "{x} {y} {:?}", hull.corners());
            }
            let bound = |axis: usize, m: f64| {
                let all = || points.iter().map(|p| p[axis]);
                (all().fold(f64::INFINITY, f64::min) - m, all().fold(-1e9, f64::max) + m)
            };
            let ((x0, x1), (y0, y1)) = (bound(0, mx), bound(1, my));
            let mut count = 0;
            for (row, from, to) in hull.rows() {
                for column in from..to {
                    let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
                    prop_assert!(inside(&hull, x, y, 1e-4));
                    prop_assert!(x0 - 1e-4 <= x && x <= x1 + 1e-4 && y0 - 1e-4 <= y && y <= y1 + 1e-4);
                    count += 1;
                }
            }
            // And no pixel is passed over.
            for row in 0..48 {
                for column in 0..64 {
                    let (x, y) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
                    count -= i32::from(inside(&hull, x, y, -1e-4));
                    let edge = inside(&hull, x, y, 1e-4) && !inside(&hull, x, y, -1e-4);
                    count -= i32::from(edge && hull.rows().any(|(r, f, t)| {
                        r == row && (f..t).contains(&column)
                    }));
                }
            }
            prop_assert_eq!(count, 0);
        }
    }

    #[test]
    fn what_cannot_be_a_hull_is_none() {
        let of = |points: &[[f64; 2]]| Hull::new(points, [0.125; 2], &PICTURE);
        assert!(of(&[[1.0, 1.0], [f64::NAN, 2.0]]).is_none());
        assert!(of(&[[1.0, 1.0], [MOST_WINDOW, 2.0]]).is_none(), "over by its margin");
        assert!(of(&[[1.0, 1.0], [MOST_WINDOW - 0.125, 2.0]]).is_some(), "at it");
        assert!(of(&[[-9.0, -9.0]]).is_none(), "wholly outside");
        let dot = of(&[[10.5, 10.5]]).unwrap();
        assert_eq!(dot.rows().collect::<Vec<_>>(), [(10, 10, 11)]);
        assert_eq!((dot.corners().len(), dot.area()), (4, 0.0625));
        let (min, max) = ([10, 10], [11, 11]);
        assert_eq!(dot.rectangle(), Some(PixelRectangle { min, max }));
        assert_eq!(of(&[[10.0, 10.0]]).unwrap().rectangle(), None);
    }
}
