//! In: a station, scans of a flat surface, scans of one object from several sides, touched points. Out: the
//! residuals of the fits and, separately, the results of checks with other data.
//! Frame and unit: base frame; mm, px, degrees.

use super::find::{different, fits};
use crate::calibrate::verify::{FlatCheck, TouchCheck, flat, read_touches, touch};
use crate::fault::{Fault, Result};
use crate::find::look::looks::{Disagreement, Look, agree};
use crate::find::look::register::{Registered, register};
use crate::find::measure::points::Ordered;
use crate::geometry::Vec3;
use crate::rig::{Quality, Record, Rig};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The data that [`verify`] compares.
#[derive(Clone, Debug, Default)]
pub struct VerifyRun {
    /// Scan folders of one flat surface.
    pub flats: Vec<PathBuf>,
    /// Number of shots of one pose in a flat scan; 0: each scan is one view.
    pub shots_per_view: u32,
    /// Scan folders of one object of any shape, from several sides.
    pub object: Vec<PathBuf>,
    /// File of predicted and touched points.
    pub touches: Option<PathBuf>,
}

/// How scans of one object agree.
#[derive(Clone, Debug, serde::Serialize)]
pub struct ObjectCheck {
    /// For each scan: its name, the share of its surfaces that the first scan saw too, and their rms distance from
    /// those, mm.
    pub scans: Vec<(String, f64, f64)>,
    /// The disagreement along the base's axes about the object's middle.
    pub looks: Disagreement,
}

/// Fit and verification of one calibration, never mixed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CalibrationCheck {
    /// good, usable, badly determined, refused, or "of another camera".
    pub verdict: String,
    /// Residuals of the data that was fitted.
    pub fit: BTreeMap<String, f64>,
    /// Errors on data that was excluded from the fit, and the expected error.
    pub verification: BTreeMap<String, f64>,
}

/// Result of [`verify`].
#[derive(Clone, Debug, serde::Serialize)]
pub struct VerifyReport {
    /// Checks by name of the calibration, e.g. "laser plane".
    pub calibrations: BTreeMap<String, CalibrationCheck>,
    /// How the views of the flat surface agree; `None` where no flat scan was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flat: Option<FlatCheck>,
    /// How the scans of the object agree; `None` where none was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<ObjectCheck>,
    /// How predicted and touched points agree; `None` where no file was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchCheck>,
    /// Warnings in the calibration files.
    pub remarks: Vec<String>,
}

/// Verdict of a calibration that was measured with another camera than the station's.
const OTHER_CAMERA: &str = "of another camera";

fn check(quality: &Quality) -> CalibrationCheck {
    let pick = |f: &dyn Fn(&str) -> bool| -> BTreeMap<String, f64> {
        quality.figures.iter().filter(|(k, _)| f(k)).map(|(k, v)| (k.clone(), *v)).collect()
    };
    CalibrationCheck {
        verdict: quality.verdict.words().into(),
        fit: pick(&|k| k.starts_with("rms_")),
        verification: pick(&|k| k.starts_with("holdout") || k.starts_with("expected_error")),
    }
}

/// Checks a station with data that its calibrations did not use.
pub fn verify(rig: &Rig, run: &VerifyRun) -> Result<VerifyReport> {
    let stale = rig.stale();
    let checked = |part: &dyn Record| {
        let other = stale.iter().any(|(kind, _)| *kind == part.kind());
        let judged = check(part.quality());
        (part.kind().words(), if other { CalibrationCheck { verdict: OTHER_CAMERA.into(), ..judged } } else { judged })
    };
    let calibrations: BTreeMap<String, CalibrationCheck> = rig.records().into_iter().map(checked).collect();
    if calibrations.is_empty() {
        return Err(Fault::input("the station has no calibration")
            .cause("another folder was given as --station")
            .next("calibrate it first"));
    }
    let mut views: Vec<(String, Vec<Vec3>)> = Vec::new();
    for folder in &run.flats {
        let mut parts: BTreeMap<u32, Vec<Vec3>> = BTreeMap::new();
        for p in super::cloud_of(folder)? {
            let view = p.shot.checked_div(run.shots_per_view).unwrap_or(0);
            parts.entry(view).or_default().push(p.at());
        }
        let label =
            folder.file_name().map_or_else(|| folder.display().to_string(), |n| n.to_string_lossy().into_owned());
        for (k, points) in parts {
            let name = if run.shots_per_view > 0 { format!("{label}, view {k}") } else { label.clone() };
            views.push((name, points));
        }
    }
    let touch = match &run.touches {
        None => None,
        Some(path) => {
            let text = crate::files::read_text(path)?;
            Some(touch(&read_touches(&text).map_err(|e| e.at(path.display()))?)?)
        }
    };
    let flat = if run.flats.is_empty() { None } else { Some(flat(&views)?) };
    let object = if run.object.is_empty() { None } else { Some(object(rig, &run.object)?) };
    let mut remarks = rig.remarks();
    remarks.extend(object.as_ref().and_then(ObjectCheck::remark));
    remarks.extend(stale.into_iter().map(|(_, what)| what));
    remarks.extend(rig.unfinished());
    Ok(VerifyReport { calibrations, flat, object, touch, remarks })
}

/// A disagreement of more than this many standard deviations comes from a calibration, the robot, or an object that
/// was moved.
const RATIO: f64 = 3.0;

/// Registers the scans' surfaces and judges their disagreement.
fn object(rig: &Rig, folders: &[PathBuf]) -> Result<ObjectCheck> {
    different(folders)?;
    let mut scans = Vec::new();
    // The scans of one object use the same parts of the rig: they have one fingerprint.
    let mut rig = rig.clone();
    for folder in folders {
        let report = super::load_report(folder)?;
        rig = report.parts_of(&rig);
        fits(&rig, folder, &report)?;
        let points = Ordered::new(&super::lit_cloud_of(folder)?, &super::shots_of(folder)?)
            .map_err(|e| e.at(folder.display()))?;
        scans.push((folder.display().to_string(), points));
    }
    let registered = register(&scans, &rig)?;
    let looks: Vec<Look> =
        registered.iter().map(|r| Look { base_from_part: r.base_from_object, budget: &r.budget }).collect();
    let looks = agree(&looks, None, 0.0, RATIO)?.disagreement;
    let said = |(scan, r): (&(String, Ordered), &Registered)| (scan.0.clone(), r.overlap, r.rms_mm);
    Ok(ObjectCheck { scans: scans.iter().zip(&registered).map(said).collect(), looks })
}

impl ObjectCheck {
    /// The cause that best explains a disagreement that is larger than expected.
    fn remark(&self) -> Option<String> {
        let l = &self.looks;
        let best = l.explained_by.first().filter(|_| l.ratio > RATIO || l.misfit_sigmas > RATIO)?;
        let off: Vec<String> = best.off_by.iter().map(|(name, by)| format!("{name} by {by:+.3}")).collect();
        Some(format!(
            "the scans of the object disagree by {:.1} times the amount that the calibrations state; an error of the \
             {} explains {:.0} % of it: {}",
            l.ratio,
            best.name,
            100.0 * best.share,
            off.join(", ")
        ))
    }
}
