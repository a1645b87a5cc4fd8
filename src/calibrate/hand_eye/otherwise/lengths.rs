//! A factor between the robot's lengths and the board's: another unit, or a board of another size.

use super::explanation::Explanation;
use super::parts::names;
use super::present::Present;
use crate::calibrate::hand_eye::closed::{Pair, agree, robot_scale};
use crate::calibrate::hand_eye::options::HandEyeOptions;
use crate::fault::{Fault, Result};
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
    let (board, robot) = reaches(now.pairs);
    let board_in_metres = (9e-4..1.1e-3).contains(&scale) && board < NEAREST && robot < FARTHEST;
    let next = match converts.into_iter().find(|(range, _)| unit(range.clone())) {
        Some(_) if board_in_metres => format!(
            "multiply the positions of the board's poses by 1000, or correct {}; the robot's poses are not the cause",
            o.board_length
        ),
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
        _ if board_in_metres => format!(
            "the board's lengths are in metres, millimetres are expected: it would stand {board:.3} mm from the camera"
        ),
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
        part: Vec::new(),
    })
}

/// Units in which one part of the poses may be written, and their length in mm.
const UNITS: [(&str, f64); 3] = [("metres", 1000.0), ("inches", 25.4), ("centimetres", 10.0)];
/// Smallest jump among the sorted distances of the robot's poses from its base that may be a change of unit.
const JUMP: f64 = 4.0;
/// Smallest factor by which another unit in one part must improve the fit.
const BETTER: f64 = 5.0;

/// A part of the poses in another unit than the rest: those closest to the robot's base.
pub fn in_one_part(now: &Present<'_>) -> Option<Explanation> {
    let far = |i: usize| now.pairs[i].near_from_far.translation.norm();
    let mut order: Vec<usize> = (0..now.pairs.len()).collect();
    order.sort_by(|&a, &b| far(a).total_cmp(&far(b)));
    let jump = |k: usize| far(order[k]) / far(order[k - 1]).max(1e-9);
    let end = (1..order.len()).max_by(|&a, &b| jump(a).total_cmp(&jump(b))).filter(|&k| jump(k) > JUMP)?;
    let mut part = order[..end].to_vec();
    part.sort_unstable();
    let fitting = UNITS.into_iter().filter_map(|(unit, mm)| {
        let one = |(i, p): (usize, &Pair)| {
            if part.contains(&i) { scaled(std::slice::from_ref(p), mm) } else { vec![p.clone()] }
        };
        let changed: Vec<Pair> = now.pairs.iter().enumerate().flat_map(one).collect();
        now.better(&changed, BETTER).map(|fits| (unit, mm, fits))
    });
    let (unit, mm, fits) = fitting.min_by(|a, b| a.2.then.total_cmp(&b.2.then))?;
    let (who, few, all) = (names(now.pairs, &part), part.len(), now.pairs.len());
    Some(Explanation {
        what: format!("the robot's poses are in two units: {who} ({few} of {all}) are in {unit}, the others are not"),
        cause: format!("with the positions of that part times {mm} all poses fit the pictures to {:.3} mm", fits.then),
        next: "write all positions of the pose file in one unit".into(),
        fits,
        changes: 1,
        refuses: true,
        part,
    })
}

/// Nearer than this a camera sees no board, and within this of its base no robot turns a camera, mm: the numbers are
/// metres.
const NEAREST: f64 = 2.0;
/// Farther than this from its base no robot reaches, mm.
const FARTHEST: f64 = 20_000.0;

/// Median distance of the boards from the camera, and the robot's largest distance from its base, mm as read.
fn reaches(pairs: &[Pair]) -> (f64, f64) {
    let mut boards: Vec<f64> = pairs.iter().map(|p| p.seen.centre().norm()).collect();
    boards.sort_by(f64::total_cmp);
    let robot = pairs.iter().map(|p| p.near_from_far.translation.norm()).fold(0.0, f64::max);
    (boards.get(boards.len() / 2).copied().unwrap_or(f64::INFINITY), robot)
}

/// Refuses lengths of robot and board that are both in metres: they agree with each other, so no fit shows it.
pub fn both_in_metres(pairs: &[Pair], o: &HandEyeOptions) -> Result<()> {
    let (board, robot) = reaches(pairs);
    if pairs.is_empty() || board >= NEAREST || robot >= NEAREST {
        return Ok(());
    }
    Err(Fault::input(format!(
        "the boards stand {board:.3} mm from the camera, and the robot goes to {robot:.3} mm from its base (limit \
         {NEAREST} mm)"
    ))
    .cause("the robot's positions and the board's lengths are both in metres, millimetres are expected")
    .next(format!("multiply the positions of the robot's poses and of the board's by 1000; check {}", o.board_length)))
}
