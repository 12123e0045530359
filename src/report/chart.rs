//! Line charts of figures per frame. It knows figures and names, nothing of scenes.

use super::drawing::{
    self, BOTTOM, COLORS, GRID, HEIGHT, INK, LEFT, Mark, RIGHT, TOP, WIDTH, short,
};

/// One line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the legend says.
    pub name: String,
    /// One figure a frame, finite and ≥ 0.
    pub values: Vec<f64>,
}

/// A chart over the frames of a run.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What stands above it.
    pub title: String,
    /// What is counted, with its unit.
    pub unit: String,
    /// The lines; those beyond the seventh begin the colours again.
    pub series: Vec<Series>,
    /// Whether the scale is logarithmic; figures of zero then stand at the bottom.
    pub logarithmic: bool,
}

impl Chart {
    /// The range of the scale, and the values at which it has lines.
    fn scale(&self) -> (f64, f64, Vec<f64>) {
        let values = || self.series.iter().flat_map(|s| s.values.iter().copied());
        let most = values().fold(0.0_f64, f64::max).max(f64::MIN_POSITIVE);
        if self.logarithmic {
            let least = values().filter(|&v| v > 0.0).fold(most, f64::min);
            let (low, high) = (libm::log10(least).floor(), libm::log10(most).ceil());
            let high = if high > low { high } else { low + 1.0 };
            let lines = (0..=(high - low) as i32).map(|i| libm::pow(10.0, low + f64::from(i)));
            return (low, high, lines.collect());
        }
        let decade = libm::pow(10.0, libm::log10(most).floor());
        let fits = |step: &f64| most / step <= 6.0;
        let steps = [0.2, 0.5, 1.0, 2.0].map(|step| step * decade);
        let step = steps.into_iter().find(fits).unwrap_or(decade * 2.0);
        let count = (most / step).ceil();
        (0.0, count * step, (0..=count as u32).map(|i| f64::from(i) * step).collect())
    }

    fn marks(&self) -> Vec<Mark> {
        let (low, high, lines) = self.scale();
        let frames = self.series.iter().map(|s| s.values.len()).max().unwrap_or(0);
        let (wide, tall) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
        let x = |frame: usize| LEFT + wide * frame as f32 / (frames.max(2) - 1) as f32;
        let y = |value: f64| {
            let value = if self.logarithmic { libm::log10(value.max(1e-300)) } else { value };
            TOP + tall * (1.0 - ((value - low) / (high - low)).clamp(0.0, 1.0)) as f32
        };
        let text = |at, align, text: String, color| Mark::Text { at, align, text, color };
        let mut marks = vec![text([LEFT, 18.0], 0.0, self.title.clone(), INK)];
        marks.push(text([LEFT, 34.0], 0.0, self.unit.clone(), INK));
        for value in lines {
            let at = y(value);
            let points = vec![[LEFT, at], [LEFT + wide, at]];
            marks.push(Mark::Line { points, color: GRID, width: 1.0 });
            marks.push(text([LEFT - 6.0, at + 4.0], 1.0, short(value), INK));
        }
        for i in 0..=5 {
            let frame = frames.saturating_sub(1) * i / 5;
            let at = [x(frame), HEIGHT - BOTTOM + 16.0];
            marks.push(text(at, 0.5, frame.to_string(), INK));
        }
        let middle = [LEFT + wide * 0.5, HEIGHT - 10.0];
        marks.push(text(middle, 0.5, "frame".to_owned(), INK));
        for (number, series) in self.series.iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            let points = series.values.iter().enumerate().map(|(i, &v)| [x(i), y(v)]).collect();
            marks.push(Mark::Line { points, color, width: 1.6 });
            let at = TOP + 14.0 * number as f32 + 8.0;
            let from = LEFT + wide + 10.0;
            let points = vec![[from, at - 3.0], [from + 14.0, at - 3.0]];
            marks.push(Mark::Line { points, color, width: 3.0 });
            marks.push(text([from + 20.0, at], 0.0, series.name.clone(), INK));
        }
        marks
    }

    /// The chart as a standalone SVG document.
    #[must_use]
    pub fn svg(&self) -> String {
        drawing::svg(self.marks())
    }

    /// The chart as a picture.
    #[must_use]
    pub fn png(&self) -> image::RgbImage {
        drawing::png(self.marks())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(values: Vec<f64>, logarithmic: bool) -> Chart {
        let series = vec![Series { name: "a < b".to_owned(), values }];
        Chart { title: "t".to_owned(), unit: "ms".to_owned(), series, logarithmic }
    }

    #[test]
    fn the_scale_holds_every_figure() {
        for values in [vec![], vec![0.0], vec![3.0, 7.2], vec![0.004, 9e6]] {
            for logarithmic in [false, true] {
                let chart = chart(values.clone(), logarithmic);
                let (low, high, lines) = chart.scale();
                assert!(high > low && lines.len() >= 2 && lines.len() <= 20, "{values:?}");
                let most = values.iter().copied().fold(0.0, f64::max);
                let top = if logarithmic { libm::pow(10.0, high) } else { high };
                assert!(top >= most * 0.999, "{values:?} {high}");
            }
        }
    }

    #[test]
    fn names_are_escaped_and_both_forms_have_the_marks() {
        let chart = chart(vec![1.0, 2.0, 4.0], false);
        assert!(chart.svg().contains("a &lt; b"));
        let blue = COLORS[0];
        assert!(chart.png().pixels().any(|p| p.0 == blue));
    }
}
