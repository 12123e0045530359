//! Scatter charts: what something takes across, what it loses upwards, with the front of points that
//! nothing beats. It knows figures and names, nothing of knobs.

use super::drawing::{
    self, BOTTOM, COLORS, GRID, HEIGHT, INK, LEFT, Mark, RIGHT, TOP, WIDTH, short,
};

/// Share of the height that points without loss have for themselves.
const ZERO_BAND: f32 = 0.12;

/// A point of a scatter chart.
#[derive(Clone, Debug)]
pub struct Dot {
    /// Which group it belongs to: its colour.
    pub group: String,
    /// What pointing at it says, and what stands beside it on the front.
    pub name: String,
    /// Across, on a logarithmic scale; finite and ≥ 0.
    pub takes: f64,
    /// Upwards, on a logarithmic scale with a place of its own for 0; finite and ≥ 0.
    pub loses: f64,
    /// Whether nothing beats it: these are joined.
    pub front: bool,
}

/// A chart of points.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// What stands above it.
    pub title: String,
    /// What is across, with its unit.
    pub takes: String,
    /// What is upwards, with its unit.
    pub loses: String,
    /// The points.
    pub dots: Vec<Dot>,
}

impl Scatter {
    /// Groups in the order of their first points.
    fn groups(&self) -> Vec<&str> {
        let mut groups: Vec<&str> = Vec::new();
        for dot in &self.dots {
            if !groups.contains(&dot.group.as_str()) {
                groups.push(&dot.group);
            }
        }
        groups
    }

    /// What the scale across reaches from and to, some room at both ends.
    fn across(&self) -> (f64, f64) {
        let taken = || self.dots.iter().map(|dot| dot.takes).filter(|&takes| takes > 0.0);
        let (least, most) = (taken().fold(f64::INFINITY, f64::min), taken().fold(0.0, f64::max));
        if most > 0.0 { (least / 1.1, most * 1.1) } else { (0.5, 2.0) }
    }

    fn marks(&self) -> Vec<Mark> {
        let (wide, tall) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
        let (least, most) = self.across();
        let x = |takes: f64| {
            let along = |takes: f64| libm::log10(takes.max(least));
            LEFT + wide * ((along(takes) - along(least)) / (along(most) - along(least))) as f32
        };
        let losses = || self.dots.iter().map(|dot| dot.loses).filter(|&loses| loses > 0.0);
        let low = libm::log10(losses().fold(f64::INFINITY, f64::min)).floor();
        let high = libm::log10(losses().fold(0.0, f64::max)).ceil();
        let (low, high) = if low.is_finite() { (low, high.max(low + 1.0)) } else { (0.0, 1.0) };
        let y = |loses: f64| {
            let share = if loses > 0.0 {
                let along = ((libm::log10(loses) - low) / (high - low)) as f32;
                ZERO_BAND + (1.0 - ZERO_BAND) * along
            } else {
                ZERO_BAND * 0.4
            };
            TOP + tall * (1.0 - share)
        };
        let text = |at, align, text: String, color| Mark::Text { at, align, text, color };
        let line = |points, color, width| Mark::Line { points, color, width };
        let mut marks = vec![text([LEFT, 18.0], 0.0, self.title.clone(), INK)];
        marks.push(text([LEFT, 34.0], 0.0, self.loses.clone(), INK));
        let decades = (0..=(high - low) as i32).map(|i| libm::pow(10.0, low + f64::from(i)));
        for loses in std::iter::once(0.0).chain(decades) {
            let at = y(loses);
            marks.push(line(vec![[LEFT, at], [LEFT + wide, at]], GRID, 1.0));
            marks.push(text([LEFT - 6.0, at + 4.0], 1.0, short(loses), INK));
        }
        for takes in ticks(least, most) {
            let (from, to) = ([x(takes), HEIGHT - BOTTOM], [x(takes), HEIGHT - BOTTOM + 4.0]);
            marks.push(line(vec![from, to], INK, 1.0));
            marks.push(text([x(takes), HEIGHT - BOTTOM + 16.0], 0.5, short(takes), INK));
        }
        let middle = [LEFT + wide * 0.5, HEIGHT - 10.0];
        marks.push(text(middle, 0.5, self.takes.clone(), INK));
        let mut front: Vec<&Dot> = self.dots.iter().filter(|dot| dot.front).collect();
        front.sort_by(|a, b| a.takes.total_cmp(&b.takes));
        let corners = front.iter().map(|dot| [x(dot.takes), y(dot.loses)]).collect();
        marks.push(line(corners, INK, 1.2));
        for (number, group) in self.groups().into_iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            for dot in self.dots.iter().filter(|dot| dot.group == group) {
                let radius = if dot.front { 5.0 } else { 3.5 };
                let at = [x(dot.takes), y(dot.loses)];
                marks.push(Mark::Dot { at, radius, color, title: dot.name.clone() });
            }
            let at = TOP + 14.0 * number as f32 + 8.0;
            let from = LEFT + wide + 10.0;
            let title = group.to_owned();
            marks.push(Mark::Dot { at: [from + 6.0, at - 4.0], radius: 4.0, color, title });
            marks.push(text([from + 16.0, at], 0.0, group.to_owned(), INK));
        }
        // Names beside the front's points, none upon another.
        let mut taken: Vec<[f32; 2]> = Vec::new();
        for dot in front {
            let (at, mut down) = ([x(dot.takes), y(dot.loses)], -8.0);
            let meets = |down: f32| {
                taken
                    .iter()
                    .any(|t| (t[1] - at[1] - down).abs() < 12.0 && (t[0] - at[0]).abs() < 200.0)
            };
            while meets(down) && at[1] + down > TOP {
                down -= 12.0;
            }
            taken.push([at[0], at[1] + down]);
            let align = if at[0] > LEFT + wide * 0.6 { 1.0 } else { 0.0 };
            marks.push(text([at[0], at[1] + down], align, dot.name.clone(), INK));
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

/// Ones, twos and fives of each decade within; where they are fewer than three, all whole steps of the
/// largest decade that has more.
fn ticks(least: f64, most: f64) -> Vec<f64> {
    let within = |value: &f64| (least..=most).contains(value);
    let decades = libm::log10(least).floor() as i32..=libm::log10(most).ceil() as i32;
    let fives = decades
        .flat_map(|decade| [1.0, 2.0, 5.0].map(|digit| digit * libm::pow(10.0, f64::from(decade))));
    let fives: Vec<f64> = fives.filter(within).collect();
    if fives.len() >= 3 {
        return fives;
    }
    let step = libm::pow(10.0, libm::log10(most - least).floor() - 1.0);
    let every = [1.0, 2.0, 5.0, 10.0].into_iter().map(|by| by * step);
    let fits = every.into_iter().find(|step| (most - least) / step <= 6.0).unwrap_or(most - least);
    let first = (least / fits).ceil() as i64;
    (0..7).map(|i| (first + i) as f64 * fits).filter(within).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_figures() {
        assert_eq!(ticks(0.4, 30.0), [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
        for (least, most) in [(4.1, 4.6), (4.1, 6.0), (0.011, 0.013), (900.0, 1200.0)] {
            let ticks = ticks(least, most);
            assert!((3..=7).contains(&ticks.len()), "{least} {most}: {ticks:?}");
            assert!(ticks.is_sorted() && ticks.iter().all(|tick| (least..=most).contains(tick)));
        }
    }

    #[test]
    fn every_dot_is_within_and_named() {
        let dot = |takes: f64, loses: f64| Dot {
            group: format!("group {}", loses > 0.0),
            name: format!("{takes} & {loses}"),
            takes,
            loses,
            front: loses == 0.0,
        };
        for dots in
            [vec![], vec![dot(0.0, 0.0)], vec![dot(1.0, 0.0), dot(2.0, 3e-4), dot(9.0, 7e5)]]
        {
            let count = dots.len();
            let (takes, loses) = ("ms".to_owned(), "pixels".to_owned());
            let chart = Scatter { title: "t".to_owned(), takes, loses, dots };
            let mut seen = 0;
            for mark in chart.marks() {
                if let Mark::Dot { at: [x, y], .. } = mark {
                    assert!((LEFT..=WIDTH).contains(&x) && (TOP..=HEIGHT - BOTTOM).contains(&y));
                    seen += 1;
                }
            }
            assert_eq!(seen, count + chart.groups().len());
            assert!(count == 0 || chart.svg().contains("&amp;"));
            assert_eq!(chart.png().width(), WIDTH as u32);
        }
    }
}
