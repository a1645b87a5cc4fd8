//! In: the scatter of a set's pictures relative to their own sigmas, and its degrees of freedom. Out: the factor on
//! a stated variance; which pictures stand out; whether the others may overrule them.
//! Frame and unit: none; squared distances in sigmas.

use super::limits::Judgement;
use crate::rig::Verdict;

/// Share of the pictures that may contradict the others. With more, it is not known which are right.
const CONTRADICTING: f64 = 1.0 / 3.0;
/// Pictures that must agree to overrule contradicting ones, and for the verdict good.
pub const ENOUGH: usize = 5;
/// Three sigmas, squared.
const FAR2: f64 = 9.0;
/// Median of a chi-square with 2 degrees of freedom.
const MEDIAN_OF_TWO: f64 = 2.0 * std::f64::consts::LN_2;

/// The factor on the variance. The scatter itself is estimated from few pictures, so three sigmas shall cover what
/// three sigmas of Student's distribution cover (its expansion at 3 [abramowitz72, 26.7.5]). This widening grows
/// with the excess of the scatter over chance. For three and four pictures it applies in full, because they hardly
/// show whether they scatter.
pub fn inflation(scatter2: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    let student = 1.0 + 2.5 / n + 5.75 / (n * n) + 10.1 / (n * n * n);
    let more = (scatter2 - 1.0).clamp(0.0, 1.0);
    let few = ((9.0 - n) / 4.0).clamp(0.0, 1.0);
    scatter2.max(1.0) * (1.0 + (student - 1.0) * more.max(few)).powi(2)
}

/// The scatter with each excluded picture counted at the limit of doubt, three sigmas (Winsor's variance
/// \[tukey62\]). Where some pictures stand out, others may do so less and go unnoticed. `left_out`: number of
/// excluded pictures, 2 degrees of freedom each.
pub fn winsorised(scatter2: f64, freedom: f64, left_out: usize) -> f64 {
    let (n, k) = (freedom.max(1.0), left_out as f64);
    if left_out == 0 { scatter2 } else { scatter2.max(1.0) * (n + FAR2 * k) / (n + 2.0 * k) }
}

/// Squared distances (2 degrees of freedom each) divided by their usual size among the pictures that count, if that
/// is larger than chance explains. Pictures that all scatter alike are therefore not excluded.
pub fn beside(distances: &[f64], counts: impl Fn(usize) -> bool) -> Vec<f64> {
    let mut sorted: Vec<f64> = (0..distances.len()).filter(|i| counts(*i)).map(|i| distances[i]).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).map_or(1.0, |m| m / MEDIAN_OF_TWO);
    let scale = if middle.is_finite() { middle.max(1.0) } else { 1.0 };
    distances.iter().map(|d| d / scale).collect()
}

/// Lowers the verdict if the agreeing pictures are too few to overrule the contradicting ones.
pub fn overrule(agree: usize, against: usize, j: &mut Judgement) {
    let all = agree + against;
    j.at_best(Verdict::BadlyDetermined, against as f64 > CONTRADICTING * all as f64, || {
        format!("{against} of {all} pictures contradict the others, up to a third may: it is not known who is right")
    });
    j.at_best(Verdict::BadlyDetermined, against > 0 && agree < ENOUGH, || {
        format!("{agree} pictures agree, {ENOUGH} are needed to overrule the others")
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_one_for_many_quiet_pictures_and_students_for_few() {
        assert_eq!(inflation(0.7, 17.0), 1.0);
        // Three sigmas of Student's distribution with 3, 5 and 17 degrees of freedom: 9.22, 5.51, 3.51.
        for (n, t, within) in [(3.0, 9.22, 0.08), (5.0, 5.51, 0.02), (17.0, 3.51, 0.01)] {
            let found = 3.0 * (inflation(2.0, n) / 2.0).sqrt();
            assert!((found / t - 1.0).abs() < within, "{n}: {found} for {t}");
        }
    }

    #[test]
    fn what_is_left_out_still_scatters() {
        assert_eq!(winsorised(0.7, 17.0, 0), 0.7);
        // Ten pictures, one of them excluded: 15 degrees of freedom and two more.
        assert!((winsorised(2.0, 15.0, 1) - 2.0 * 24.0 / 17.0).abs() < 1e-12);
        assert!(winsorised(0.5, 7.0, 2) > 2.0);
    }

    #[test]
    fn one_that_stands_out_does_so_beside_loud_ones_too() {
        let quiet = beside(&[1.0, 2.0, 1.5, 90.0], |_| true);
        assert!(quiet[3] > 60.0 && quiet[0] < 1.01);
        let loud = beside(&[60.0, 50.0, 70.0, 90.0], |_| true);
        assert!(loud.iter().all(|d| *d < 3.0), "{loud:?}");
    }
}
