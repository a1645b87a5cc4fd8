//! In: pairs of robot poses and pictures, a fit. Out: refusals that name the fault of the pairs: units, order,
//! duplicates, rotation about one axis only.
//! Frame and unit: mm, rad.

use super::chance::{BY_CHANCE, chance};
use super::closed::{Pair, axis_spread};
use super::fit::HandEyeFit;
use super::options::{HandEyeOptions, Mount};
use super::otherwise;
use crate::calibrate::limits::rms;
use crate::fault::{Fault, Result};

/// Robot poses closer than this count as the same pose: 1 µm and 0.001 degrees.
const SAME_MM: f64 = 1e-3;
const SAME_RAD: f64 = 2e-5;

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

/// Refuses faults that are visible before any fit: too few poses, duplicates, rotation about one axis only.
pub fn before(pairs: &[Pair], mount: Mount, o: &HandEyeOptions) -> Result<()> {
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
    otherwise::both_in_metres(pairs, o)?;
    let spread = axis_spread(&pairs.iter().collect::<Vec<_>>());
    let [first, second, _] = spread.map(|s| s.1.to_degrees());
    if second < o.min_second_axis_deg {
        // Angles read in a wrong unit look like a robot that hardly rotates.
        if let Some(e) = otherwise::find(pairs, mount, false, false, o).filter(|e| e.refuses) {
            return Err(e.fault("the poses turn about one axis only".into()));
        }
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

/// From this rms misfit of a fit on, mm, one part of its pairs may differ from the rest. A robot that is less accurate
/// than its kind stays below it, and by itself it is no fault: the part must also explain the misfit.
const PARTS_MM: f64 = 1.0;
/// Below this ratio to chance, no other order of the poses is tried.
const SURELY: f64 = 0.02;

/// Refuses a fit that is no better than chance, that few pairs agree with, or that another notation, unit or order of
/// the poses would improve much. Returns the explanation for the excluded pairs, if one was found.
pub fn after(pairs: &[Pair], fit: &HandEyeFit, mount: Mount, o: &HandEyeOptions) -> Result<Option<String>> {
    let chosen: Vec<&Pair> = pairs.iter().zip(&fit.pairs).filter(|(_, r)| r.used).map(|(p, _)| p).collect();
    let used = chosen.len();
    let chance = chance(&chosen, o.seed);
    let what = format!(
        "pictures and robot poses do not belong together: {used} of {} pairs agree, the robot would scatter by \
         {:.2} mm and {:.3} degrees; their misfit is {:.0} % of that of poses dealt out at random (limit {:.0} %)",
        pairs.len(),
        fit.noise.robot_mm,
        fit.noise.robot_rad.to_degrees(),
        100.0 * chance,
        100.0 * BY_CHANCE
    );
    // Fewer than 60 % agreeing pairs could be a coincidence among wrong ones.
    if chance > BY_CHANCE || used * 10 < pairs.len() * 6 || used < o.min_pairs {
        return Err(otherwise::explain(pairs, what, mount, o));
    }
    let rms = rms(fit.pairs.iter().filter(|p| p.used).map(|p| p.mm));
    let parts_too = pairs.len() - used > 1 || rms > PARTS_MM;
    match otherwise::find(pairs, mount, chance > SURELY, parts_too, o) {
        Some(e) if e.refuses => Err(e.fault(what)),
        // The fit is wrong too if it took in most of the part that differs.
        Some(e) if 2 * e.part.iter().filter(|&&i| fit.pairs[i].used).count() > e.part.len() => {
            let what = format!(
                "robot poses and pictures disagree by {rms:.2} mm rms, and by {:.3} mm with one part of them changed",
                e.fits.then
            );
            Err(e.fault(what))
        }
        other => Ok(other.map(|e| e.cause)),
    }
}

/// For an excluded pair: the picture whose pose it fits, if any.
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
