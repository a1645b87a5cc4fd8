//! In: squared residuals of groups. Out: robust costs and weights, and a robust scale.
//! Frame and unit: none; residuals are in units of their sigma (docs/math.md, Least squares (3)).

/// How a group of residuals with squared length s is weighted. Thresholds are in sigmas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Plain least squares.
    Squares,
    /// Quadratic up to k, linear beyond: bounded influence \[huber81\].
    Huber(f64),
    /// log(1 + s/c²): wrong data loses all influence; needs a start near the answer.
    Cauchy(f64),
}

impl Loss {
    /// (cost, weight, slope of the weight) at s = |r|²: rho(s), rho'(s), rho''(s).
    pub fn at(self, s: f64) -> (f64, f64, f64) {
        match self {
            Loss::Squares => (s, 1.0, 0.0),
            Loss::Huber(k) if s <= k * k => (s, 1.0, 0.0),
            Loss::Huber(k) => {
                let r = s.sqrt();
                (2.0 * k * r - k * k, k / r, -0.5 * k / (r * s))
            }
            Loss::Cauchy(c) => {
                let (c2, d) = (c * c, 1.0 + s / (c * c));
                (c2 * d.ln(), 1.0 / d, -1.0 / (c2 * d * d))
            }
        }
    }
}

/// Standard deviation per coordinate from the median length of groups of `size` Gaussian residuals.
/// Half of the groups may be wrong. 0 for no groups.
pub fn robust_scale(lengths: &mut [f64], size: usize) -> f64 {
    if lengths.is_empty() {
        return 0.0;
    }
    let middle = lengths.len() / 2;
    let (_, median, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
    // Median of a chi variable: 0.67449 exactly for 1, and sqrt(2 ln 2) for 2 degrees of freedom;
    // beyond that the Wilson-Hilferty approximation, good to 0.5 %.
    let m = size as f64;
    let chi = match size {
        1 => 0.674_489_75,
        2 => (2.0 * 2f64.ln()).sqrt(),
        _ => (m * (1.0 - 2.0 / (9.0 * m)).powi(3)).sqrt(),
    };
    *median / chi
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_the_derivatives_of_costs() {
        for loss in [Loss::Squares, Loss::Huber(1.5), Loss::Cauchy(2.0)] {
            for s in [0.1, 1.0, 2.0, 5.0, 40.0] {
                let h = 1e-6 * s;
                let (_, w, slope) = loss.at(s);
                assert!(((loss.at(s + h).0 - loss.at(s - h).0) / (2.0 * h) - w).abs() < 1e-7);
                assert!(((loss.at(s + h).1 - loss.at(s - h).1) / (2.0 * h) - slope).abs() < 1e-7);
            }
        }
    }
}
