//! A group of pairs that fits the others except for one constant transform: a tool in the robot's poses, a camera or
//! a board that was moved, another work frame, boards that were read rotated.

use super::explanation::Explanation;
use super::present::Present;
use crate::calibrate::hand_eye::closed::{Chain, Far, Near, Pair, park_martin};
use crate::calibrate::hand_eye::options::Mount;
use crate::geometry::{Board, Frame, Mat3, Rigid, Vec3, log, orthonormalise};
use rand::SeedableRng;

/// Smallest factor by which the transform must improve the fit. It is above 1 because both the transform and its
/// pairs are selected for the best fit.
const BETTER: f64 = 5.0;
/// Smallest number of pairs that agree with each other, and of pairs that fit them after the transform.
const FEWEST: usize = 4;
const FEWEST_OTHERS: usize = 2;
/// Number of triples that are tried, as many as 25 pairs have.
const TRIPLES: usize = 2300;
/// Number of candidate groups that are examined closely.
const MOST: usize = 12;
/// Pairs belong to a group if their misfit is at most this many times the group's median.
const WITHIN: f64 = 6.0;
/// A rotation this close to a multiple of a quarter turn about the board's normal counts as one, rad.
const QUARTER: f64 = 0.09;
/// Positions of one rotated board differ by less than this share of the displacement by the rotation.
const PLACE: f64 = 0.1;

/// A chain with the pairs that agree with it.
struct Group {
    chain: Chain,
    members: Vec<usize>,
}

fn chosen<'a>(pairs: &'a [Pair], which: &[usize]) -> Vec<&'a Pair> {
    which.iter().map(|&i| &pairs[i]).collect()
}

/// Triples of pairs: all of them, or a random selection.
fn triples(n: usize, seed: u64) -> Vec<[usize; 3]> {
    if n * (n - 1) * (n - 2) / 6 <= TRIPLES {
        return (0..n).flat_map(|i| (0..i).flat_map(move |j| (0..j).map(move |k| [i, j, k]))).collect();
    }
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut drawn = || {
        let d = rand::seq::index::sample(&mut rng, n, 3);
        [d.index(0), d.index(1), d.index(2)]
    };
    (0..TRIPLES).map(|_| drawn()).collect()
}

/// Groups of pairs that agree with each other far better than with the rest, the most distinct first.
fn groups(now: &Present<'_>) -> Vec<Group> {
    let n = now.pairs.len();
    let mut marked: Vec<(f64, Vec<usize>)> = Vec::new();
    for triple in triples(n, now.seed) {
        let Some(chain) = park_martin(&chosen(now.pairs, &triple)) else { continue };
        let mut order: Vec<(f64, usize)> = now.pairs.iter().map(|p| chain.misfit(p)).zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The rest begins at the largest jump of the sorted misfits.
        let jump = |k: usize| order[k].0 / order[k - 1].0.max(1e-6);
        let ends = FEWEST..=n.saturating_sub(FEWEST_OTHERS);
        let Some(end) = ends.filter(|&k| k < n).max_by(|&a, &b| jump(a).total_cmp(&jump(b))) else { continue };
        let mut members: Vec<usize> = order[..end].iter().map(|o| o.1).collect();
        members.sort_unstable();
        marked.push((jump(end), members));
    }
    marked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut out: Vec<Group> = Vec::new();
    for (_, members) in marked {
        if out.len() >= MOST {
            break;
        }
        let Some(group) = settled(now.pairs, members) else { continue };
        if !out.iter().any(|g| g.members == group.members) {
            out.push(group);
        }
    }
    out
}

/// The chain of some pairs, and all pairs that agree with it.
fn settled(pairs: &[Pair], mut members: Vec<usize>) -> Option<Group> {
    for _ in 0..3 {
        let chain = park_martin(&chosen(pairs, &members))?;
        let misfits: Vec<f64> = pairs.iter().map(|p| chain.misfit(p)).collect();
        let mut own: Vec<f64> = members.iter().map(|&i| misfits[i]).collect();
        own.sort_by(f64::total_cmp);
        let limit = WITHIN * own[own.len() / 2];
        let next: Vec<usize> = (0..pairs.len()).filter(|&i| misfits[i] <= limit).collect();
        if next.len() < FEWEST {
            return None;
        }
        if next == members {
            return Some(Group { chain, members });
        }
        members = next;
    }
    Some(Group { chain: park_martin(&chosen(pairs, &members))?, members })
}

/// The mean of nearly equal transforms, averaging their translations.
fn mean<A: Frame, B: Frame>(all: &[Rigid<A, B>]) -> Rigid<A, B> {
    let rotation = orthonormalise(&all.iter().map(|t| t.rotation).sum::<Mat3>());
    Rigid::new(rotation, all.iter().map(|t| t.translation).sum::<Vec3>() / all.len() as f64)
}

/// A constant transform that makes the rest fit a group.
enum Constant {
    /// Between the flange and the frame that the robot's poses refer to, for the rest: flange_from_tool.
    OnFlange(Rigid<Near, Near>),
    /// The board, the camera or the base frame was at another pose.
    InBase(Rigid<Near, Near>),
    /// Boards were read rotated by multiples of a quarter turn: index of the pair, number of quarters.
    Turned(Vec<(usize, usize)>),
}

/// Transforms that make the rest fit a group, with the resulting pairs.
fn constants(pairs: &[Pair], g: &Group, mount: Mount) -> Vec<(Constant, Vec<Pair>)> {
    let rest: Vec<usize> = (0..pairs.len()).filter(|i| !g.members.contains(i)).collect();
    if rest.len() < FEWEST_OTHERS {
        return Vec::new();
    }
    let (x, w) = (g.chain.near_from_camera, g.chain.far_from_board);
    let changed = |f: &dyn Fn(&Pair) -> Pair| -> Vec<Pair> {
        pairs.iter().enumerate().map(|(i, p)| if rest.contains(&i) { f(p) } else { p.clone() }).collect()
    };
    // On the camera's side the rest has another near_from_camera, on the board's another far_from_board.
    let by_near: Vec<Rigid<Near, Near>> = chosen(pairs, &rest)
        .iter()
        .map(|p| x * (p.near_from_far * w * p.seen.camera_from_board.inverse()).inverse())
        .collect();
    let boards: Vec<Rigid<Board, Board>> = chosen(pairs, &rest)
        .iter()
        .map(|p| w.inverse() * (p.near_from_far.inverse() * x * p.seen.camera_from_board))
        .collect();
    let by_far: Vec<Rigid<Far, Far>> = boards.iter().map(|d| w * *d * w.inverse()).collect();
    let (near, far) = (mean(&by_near), mean(&by_far));
    let on_near = changed(&|p| p.at(near * p.near_from_far));
    let on_far = changed(&|p| p.at(p.near_from_far * far));
    // Only the numbers of the transform are reported, not its frames.
    let plain = Rigid::<Near, Near>::new(far.rotation, far.translation);
    let of_flange = |t: Rigid<Near, Near>| Constant::OnFlange(t);
    let mut out = match mount {
        Mount::EyeInHand => vec![(of_flange(near), on_near), (Constant::InBase(plain), on_far)],
        Mount::EyeToHand => vec![(of_flange(plain.inverse()), on_far), (Constant::InBase(near), on_near)],
    };
    out.extend(turned(pairs, &rest, &boards));
    out
}

/// The rest's boards rotated by quarter turns about their normal, if all boards with the same rotation agree on one
/// position.
fn turned(pairs: &[Pair], rest: &[usize], boards: &[Rigid<Board, Board>]) -> Option<(Constant, Vec<Pair>)> {
    let quarter = |d: &Rigid<Board, Board>| {
        let v = log(&d.rotation);
        let turns = (v.z / std::f64::consts::FRAC_PI_2).round();
        let off = Vec3::new(v.x, v.y, v.z - turns * std::f64::consts::FRAC_PI_2).norm();
        // At half a turn the sign of the rotation vector is arbitrary.
        let tilt = d.rotation[(2, 2)].clamp(-1.0, 1.0).acos();
        let half = (v.norm() - std::f64::consts::PI).abs() < QUARTER && tilt < QUARTER;
        if half { Some(2) } else { Some(turns.rem_euclid(4.0) as usize).filter(|t| *t != 0 && off < QUARTER) }
    };
    let quarters: Vec<usize> = boards.iter().map(quarter).collect::<Option<_>>()?;
    let mut out = pairs.to_vec();
    for q in 1..4 {
        let alike: Vec<usize> = (0..rest.len()).filter(|&k| quarters[k] == q).collect();
        if alike.is_empty() {
            continue;
        }
        let same: Vec<Rigid<Board, Board>> = alike.iter().map(|&k| boards[k]).collect();
        let turn = mean(&same);
        let moved = turn.translation.norm();
        if same.iter().any(|d| (d.translation - turn.translation).norm() > PLACE * moved) {
            return None;
        }
        for &k in &alike {
            out[rest[k]].seen.camera_from_board = out[rest[k]].seen.camera_from_board * turn.inverse();
        }
    }
    Some((Constant::Turned(rest.iter().copied().zip(quarters).collect()), out))
}

/// Names of the given pairs, such as `pose 7 to pose 13`.
pub fn names(pairs: &[Pair], which: &[usize]) -> String {
    const MOST_NAMES: usize = 6;
    let name = |i: usize| pairs[i].seen.name.as_str();
    let (first, last) = (which[0], which[which.len() - 1]);
    if last - first + 1 == which.len() && which.len() > 2 {
        return format!("{} to {}", name(first), name(last));
    }
    let named: Vec<&str> = which.iter().take(MOST_NAMES).map(|&i| name(i)).collect();
    let more = which.len() - named.len();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", named.join(", "))
}

fn transform(t: &Rigid<Near, Near>) -> String {
    let (p, angle) = (t.translation, log(&t.rotation).norm().to_degrees());
    let turn = if angle < 0.5 { String::new() } else { format!(" and a turn of {angle:.1} degrees") };
    // Adding 0.0 removes the sign of a negative zero.
    let [x, y, z] = [p.x, p.y, p.z].map(|v| (v * 10.0).round() / 10.0 + 0.0);
    format!("({x:.1}, {y:.1}, {z:.1}) mm{turn}")
}

impl Constant {
    /// The same transform, stated for the group instead of the rest.
    fn inverse(self) -> Constant {
        match self {
            Constant::OnFlange(t) => Constant::OnFlange(t.inverse()),
            Constant::InBase(t) => Constant::InBase(t.inverse()),
            Constant::Turned(quarters) => Constant::Turned(quarters.into_iter().map(|(i, q)| (i, 4 - q)).collect()),
        }
    }

    fn explained(self, now: &Present<'_>, g: &Group, mount: Mount, fits: super::present::Fits) -> Explanation {
        let rest: Vec<usize> = (0..now.pairs.len()).filter(|i| !g.members.contains(i)).collect();
        // The message names the smaller of the two parts.
        let (told, part) = if rest.len() > g.members.len() { (self.inverse(), &g.members) } else { (self, &rest) };
        let who = names(now.pairs, part);
        let well = format!("{who} ({} of {}) fit the others to {:.3} mm", part.len(), now.pairs.len(), fits.then);
        let carried = if mount == Mount::EyeInHand { "camera" } else { "board" };
        let fixed = if mount == Mount::EyeInHand { "board" } else { "camera" };
        let (cause, next, changes, refuses) = match &told {
            Constant::OnFlange(t) => (
                format!(
                    "{well} with a constant tool of {} between: a tool was selected in the robot for one part of the \
                     poses, or the {carried} was moved on the flange",
                    transform(t)
                ),
                "export all poses of the flange, with no tool selected, or calibrate with one part alone".to_string(),
                2,
                true,
            ),
            Constant::InBase(t) => (
                format!(
                    "{well} when moved by {} in the base frame: the {fixed} was moved, or another work frame was \
                     selected in the robot",
                    transform(t)
                ),
                "calibrate with the pictures of one part alone, or take them again".to_string(),
                3,
                false,
            ),
            Constant::Turned(quarters) => {
                let mut angles: Vec<String> = quarters.iter().map(|q| format!("{}", 90 * q.1)).collect();
                angles.sort();
                angles.dedup();
                (
                    format!(
                        "{well} when their boards are turned by {} degrees: the board's origin was taken at another \
                         corner in these pictures",
                        angles.join(" or ")
                    ),
                    "find the boards with one origin, or use a board that looks the same from no two sides".to_string(),
                    2,
                    false,
                )
            }
        };
        Explanation { what: String::new(), cause, next, fits, changes, refuses, part: part.clone() }
    }
}

/// A constant transform with which one part of the pairs fits the others.
pub fn explain(now: &Present<'_>, mount: Mount) -> Option<Explanation> {
    if now.pairs.len() < FEWEST + FEWEST_OTHERS {
        return None;
    }
    let mut best: Option<Explanation> = None;
    for group in groups(now) {
        for (constant, pairs) in constants(now.pairs, &group, mount) {
            let Some(fits) = now.better(&pairs, BETTER) else { continue };
            if best.as_ref().is_none_or(|b| fits.then < b.fits.then) {
                best = Some(constant.explained(now, &group, mount, fits));
            }
        }
    }
    best
}
