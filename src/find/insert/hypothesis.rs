//! In: the search's matches and their rivals, a scan's points, a recipe. Out: the measured pose that the points agree
//! with, and its lead over the best rival that the points allow.
//! Frame and unit: base frame, mm; poses of matches in px of the map.

use super::recipe::Recipe;
use super::verdict::{Agreement, judge};
use crate::fault::Result;
use crate::find::measure::points::{Ordered, localise};
use crate::find::measure::pose::{Measured, measure};
use crate::find::measure::slide::{long_axis, settle, slide};
use crate::find::search::coarse::turn_between;
use crate::find::search::full::Match;
use crate::find::search::refine::Pose;
use crate::geometry::{Base, Grid, Part, Rigid, Vec3, angle_between, exp};
use crate::scan::HeightMap;

/// A match and the part's pose as measured there.
pub(super) struct Judged {
    pub found: Match,
    pub measured: Measured,
}

/// Measures at the best match. Where the points do not agree with the drawing there, measures at its rivals and at the
/// other matches too. A long part shifted along itself scores nearly as well in the search, but its surfaces do not end
/// where they should.
pub(super) fn best_hypothesis(
    points: &Ordered,
    map: &HeightMap,
    recipe: &Recipe,
    expected: Option<&Rigid<Base, Part>>,
    best: &Match,
    matches: &[Match],
) -> Result<Judged> {
    const MOST: usize = 12;
    let drawing = recipe.drawing();
    let rivals = best.rivals.iter().filter(|r| r.1 > 0.6 * best.score).map(|&(pose, score)| {
        let second_score = best.score;
        let rivals =
            std::iter::once((best.pose, best.score)).chain(best.rivals.iter().copied().filter(|r| r.0 != pose));
        Match { pose, score, second_score, rivals: rivals.collect(), ..best.clone() }
    });
    let mut kept: Option<(f64, Judged)> = None;
    let mut trouble = None;
    let searched = std::iter::once(best.clone()).chain(rivals).chain(matches.iter().skip(1).cloned()).take(MOST);
    let slid = |(m, start): (Match, Rigid<Base, Part>)| (m, slide(points, &drawing, start, &recipe.measure));
    let starts = expected.map(|e| slid((best.clone(), *e))).into_iter();
    // Before its rivals, the best match is tried again at the position to which the points settle it.
    let settled = std::iter::once_with(|| {
        let start = settle(points, &drawing, lift(&best.pose, map, points, recipe), &recipe.measure);
        (best.clone(), start)
    });
    let mut searched = searched.map(|m| (m.clone(), lift(&m.pose, map, points, recipe))).map(slid);
    let first = searched.next();
    for (found, start) in starts.chain(first).chain(settled).chain(searched) {
        let measured = match measure(points, &drawing, start, &recipe.measure) {
            Ok(measured) => measured,
            Err(e) => {
                trouble.get_or_insert_with(|| {
                    e.at(format!(
                        "match at {:.1} {:.1} mm of the map, turned by {:.1} degrees, score {:.3}",
                        (found.pose.x + 0.5) * map.cell,
                        (found.pose.y + 0.5) * map.cell,
                        found.pose.angle.to_degrees(),
                        found.score
                    ))
                });
                continue;
            }
        };
        let a = judge(points, &drawing, &measured, &recipe.measure);
        let value = a.agreement * a.edges * found.score;
        let good = a.agreement >= recipe.gates.min_agreement && a.edges >= 0.5 && a.crossed <= recipe.gates.max_crossed;
        if kept.as_ref().is_none_or(|k| value > k.0) {
            kept = Some((value, Judged { found, measured }));
        }
        if good {
            break;
        }
    }
    kept.map(|k| k.1).ok_or_else(|| trouble.expect("every hypothesis failed, and there was one"))
}

/// A match in the map as a pose in the base frame: its height is the most frequent one of the points on
/// the drawing's first face.
pub(super) fn lift(pose: &Pose, map: &HeightMap, points: &Ordered, recipe: &Recipe) -> Rigid<Base, Part> {
    let bin = 0.5 * recipe.measure.height_gate_mm;
    let flat: Rigid<Grid, Part> = Rigid::from_vectors(
        &Vec3::new(0.0, 0.0, pose.angle),
        Vec3::new((pose.x + 0.5) * map.cell, (pose.y + 0.5) * map.cell, 0.0),
    );
    let base_from_part = map.base_from_grid * flat;
    let drawing = recipe.drawing();
    let faces = drawing.faces();
    let face = &faces[0];
    let mut bins = std::collections::BTreeMap::<i64, usize>::new();
    for q in localise(points, &drawing, &base_from_part, &recipe.measure).iter().flatten() {
        if face.material(q.x, q.y) {
            *bins.entry(((q.z - face.z) / bin).floor() as i64).or_default() += 1;
        }
    }
    // Three neighbouring bins, so that a tilted face is not split.
    let weight = |k: i64| (k - 1..=k + 1).filter_map(|b| bins.get(&b)).sum::<usize>();
    let best = bins.keys().copied().max_by_key(|&k| weight(k)).unwrap_or(0);
    base_from_part * Rigid::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.0, (best as f64 + 0.5) * bin))
}

/// Lead of the measured pose over the best rival, 1 - second / first. A rival's score counts for less where the points
/// contradict it. A map's edges fit as well where a part is shifted by the length of its shadow, but no point lies in a
/// shadow.
pub(super) fn lead(
    points: &Ordered,
    map: &HeightMap,
    recipe: &Recipe,
    found: &Match,
    pose: &Rigid<Base, Part>,
    agreement: &Agreement,
) -> f64 {
    let weighed = |(rival, score): &(Pose, f64)| {
        // A rival that is far enough behind need not be measured.
        if *score < (1.0 - recipe.gates.min_margin) * found.score {
            return *score;
        }
        score * agreement_at(rival, points, map, recipe, pose) / agreement.agreement.max(1e-9)
    };
    let rivals = found.rivals.iter().filter(|r| !alike(&r.0, &found.pose, recipe));
    1.0 - rivals.map(weighed).fold(0.0, f64::max) / found.score.max(1e-9)
}

/// How well the points agree with a rival, 0 to 1. It is 0 where the rival cannot be measured, or where its measurement
/// ends at the taken pose or at one of its alike turns.
fn agreement_at(rival: &Pose, points: &Ordered, map: &HeightMap, recipe: &Recipe, taken: &Rigid<Base, Part>) -> f64 {
    let drawing = recipe.drawing();
    let Ok(measured) = measure(points, &drawing, lift(rival, map, points, recipe), &recipe.measure) else { return 0.0 };
    let apart = taken.inverse() * measured.base_from_part;
    let turned = |turn: f64| angle_between(&apart.rotation, &exp(&(Vec3::z() * turn)));
    let same = apart.translation.norm() < recipe.measure.edge_gate_mm
        && alike_turns(recipe).any(|turn| turned(turn) < SAME_TURN);
    if same { 0.0 } else { judge(points, &drawing, &measured, &recipe.measure).agreement }
}

/// The turns at which the part looks nearly alike, rad; the first is 0.
fn alike_turns(recipe: &Recipe) -> impl Iterator<Item = f64> {
    let n = recipe.alike_turns;
    (0..n).map(move |k| std::f64::consts::TAU * f64::from(k) / f64::from(n))
}

/// Turns that differ by less than this count as one, rad.
const SAME_TURN: f64 = 3.0 / 180.0 * std::f64::consts::PI;

/// True for a pose at one of the part's alike turns or, for a long part, shifted along itself: the points themselves
/// distinguish such poses.
fn alike(pose: &Pose, found: &Pose, recipe: &Recipe) -> bool {
    let long = long_axis(&recipe.drawing());
    alike_turns(recipe).any(|turn| {
        let (s, c) = found.angle.sin_cos();
        let (dx, dy) = ((pose.x - found.x) * recipe.cell_mm, (pose.y - found.y) * recipe.cell_mm);
        let (along, across) = (c * dx + s * dy, c * dy - s * dx);
        let free = |axis: usize, shift: f64| long == Some(axis) || shift.abs() < 1.0;
        // An error of the turn swings the middle of a long part sideways when it is shifted.
        let swing = if long.is_some() { 3.0 } else { 1.0 };
        turn_between(pose.angle - found.angle, turn) < SAME_TURN && free(0, along / swing) && free(1, across / swing)
    })
}
