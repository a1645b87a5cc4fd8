//! In: pairs of pictures of boards (room light, laser) and a station with a camera. Out: the laser plane's
//! calibration. The stripe is found by the scan engine's own stages and a straight line on each board.
//! Frame and unit: camera frame, mm.

use super::board_views::{Boards, FrameBoard, boards, unchecked_size};
use super::hand_eye::{Calibrated, first_line};
use super::room_light::{self, lit};
use super::straight::keep_straight;
use super::turned_light::{Flip, turned_against_ambient};
use crate::calibrate::laser_plane::options::LaserPlaneOptions;
use crate::calibrate::laser_plane::report::{covariance, judge, page};
use crate::calibrate::laser_plane::solve::{LaserPlaneFit, solve};
use crate::calibrate::laser_plane::views::{StripePeak, StripeView};
use crate::calibrate::limits::Asked;
use crate::calibrate::measured_pose::{intrinsic_covariance, pooled_factor};
use crate::camera::{CameraCovariance, Intrinsics};
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Plane, Vec2, Vec3};
use crate::raster::Image;
use crate::recording::{Beam, Recording, hot_pixels};
use crate::rig::{Calibration, Kind, Rig, Volume, hash_file};
use crate::scan::{Engine, Extraction, Format, Optical, Place, Processor, Where};

/// Options of [`calibrate_laser_plane`].
#[derive(Clone, Debug)]
pub struct LaserPlaneRun {
    /// Gates and seed of the fit.
    pub solver: LaserPlaneOptions,
    /// Depths and tolerance by which the result is judged.
    pub asked: Asked,
    /// How the stripe is extracted, as in a scan.
    pub extraction: Extraction,
    /// Where the stages run.
    pub place: Where,
}

/// Calibrates the laser plane from a recording with an `ambient` and a `laser` picture in each frame; the board has
/// the same pose in both.
pub fn calibrate_laser_plane(
    recording: &Recording,
    rig: &Rig,
    run: &LaserPlaneRun,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Calibrated<Plane<Camera>>> {
    run.asked.check()?;
    run.solver.check()?;
    let camera = rig.need_camera()?;
    recording.shows(Beam::Line)?;
    let Boards { found, mut missing } = boards(recording, camera, progress)?;
    let mut seen: Vec<FrameBoard> = Vec::new();
    let mut images = Vec::new();
    let mut names = Vec::new();
    for b in found {
        match &recording.meta.frames[b.frame].laser {
            Some(name) => {
                let (laser, ambient) = (recording.picture(name)?, recording.picture(&b.pose.name)?);
                images.push(room_light::alone(laser, &ambient, &b, &camera.value));
                names.push(name.clone());
                seen.push(b);
            }
            None => missing.push((b.pose.name.clone(), "its frame has no laser picture".into())),
        }
    }
    if seen.len() < 2 {
        return Err(Fault::refused(format!("{} frames with a board and a laser picture, 2 are needed", seen.len()))
            .cause("boards were not found, or the frames name no laser pictures")
            .next("record an ambient and a laser picture of each board pose"));
    }
    let c = intrinsic_covariance(&camera.covariance)?;
    let fit = |images: &[Image]| sheet_on_boards(&seen, images, &camera.value, &c, run);
    let turned = |flip: Flip| -> Result<Vec<Image>> {
        let one = |(name, b): (&String, &FrameBoard)| {
            let laser = flip.of(&recording.picture(name)?);
            Ok(room_light::alone(laser, &recording.picture(&b.pose.name)?, b, &camera.value))
        };
        names.iter().zip(&seen).map(one).collect()
    };
    let found = fit(&images);
    if let Some(fault) = turned_against_ambient(&images, &found, &turned, &fit)? {
        return Err(fault);
    }
    let (views, fit) = found.map_err(|fault| lit(recording, &names[names.len() / 2], fault))?;
    let lit = Volume::new(fit.reach[0], fit.reach[1], "where the boards were lit");
    let limits = run.asked.limits(&lit, |z| camera.value.view_mm(z));
    let mut quality = judge(&fit, &views, &camera.value, &limits);
    quality.reasons.push(unchecked_size(seen.iter().map(|s| &s.board)));
    quality.reasons.extend(missing.iter().map(|(name, why)| format!("{name} was not used: {}", first_line(why))));
    let page = page(&fit, &views, &quality, (camera.value.width, camera.value.height));
    let mut calibration = Calibration::new(Kind::LaserPlane, fit.plane, Some(camera), covariance(&fit), quality);
    calibration.hot_pixels = hot_pixels(std::slice::from_ref(recording)).places().to_vec();
    let inputs = &mut calibration.inputs;
    inputs.insert("meta.json".into(), hash_file(&recording.folder.join("meta.json"))?);
    for (s, laser) in seen.iter().zip(&names) {
        for name in [&s.pose.name, laser] {
            inputs.insert(name.clone(), hash_file(&recording.folder.join(name))?);
        }
    }
    Ok(Calibrated { calibration, page, missing })
}

/// Finds the stripe in pictures of boards, and the sheet, without prior knowledge of the sheet. `images` contain
/// only the laser's light.
pub(super) fn sheet_on_boards(
    seen: &[FrameBoard],
    images: &[Image],
    camera: &Intrinsics,
    c: &CameraCovariance,
    run: &LaserPlaneRun,
) -> Result<(Vec<StripeView>, LaserPlaneFit)> {
    let factor = pooled_factor(seen.iter().map(|s| &s.pose)).unwrap_or(f64::NAN);
    let processor = run.place.open()?;
    let device = match &processor {
        Processor::Gpu(device) => Some(device),
        Processor::Host(_) => None,
    };
    let fit_with = |laser: &Plane<Camera>, depth_mm: [f64; 2]| -> Result<(Vec<StripeView>, LaserPlaneFit)> {
        let peaks = stripes(images, camera, laser, depth_mm, run, &processor)?;
        let mut views: Vec<StripeView> = seen
            .iter()
            .zip(peaks)
            .map(|(s, peaks)| StripeView { pose: s.pose.clone(), board: s.board.clone(), peaks })
            .collect();
        keep_straight(&mut views, camera, device)?;
        let fit = solve(&views, camera, c, factor, &run.solver)?;
        Ok((views, fit))
    };
    // The plane is unknown so far: whole pictures are used, with the stripe assumed first along rows and then along
    // columns. The better plane is then used to run the stages again as in a scan.
    let everywhere = [0.0, f64::INFINITY];
    let unknown = |across: Vec3| Plane::new(across * 1e-3 + Vec3::z(), 1000.0).expect("not zero");
    let guesses = [fit_with(&unknown(Vec3::y()), everywhere), fit_with(&unknown(Vec3::x()), everywhere)];
    let used = |r: &Result<(Vec<StripeView>, LaserPlaneFit)>| {
        r.as_ref().map_or(0, |(_, f)| f.views.iter().map(|v| v.peaks_used).sum::<usize>())
    };
    let best = if used(&guesses[0]) >= used(&guesses[1]) { 0 } else { 1 };
    let guess = guesses.into_iter().nth(best).expect("two guesses")?.1.plane;
    fit_with(&guess, everywhere)
}

/// The stripe's peaks in each picture, by the stages that a scan uses.
fn stripes(
    images: &[Image],
    camera: &Intrinsics,
    laser: &Plane<Camera>,
    depth_mm: [f64; 2],
    run: &LaserPlaneRun,
    processor: &Processor,
) -> Result<Vec<Vec<StripePeak>>> {
    let first = &images[0];
    let format = Format { width: first.width, height: first.height, bits: first.bits };
    let optical = Optical { camera: *camera, laser: *laser, depth_mm };
    let mut engine = Engine::new(format, &optical, &run.extraction, None, processor.clone());
    if run.extraction.measure_stripe
        && let Some(seen) = engine.measure(&images.iter().collect::<Vec<_>>())
    {
        engine.set_stripe(&seen.stripe)?;
        engine.set_hot(seen.hot);
    }
    for (i, image) in images.iter().enumerate() {
        engine.submit(i as u32, image.clone(), Place::camera())?;
    }
    let mut out = vec![Vec::new(); images.len()];
    for measured in engine.collect(true)? {
        let mut peaks: Vec<StripePeak> = measured
            .peaks
            .iter()
            .filter(|p| p.kept())
            .map(|p| StripePeak {
                pixel: Vec2::new(f64::from(p.u), f64::from(p.v)),
                sigma_px: f64::from(p.sigma_px),
                width_px: f64::from(p.width_px),
            })
            .collect();
        // Sorted along the stripe, whatever the order of the stages' results.
        let columns = laser.normal.y.abs() >= laser.normal.x.abs();
        peaks.sort_by(|a, b| {
            let key = |p: &StripePeak| if columns { p.pixel.x } else { p.pixel.y };
            key(a).total_cmp(&key(b))
        });
        out[measured.shot as usize] = peaks;
    }
    Ok(out)
}
