//! In: a station, scans of a flat surface, touched points. Out: what the fits said and, apart from it,
//! what checks with other data say.
//! Frame and unit: base frame; mm, px, degrees.

use crate::calibrate::verify::{FlatCheck, TouchCheck, flat, read_touches, touch};
use crate::fault::{Fault, Result};
use crate::geometry::Vec3;
use crate::rig::{Calibration, Rig};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What [`verify`] compares.
#[derive(Clone, Debug, Default)]
pub struct VerifyRun {
    /// Scan folders of one flat surface.
    pub flats: Vec<PathBuf>,
    /// Shots that belong to one pose of a flat scan; 0: each scan is one view.
    pub shots_per_view: u32,
    /// File of predicted and touched points.
    pub touches: Option<PathBuf>,
}

/// Fit and verification of one calibration, never mixed.
#[derive(Clone, Debug, serde::Serialize)]
pub struct CalibrationCheck {
    pub verdict: String,
    /// Residuals of the data that was fitted.
    pub fit: BTreeMap<String, f64>,
    /// Errors on data that was left out of the fit, and the expected error.
    pub verification: BTreeMap<String, f64>,
}

/// What [`verify`] found.
#[derive(Clone, Debug, serde::Serialize)]
pub struct VerifyReport {
    pub calibrations: BTreeMap<String, CalibrationCheck>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flat: Option<FlatCheck>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touch: Option<TouchCheck>,
    /// What the calibrations' own files say against them.
    pub remarks: Vec<String>,
}

fn check<T>(c: &Calibration<T>) -> CalibrationCheck {
    let pick = |f: &dyn Fn(&str) -> bool| -> BTreeMap<String, f64> {
        c.quality.figures.iter().filter(|(k, _)| f(k)).map(|(k, v)| (k.clone(), *v)).collect()
    };
    CalibrationCheck {
        verdict: c.quality.verdict.words().into(),
        fit: pick(&|k| k.starts_with("rms_")),
        verification: pick(&|k| k.starts_with("holdout") || k.starts_with("expected_error")),
    }
}

/// Checks a station with data that its calibrations did not see.
pub fn verify(rig: &Rig, run: &VerifyRun) -> Result<VerifyReport> {
    let mut calibrations = BTreeMap::new();
    let mut add = |name: &str, c: Option<CalibrationCheck>| c.map(|c| calibrations.insert(name.to_owned(), c));
    add("camera", rig.camera.as_ref().map(check));
    add("laser plane", rig.laser_plane.as_ref().map(check));
    add("pointer", rig.pointer.as_ref().map(check));
    add("hand-eye", rig.hand_eye.as_ref().map(check));
    if calibrations.is_empty() {
        return Err(Fault::input("the station holds no calibration")
            .cause("another folder was given as --station")
            .next("calibrate it first"));
    }
    let mut views: Vec<(String, Vec<Vec3>)> = Vec::new();
    for folder in &run.flats {
        let mut parts: BTreeMap<u32, Vec<Vec3>> = BTreeMap::new();
        for p in super::cloud_of(folder)? {
            let view = p.shot.checked_div(run.shots_per_view).unwrap_or(0);
            parts.entry(view).or_default().push(Vec3::from(p.position.map(f64::from)));
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
    let mut remarks = rig.remarks();
    remarks.extend(rig.belong_together().err().map(|fault| fault.what));
    Ok(VerifyReport { calibrations, flat, touch, remarks })
}
