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
    /// Mesa 22.3.6's lavapipe on two cores of an EPYC (Zen 4), 1280 × 1024, read off the scene
    /// `powerplant` at full size and rounded, not fitted: `vfc` takes 98 ns a triangle over 250
    /// frames; batches of `full` with a thousand questions and few triangles take 10 to 20 µs a
    /// question; a batch with one question and one part 0.3 to 0.6 ms. A proxy's true cost grows with
    /// its area and a triangle's with what shows of it, which no figure here knows.
    #[must_use]
    pub fn lavapipe() -> Self {
        Self {
            name: "lavapipe".to_owned(),
            source: "batches of full in powerplant, Mesa 22.3.6, two cores".to_owned(),
            frame_ns: 500_000.0,
            part_ns: 2_000.0,
            triangle_ns: 95.0,
            query_ns: 10_000.0,
            proxy_ns: 4_000.0,
            pixel_ns: 0.0,
            trip_ns: 300_000.0,
        }
    }

    /// The model of a name (`lavapipe`), or that of a calibration file: the fields of this type in
    /// TOML.
    ///
    /// # Errors
    /// One line that names the file, the place and the remedy.
    pub fn open(name_or_file: &str) -> Result<Self, String> {
        if name_or_file == "lavapipe" {
            return Ok(Self::lavapipe());
        }
        let refuse = |what: String| format!("{name_or_file}: {what}");
        let text = std::fs::read_to_string(name_or_file).map_err(|error| {
            refuse(format!("{error}; name a calibration file, or the model lavapipe"))
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
        let by_hand = 500_000 + 2 * 2_000 + 100 * 95 + 3 * 10_000 + 5 * 4_000 + 300 + 300_000;
        assert_eq!(model.frame_total_ns(work), by_hand);
    }

    #[test]
    fn calibration_files_are_read_and_bad_ones_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        let text = toml::to_string(&CostModel::lavapipe()).unwrap();
        std::fs::write(&path, &text).unwrap();
        assert_eq!(CostModel::open(path.to_str().unwrap()), Ok(CostModel::lavapipe()));
        let older = text.replace("pixel_ns = 0.0\n", "");
        assert_ne!(older, text);
        std::fs::write(&path, older).unwrap();
        assert_eq!(CostModel::open(path.to_str().unwrap()), Ok(CostModel::lavapipe()));
        for (from, to, says) in [
            ("95.0", "-1.0", "triangle_ns must be 0 or more, got -1"),
            ("95.0", "nan", "triangle_ns must be 0 or more, got NaN"),
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
