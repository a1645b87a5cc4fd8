//! In: the points of a cloud, chunk by chunk. Out: the median of their standard deviations, in memory that does not
//! grow.
//! Frame and unit: mm.

use crate::scan::CloudPoint;

const BINS: usize = 240;

/// Histogram of log10(sigma / mm) from -5 to 1 in 240 steps of 0.025 (6 % a step).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Spread(Vec<u64>);

impl Default for Spread {
    fn default() -> Spread {
        Spread(vec![0; BINS])
    }
}

impl Spread {
    pub fn add(&mut self, points: &[CloudPoint]) {
        for p in points {
            let bin = ((f64::from(p.sigma_mm).max(1e-30).log10() + 5.0) * 40.0).clamp(0.0, BINS as f64 - 1.0);
            self.0[bin as usize] += 1;
        }
    }

    /// The median to 3 %; `None` without points.
    pub fn median_mm(&self) -> Option<f64> {
        // A damaged checkpoint may contain any numbers.
        let half = self.0.iter().map(|n| u128::from(*n)).sum::<u128>().div_ceil(2);
        let mut sum = 0;
        let bin = self.0.iter().position(|n| {
            sum += u128::from(*n);
            half > 0 && sum >= half
        });
        bin.map(|b| 10f64.powf((b as f64 + 0.5) / 40.0 - 5.0))
    }

    /// A remark on a wrong number of bins, as another version would have.
    pub fn strange(&self) -> Option<String> {
        let has = self.0.len();
        (has != BINS).then(|| format!("has {has} steps of sigma, {BINS} are needed"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_points() {
        let of = |sigma_mm: f32| CloudPoint { sigma_mm, ..Default::default() };
        let mut spread = Spread::default();
        assert_eq!(spread.median_mm(), None);
        spread.add(&[of(0.01), of(0.02), of(0.3)]);
        assert!((spread.median_mm().unwrap() / 0.02 - 1.0).abs() < 0.03);
        // Values outside the histogram are counted in its end bins.
        spread.add(&[of(f32::INFINITY), of(0.0)]);
        assert!((spread.median_mm().unwrap() / 0.02 - 1.0).abs() < 0.03);
    }
}
