//! Charts are marks: lines, dots and letters, drawn as SVG and as PNG, so that the two never differ.

use font8x8::legacy::BASIC_LEGACY;
use tiny_skia::{Color, FillRule, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// Pixels of a chart.
pub(super) const WIDTH: f32 = 900.0;
/// Pixels of a chart.
pub(super) const HEIGHT: f32 = 420.0;
/// Room for the scale on the left, the title above, the legend on the right, the frames below.
pub(super) const LEFT: f32 = 84.0;
/// See `LEFT`.
pub(super) const TOP: f32 = 44.0;
/// See `LEFT`.
pub(super) const RIGHT: f32 = 150.0;
/// See `LEFT`.
pub(super) const BOTTOM: f32 = 48.0;
/// Side of a letter.
pub(super) const LETTER: f32 = 8.0;
/// Colours of the series, told apart also by those who do not see red and green (Okabe & Ito 2008).
pub(super) const COLORS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [80, 80, 80],
];
pub(super) const INK: [u8; 3] = [40, 40, 40];
pub(super) const GRID: [u8; 3] = [222, 222, 222];

/// What a chart is drawn of.
pub(super) enum Mark {
    Line {
        points: Vec<[f32; 2]>,
        color: [u8; 3],
        width: f32,
    },
    Dot {
        at: [f32; 2],
        radius: f32,
        color: [u8; 3],
        /// What pointing at it says.
        title: String,
    },
    /// `align`: 0 begins at the point, 1 ends there, ½ is in the middle.
    Text {
        at: [f32; 2],
        align: f32,
        text: String,
        color: [u8; 3],
    },
}

/// The marks as a standalone SVG document.
pub(super) fn svg(marks: Vec<Mark>) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"monospace\" font-size=\"13\">\n\
<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let rgb = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
    for mark in marks {
        out += &match mark {
            Mark::Line { points, color, width } => {
                let points: Vec<String> =
                    points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
                format!(
                    "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" points=\"{}\"/>\n",
                    rgb(color),
                    points.join(" ")
                )
            }
            Mark::Dot { at: [x, y], radius, color, title } => format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{}\"><title>{}</title></circle>\n",
                rgb(color),
                escaped(&title)
            ),
            Mark::Text { at: [x, y], align, text, color } => {
                let anchor = ["start", "middle", "end"][(align * 2.0) as usize];
                let text = escaped(&text);
                format!(
                    "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{}\">{text}</text>\n",
                    rgb(color)
                )
            }
        };
    }
    out + "</svg>\n"
}

/// The marks as a picture.
pub(super) fn png(marks: Vec<Mark>) -> image::RgbImage {
    let mut map = Pixmap::new(WIDTH as u32, HEIGHT as u32).expect("the size is not zero");
    map.fill(Color::WHITE);
    for mark in marks {
        let (Mark::Line { color: [r, g, b], .. }
        | Mark::Dot { color: [r, g, b], .. }
        | Mark::Text { color: [r, g, b], .. }) = mark;
        let mut paint = Paint::default();
        paint.set_color_rgba8(r, g, b, 255);
        match mark {
            Mark::Line { points, width, .. } => {
                let mut path = PathBuilder::new();
                for (i, [x, y]) in points.into_iter().enumerate() {
                    if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
                }
                let stroke = Stroke { width, ..Stroke::default() };
                if let Some(path) = path.finish() {
                    map.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
                }
            }
            Mark::Dot { at: [x, y], radius, .. } => {
                if let Some(circle) = PathBuilder::from_circle(x, y, radius) {
                    paint.anti_alias = true;
                    map.fill_path(&circle, &paint, FillRule::Winding, Transform::identity(), None);
                }
            }
            Mark::Text { at: [x, y], align, text, .. } => {
                let from = x - align * LETTER * text.chars().count() as f32;
                for (i, letter) in text.chars().enumerate() {
                    let at = [from.round() + LETTER * i as f32, y.round() - LETTER];
                    write_letter(&mut map, letter, at, &paint);
                }
            }
        }
    }
    let bytes = map.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    image::RgbImage::from_raw(map.width(), map.height(), bytes).expect("three bytes a pixel")
}

/// One letter, as a square for each of its 8 × 8 dots.
fn write_letter(map: &mut Pixmap, letter: char, [x, y]: [f32; 2], paint: &Paint<'_>) {
    let rows = BASIC_LEGACY.get(letter as usize).copied().unwrap_or([0; 8]);
    for (row, dots) in rows.into_iter().enumerate() {
        for column in (0..8).filter(|column| dots >> column & 1 == 1) {
            let dot = Rect::from_xywh(x + column as f32, y + row as f32, 1.0, 1.0);
            if let Some(dot) = dot {
                map.fill_rect(dot, paint, Transform::identity(), None);
            }
        }
    }
}

/// A figure in few letters.
pub(super) fn short(value: f64) -> String {
    let plain = |value: f64| {
        let text = format!("{value:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    if value >= 1e6 {
        format!("{}M", plain(value / 1e6))
    } else if value >= 1e4 {
        format!("{}k", plain(value / 1e3))
    } else if value >= 0.01 || value == 0.0 {
        plain(value)
    } else {
        format!("{value:.0e}")
    }
}

/// Text as XML takes it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
