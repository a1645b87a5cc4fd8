//! In: pairs of robot poses and pictures, a fit. Out: refusals that name what is wrong with the pairs:
//! units, order, duplicates, one axis only.
//! Frame and unit: mm, rad.

use super::closed::{Pair, agree, axis_spread, park_martin, robot_scale};
use super::fit::HandEyeFit;
use super::options::HandEyeOptions;
use crate::fault::{Fault, Result};
use crate::geometry::Rigid;
use rand::{SeedableRng, seq::SliceRandom};

/// Robot poses closer than this are the same pose: 1 µm and 0.001 degrees.
const SAME_MM: f64 = 1e-3;
const SAME_RAD: f64 = 2e-5;
/// Lengths of robot and board may differ by this share before one of them is called wrong.
const SCALE_TOLERANCE: f64 = 0.01;

/// Names of pictures that share one robot pose, in pairs.
pub fn duplicates(pairs: &[Pair]) -> Vec<(String, String)> {
    let mut out = Vec::new();
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[..i] {
            let (angle, shift) = a.near_from_far.difference(&b.near_from_far);
            if shift < SAME_MM && angle < SAME_RAD {
                out.push((b.seen.name.clone(), a.seen.name.clone()));
            }
        }
    }
    out
}

/// Refuses what can be seen before any fit: too few poses, duplicates, no second axis.
pub fn before(pairs: &[Pair], o: &HandEyeOptions) -> Result<()> {
    if pairs.len() < o.min_pairs {
        return Err(Fault::refused(format!(
            "{} pictures with a board and a pose, {} are needed",
            pairs.len(),
            o.min_pairs
        ))
        .cause("too few pictures, or the board was not found in most")
        .next("take eight or more pictures from all sides, the flange turned about all its axes"));
    }
    let same = duplicates(pairs);
    if !same.is_empty() {
        let named: Vec<String> = same.iter().take(4).map(|(a, b)| format!("{a} and {b}")).collect();
        return Err(Fault::input(format!("duplicate poses: {} have the same robot pose", named.join("; ")))
            .cause("the robot did not move between the pictures, or a pose was copied")
            .next("take one picture of each such pair out of the recording"));
    }
    let spread = axis_spread(&pairs.iter().collect::<Vec<_>>());
    let [first, second, _] = spread.map(|s| s.1.to_degrees());
    if second < o.min_second_axis_deg {
        let axis = spread[0].0;
        return Err(Fault::refused(format!(
            "the poses turn about one axis only: {first:.1} degrees rms about ({:.2}, {:.2}, {:.2}) of the camera's \
             carrier, \
             {second:.2} degrees about the next axis, {} are needed",
            axis.x, axis.y, axis.z, o.min_second_axis_deg
        ))
        .cause("with one axis of rotation the camera's position along that axis is not determined")
        .next(
            "tilt the flange about an axis at right angles to the first by 20 degrees or more and take more \
               pictures",
        ));
    }
    Ok(())
}

/// Poses dealt out at random fit a chain too, badly. Pairs whose misfit is above this share of the best of
/// [`DEALS`] random deals fit by chance: 1200 shuffled sets of 6 to 25 pairs come out at 0.56 and more, robots
/// that scatter by 2 mm and 1 degree at 0.33 and less, and once of 1200 more at 0.47
/// (tests/calibrate/hand_eye_judge.rs, its long form).
const BY_CHANCE: f64 = 0.5;
const DEALS: u64 = 20;
/// Below this share no other order of the poses is looked for.
const SURELY: f64 = 0.02;

/// Misfit of the pairs, as the share of the best misfit of random deals of their poses.
pub fn chance(pairs: &[&Pair], seed: u64) -> f64 {
    let deal = |k: u64| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.shuffle(&mut rand_pcg::Pcg64::seed_from_u64(seed.wrapping_add(k)));
        let dealt: Vec<Pair> = order
            .iter()
            .zip(pairs)
            .map(|(&i, p)| Pair { near_from_far: pairs[i].near_from_far, seen: p.seen.clone() })
            .collect();
        // A deal that leaves most poses where they were says nothing about chance.
        let stayed = order.iter().enumerate().filter(|(i, k)| i == *k).count();
        if stayed * 3 > pairs.len() { None } else { misfit(&dealt.iter().collect::<Vec<_>>()) }
    };
    let best = (0..DEALS).filter_map(deal).fold(f64::INFINITY, f64::min);
    misfit(pairs).map_or(f64::INFINITY, |m| m / best)
}

/// Refuses a fit that is no better than chance or that few pairs agree with, with what would make the others fit.
pub fn after(pairs: &[Pair], fit: &HandEyeFit, o: &HandEyeOptions) -> Result<()> {
    let chosen: Vec<&Pair> = pairs.iter().zip(&fit.pairs).filter(|(_, r)| r.used).map(|(p, _)| p).collect();
    let used = chosen.len();
    let chance = chance(&chosen, o.seed);
    // Fewer than 60 % agreeing pairs could be a coincidence of wrong ones.
    let agree = chance <= BY_CHANCE && used * 10 >= pairs.len() * 6 && used >= o.min_pairs;
    if !agree || (chance > SURELY && other_order(pairs, o).is_some()) {
        let what = format!(
            "pictures and robot poses do not belong together: {used} of {} pairs agree, the robot would scatter by \
             {:.2} mm and \
             {:.3} degrees; the misfit is {:.0} % of that of random pairs (limit {:.0} %)",
            pairs.len(),
            fit.noise.robot_mm,
            fit.noise.robot_rad.to_degrees(),
            100.0 * chance,
            100.0 * BY_CHANCE
        );
        return Err(explain(pairs, what, o));
    }
    match other_scale(pairs, &chosen, o) {
        Some(scale) => Err(wrong_scale(scale, o)),
        None => Ok(()),
    }
}

/// A factor on the robot's lengths with which the pairs agree at least twice as well, all of them and in the median.
fn other_scale(pairs: &[Pair], chosen: &[&Pair], o: &HandEyeOptions) -> Option<f64> {
    let scale = robot_scale(chosen).filter(|s| *s > 0.0 && (s - 1.0).abs() > SCALE_TOLERANCE)?;
    let scaled: Vec<Pair> = pairs
        .iter()
        .map(|p| {
            let t = p.near_from_far;
            Pair { near_from_far: Rigid::new(t.rotation, t.translation * scale), seen: p.seen.clone() }
        })
        .collect();
    let (now, then) = (agree(pairs, o.seed)?, agree(&scaled, o.seed)?);
    // Medians of few pairs halve by chance; the squares of all that agree do not.
    let on = |of: &[Pair]| misfit(&then.agreeing.iter().map(|&i| &of[i]).collect::<Vec<_>>());
    let better = then.spread < 0.5 * now.spread && on(&scaled)? < 0.5 * on(pairs)?;
    (better && then.agreeing.len() * 5 >= pairs.len() * 4).then_some(scale)
}

/// Root of the sum of squared misfits of pairs to the closed form on all of them.
fn misfit(pairs: &[&Pair]) -> Option<f64> {
    let chain = park_martin(pairs)?;
    Some(pairs.iter().map(|p| chain.misfit(p).powi(2)).sum::<f64>().sqrt())
}

/// For pairs on which no fit succeeded: says why, if that can be found out.
pub fn explain(pairs: &[Pair], what: String, o: &HandEyeOptions) -> Fault {
    let all: Vec<&Pair> = pairs.iter().collect();
    if let Some(scale) = other_scale(pairs, &all, o) {
        return wrong_scale(scale, o);
    }
    if let Some(order) = other_order(pairs, o) {
        let inverted = order.contains("inverted");
        return Fault::input(what).cause(format!("the poses fit the pictures {order}")).next(if inverted {
            "state the mount as it is (mount in station.toml), or export the poses as base_from_flange"
        } else {
            "put the poses into the order in which the pictures were taken"
        });
    }
    Fault::input(what)
        .cause("poses and pictures mispaired, a board that was moved, or another hand-eye mount than stated")
        .next("check which pose belongs to which picture, and that the board stood still")
}

fn wrong_scale(scale: f64, o: &HandEyeOptions) -> Fault {
    let cause = match scale {
        s if (900.0..1100.0).contains(&s) => "the poses are in metres, millimetres are expected".to_string(),
        s if (24.5..26.3).contains(&s) => "the poses are in inches, millimetres are expected".to_string(),
        s if (9.5..10.5).contains(&s) => "the poses are in centimetres, millimetres are expected".to_string(),
        s => format!(
            "the board's lengths are {:.1} % of the stated ones, or the camera's focal length is off",
            100.0 / s
        ),
    };
    Fault::input(format!("the robot's lengths must be multiplied by {scale:.4} to agree with the board's"))
        .cause(cause)
        .next(format!("state the unit of the poses, or measure the board and correct {}", o.board_length))
}

/// Another order of the poses with which at least four fifths of the pairs agree, at least twice as well.
fn other_order(pairs: &[Pair], o: &HandEyeOptions) -> Option<String> {
    let n = pairs.len();
    let now = agree(pairs, o.seed).map_or(f64::INFINITY, |a| a.spread);
    let paired = |f: &dyn Fn(usize) -> usize| -> Vec<Pair> {
        (0..n).map(|i| Pair { near_from_far: pairs[f(i)].near_from_far, seen: pairs[i].seen.clone() }).collect()
    };
    let fits = |p: &[Pair]| {
        agree(p, o.seed).is_some_and(|a| {
            let chosen: Vec<&Pair> = a.agreeing.iter().map(|&i| &p[i]).collect();
            a.agreeing.len() * 5 >= n * 4 && a.spread < 0.5 * now && chance(&chosen, o.seed) <= BY_CHANCE
        })
    };
    if fits(&paired(&|i| n - 1 - i)) {
        return Some("in the reverse order".into());
    }
    for k in 1..=3.min(n - 1) {
        if fits(&paired(&|i| (i + k) % n)) {
            return Some(format!("when each picture takes the pose {k} places later"));
        }
        if fits(&paired(&|i| (i + n - k) % n)) {
            return Some(format!("when each picture takes the pose {k} places earlier"));
        }
    }
    let inverted: Vec<Pair> = pairs
        .iter()
        .map(|p| {
            let i = p.near_from_far.inverse();
            Pair { near_from_far: Rigid::new(i.rotation, i.translation), seen: p.seen.clone() }
        })
        .collect();
    fits(&inverted).then(|| "when each is inverted: the mount is the other one (eye in hand, eye to hand)".into())
}

/// For a pair that was left out: the picture whose pose it fits, if there is one.
pub fn belongs_to(pairs: &[Pair], fit: &HandEyeFit, wrong: usize) -> Option<String> {
    let limit = 4.0 * fit.start.spread + 0.5;
    pairs
        .iter()
        .enumerate()
        .filter(|(k, _)| *k != wrong)
        .map(|(_, p)| (pairs[wrong].seen.displacement(&fit.chain.expected(&p.near_from_far)), &p.seen.name))
        .filter(|(d, _)| *d < limit)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name.clone())
}
