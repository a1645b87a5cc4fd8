//! In: the time from each picture's last byte to its points. Out: median and 99th percentile, in constant memory.
//! Frame and unit: ms.

/// Classes 1 % wide, from a microsecond to a thousand seconds.
const LEAST_MS: f64 = 1e-3;
const WIDTH: f64 = 0.01;
const CLASSES: usize = 2080;

/// Processing times of pictures, counted in classes 1 % wide.
#[derive(Clone, Debug)]
pub struct Delays {
    classes: Vec<u32>,
    count: u64,
}

/// The times below which half and 99 % of the pictures stayed.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    /// The median, ms.
    pub p50_ms: f64,
    /// The 99th percentile, ms.
    pub p99_ms: f64,
}

impl Default for Delays {
    fn default() -> Self {
        Delays { classes: vec![0; CLASSES], count: 0 }
    }
}

impl Delays {
    /// Adds a time.
    pub fn add(&mut self, ms: f64) {
        let class = ((ms / LEAST_MS).max(1.0).ln() / WIDTH) as usize;
        self.classes[class.min(CLASSES - 1)] += 1;
        self.count += 1;
    }

    /// Adds the time from a moment of the host's clock until now.
    pub fn since(&mut self, here_ns: u64) {
        self.add(super::now_ns().saturating_sub(here_ns) as f64 * 1e-6);
    }

    /// The percentiles so far; `None` before the first picture.
    pub fn so_far(&self) -> Option<Delay> {
        (self.count > 0).then(|| Delay { p50_ms: self.percentile(0.5), p99_ms: self.percentile(0.99) })
    }

    /// The middle of the class in which the share is reached, rounded to three digits.
    fn percentile(&self, share: f64) -> f64 {
        let wanted = (share * self.count as f64).ceil().max(1.0) as u64;
        let mut below = 0u64;
        let class = self.classes.iter().position(|n| {
            below += u64::from(*n);
            below >= wanted
        });
        let ms = LEAST_MS * ((class.unwrap_or(CLASSES - 1) as f64 + 0.5) * WIDTH).exp();
        let digits = 10f64.powi(2 - ms.log10().floor() as i32);
        (ms * digits).round() / digits
    }
}

impl std::fmt::Display for Delay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1} ms (median), {:.1} ms (99 %)", self.p50_ms, self.p99_ms)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_right_to_a_hundredth() {
        let mut delays = Delays::default();
        assert_eq!(delays.so_far(), None);
        (1..=1000).for_each(|k| delays.add(f64::from(k) * 0.1));
        let d = delays.so_far().unwrap();
        assert!((d.p50_ms / 50.0 - 1.0).abs() < 0.011 && (d.p99_ms / 99.0 - 1.0).abs() < 0.011, "{d:?}");
        [0.0, 1e-9, 1e12].iter().for_each(|ms| delays.add(*ms));
        assert_eq!(delays.count, 1003);
    }
}
