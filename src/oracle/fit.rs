//! Fits the prices of a cost model to measured frames: least squares of the *relative* error under
//! prices that may not be negative. It must not know how anything is measured.
//!
//! An error is relative to the *measured* time. Where measurements disagree, the fit thereby leans to
//! the faster ones, which is right: what disturbs a machine makes it slower, never quicker.
//!
//! The least squares without a negative price are the plain least squares over the columns whose price
//! is above zero (Lawson & Hanson 1974, chapter 23). There are seven columns, so all 127 choices of
//! them are solved and the best admissible one is taken: exact, and without iterations to bound.

use super::{Amounts, CostModel};

/// Prices of a model: frame, part, triangle, query, proxy, pixel, trip.
const COLUMNS: usize = 7;
/// Where less than this is left of the square of a column of length 1 once the columns before it are
/// taken off, it says nothing of its own and a choice with it is passed over. Rounding leaves of such a
/// column at most about (10⁻¹⁶ · measurements)², far below; a column that differs from the others by a
/// hundred-thousandth of itself still counts.
const LEAST_LEFT: f64 = 1e-10;

/// A frame's work and how long a device took for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// What was done.
    pub work: Amounts,
    /// Nanoseconds it took, above 0 and finite.
    pub ns: f64,
}

/// How far a model is from measurements: |modelled − measured| ÷ measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitError {
    /// Half of the measurements are no farther off.
    pub median: f64,
    /// 95 in 100 are no farther off.
    pub p95: f64,
}

impl CostModel {
    /// The prices, none negative, with the least sum of squared relative errors over `measurements`. A
    /// price that nothing was measured of is 0. Name and source are the caller's.
    ///
    /// # Panics
    /// Where a time is not above 0 and finite.
    #[must_use]
    pub fn fitted(name: String, source: String, measurements: &[Measurement]) -> Self {
        let [frame_ns, part_ns, triangle_ns, query_ns, proxy_ns, pixel_ns, trip_ns] =
            prices(measurements);
        Self { name, source, frame_ns, part_ns, triangle_ns, query_ns, proxy_ns, pixel_ns, trip_ns }
    }

    /// How far the model is from `measurements`.
    ///
    /// # Panics
    /// Where there are none.
    #[must_use]
    pub fn error_over(&self, measurements: &[Measurement]) -> FitError {
        assert!(!measurements.is_empty(), "an error is one over measurements");
        let error = |m: &Measurement| (self.frame_total_ns(m.work) as f64 - m.ns).abs() / m.ns;
        let mut errors: Vec<f64> = measurements.iter().map(error).collect();
        errors.sort_by(f64::total_cmp);
        // The least figure that so many hundredths do not exceed.
        let at = |hundredths: usize| errors[(errors.len() * hundredths).div_ceil(100) - 1];
        FitError { median: at(50), p95: at(95) }
    }
}

/// See [`CostModel::fitted`].
fn prices(measurements: &[Measurement]) -> [f64; COLUMNS] {
    // Divided by its time, each measurement asks for 1: what is left over is the relative error.
    let rows: Vec<[f64; COLUMNS]> = measurements.iter().map(row).collect();
    // Columns of length 1, so that one threshold fits prices of any size.
    let square = |column: usize| rows.iter().map(|row| row[column] * row[column]).sum::<f64>();
    let length: [f64; COLUMNS] = std::array::from_fn(|c| square(c).sqrt());
    let scaled = |row: &[f64; COLUMNS], c: usize| {
        if length[c] > 0.0 { row[c] / length[c] } else { 0.0 }
    };
    let rows: Vec<[f64; COLUMNS]> =
        rows.iter().map(|row| std::array::from_fn(|c| scaled(row, c))).collect();
    let left = |x: &[f64; COLUMNS]| -> f64 {
        let off = |row: &[f64; COLUMNS]| 1.0 - row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        rows.iter().map(|row| off(row) * off(row)).sum()
    };
    let mut best = [0.0; COLUMNS];
    let mut least = left(&best);
    for mask in 1_u32..1 << COLUMNS {
        let chosen: Vec<usize> = (0..COLUMNS).filter(|&c| mask >> c & 1 == 1).collect();
        let Some(x) = solve(&rows, &chosen) else { continue };
        if x.iter().all(|&price| price >= 0.0) && left(&x) < least {
            (best, least) = (x, left(&x));
        }
    }
    std::array::from_fn(|c| if length[c] > 0.0 { best[c] / length[c] } else { 0.0 })
}

/// A measurement's work, per nanosecond that it took.
fn row(measurement: &Measurement) -> [f64; COLUMNS] {
    let Measurement { work, ns } = *measurement;
    assert!(ns > 0.0 && ns.is_finite(), "a frame takes time, got {ns} ns");
    [1, work.parts, work.triangles, work.queries, work.proxies, work.pixels, work.trips]
        .map(|amount: u64| amount as f64 / ns)
}

/// Least squares over the chosen columns (of length 1), the others 0, by modified Gram-Schmidt: what is
/// left of each column and of the right side once the columns before it are taken off. `None` where a
/// column says nothing of its own.
fn solve(rows: &[[f64; COLUMNS]], chosen: &[usize]) -> Option<[f64; COLUMNS]> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut columns: Vec<Vec<f64>> =
        chosen.iter().map(|&c| rows.iter().map(|row| row[c]).collect()).collect();
    columns.push(vec![1.0; rows.len()]);
    let count = chosen.len();
    // Each column's share of each column after it, the right side last.
    let mut shares = vec![vec![0.0; count + 1]; count];
    for this in 0..count {
        let (before, after) = columns.split_at_mut(this + 1);
        let own = &before[this];
        let square = dot(own, own);
        if square < LEAST_LEFT {
            return None;
        }
        for (column, share) in after.iter_mut().zip(&mut shares[this][this + 1..]) {
            *share = dot(own, column) / square;
            column.iter_mut().zip(own).for_each(|(value, own)| *value -= *share * own);
        }
    }
    let mut x = [0.0; COLUMNS];
    for this in (0..count).rev() {
        let later: f64 = (this + 1..count).map(|c| shares[this][c] * x[chosen[c]]).sum();
        x[chosen[this]] = shares[this][count] - later;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Stream;

    const KNOWN: [f64; COLUMNS] = [450_000.0, 1_900.0, 83.0, 8_000.0, 2_500.0, 0.4, 210_000.0];

    fn model(
        [frame_ns, part_ns, triangle_ns, query_ns, proxy_ns, pixel_ns, trip_ns]: [f64; 7],
    ) -> CostModel {
        let (name, source) = (String::new(), String::new());
        CostModel {
            name,
            source,
            frame_ns,
            part_ns,
            triangle_ns,
            query_ns,
            proxy_ns,
            pixel_ns,
            trip_ns,
        }
    }

    /// Random work and what it costs by `known`, each time off by up to `noise` of itself.
    fn measured(known: [f64; COLUMNS], noise: f64) -> Vec<Measurement> {
        let mut stream = Stream::new(11, "fit");
        let mut work = || {
            let queries = u64::from(stream.below(800));
            let parts = u64::from(stream.below(900));
            Amounts {
                parts,
                triangles: parts * u64::from(stream.below(3000)),
                queries,
                proxies: queries * u64::from(1 + stream.below(8)),
                pixels: queries * u64::from(stream.below(40_000)),
                trips: u64::from(stream.below(30)),
            }
        };
        let works: Vec<Amounts> = (0..150).map(|_| work()).collect();
        let mut stream = Stream::new(11, "noise");
        let off = |work: Amounts| {
            let exact = model(known).frame_total_ns(work) as f64;
            Measurement { work, ns: exact * stream.range(1.0 - noise, 1.0 + noise) }
        };
        works.into_iter().map(off).collect()
    }

    fn assert_near(found: [f64; COLUMNS], known: [f64; COLUMNS], share: f64) {
        for (found, known) in found.into_iter().zip(known) {
            assert!((found - known).abs() <= share * known, "{found} is not {known}");
        }
    }

    #[test]
    fn exact_measurements_give_the_prices_back() {
        // Times are whole nanoseconds: exact but for that.
        let measurements = measured(KNOWN, 0.0);
        assert_near(prices(&measurements), KNOWN, 1e-6);
        let fitted = CostModel::fitted("n".to_owned(), "s".to_owned(), &measurements);
        assert!(fitted.error_over(&measurements).p95 < 1e-6);
        assert_eq!((fitted.name.as_str(), fitted.source.as_str()), ("n", "s"));
    }

    #[test]
    fn noisy_measurements_give_prices_near() {
        let measurements = measured(KNOWN, 0.05);
        assert_near(prices(&measurements), KNOWN, 0.15);
        let error = model(prices(&measurements)).error_over(&measurements);
        assert!((0.01..0.05).contains(&error.median) && error.p95 < 0.08, "{error:?}");
    }

    /// A column that is worth a negative price is worth none, and the others make the best of it.
    #[test]
    fn no_price_is_negative() {
        let mut measurements = measured(KNOWN, 0.0);
        for m in &mut measurements {
            m.ns = (m.ns - 2_600.0 * m.work.proxies as f64).max(1_000.0);
        }
        let found = prices(&measurements);
        assert!(found.iter().all(|&price| price >= 0.0), "{found:?}");
        assert!(found[4] == 0.0 && found[2] > 0.0, "{found:?}");
        // Nothing near it is better: the conditions of Karush, Kuhn and Tucker, felt by hand.
        let squares = |prices: [f64; COLUMNS]| -> f64 {
            let off =
                |m: &Measurement| 1.0 - row(m).iter().zip(prices).map(|(a, x)| a * x).sum::<f64>();
            measurements.iter().map(|m| off(m) * off(m)).sum()
        };
        for column in 0..COLUMNS {
            for factor in [0.99, 1.01] {
                let mut other = found;
                other[column] = other[column].max(0.001) * factor;
                assert!(squares(other) >= squares(found), "price {column} times {factor}");
            }
        }
    }

    #[test]
    fn what_was_not_measured_costs_nothing() {
        let mut measurements = measured(KNOWN, 0.0);
        for m in &mut measurements {
            m.ns -= KNOWN[5] * m.work.pixels as f64 + KNOWN[6] * m.work.trips as f64;
            (m.work.pixels, m.work.trips) = (0, 0);
        }
        let [known @ .., _, _] = KNOWN;
        let found = prices(&measurements);
        for (found, known) in found.into_iter().zip(known) {
            assert!((found - known).abs() <= 1e-6 * known, "{found} is not {known}");
        }
        assert_eq!(found[5..], [0.0, 0.0]);
        assert_eq!(prices(&[]), [0.0; COLUMNS]);
    }

    /// Two columns that always go together: one of them gets the price of both.
    #[test]
    fn columns_that_cannot_be_told_apart_are_priced_once() {
        let mut measurements = measured(KNOWN, 0.0);
        for m in &mut measurements {
            m.ns -= KNOWN[4] * (m.work.proxies - m.work.queries) as f64;
            m.work.proxies = m.work.queries;
        }
        let found = prices(&measurements);
        assert!((found[3] + found[4] - KNOWN[3] - KNOWN[4]).abs() < 0.01, "{found:?}");
        assert!(found[3] == 0.0 || found[4] == 0.0, "{found:?}");
    }
}
