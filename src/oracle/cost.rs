//! Cost models: what a frame's work costs a device, in nanoseconds of virtual time. Named models have
//! their source beside them; others are read from the calibration files that `calibrate` writes, so
//! that whoever uses one (an adaptive culler, the virtual clock) stays reproducible.

use serde::{Deserialize, Serialize};

/// Nanoseconds by kind of work; virtual time is their weighted sum, all ≥ 0 and finite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CostModel {
    /// Name for traces and reports.
    pub name: String,
    /// Where the figures come from.
    pub source: String,
    /// A frame with nothing in it.
    pub frame_ns: f64,
    /// A part drawn, apart from its triangles.
    pub part_ns: f64,
    /// A triangle drawn.
    pub triangle_ns: f64,
    /// A question, apart from its proxies.
    pub query_ns: f64,
    /// A proxy asked about.
    pub proxy_ns: f64,
    /// A sample of a rectangle asked about; a file without it prices none.
    #[serde(default)]
    pub pixel_ns: f64,
    /// Waiting for a batch of answers.
    pub trip_ns: f64,
}

/// Amounts of work, as a cost model weighs them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Amounts {
    /// Parts drawn.
    pub parts: u64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Questions asked.
    pub queries: u64,
    /// Proxies in them.
    pub proxies: u64,
    /// Samples of the rectangles among them; what a box covers is not known and counts none.
    pub pixels: u64,
    /// Batches waited for.
    pub trips: u64,
}

impl CostModel {
    /// Mesa 22.3.6's lavapipe, 256 bits wide, on two cores of an EPYC (Zen 4), 1280 × 1024, questions by
    /// query objects: between what `calibrate --full-size` fits to `powerplant` (triangle 90 ns, part
    /// 5.9 µs, query 18 µs, pixel 0.8 ns, trip 0.32 ms; half of its measurements within 19 %) and to
    /// `bunnies` (73 ns, 8.3 µs, 12 µs, proxy 0.9 µs, pixel 0.7 ns, 0.25 ms; within 11 %).
    #[must_use]
    pub fn lavapipe() -> Self {
        Self {
            name: "lavapipe".to_owned(),
            source: "calibrate on powerplant and bunnies, Mesa 22.3.6, two cores".to_owned(),
            frame_ns: 600_000.0,
            part_ns: 7_000.0,
            triangle_ns: 80.0,
            query_ns: 15_000.0,
            proxy_ns: 500.0,
            pixel_ns: 0.75,
            trip_ns: 300_000.0,
        }
    }

    /// The same device with questions answered from depths that are read back: between the fits to
    /// `powerplant` (query 0.2 µs, pixel 0.08 ns, trip 0.83 ms) and `bunnies` (1.4 µs, proxy 0.1 µs,
    /// 0.23 ns, 0.63 ms); drawing costs the same.
    #[must_use]
    pub fn lavapipe_read_back() -> Self {
        Self {
            name: "lavapipe-read-back".to_owned(),
            query_ns: 800.0,
            proxy_ns: 50.0,
            pixel_ns: 0.15,
            trip_ns: 730_000.0,
            ..Self::lavapipe()
        }
    }

    /// An NVIDIA H100 (driver 580.159.04) behind an EPYC, as `calibrate` fits it to `powerplant`: half of
    /// its measurements within 8 %, nineteen in twenty within 29 %. Beside lavapipe a triangle costs a
    /// sixtieth, a pixel a hundredth and a round trip a third, so that a question saves far less than it
    /// costs unless it hides tens of thousands of triangles.
    #[must_use]
    pub fn h100() -> Self {
        Self {
            name: "h100".to_owned(),
            source: "calibrate on powerplant, NVIDIA H100, driver 580.159.04".to_owned(),
            frame_ns: 180_000.0,
            part_ns: 250.0,
            triangle_ns: 1.36,
            query_ns: 1_130.0,
            proxy_ns: 50.0,
            pixel_ns: 0.005,
            trip_ns: 104_000.0,
        }
    }

    /// Those that have a name.
    #[must_use]
    pub fn named() -> [Self; 3] {
        [Self::lavapipe(), Self::lavapipe_read_back(), Self::h100()]
    }

    /// The model of a name (`lavapipe`, `lavapipe-read-back`, `h100`), or that of a calibration file: the
    /// fields of this type in TOML.
    ///
    /// # Errors
    /// One line that names the file, the place and the remedy.
    pub fn open(name_or_file: &str) -> Result<Self, String> {
        if let Some(model) = Self::named().into_iter().find(|model| model.name == name_or_file) {
            return Ok(model);
        }
        let refuse = |what: String| format!("{name_or_file}: {what}");
        let text = std::fs::read_to_string(name_or_file).map_err(|error| {
            refuse(format!(
                "{error}; name a calibration file, or the model lavapipe, lavapipe-read-back or h100"
            ))
        })?;
        let model: Self =
            toml::from_str(&text).map_err(|error| refuse(error.message().replace('\n', " ")))?;
        let figures = [
            ("frame_ns", model.frame_ns),
            ("part_ns", model.part_ns),
            ("triangle_ns", model.triangle_ns),
            ("query_ns", model.query_ns),
            ("proxy_ns", model.proxy_ns),
            ("pixel_ns", model.pixel_ns),
            ("trip_ns", model.trip_ns),
        ];
        match figures.iter().find(|(_, figure)| !(figure.is_finite() && *figure >= 0.0)) {
            Some((field, figure)) => {
                Err(refuse(format!("{field} must be 0 or more, got {figure}")))
            }
            None => Ok(model),
        }
    }

    /// Drawing so many parts of so many triangles together.
    #[must_use]
    pub fn drawing_ns(&self, parts: u64, triangles: u64) -> f64 {
        self.part_ns * parts as f64 + self.triangle_ns * triangles as f64
    }

    /// Asking so many questions about so many proxies, of so many samples together, the waiting apart.
    #[must_use]
    pub fn asking_ns(&self, queries: u64, proxies: u64, pixels: u64) -> f64 {
        self.query_ns * queries as f64
            + self.proxy_ns * proxies as f64
            + self.pixel_ns * pixels as f64
    }

    /// A whole frame, rounded to a nanosecond.
    #[must_use]
    pub fn frame_total_ns(&self, work: Amounts) -> u64 {
        let asking = self.asking_ns(work.queries, work.proxies, work.pixels)
            + self.trip_ns * work.trips as f64;
        (self.frame_ns + self.drawing_ns(work.parts, work.triangles) + asking).round() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn virtual_time_is_the_weighted_sum() {
        let work =
            Amounts { parts: 2, triangles: 100, queries: 3, proxies: 5, pixels: 600, trips: 1 };
        let model = CostModel { pixel_ns: 0.5, ..CostModel::lavapipe() };
        let by_hand = 600_000 + 2 * 7_000 + 100 * 80 + 3 * 15_000 + 5 * 500 + 300 + 300_000;
        assert_eq!(model.frame_total_ns(work), by_hand);
    }

    #[test]
    fn calibration_files_are_read_and_bad_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let text = toml::to_string(&CostModel::lavapipe()).unwrap();
        std::fs::write(&path, &text).unwrap();
        assert_eq!(CostModel::open(path.to_str().unwrap()), Ok(CostModel::lavapipe()));
        let older = text.replace("pixel_ns = 0.75\n", "");
        assert_ne!(older, text);
        std::fs::write(&path, older).unwrap();
        let without_pixels = CostModel { pixel_ns: 0.0, ..CostModel::lavapipe() };
        assert_eq!(CostModel::open(path.to_str().unwrap()), Ok(without_pixels));
        assert_eq!(CostModel::open("lavapipe-read-back"), Ok(CostModel::lavapipe_read_back()));
        for (from, to, says) in [
            ("80.0", "-1.0", "triangle_ns must be 0 or more, got -1"),
            ("80.0", "nan", "triangle_ns must be 0 or more, got NaN"),
            ("triangle_ns", "triangel_ns", "triangel_ns"),
            ("pixel_ns", "pixle_ns", "pixle_ns"),
        ] {
            std::fs::write(&path, text.replace(from, to)).unwrap();
            let error = CostModel::open(path.to_str().unwrap()).unwrap_err();
            assert!(error.contains(says) && !error.contains('\n'), "{error}");
        }
        assert!(CostModel::open("nowhere.toml").unwrap_err().contains("name a calibration file"));
    }
}
