//! A factor between the robot's lengths and the board's: another unit, or a board of another size.

use super::explanation::Explanation;
use super::present::Present;
use crate::calibrate::hand_eye::closed::{Pair, agree, robot_scale};
use crate::calibrate::hand_eye::options::HandEyeOptions;
use crate::geometry::Rigid;

/// Relative difference between the lengths of robot and board up to which neither counts as wrong.
const TOLERANCE: f64 = 0.01;

/// The pairs with the robot's lengths multiplied by `scale`.
fn scaled(pairs: &[Pair], scale: f64) -> Vec<Pair> {
    let at = |p: &Pair| p.at(Rigid::new(p.near_from_far.rotation, p.near_from_far.translation * scale));
    pairs.iter().map(at).collect()
}

/// A factor on the robot's lengths that improves the agreement at least twofold, both in the median and over all
/// pairs.
pub fn explain(now: &Present<'_>, o: &HandEyeOptions) -> Option<Explanation> {
    let before = agree(now.pairs, now.seed)?;
    let of = |pairs: Vec<&Pair>| robot_scale(&pairs).filter(|s| *s > 0.0 && (s - 1.0).abs() > TOLERANCE);
    let agreeing = of(before.agreeing.iter().map(|&i| &now.pairs[i]).collect());
    let candidates = [agreeing, of(now.pairs.iter().collect())];
    let fitting = candidates.into_iter().flatten().filter_map(|scale| {
        let then = scaled(now.pairs, scale);
        // The median of few pairs halves by chance; the sum of squares of all agreeing pairs does not.
        let median = agree(&then, now.seed)?.spread;
        (median < 0.5 * before.spread).then(|| now.better(&then, 2.0)).flatten().map(|fits| (scale, fits))
    });
    let (scale, fits) = fitting.min_by(|a, b| a.1.then.total_cmp(&b.1.then))?;
    let unit = |range: std::ops::Range<f64>| range.contains(&scale);
    let converts = [(900.0..1100.0, "1000"), (24.5..26.3, "25.4"), (9.5..10.5, "10"), (9e-4..1.1e-3, "0.001")];
    let next = match converts.into_iter().find(|(range, _)| unit(range.clone())) {
        Some((_, factor)) => format!(
            "multiply the positions in the pose file by {factor} (of matrices the columns m03, m13, m23); the board's \
             size is not the cause"
        ),
        None => format!("measure the board and correct {}, or state the unit of the poses", o.board_length),
    };
    let cause = match scale {
        s if (900.0..1100.0).contains(&s) => "the poses are in metres, millimetres are expected".to_string(),
        s if (24.5..26.3).contains(&s) => "the poses are in inches, millimetres are expected".to_string(),
        s if (9.5..10.5).contains(&s) => "the poses are in centimetres, millimetres are expected".to_string(),
        s if (9e-4..1.1e-3).contains(&s) => "the poses are in millimetres, metres are expected".to_string(),
        s => format!(
            "the board's lengths are {:.1} % of the stated ones, or the camera's focal length is off",
            100.0 / s
        ),
    };
    Some(Explanation {
        what: format!("the robot's lengths must be multiplied by {scale:.4} to agree with the board's"),
        cause,
        next,
        fits,
        changes: 1,
        refuses: true,
    })
}
