//! Probability that a gain is explained by chance alone.

/// Logarithm of the probability that `numbers` useless parameters lower a sum of squares by `gain`, in units of a
/// variance that was estimated from `freedom` squares. It is the tail of Fisher's F distribution. An odd count is
/// rounded up: even counts have a closed form, and the larger count's tail is never the smaller one.
pub fn ln_tail(gain: f64, numbers: usize, freedom: f64) -> f64 {
    let rest = freedom / (freedom + gain.max(0.0));
    let (mut term, mut sum) = (1.0, 1.0);
    for j in 1..numbers.div_ceil(2) {
        let j = j as f64;
        term *= (freedom / 2.0 + j - 1.0) / j * (1.0 - rest);
        sum += term;
    }
    freedom / 2.0 * rest.ln() + sum.ln()
}

/// Logarithm of the number of ways to choose `k` of `n`.
fn ln_ways(n: usize, k: usize) -> f64 {
    (0..k).map(|i| ((n - i) as f64 / (i + 1) as f64).ln()).sum()
}

/// Logarithm of the prior number of sets that are as likely as this one. Half of the prior is for pictures taken
/// consecutively, half for any selection. All sizes up to half of the pictures are equally likely.
pub fn ln_sets(other: &[bool]) -> f64 {
    let n = other.len();
    let k = other.iter().filter(|o| **o).count();
    let begins = (0..n).filter(|&i| other[i] && (i == 0 || !other[i - 1])).count();
    let of_this_size = ln_ways(n, k);
    let run = if begins == 1 { ((n - k + 1) as f64).ln().min(of_this_size) } else { of_this_size };
    2f64.ln() + (n as f64 / 2.0).max(1.0).ln() + run
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // Upper 0.1 % points of F(2, 10) and F(4, 20).
        assert!((ln_tail(2.0 * 14.905, 2, 10.0) - 0.001f64.ln()).abs() < 1e-3);
        assert!((ln_tail(4.0 * 7.096, 4, 20.0) - 0.001f64.ln()).abs() < 1e-3);
        // One and three numbers: F(1, 10) = 21.04 and F(3, 20) = 8.098 at 0.1 %.
        assert!(ln_tail(21.04, 1, 10.0) > 0.001f64.ln() && ln_tail(3.0 * 8.098, 3, 20.0) > 0.001f64.ln());
    }

    #[test]
    fn a_run_of_pictures_is_believed_sooner_than_any_others() {
        let some = |which: &[usize]| ln_sets(&(0..10).map(|i| which.contains(&i)).collect::<Vec<_>>());
        assert!((some(&[3, 4, 5]) - (2.0f64 * 5.0 * 8.0).ln()).abs() < 1e-9);
        assert!((some(&[1, 4, 6]) - (2.0f64 * 5.0 * 120.0).ln()).abs() < 1e-9);
    }
}
