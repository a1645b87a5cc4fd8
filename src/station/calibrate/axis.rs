//! In: pictures of a board that is mounted on a linear axis or turntable, with their counts, and a station with a
//! camera. Out: the axis' calibration, its report, and its input files.
//! Frame and unit: camera frame, mm, rad, counts.

use super::board_views::{FrameBoard, boards};
use super::hand_eye::{Calibrated, first_line};
use crate::calibrate::axis::fit::Stop;
use crate::calibrate::axis::report::{covariance, judge, kind, page};
use crate::calibrate::axis::solve::{AxisOptions, solve};
use crate::calibrate::boards::turns;
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::intrinsic_covariance;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, angle_between};
use crate::recording::Recording;
use crate::rig::{Calibration, Rig, Volume, hash_file};

/// Options of [`calibrate_axis`].
#[derive(Clone, Debug, Default)]
pub struct AxisRun {
    /// Gate and seed of the fit.
    pub solver: AxisOptions,
    /// Depths and tolerance by which the result is judged.
    pub asked: Asked,
}

/// Calibrates the axis that the recording's `motion` names. `progress` receives (pictures done, pictures in all).
pub fn calibrate_axis(
    recording: &Recording,
    rig: &Rig,
    run: &AxisRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Calibrated<Axis>> {
    run.asked.check()?;
    let camera = rig.need_camera()?;
    let counts = recording.counts()?;
    let motion = recording.meta.motion();
    let (Some(moved), Some(unit)) = (motion.axis(), motion.unit) else {
        unreachable!("a recording with counts is an axis', and its unit was checked")
    };
    let seen = boards(recording, camera, progress)?;
    let mut missing = seen.missing;
    let mut found: Vec<(f64, FrameBoard)> = Vec::new();
    for b in seen.found {
        match counts[b.frame] {
            Some(count) => found.push((count, b)),
            None => missing.push((b.pose.name.clone(), "its count is not known".into())),
        }
    }
    let board = found.first().map(|(_, b)| b.board.clone());
    let board = board.ok_or_else(|| {
        Fault::refused("no picture has a board and a count").next("give every frame its count (docs/file-formats.md)")
    })?;
    if found.iter().any(|(_, b)| b.board != board) {
        return Err(Fault::input("several boards ride on the axis, one is needed")
            .cause("frames of several recordings were merged")
            .next("record one board that does not move on the axis"));
    }
    let notes = one_origin(&mut found);
    let stops: Vec<Stop> = found.iter().map(|(count, b)| Stop { count: *count, pose: b.pose.clone() }).collect();
    let fit = solve(&stops, moved, unit, &intrinsic_covariance(&camera.covariance)?, &run.solver)?;
    let depths = Volume::spanned(stops.iter().map(|s| s.pose.centre().z), "where the boards stood");
    let limits = run.asked.limits(&depths.expect("three stops or more"), |z| camera.value.view_mm(z));
    let mut quality = judge(&fit, &limits, &format!("{} in meta.json", board.length_key()));
    quality.reasons.extend(notes);
    quality.reasons.extend(missing.iter().map(|(name, why)| format!("{name} was not used: {}", first_line(why))));
    let page = page(&fit, &quality);
    let mut calibration = Calibration::new(kind(&fit), fit.axis, Some(camera), covariance(&fit), quality);
    calibration.inputs.insert("meta.json".into(), hash_file(&recording.folder.join("meta.json"))?);
    if let Some(name) = &motion.counts_file {
        calibration.inputs.insert(name.clone(), hash_file(&recording.inside(name)?)?);
    }
    for (_, b) in &found {
        calibration.inputs.insert(b.pose.name.clone(), hash_file(&recording.folder.join(&b.pose.name))?);
    }
    Ok(Calibrated { calibration, page, missing })
}

/// Resolves a board that looks the same after a turn: of the possible poses the one nearest to the previous stop's
/// is taken.
fn one_origin(found: &mut [(f64, FrameBoard)]) -> Option<String> {
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all = turns(&found[0].1.board);
    if all.len() < 2 {
        return None;
    }
    for i in 1..found.len() {
        let before = found[i - 1].1.pose.camera_from_board.rotation;
        let now = found[i].1.pose.camera_from_board;
        let read = all.iter().map(|t| now * t.turn.inverse());
        let nearest =
            read.min_by(|a, b| angle_between(&a.rotation, &before).total_cmp(&angle_between(&b.rotation, &before)));
        found[i].1.pose.camera_from_board = nearest.expect("one turn or more");
    }
    Some(format!(
        "the board looks the same in {} orientations: it is assumed to turn by less than {} degrees between stops",
        all.len(),
        180 / all.len()
    ))
}
