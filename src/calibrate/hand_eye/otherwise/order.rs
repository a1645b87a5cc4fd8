//! Poses in another order than the pictures.

use super::explanation::Explanation;
use super::present::Present;
use crate::calibrate::hand_eye::closed::Pair;

/// Largest offset between the sequences of pictures and poses that is tried.
const SLIPS: usize = 3;

/// An order of the poses with which the pairs fit at least twice as well.
pub fn explain(now: &Present<'_>) -> Option<Explanation> {
    let n = now.pairs.len();
    let paired = |f: &dyn Fn(usize) -> usize| -> Vec<Pair> {
        (0..n).map(|i| now.pairs[i].at(now.pairs[f(i)].near_from_far)).collect()
    };
    let mut orders = vec![(paired(&|i| n - 1 - i), "in the reverse order".to_string())];
    for k in 1..=SLIPS.min(n - 1) {
        orders.push((paired(&|i| (i + k) % n), format!("when each picture takes the pose {k} places later")));
        orders.push((paired(&|i| (i + n - k) % n), format!("when each picture takes the pose {k} places earlier")));
    }
    let fitting = orders.into_iter().filter_map(|(pairs, words)| now.better(&pairs, 2.0).map(|fits| (fits, words)));
    let (fits, words) = fitting.min_by(|a, b| a.0.then.total_cmp(&b.0.then))?;
    Some(Explanation {
        what: String::new(),
        cause: format!("the poses fit the pictures {words}, to {:.3} mm", fits.then),
        next: "put the poses into the order in which the pictures were taken".into(),
        fits,
        changes: 1,
        refuses: true,
        part: Vec::new(),
    })
}
