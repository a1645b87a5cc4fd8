//! In: a seed. Out: numbers that look like noise, the same on every machine. Frame and unit: none.

/// A small generator of repeatable noise (a permuted congruential generator would be no better here).
pub struct Noise(pub u64);

impl Noise {
    /// The next number, which has 31 bits.
    pub fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as u32
    }
    /// A number from an approximately normal distribution, mean 0, sigma 1.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| f64::from(self.next() % 65536) / 65536.0).sum::<f64>() - 6.0
    }
}
