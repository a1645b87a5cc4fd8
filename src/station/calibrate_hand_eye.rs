//! In: a recording of a fixed board with robot poses, a station with a camera. Out: the hand-eye
//! calibration, its report, and the files it came from.
//! Frame and unit: flange_from_camera (eye in hand) or base_from_camera (eye to hand); mm, rad.

use super::board_views::{FrameBoard, boards};
use crate::calibrate::boards::turns;
use crate::calibrate::hand_eye::{HandEyeOptions, Mount, solve};
use crate::calibrate::hand_eye_closed::Pair;
use crate::calibrate::hand_eye_report::{covariance, judge, page};
use crate::calibrate::hand_eye_turns::{read_with, resolve};
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::{AboutCamera, intrinsic_covariance};
use crate::calibrate::report::Page;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Flange, Rigid};
use crate::recording::Recording;
use crate::rig::{Calibration, HandEye, Kind, Rig, Volume, hash_text};

/// How [`calibrate_hand_eye`] is run.
#[derive(Clone, Debug)]
pub struct HandEyeRun {
    /// Name of the pose file in the recording; `None`: the one that meta.json names.
    pub poses: Option<String>,
    pub mount: Mount,
    pub solver: HandEyeOptions,
    /// Judged where the laser plane is used, unless stated; without a laser plane where the boards stood.
    pub asked: Asked,
}

/// What a calibration command leaves: the record to be stored, the page to be read.
pub struct Calibrated<T> {
    pub calibration: Calibration<T>,
    pub page: Page,
    /// Pictures that could not be used, with the reason.
    pub missing: Vec<(String, String)>,
}

/// Where the camera sits.
pub enum HandEyeResult {
    OnFlange(Calibrated<HandEye>),
    InBase(Calibrated<Rigid<Base, Camera>>),
}

/// Calibrates the hand-eye transform from a recording of one board that stands still (eye in hand)
/// or is carried by the flange (eye to hand). `progress` is told (pictures done, pictures in all).
pub fn calibrate_hand_eye(
    recording: &Recording,
    rig: &Rig,
    run: &HandEyeRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<HandEyeResult> {
    run.asked.check()?;
    run.solver.check()?;
    let camera = rig.need_camera()?;
    let poses = recording.poses(run.poses.as_deref())?;
    let seen = boards(recording, &camera.value, progress)?;
    let mut pairs = Vec::new();
    for b in &seen.found {
        let pose: &Rigid<Base, Flange> = recording.pose_of(b.frame, &poses).map_err(|e| e.at(&b.pose.name))?;
        let (r, t) = match run.mount {
            Mount::EyeInHand => (pose.inverse().rotation, pose.inverse().translation),
            Mount::EyeToHand => (pose.rotation, pose.translation),
        };
        pairs.push(Pair { near_from_far: Rigid::new(r, t), seen: b.pose.clone() });
    }
    let again = said_already(recording, camera, &mut pairs)?;
    let turned = one_origin(&mut pairs, &seen.found, run.solver.seed)?;
    let fit = solve(&pairs, run.mount, &intrinsic_covariance(&camera.covariance), &camera.value, &run.solver)?;
    let depths = pairs.iter().map(|p| p.seen.centre().z);
    let work = super::volume::calibrated(rig).or_else(|| Volume::spanned(depths, "where the boards stood"));
    let limits = run.asked.limits(&work.expect("pairs with boards"), |z| camera.value.view_mm(z));
    let mut quality = judge(&fit, &pairs, &limits);
    quality.reasons.extend(seen.missing.iter().map(|(name, why)| format!("{name} was not used: {}", first_line(why))));
    quality.reasons.extend(turned);
    if again > 0 {
        quality.reasons.push(format!(
            "{again} of these pictures are among those that the camera was calibrated with: what they say of it counts once"
        ));
    }
    let x = fit.chain.near_from_camera;
    let pose_name = run.poses.clone().or(recording.meta.pose_file.clone()).unwrap_or_default();
    let sources = |c: &mut std::collections::BTreeMap<String, String>| -> Result<()> {
        c.insert("meta.json".into(), crate::rig::hash_file(&recording.folder.join("meta.json"))?);
        let rows: Vec<[f64; 16]> = poses.iter().map(|p| p.to_rows()).collect();
        c.insert(format!("poses {pose_name}"), hash_text(serde_json::to_string(&rows).expect("numbers").as_bytes()));
        for b in &seen.found {
            c.insert(b.pose.name.clone(), crate::rig::hash_file(&recording.folder.join(&b.pose.name))?);
        }
        Ok(())
    };
    Ok(match run.mount {
        Mount::EyeInHand => {
            let page = page(&fit, &pairs, &quality, "flange");
            let value = HandEye::new(x.rotation, x.translation);
            let mut calibration = Calibration::new(Kind::HandEye, value, Some(camera), covariance(&fit), quality);
            sources(&mut calibration.inputs)?;
            HandEyeResult::OnFlange(Calibrated { calibration, page, missing: seen.missing })
        }
        Mount::EyeToHand => {
            let page = page(&fit, &pairs, &quality, "base");
            let value = Rigid::<Base, Camera>::new(x.rotation, x.translation);
            let mut calibration = Calibration::new(Kind::BaseCamera, value, Some(camera), covariance(&fit), quality);
            sources(&mut calibration.inputs)?;
            HandEyeResult::InBase(Calibrated { calibration, page, missing: seen.missing })
        }
    })
}

/// Pictures that went into the camera's calibration have said what they know of the camera: here they speak of the
/// board's pose alone. Returns how many there are.
fn said_already(recording: &Recording, camera: &Calibration<Intrinsics>, pairs: &mut [Pair]) -> Result<usize> {
    let known: std::collections::BTreeSet<&String> = camera.inputs.values().collect();
    let mut count = 0;
    for pair in pairs {
        if known.contains(&crate::rig::hash_file(&recording.folder.join(&pair.seen.name))?) {
            pair.seen.about_camera = AboutCamera::silent();
            count += 1;
        }
    }
    Ok(count)
}

/// Reads a board that looks the same after a turn alike in all pictures, and says so.
fn one_origin(pairs: &mut [Pair], found: &[FrameBoard], seed: u64) -> Result<Option<String>> {
    if !found.iter().any(|b| b.ambiguous) {
        return Ok(None);
    }
    if let Some(b) = found.iter().find(|b| b.board != found[0].board) {
        return Err(Fault::input(format!("{} shows another board than {}", b.pose.name, found[0].pose.name))
            .cause("a hand-eye recording shows one board that does not move against its carrier")
            .next("keep the pictures of one board"));
    }
    let turns = turns(&found[0].board);
    let chosen = resolve(pairs, &turns, seed)?;
    for (pair, k) in pairs.iter_mut().zip(&chosen) {
        *pair = read_with(pair, &turns[*k]);
    }
    let anew = chosen.iter().filter(|k| **k != 0).count();
    Ok(Some(format!(
        "the board looks the same after a turn: its origin was told by the robot's poses, {anew} of {} pictures are read turned",
        chosen.len()
    )))
}

pub(super) fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or("")
}
