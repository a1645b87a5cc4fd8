//! In: pairs of robot poses and pictures of a board that looks the same after a rotation. Out: every picture read
//! with the same origin, resolved over the entire set, or a refusal.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye (11)).

use super::closed::{Chain, Pair, canonical_order, park_martin};
use crate::calibrate::boards::Turn;
use crate::fault::{Fault, Result};
use crate::geometry::angle_between;
use rand::SeedableRng;

/// The rotation between two pictures' boards has the same angle as the robot's rotation between them. Two readings
/// whose angles differ by more than this cannot both be right: 5.7 degrees. That is a fifteenth of the difference
/// between two readings, and four times the effect of a robot that scatters by a degree.
const SAME_ANGLE: f64 = 0.1;
/// Any other reading of the set must fit this many times worse than the chosen one.
const MARGIN: f64 = 3.0;
/// Rotation misfits that differ by less than this count as equally good, whatever their ratio: 0.6 degrees.
const FINE: f64 = 0.01;
/// Number of triples that are tried for more than 25 pairs; with fewer pairs, all are tried.
const DRAWN: usize = 3000;

/// One reading of all pictures: a rotation for each, and the consistency of the set.
struct Reading {
    turns: Vec<usize>,
    /// Pictures that agree with this reading; a wrong pair agrees with no reading.
    agrees: Vec<bool>,
    /// Medians over the pictures: rotation and position misfit of the board to the chain.
    rad: f64,
    mm: f64,
}

impl Reading {
    /// Reads every picture with the rotation that fits the chain best. Only rotations decide: readings of one picture
    /// differ by one or two right angles, and a wrong length unit of the poses does not affect them.
    fn by(chain: &Chain, readings: &[Vec<Pair>]) -> Reading {
        let (mut turns, mut rads, mut mms) = (Vec::new(), Vec::new(), Vec::new());
        for one in readings {
            let off = |p: &Pair| {
                angle_between(&chain.expected(&p.near_from_far).rotation, &p.seen.camera_from_board.rotation)
            };
            let all: Vec<f64> = one.iter().map(off).collect();
            let best = (0..all.len()).min_by(|&a, &b| all[a].total_cmp(&all[b])).expect("a turn or more");
            turns.push(best);
            rads.push(all[best]);
            mms.push(chain.misfit(&one[best]));
        }
        // The triple that determined the chain fits too well to count in the median.
        let middle = (readings.len() / 2 + 1).min(readings.len() - 1);
        let median = |values: &[f64]| {
            let mut sorted = values.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[middle]
        };
        let (rad, mm) = (median(&rads), median(&mms));
        let agrees = rads.iter().map(|r| *r < 4.0 * rad + 2.0 * FINE).collect();
        Reading { turns, agrees, rad, mm }
    }
    /// True if both readings differ only by a common rotation of all boards, which merely renames the origin.
    fn same(&self, other: &Reading, count: usize) -> bool {
        let both = (0..self.turns.len()).filter(|&i| self.agrees[i] && other.agrees[i]);
        let mut steps = both.map(|i| (self.turns[i] + count - other.turns[i]) % count);
        let first = steps.next();
        steps.all(|s| Some(s) == first)
    }
}

/// Readings by the chains of all triples of pictures with equal rotation angles of robot and boards, or of many drawn
/// triples.
fn candidates(readings: &[Vec<Pair>], count: usize, seed: u64) -> Vec<Reading> {
    let n = readings.len();
    let mut found: Vec<Reading> = Vec::new();
    let mut consider = |[a, b, c]: [usize; 3]| {
        for kb in 0..count {
            if !same_angle(&readings[a][0], &readings[b][kb]) {
                continue;
            }
            for kc in 0..count {
                let three = [&readings[a][0], &readings[b][kb], &readings[c][kc]];
                if !same_angle(three[0], three[2]) || !same_angle(three[1], three[2]) {
                    continue;
                }
                found.extend(park_martin(&three).map(|chain| Reading::by(&chain, readings)));
            }
        }
    };
    if n <= 25 {
        for a in 0..n {
            (a + 1..n).for_each(|b| (b + 1..n).for_each(|c| consider([a, b, c])));
        }
    } else {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        for _ in 0..DRAWN {
            let drawn = rand::seq::index::sample(&mut rng, n, 3);
            consider([drawn.index(0), drawn.index(1), drawn.index(2)]);
        }
    }
    found
}

/// For each picture, the index of the rotation in `turns` that makes all boards one board in one pose. The rotation
/// common to all pictures is free; as few pictures as possible are changed. Up to half of the pairs may be wrong. The
/// result does not depend on the order of the pairs.
///
/// # Errors
/// No reading agrees with the robot's poses, or two different ones do.
pub fn resolve(pairs: &[Pair], turns: &[Turn], seed: u64) -> Result<Vec<usize>> {
    let (n, count) = (pairs.len(), turns.len());
    if n < 3 || count < 2 {
        return Ok(vec![0; n]);
    }
    let order = canonical_order(pairs);
    let readings: Vec<Vec<Pair>> =
        order.iter().map(|&i| turns.iter().map(|t| read_with(&pairs[i], t)).collect()).collect();
    let found = candidates(&readings, count, seed);
    let least = found.iter().map(|r| r.rad).fold(f64::INFINITY, f64::min);
    let fitting: Vec<&Reading> = found.iter().filter(|r| r.rad <= MARGIN * least + FINE).collect();
    let best = fitting.iter().min_by(|a, b| a.mm.total_cmp(&b.mm));
    let Some(best) = best.filter(|b| b.rad < SAME_ANGLE) else { return Err(none_agrees(least)) };
    let rival = fitting.iter().filter(|r| r.mm < MARGIN * best.mm && !r.same(best, count));
    if let Some(other) = rival.min_by(|a, b| a.mm.total_cmp(&b.mm)) {
        return Err(Fault::refused(format!(
            "the board looks the same after a turn, and two readings of the pictures fit the robot's poses equally \
             well: {:.3} mm and {:.3} degrees against {:.3} mm and {:.3} degrees",
            best.mm,
            best.rad.to_degrees(),
            other.mm,
            other.rad.to_degrees()
        ))
        .cause("the flange turned about too few axes to determine the board's origin")
        .next(
            "tilt the flange about two axes by 20 degrees and more, or use a board with one even and one odd \
               number of corners, or a ChArUco board",
        ));
    }
    let kept =
        |shift: usize| (0..n).filter(|&i| best.agrees[i] && (best.turns[i] + shift).is_multiple_of(count)).count();
    let shift = (0..count).rev().max_by_key(|&s| kept(s)).expect("a turn or more");
    let mut chosen = vec![0; n];
    order.iter().zip(&best.turns).for_each(|(&i, k)| chosen[i] = (k + shift) % count);
    Ok(chosen)
}

/// The pair with its board read with another rotation; measurements in the camera frame do not change.
pub fn read_with(pair: &Pair, turn: &Turn) -> Pair {
    let mut read = pair.clone();
    read.seen.camera_from_board = pair.seen.camera_from_board * turn.turn.inverse();
    read
}

fn same_angle(a: &Pair, b: &Pair) -> bool {
    let robot = angle_between(&a.near_from_far.rotation, &b.near_from_far.rotation);
    let camera = angle_between(&a.seen.camera_from_board.rotation, &b.seen.camera_from_board.rotation);
    (robot - camera).abs() < SAME_ANGLE
}

fn none_agrees(least: f64) -> Fault {
    let off = if least.is_finite() {
        format!("the best one is {:.2} degrees off in the median", least.to_degrees())
    } else {
        "no three pictures agree".into()
    };
    Fault::input(format!(
        "pictures and robot poses do not belong together: the board looks the same after a turn, and no reading of \
         it fits the robot's poses ({off})"
    ))
    .cause(
        "poses and pictures mispaired or in another order, a board that was moved, or another hand-eye mount than \
            stated",
    )
    .next("check which pose belongs to which picture, and that the board stood still")
}
