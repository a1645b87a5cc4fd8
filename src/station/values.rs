//! In: known values of a rig (a data sheet, another program, a truth file). Out: calibration files;
//! and the other way round, for programs that compare.
//! Frame and unit: keys as in the reference data's format: `flange_T_camera`, mm, row-major.

use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Plane, Ray, Vec3};
use crate::rig::{Calibration, Covariance, HandEye, Quality, Rig, Verdict};
use std::path::Path;

/// The values of a rig as one JSON object; every entry may be missing, other keys are left alone.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Values {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<Intrinsics>,
    #[serde(rename = "flange_T_camera", default, skip_serializing_if = "Option::is_none")]
    pub flange_from_camera: Option<HandEye>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser_plane_camera: Option<PlaneValue>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointer_camera: Option<PointerValue>,
}

/// `normal · X = offset_mm` in the camera frame.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PlaneValue {
    pub normal: [f64; 3],
    pub offset_mm: f64,
}

/// The pointer's beam in the camera frame: a point on it (mm) and its direction.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PointerValue {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
}

impl Values {
    pub fn load(path: &Path) -> Result<Values> {
        let text = std::fs::read_to_string(path).map_err(|e| Fault::read(path, e))?;
        serde_json::from_str(&text).map_err(|e| {
            Fault::input(format!("{}: holds no rig values: {e}", path.display()))
                .cause("not JSON, or an entry of another shape")
                .next("use the keys intrinsics, flange_T_camera, laser_plane_camera, pointer_camera of docs/file-formats.md")
        })
    }

    pub fn of(rig: &Rig) -> Values {
        Values {
            intrinsics: rig.camera.as_ref().map(|c| c.value),
            flange_from_camera: rig.hand_eye.as_ref().map(|c| c.value),
            laser_plane_camera: rig
                .laser_plane
                .as_ref()
                .map(|c| PlaneValue { normal: c.value.normal.into(), offset_mm: c.value.offset }),
            pointer_camera: rig
                .pointer
                .as_ref()
                .map(|c| PointerValue { origin: c.value.origin.into(), direction: c.value.direction.into() }),
        }
    }

    /// Stores each value as a calibration whose covariance is unknown, naming `source` as its
    /// input. Returns the kinds stored.
    pub fn store(&self, station: &Path, source: &Path) -> Result<Vec<&'static str>> {
        let mut stored = Vec::new();
        if let Some(camera) = self.intrinsics {
            camera.check()?;
            Rig::store(station, &imported("camera", "camera", camera, source)?)?;
            stored.push("camera");
        }
        if let Some(p) = &self.laser_plane_camera {
            let plane: Plane<Camera> =
                Plane::new(Vec3::from(p.normal), p.offset_mm).ok_or_else(|| no_length("laser_plane_camera.normal"))?;
            Rig::store(station, &imported("laser_plane", "camera", plane, source)?)?;
            stored.push("laser_plane");
        }
        if let Some(p) = &self.pointer_camera {
            let ray: Ray<Camera> = Ray::new(Vec3::from(p.origin), Vec3::from(p.direction))
                .ok_or_else(|| no_length("pointer_camera.direction"))?;
            Rig::store(station, &imported("pointer", "camera", ray, source)?)?;
            stored.push("pointer");
        }
        if let Some(hand_eye) = self.flange_from_camera {
            Rig::store(station, &imported("hand_eye", "flange_from_camera", hand_eye, source)?)?;
            stored.push("hand_eye");
        }
        if stored.is_empty() {
            return Err(Fault::input(format!("{}: holds none of the rig's values", source.display()))
                .cause("another kind of JSON file")
                .next("use the keys intrinsics, flange_T_camera, laser_plane_camera, pointer_camera"));
        }
        Ok(stored)
    }
}

fn no_length(key: &str) -> Fault {
    Fault::input(format!("{key} has no length")).cause("all zeros").next("give a direction")
}

fn imported<T>(kind: &str, frame: &str, value: T, source: &Path) -> Result<Calibration<T>> {
    let quality = Quality {
        verdict: Verdict::Usable,
        reasons: vec!["imported: the values are as good as their source, their uncertainty is unknown".into()],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    Calibration::new(kind, frame, value, Covariance::default(), quality).with_input(source)
}
