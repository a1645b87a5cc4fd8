//! In: pairs of pictures of boards (room light, pointer) and a station with a camera. Out: the
//! pointer's calibration.
//! Frame and unit: camera frame, mm.

use super::board_views::{Boards, boards, unchecked_size};
use super::hand_eye::{Calibrated, first_line};
use super::room_light::{self, lit};
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::{intrinsic_covariance, pooled_factor};
use crate::calibrate::pointer::report::{covariance, judge, page};
use crate::calibrate::pointer::solve::{PointerOptions, SpotView, solve};
use crate::calibrate::pointer::spot::{SpotOptions, SpotPicture, find_spots, hot_pixels};
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Ray};
use crate::recording::{Beam, Recording};
use crate::rig::{Calibration, Kind, Rig, Volume, hash_file};

/// Options of [`calibrate_pointer`].
#[derive(Clone, Debug)]
pub struct PointerRun {
    /// How the spot is found in the pictures.
    pub spots: SpotOptions,
    /// Settings of the fit.
    pub solver: PointerOptions,
    /// Depths and tolerance by which the result is judged.
    pub asked: Asked,
}

/// Calibrates the pointer from a recording with an `ambient` and a `laser` picture in each frame; the board has the
/// same pose in both.
pub fn calibrate_pointer(
    recording: &Recording,
    rig: &Rig,
    run: &PointerRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Calibrated<Ray<Camera>>> {
    run.asked.check()?;
    run.solver.check()?;
    let camera = rig.need_camera()?;
    recording.shows(Beam::Pointer)?;
    let Boards { found, mut missing } = boards(recording, camera, progress)?;
    let mut pictures = Vec::new();
    for b in found {
        match &recording.meta.frames[b.frame].laser {
            Some(name) => {
                let (laser, ambient) = (recording.picture(name)?, recording.picture(&b.pose.name)?);
                let laser = room_light::alone(laser, &ambient, &b, &camera.value);
                pictures.push((b, name.clone(), laser, ambient));
            }
            None => missing.push((b.pose.name.clone(), "its frame has no laser picture".into())),
        }
    }
    if pictures.is_empty() {
        return Err(Fault::refused("no frame has both a board and a laser picture")
            .cause("boards were not found, or the frames name no laser pictures")
            .next("record an ambient and a laser picture of each board pose"));
    }
    let hot = hot_pixels(&pictures.iter().map(|p| &p.2).collect::<Vec<_>>());
    let asked: Vec<SpotPicture<'_>> =
        pictures.iter().map(|(_, name, laser, ambient)| SpotPicture { name, laser, ambient: Some(ambient) }).collect();
    let mut views = Vec::new();
    for (found, (b, name, _, _)) in find_spots(&asked, &hot, &run.spots)?.into_iter().zip(&pictures) {
        match found {
            Ok(spot) => views.push(SpotView { pose: b.pose.clone(), pixel: spot.pixel, covariance: spot.covariance }),
            Err(fault) => missing.push((name.clone(), fault.to_string())),
        }
    }
    let factor = pooled_factor(views.iter().map(|v| &v.pose)).unwrap_or(f64::NAN);
    let c = intrinsic_covariance(&camera.covariance)?;
    let fit = solve(&views, &camera.value, &c, factor, &run.solver).map_err(|mut fault| {
        if let Some((name, why)) = missing.first() {
            fault.cause = format!("{}; {name}: {}", fault.cause, first_line(why));
        }
        lit(recording, &pictures[pictures.len() / 2].1, fault)
    })?;
    let mut sigmas: Vec<f64> = views.iter().map(|v| (v.covariance.trace() / 2.0).sqrt()).collect();
    sigmas.sort_by(f64::total_cmp);
    let seen = Volume::new(fit.reach[0], fit.reach[1], "where the spots lay");
    let limits = run.asked.limits(&seen, |z| camera.value.view_mm(z));
    let mut quality = judge(&fit, &camera.value, sigmas[sigmas.len() / 2], &limits);
    quality.reasons.push(unchecked_size(pictures.iter().map(|(b, ..)| &b.board)));
    quality.reasons.extend(missing.iter().map(|(name, why)| format!("{name} was not used: {}", first_line(why))));
    let page = page(&fit, &quality);
    let mut calibration = Calibration::new(Kind::Pointer, fit.beam, Some(camera), covariance(&fit), quality);
    let inputs = &mut calibration.inputs;
    inputs.insert("meta.json".into(), hash_file(&recording.folder.join("meta.json"))?);
    for (b, laser, _, _) in &pictures {
        for name in [&b.pose.name, laser] {
            inputs.insert(name.clone(), hash_file(&recording.folder.join(name))?);
        }
    }
    Ok(Calibrated { calibration, page, missing })
}
