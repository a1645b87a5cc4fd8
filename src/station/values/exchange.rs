//! In: known values of a rig (a data sheet, another program, a truth file). Out: calibration files. Also writes the
//! values of a rig for programs that compare them.
//! Frame and unit: keys as in the reference data's format: `flange_T_camera`, mm, row-major.

use super::assumed::{Assumed, Sigmas};
use super::sound;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, Base, Camera, ORTHONORMAL_WARN, Plane, Ray, Rigid, Vec3};
use crate::rig::{
    Calibration, Covariance, HandEye, Kind, Quality, ROBOT_SIGMA_DEG, ROBOT_SIGMA_MM, Record, Rig, Verdict, json_once,
};
use serde_json::Value;
use std::path::Path;

/// The values of a rig as one JSON object; every entry may be missing, other keys are ignored.
#[derive(Clone, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Values {
    /// Pinhole camera with lens; px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<Intrinsics>,
    /// Hand-eye transform, 4 x 4 row-major, mm.
    #[serde(rename = "flange_T_camera", default, skip_serializing_if = "Option::is_none")]
    pub flange_from_camera: Option<[f64; 16]>,
    /// The laser sheet, camera frame, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub laser_plane_camera: Option<PlaneValue>,
    /// The pointer's beam, camera frame, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pointer_camera: Option<PointerValue>,
    /// Pose of a camera that stands still beside the robot, 4 x 4 row-major, mm.
    #[serde(rename = "base_T_camera", default, skip_serializing_if = "Option::is_none")]
    pub base_from_camera: Option<[f64; 16]>,
    /// A linear axis as a fixed camera sees it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linear_axis: Option<Axis>,
    /// A turntable as a fixed camera sees it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turntable: Option<Axis>,
    /// The program that wrote the file and the conventions by which it was read; `None` for this program's own
    /// files.
    #[serde(skip)]
    pub read_as: Option<String>,
}

/// `normal · X = offset_mm` in the camera frame.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PlaneValue {
    /// Of unit length.
    pub normal: [f64; 3],
    /// Distance along the normal, mm.
    pub offset_mm: f64,
}

/// The pointer's beam in the camera frame: a point on it (mm) and its direction.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct PointerValue {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
}

impl Values {
    /// Reads a JSON file.
    pub fn load(path: &Path) -> Result<Values> {
        let text = crate::files::read_text(path)?;
        if let Some((camera, said)) = super::foreign::camera(&text).map_err(|e| e.at(path.display()))? {
            return Ok(Values { intrinsics: Some(camera), read_as: Some(said), ..Values::default() });
        }
        // A key that is there twice has no value: programs differ in which of them they take.
        let file = json_once(text.trim_start_matches('\u{feff}'));
        if let Ok(Value::Object(map)) = &file {
            super::stated::check(map).map_err(|e| e.at(path.display()))?;
        }
        file.and_then(|_| serde_json::from_str(&text)).map_err(|e| {
            Fault::input(format!("{}: contains no rig values: {e}", path.display()))
                .cause(crate::files::slip_in(
                    &text,
                    e.line(),
                    "not JSON, an entry of another shape, or a key that is there twice",
                ))
                .next(
                    "use the keys intrinsics, flange_T_camera, laser_plane_camera, pointer_camera, base_T_camera, \
                       linear_axis, turntable of docs/file-formats.md",
                )
        })
    }

    /// The values that a rig holds; missing ones stay `None`.
    pub fn of(rig: &Rig) -> Values {
        Values {
            intrinsics: rig.camera.as_ref().map(|c| c.value),
            flange_from_camera: rig.hand_eye.as_ref().map(|c| c.value.to_rows()),
            laser_plane_camera: rig
                .laser_plane
                .as_ref()
                .map(|c| PlaneValue { normal: c.value.normal.into(), offset_mm: c.value.offset }),
            pointer_camera: rig
                .pointer
                .as_ref()
                .map(|c| PointerValue { origin: c.value.origin.into(), direction: c.value.direction.into() }),
            base_from_camera: rig.base_camera.as_ref().map(|c| c.value.to_rows()),
            linear_axis: rig.linear_axis.as_ref().map(|c| c.value),
            turntable: rig.turntable.as_ref().map(|c| c.value),
            read_as: None,
        }
    }

    /// Makes each value a calibration, with `source` as its input, and stores all of them or none. Camera, laser
    /// plane and the camera's pose get the covariance of `sigmas`, others an unknown one. Values that look like
    /// another unit are refused unless `as_stated` is set. Returns the kinds that were stored.
    pub fn store(&self, station: &Path, source: &Path, as_stated: bool, sigmas: &Sigmas) -> Result<Vec<Kind>> {
        sigmas.check()?;
        let camera = self
            .intrinsics
            .map(|c| {
                Ok::<_, Fault>(known(imported(Kind::Camera, c, None, self.read_as.clone(), source)?, sigmas.camera()))
            })
            .transpose()?;
        // Values without a camera belong to the station's camera.
        let theirs = if camera.is_none() { Rig::load_camera(station)?.camera } else { None };
        let with = camera.as_ref().or(theirs.as_ref());
        let plane = self.laser_plane_camera.as_ref().map(|p| {
            let (n, note) = unit("laser_plane_camera.normal", p.normal)?;
            let plane: Plane<Camera> =
                Plane::new(n, p.offset_mm).ok_or_else(|| no_length("laser_plane_camera.normal"))?;
            Ok::<_, Fault>(known(imported(Kind::LaserPlane, plane, with, note, source)?, sigmas.plane(&plane)))
        });
        let pointer = self.pointer_camera.as_ref().map(|p| {
            let (d, note) = unit("pointer_camera.direction", p.direction)?;
            let ray: Ray<Camera> =
                Ray::new(Vec3::from(p.origin), d).ok_or_else(|| no_length("pointer_camera.direction"))?;
            imported(Kind::Pointer, ray, with, note, source)
        });
        let hand_eye = self.flange_from_camera.as_ref().map(|rows| {
            let (pose, departure) = HandEye::from_rows(rows).map_err(|e| e.at("flange_T_camera"))?;
            let note = (departure > ORTHONORMAL_WARN)
                .then(|| format!("the rotation was repaired, it was {departure:.1e} from orthonormal"));
            let mut hand_eye = known(imported(Kind::HandEye, pose, with, note, source)?, sigmas.pose());
            let ([mm, deg], remark) = sigmas.robot();
            hand_eye.quality.figures.extend([(ROBOT_SIGMA_MM.into(), mm), (ROBOT_SIGMA_DEG.into(), deg)]);
            hand_eye.remarks.push(remark);
            Ok::<_, Fault>(hand_eye)
        });
        let base_camera = self.base_from_camera.as_ref().map(|rows| {
            let (pose, departure) = Rigid::<Base, Camera>::from_rows(rows).map_err(|e| e.at("base_T_camera"))?;
            let note = (departure > ORTHONORMAL_WARN)
                .then(|| format!("the rotation was repaired, it was {departure:.1e} from orthonormal"));
            Ok::<_, Fault>(known(imported(Kind::BaseCamera, pose, with, note, source)?, sigmas.pose()))
        });
        let axis = |value: &Option<Axis>, wanted: AxisKind, kind: Kind| {
            value.as_ref().filter(|a| a.kind == wanted).map(|a| imported(kind, *a, with, None, source)).transpose()
        };
        let linear_axis = axis(&self.linear_axis, AxisKind::Linear, Kind::LinearAxis)?;
        let turntable = axis(&self.turntable, AxisKind::Turntable, Kind::Turntable)?;
        if linear_axis.is_none() != self.linear_axis.is_none() || turntable.is_none() != self.turntable.is_none() {
            return Err(Fault::input(format!("{}: an axis is under the other kind's key", source.display()))
                .cause("linear_axis and turntable were exchanged")
                .next("put each under its own key"));
        }
        let base_camera = base_camera.transpose()?;
        let (laser_plane, pointer, hand_eye) = (plane.transpose()?, pointer.transpose()?, hand_eye.transpose()?);
        if !as_stated {
            self.intrinsics.as_ref().map_or(Ok(()), of_its_pictures).map_err(|e| e.at(source.display()))?;
        }
        let at_source = |e: Fault| e.at(source.display());
        self.intrinsics.as_ref().map_or(Ok(()), sound::lens).map_err(at_source)?;
        if let (Some(camera), Some(plane)) = (with, &laser_plane) {
            sound::plane(&camera.value, &plane.value).map_err(at_source)?;
        }
        let rig = Rig { camera, laser_plane, pointer, hand_eye, base_camera, linear_axis, turntable, ..Rig::default() };
        if !as_stated {
            rig.records().into_iter().try_for_each(Record::likely)?;
        }
        let stored = rig
            .store_all(station)
            .map_err(|e| e.at(source.display()).next("correct the file; nothing was imported of it"))?;
        if stored.is_empty() {
            return Err(Fault::input(format!("{}: contains no values of a rig", source.display()))
                .cause("another kind of JSON file")
                .next(
                    "use the keys intrinsics, flange_T_camera, laser_plane_camera, pointer_camera, base_T_camera, \
                       linear_axis, turntable",
                ));
        }
        Ok(stored)
    }
}

/// The reason that every imported record states for its verdict.
const AS_ITS_SOURCE: &str = "imported: the values are as good as their source";

/// What the records of these kinds state about their import: the program that wrote the file, what was assumed of it or
/// repaired, and the remarks of the rig's reports.
pub fn remarks_of_import(rig: &Rig, kinds: &[Kind]) -> Vec<String> {
    let of = |r: &dyn Record| -> Vec<String> {
        let reasons = r.quality().reasons.iter().filter(|said| *said != AS_ITS_SOURCE);
        reasons.map(|said| format!("{}: {said}", r.kind().words())).collect()
    };
    let stored = rig.records().into_iter().filter(|r| kinds.contains(&r.kind()));
    stored.flat_map(of).chain(rig.remarks()).collect()
}

fn no_length(key: &str) -> Fault {
    Fault::input(format!("{key} has no length")).cause("all zeros").next("give a direction")
}

/// A principal point farther from the middle than this share of the picture, along both sides alike, is that of a
/// picture of another size.
const OFF_MIDDLE: f64 = 0.2;

/// Refuses a matrix that looks like one of pictures of another size.
fn of_its_pictures(c: &Intrinsics) -> Result<()> {
    let [x, y] = [(c.cx + 0.5) / f64::from(c.width), (c.cy + 0.5) / f64::from(c.height)];
    let outside = [x, y].iter().any(|s| !(0.0..=1.0).contains(s));
    let scaled = (x - y).abs() < 0.05 && (x - 0.5).abs() > OFF_MIDDLE;
    if !outside && !scaled {
        return Ok(());
    }
    Err(Fault::refused(format!(
        "the principal point is at {:.1}, {:.1} px of pictures of {}x{} px",
        c.cx, c.cy, c.width, c.height
    ))
    .cause("the matrix is that of larger or smaller pictures (binned, scaled) than the size that is stated")
    .next("give matrix and size of the same pictures, or confirm with --as-stated (a sensor's part, a shifted lens)"))
}

/// Largest deviation from unit length of a direction with four decimals; beyond it the meaning of the other numbers
/// is unclear.
const ROUNDED: f64 = 5e-4;

/// The direction scaled to unit length, and a remark if that changed it.
fn unit(key: &str, v: [f64; 3]) -> Result<(Vec3, Option<String>)> {
    let v = Vec3::from(v);
    let length = v.norm();
    if !((length - 1.0).abs() <= ROUNDED) {
        return Err(Fault::input(format!("{key} is {length:.6} long, it must be 1 to {ROUNDED}"))
            .cause("edited by hand, or a vector that is not a direction")
            .next("give a direction of unit length, and the plane's offset along it"));
    }
    let note = ((length - 1.0).abs() > 1e-6).then(|| format!("{key} was {length:.6} long and is taken as a direction"));
    // The offset is not scaled: it is measured along the direction, whose digits were rounded.
    Ok((v / length, note))
}

fn imported<T: serde::Serialize>(
    kind: Kind,
    value: T,
    with: Option<&Calibration<Intrinsics>>,
    note: Option<String>,
    source: &Path,
) -> Result<Calibration<T>> {
    let quality = Quality {
        verdict: Verdict::Usable,
        reasons: std::iter::once(AS_ITS_SOURCE.to_owned()).chain(note).collect(),
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    Calibration::new(kind, value, with, Covariance::default(), quality).with_input(source)
}

/// The same calibration with the covariance and remarks of `assumed`.
fn known<T>(mut calibration: Calibration<T>, assumed: Assumed) -> Calibration<T> {
    calibration.covariance = assumed.covariance;
    calibration.remarks = assumed.remarks;
    calibration
}
