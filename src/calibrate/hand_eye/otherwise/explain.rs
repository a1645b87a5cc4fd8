//! Of all changes that would make the pairs fit, the simplest one that fits well, in words.

use super::explanation::Explanation;
use super::present::Present;
use super::{lengths, order, parts, readings};
use crate::calibrate::hand_eye::closed::Pair;
use crate::calibrate::hand_eye::options::{HandEyeOptions, Mount};
use crate::fault::Fault;

/// Explanations that fit this many times worse than the best one are not reported.
const WORSE: f64 = 1.5;

/// A change that would make the pairs fit much better. `order_too`: whether the pairing may be wrong. `parts_too`:
/// whether one part of the pairs may differ from the rest.
pub fn find(pairs: &[Pair], mount: Mount, order_too: bool, parts_too: bool, o: &HandEyeOptions) -> Option<Explanation> {
    let now = Present { pairs, seed: o.seed };
    let mut all: Vec<Explanation> = lengths::explain(&now, o).into_iter().collect();
    all.extend(readings::explain(&now, mount));
    if order_too {
        all.extend(order::explain(&now));
    }
    if parts_too {
        all.extend(lengths::in_one_part(&now));
        all.extend(parts::explain(&now, mount));
    }
    let best = all.iter().map(|e| e.fits.then).fold(f64::INFINITY, f64::min);
    all.retain(|e| e.fits.then <= WORSE * best);
    all.into_iter().min_by(|a, b| (a.changes, a.fits.then).partial_cmp(&(b.changes, b.fits.then)).expect("finite"))
}

/// For pairs on which no fit succeeded: the reason, if one is found.
pub fn explain(pairs: &[Pair], what: String, mount: Mount, o: &HandEyeOptions) -> Fault {
    match find(pairs, mount, true, true, o) {
        Some(e) => e.fault(what),
        None => Fault::input(what)
            .cause("poses and pictures mispaired, a board that was moved, or another hand-eye mount than stated")
            .next("check which pose belongs to which picture, and that the board stood still"),
    }
}
