//! In: a station folder. Out: the rig in its `calibration/` subfolder, loaded and stored so that no
//! file is ever half-replaced and the former one stays beside it.
//! Frame and unit: as in the records.

use super::{Calibration, HandEye};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Plane, Ray};
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// What has been measured of a station; every part may be missing.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    pub camera: Option<Calibration<Intrinsics>>,
    pub laser_plane: Option<Calibration<Plane<Camera>>>,
    pub pointer: Option<Calibration<Ray<Camera>>>,
    pub hand_eye: Option<Calibration<HandEye>>,
}

impl Rig {
    /// Loads what there is in `station/calibration`.
    pub fn load(station: &Path) -> Result<Rig> {
        let rig = Rig {
            camera: load(station, "camera")?,
            laser_plane: load(station, "laser_plane")?,
            pointer: load(station, "pointer")?,
            hand_eye: load(station, "hand_eye")?,
        };
        if let Some(c) = &rig.camera {
            c.value.check()?;
        }
        Ok(rig)
    }

    /// Stores one calibration under `station/calibration/<kind>.json`; a former one is kept as
    /// `<kind>.previous.json`. Either the new file is complete or the old one is untouched.
    pub fn store<T: Serialize>(station: &Path, calibration: &Calibration<T>) -> Result<PathBuf> {
        let path = file(station, &calibration.kind);
        let folder = station.join("calibration");
        std::fs::create_dir_all(&folder).map_err(|e| Fault::write(&folder, e))?;
        if let Ok(former) = std::fs::read(&path) {
            crate::files::write(&path.with_extension("previous.json"), &former)?;
        }
        let text = serde_json::to_string_pretty(calibration).expect("plain data");
        crate::files::write(&path, text.as_bytes())?;
        Ok(path)
    }

    /// The camera, or what to do about its absence.
    pub fn need_camera(&self) -> Result<&Calibration<Intrinsics>> {
        self.camera.as_ref().ok_or_else(|| missing("camera", "sheetlight calibrate camera"))
    }
    pub fn need_laser_plane(&self) -> Result<&Calibration<Plane<Camera>>> {
        self.laser_plane.as_ref().ok_or_else(|| missing("laser plane", "sheetlight calibrate laser-plane"))
    }
    pub fn need_pointer(&self) -> Result<&Calibration<Ray<Camera>>> {
        self.pointer.as_ref().ok_or_else(|| missing("pointer", "sheetlight calibrate pointer"))
    }
    pub fn need_hand_eye(&self) -> Result<&Calibration<HandEye>> {
        self.hand_eye.as_ref().ok_or_else(|| missing("hand-eye transform", "sheetlight calibrate hand-eye"))
    }

    /// One hash over the values that turn pixels into points; a scan keeps it, so that a later
    /// step can tell whether it was taken with the station's present calibration.
    pub fn fingerprint(&self) -> String {
        let values = serde_json::json!({
            "camera": self.camera.as_ref().map(|c| c.value),
            "laser_plane": self.laser_plane.as_ref().map(|c| c.value),
            "hand_eye": self.hand_eye.as_ref().map(|c| c.value),
        });
        super::hash_text(values.to_string().as_bytes())
    }
}

fn missing(what: &str, command: &str) -> Fault {
    Fault::input(format!("the station has no {what} calibration"))
        .cause("it was never calibrated, or another folder was given as --station")
        .next(format!("run {command}, or import known values with sheetlight station import"))
}

fn file(station: &Path, kind: &str) -> PathBuf {
    station.join("calibration").join(format!("{kind}.json"))
}

fn load<T: DeserializeOwned>(station: &Path, kind: &str) -> Result<Option<Calibration<T>>> {
    let path = file(station, kind);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(Fault::read(&path, e)),
    };
    let found: Calibration<T> = serde_json::from_str(&text).map_err(|e| {
        Fault::input(format!("{}: is not a calibration file: {e}", path.display()))
            .cause("edited by hand, truncated, or of a newer version")
            .next("calibrate again, or rename the .previous.json beside it")
    })?;
    found.check(kind).map_err(|e| e.at(path.display()))?;
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::super::{Covariance, Quality, Verdict};
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn the_former_calibration_stays_beside_the_new_one() {
        let dir = tempfile::tempdir().unwrap();
        let quality = Quality {
            verdict: Verdict::Good,
            reasons: vec![],
            advice: vec![],
            figures: Default::default(),
            per_picture: vec![],
        };
        let plane = |offset| {
            Calibration::new(
                "laser_plane",
                "camera",
                Plane::<Camera>::new(Vec3::new(0.0, 0.9, 0.4), offset).unwrap(),
                Covariance::default(),
                quality.clone(),
            )
        };
        Rig::store(dir.path(), &plane(70.0)).unwrap();
        let first = Rig::load(dir.path()).unwrap();
        Rig::store(dir.path(), &plane(71.0)).unwrap();
        let second = Rig::load(dir.path()).unwrap();
        assert_ne!(first.fingerprint(), second.fingerprint());
        let former = std::fs::read_to_string(dir.path().join("calibration/laser_plane.previous.json")).unwrap();
        let former: Calibration<Plane<Camera>> = serde_json::from_str(&former).unwrap();
        assert_eq!(former.value, first.laser_plane.unwrap().value);
        assert!(second.camera.is_none() && second.need_camera().is_err());
    }
}
