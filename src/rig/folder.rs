//! In: a station folder. Out: the rig in its `calibration/` subfolder. Storing never leaves a file half replaced and
//! keeps the previous file beside it; records that do not belong together are not used together.
//! Frame and unit: as in the records.

use super::calibration::FORMAT;
use super::seal::{apart, sealed, shaped, unsealed};
use super::{Calibration, HandEye, Joint, JointCovariance, Kind, Measured, Quality, Verdict};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::files::Together;
use crate::geometry::{Axis, AxisKind, Base, Camera, Flange, Plane, Ray, Rigid, Sensor};
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// The calibrations of a station; every part may be missing.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    /// Camera and lens.
    pub camera: Option<Calibration<Intrinsics>>,
    /// The sheet of light, camera frame.
    pub laser_plane: Option<Calibration<Plane<Camera>>>,
    /// The pointer's beam, camera frame.
    pub pointer: Option<Calibration<Ray<Camera>>>,
    /// Pose of the camera on the flange.
    pub hand_eye: Option<Calibration<HandEye>>,
    /// Pose of a fixed camera, before a robot that carries the part.
    pub base_camera: Option<Calibration<Rigid<Base, Camera>>>,
    /// Linear axis that moves the parts, or moves the camera along them.
    pub linear_axis: Option<Calibration<Axis>>,
    /// Turntable that turns the parts before the camera.
    pub turntable: Option<Calibration<Axis>>,
    /// Pose of a line-profile sensor on the flange.
    pub profile_hand_eye: Option<Calibration<Rigid<Flange, Sensor>>>,
    /// Joint covariance of the records, if they were calibrated together.
    pub joint: Joint,
}

/// Metadata of a record, independent of its value.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// Kind of the record.
    pub kind: Kind,
    /// Time of the measurement, RFC 3339.
    pub created: &'a str,
    /// Quality of the result.
    pub quality: &'a Quality,
    /// What users have vouched for.
    pub remarks: &'a [String],
}

impl<'a> Record<'a> {
    fn of<T>(c: &'a Calibration<T>) -> Record<'a> {
        Record { kind: c.kind, created: &c.created, quality: &c.quality, remarks: &c.remarks }
    }
}

impl Rig {
    /// Loads and checks the records that exist in `station/calibration`.
    pub fn load(station: &Path) -> Result<Rig> {
        let folder = station.join("calibration");
        together(&folder).settle()?;
        Ok(Rig { joint: Joint::load(station), ..Rig::read(&folder)? })
    }

    /// The records in a folder.
    fn read(folder: &Path) -> Result<Rig> {
        Ok(Rig {
            camera: read(folder, Kind::Camera)?,
            laser_plane: read(folder, Kind::LaserPlane)?,
            pointer: read(folder, Kind::Pointer)?,
            hand_eye: read(folder, Kind::HandEye)?,
            base_camera: read(folder, Kind::BaseCamera)?,
            linear_axis: read(folder, Kind::LinearAxis)?,
            turntable: read(folder, Kind::Turntable)?,
            profile_hand_eye: read(folder, Kind::ProfileHandEye)?,
            joint: Joint::default(),
        })
    }

    /// Loads the rig for a calibration that uses the camera. A spoilt earlier result, of this or of another kind,
    /// must not prevent it. The laser plane, if readable, states where the station works.
    pub fn load_to_calibrate(station: &Path) -> Result<Rig> {
        Ok(Rig { laser_plane: load(station, Kind::LaserPlane).unwrap_or(None), ..Rig::load_camera(station)? })
    }

    /// Loads the camera only.
    pub fn load_camera(station: &Path) -> Result<Rig> {
        Ok(Rig { camera: load(station, Kind::Camera)?, ..Rig::default() })
    }

    /// Stores one calibration under `station/calibration/<kind>.json`, and its `page`, if given, beside it as
    /// `<kind>.html`. The previous calibration is kept as `<kind>.previous.json`. Either the new file is complete or
    /// the old one is untouched.
    pub fn store<T: Serialize + Measured>(
        station: &Path,
        calibration: &Calibration<T>,
        page: Option<&str>,
    ) -> Result<PathBuf> {
        calibration.check(calibration.kind)?;
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        let _lock = crate::files::Lock::wait(&folder, "import")?;
        together(&folder).settle_locked()?;
        let path = file(station, calibration.kind);
        if let Some(former) = crate::files::read_text_if_there(&path)? {
            crate::files::write(&path.with_extension("previous.json"), former.as_bytes())?;
        }
        let html = path.with_extension("html");
        let beside: Vec<(&Path, &[u8])> = page.iter().map(|p| (html.as_path(), p.as_bytes())).collect();
        crate::files::write_beside((&path, sealed(calibration).as_bytes()), &beside)?;
        Ok(path)
    }

    /// Stores every part of the rig, all of them or none; previous records are kept as by [`Rig::store`].
    pub fn store_all(&self, station: &Path) -> Result<Vec<Kind>> {
        self.store_all_with(station, |_| Vec::new())
    }

    /// As [`Rig::store_all`], together with files (name, text) that belong to exactly these records. The files are
    /// made from the rig as a reader will load it, because a rotation read from its file is orthonormal to the last
    /// digit.
    pub fn store_all_with(
        &self,
        station: &Path,
        others: impl FnOnce(&Rig) -> Vec<(&'static str, String)>,
    ) -> Result<Vec<Kind>> {
        let mut texts = Vec::new();
        add(&mut texts, &self.camera)?;
        add(&mut texts, &self.laser_plane)?;
        add(&mut texts, &self.pointer)?;
        add(&mut texts, &self.hand_eye)?;
        add(&mut texts, &self.base_camera)?;
        add(&mut texts, &self.linear_axis)?;
        add(&mut texts, &self.turntable)?;
        add(&mut texts, &self.profile_hand_eye)?;
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        let set = together(&folder);
        let _lock = crate::files::Lock::take(&folder, "import", "import")?;
        set.settle_locked()?;
        let part = set.begin()?;
        let made = || {
            for (kind, text) in &texts {
                crate::files::write(&part.join(file_name(*kind)), text.as_bytes())?;
            }
            for (name, text) in others(&Rig::read(&part)?) {
                crate::files::write(&part.join(name), text.as_bytes())?;
            }
            set.commit()
        };
        made().inspect_err(|_| set.abandon())?;
        Ok(texts.into_iter().map(|(kind, _)| kind).collect())
    }

    /// Seals a file again that has no seal, was edited, or depends on another camera; the user states the reason.
    /// The remark stays in the file. A file that is no calibration at all is still refused.
    pub fn vouch<T: Serialize + DeserializeOwned + Measured>(
        station: &Path,
        kind: Kind,
        why: &str,
        as_stated: bool,
    ) -> Result<PathBuf> {
        let path = file(station, kind);
        let text = crate::files::read_text(&path)?;
        let what = path.display().to_string();
        let redo = |e: Fault| e.next(again(kind));
        let (mut value, _) = apart(&text, &what).map_err(redo)?;
        let today = jiff::Timestamp::now().strftime("%Y-%m-%d");
        let object = value.as_object_mut().expect("apart refuses all else");
        // In format 1 every writer chose its own names of frames, and the two lists were missing.
        object.insert("format".into(), FORMAT.into());
        object.insert("frame".into(), serde_json::to_value(kind.place()).expect("a name"));
        object.entry("rests_on").or_insert_with(|| serde_json::json!({}));
        object.entry("remarks").or_insert_with(|| serde_json::json!([]));
        let mut c: Calibration<T> = shaped(value, &what).map_err(redo)?;
        let camera = if kind.rests_on_camera() { Rig::load_camera(station)?.camera } else { None };
        c.rests_on = camera.map(|c| (Kind::Camera, c.content())).into_iter().collect();
        c.remarks.push(format!("vouched for on {today}: {why}"));
        c.check(kind).map_err(|e| redo(e.at(&what)))?;
        if !as_stated {
            asked(&c.value).map_err(|e| e.at(&what))?;
        }
        Rig::store(station, &c, None)
    }

    /// The camera; if it is missing, an error that says what to do.
    pub fn need_camera(&self) -> Result<&Calibration<Intrinsics>> {
        self.camera.as_ref().ok_or_else(|| missing(Kind::Camera))
    }
    /// The sensor's hot pixels as the calibrations know them: the laser plane's, whose pictures are dark, else the
    /// camera's. In room light a fixed camera may take a speck of the background for a hot pixel.
    pub fn hot_pixels(&self) -> &[[u32; 2]] {
        let of = [self.laser_plane.as_ref().map(|c| &c.hot_pixels), self.camera.as_ref().map(|c| &c.hot_pixels)];
        of.into_iter().flatten().find(|hot| !hot.is_empty()).map_or(&[], |hot| hot)
    }

    /// The sheet of light; an error if it is missing or was measured with another camera.
    pub fn need_laser_plane(&self) -> Result<&Calibration<Plane<Camera>>> {
        self.belonging(&self.laser_plane)?.ok_or_else(|| missing(Kind::LaserPlane))
    }
    /// The pointer's beam; an error if it is missing or was measured with another camera.
    pub fn need_pointer(&self) -> Result<&Calibration<Ray<Camera>>> {
        self.belonging(&self.pointer)?.ok_or_else(|| missing(Kind::Pointer))
    }
    /// Pose of the camera on the flange; an error if it is missing or was measured with another camera.
    pub fn need_hand_eye(&self) -> Result<&Calibration<HandEye>> {
        self.belonging(&self.hand_eye)?.ok_or_else(|| missing(Kind::HandEye))
    }
    /// Pose of the fixed camera; an error if it is missing or was measured with another camera.
    pub fn need_base_camera(&self) -> Result<&Calibration<Rigid<Base, Camera>>> {
        self.belonging(&self.base_camera)?.ok_or_else(|| missing(Kind::BaseCamera))
    }
    /// The axis of this kind; an error if it is missing or was measured with another camera.
    pub fn need_axis(&self, kind: AxisKind) -> Result<&Calibration<Axis>> {
        let (axis, kind) = match kind {
            AxisKind::Linear => (&self.linear_axis, Kind::LinearAxis),
            AxisKind::Turntable => (&self.turntable, Kind::Turntable),
        };
        self.belonging(axis)?.ok_or_else(|| missing(kind))
    }
    /// Pose of a line-profile sensor on the flange; an error if it is missing.
    pub fn need_profile_hand_eye(&self) -> Result<&Calibration<Rigid<Flange, Sensor>>> {
        self.profile_hand_eye.as_ref().ok_or_else(|| missing(Kind::ProfileHandEye))
    }
    /// The rig's axis, if it has one.
    ///
    /// # Errors
    /// A rig with both a linear axis and a turntable. The motion of a recording states which of them moved:
    /// [`crate::scan::parts_for`].
    pub fn axis(&self) -> Result<Option<&Calibration<Axis>>> {
        match (&self.linear_axis, &self.turntable) {
            (Some(_), Some(_)) => {
                Err(Fault::refused("the rig has a linear axis and a turntable, one of them is needed")
                    .cause("it is unknown which of the two moved the part")
                    .next("take the parts of the rig that the recording's motion rests on"))
            }
            (linear, turntable) => Ok(linear.as_ref().or(turntable.as_ref())),
        }
    }

    /// Metadata of every existing record.
    pub fn records(&self) -> Vec<Record<'_>> {
        [
            self.camera.as_ref().map(Record::of),
            self.laser_plane.as_ref().map(Record::of),
            self.hand_eye.as_ref().map(Record::of),
            self.pointer.as_ref().map(Record::of),
            self.base_camera.as_ref().map(Record::of),
            self.linear_axis.as_ref().map(Record::of),
            self.turntable.as_ref().map(Record::of),
            self.profile_hand_eye.as_ref().map(Record::of),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Whether a station has such a record, readable or not.
    pub fn stored(station: &Path, kind: Kind) -> bool {
        file(station, kind).is_file()
    }

    /// Refuses a rig that lacks two or more of these kinds, and names all of them. One that lacks a single kind is left
    /// to that kind's own `need_`.
    pub fn need_all(&self, kinds: &[Kind]) -> Result<()> {
        let there: Vec<Kind> = self.records().iter().map(|r| r.kind).collect();
        let absent: Vec<&Kind> = kinds.iter().filter(|k| !there.contains(k)).collect();
        if absent.len() < 2 {
            return Ok(());
        }
        let listed = |word: fn(&Kind) -> String| absent.iter().map(|k| word(k)).collect::<Vec<_>>().join(", ");
        Err(Fault::input(format!("the station has no calibration of these kinds: {}", listed(|kind| kind.words())))
            .cause(NEVER_CALIBRATED)
            .next(format!(
                "run sheetlight calibrate for each in this order: {}; or import known values with sheetlight station \
                 import",
                listed(|kind| kind.command())
            )))
    }

    /// What the station lacks to scan, as a remark; `None` if it has a camera, a laser plane, and the camera's pose or
    /// an axis, or only a line-profile sensor.
    pub fn unfinished(&self) -> Option<String> {
        let there: Vec<Kind> = self.records().iter().map(|r| r.kind).collect();
        let posed = [Kind::HandEye, Kind::BaseCamera, Kind::LinearAxis, Kind::Turntable];
        let lacks = |kinds: &[Kind]| !kinds.iter().any(|k| there.contains(k));
        if !lacks(&[Kind::ProfileHandEye]) && lacks(&[Kind::Camera, Kind::LaserPlane]) {
            return None;
        }
        let absent: Vec<&str> = [
            (lacks(&[Kind::Camera]), "camera"),
            (lacks(&[Kind::LaserPlane]), "laser plane"),
            (lacks(&posed), "hand-eye (or base camera, linear axis or turntable)"),
        ]
        .into_iter()
        .filter_map(|(absent, name)| absent.then_some(name))
        .collect();
        (!absent.is_empty())
            .then(|| format!("the station cannot scan yet, it has no calibration of: {}", absent.join(", ")))
    }

    /// The parts that were measured with another camera than the station's, and what is wrong with each.
    pub fn stale(&self) -> Vec<(Kind, String)> {
        let parts = [
            self.other_camera(&self.laser_plane),
            self.other_camera(&self.pointer),
            self.other_camera(&self.hand_eye),
            self.other_camera(&self.base_camera),
            self.other_camera(&self.linear_axis),
            self.other_camera(&self.turntable),
        ];
        parts.into_iter().flatten().collect()
    }

    /// Refuses a rig if one of its parts was measured with another camera than the station's; all of them are named.
    pub fn belong_together(&self) -> Result<()> {
        let stale = self.stale();
        let listed = |word: fn(&Kind) -> String| stale.iter().map(|(k, _)| word(k)).collect::<Vec<_>>().join(", ");
        match &stale[..] {
            [] => Ok(()),
            [(kind, what)] => Err(made_with_another(*kind, what.clone())),
            _ => {
                let now = self.camera.as_ref().map(Calibration::content).unwrap_or_default();
                let names = listed(|kind| kind.words());
                let what = format!("{} calibrations were measured with another camera than {now:.12}", stale.len());
                Err(Fault::refused(format!("{what}: {names}"))
                    .cause(OTHER_CAMERA)
                    .next(format!("run sheetlight calibrate again for each: {}", listed(|kind| kind.command()))))
            }
        }
    }

    fn belonging<'a, T>(&self, part: &'a Option<Calibration<T>>) -> Result<Option<&'a Calibration<T>>> {
        self.other_camera(part).map_or(Ok(part.as_ref()), |(kind, what)| Err(made_with_another(kind, what)))
    }

    /// Which part it is, and what is wrong, if it was measured with another camera than the station's.
    fn other_camera<T>(&self, part: &Option<Calibration<T>>) -> Option<(Kind, String)> {
        let (c, camera) = (part.as_ref()?, self.camera.as_ref()?);
        let (now, then) = (camera.content(), c.rests_on.get(&Kind::Camera));
        if !c.kind.rests_on_camera() || then == Some(&now) {
            return None;
        }
        let what = c.kind.words();
        let why = match then {
            Some(then) => format!("the {what} was measured with camera {then:.12}, the station now has {now:.12}"),
            None => format!("the {what} names no camera, the station has camera {now:.12}"),
        };
        Some((c.kind, why))
    }

    /// The joint covariance of camera, laser plane and the camera's pose. `None` if none was ever stated.
    ///
    /// # Errors
    /// The reason, in words, why the stated covariance does not apply to these records: a record was replaced since,
    /// or the file is spoilt.
    pub fn joint(&self) -> Option<std::result::Result<&JointCovariance, String>> {
        let stated = match &self.joint {
            Joint::Absent => return None,
            Joint::Spoilt(why) => return Some(Err(why.clone())),
            Joint::Stated(c) => c,
        };
        let now = [
            (Kind::Camera, self.camera.as_ref().map(|c| c.content())),
            (Kind::LaserPlane, self.laser_plane.as_ref().map(|c| c.content())),
            match (&self.hand_eye, &self.base_camera) {
                (None, Some(c)) => (Kind::BaseCamera, Some(c.content())),
                (c, _) => (Kind::HandEye, c.as_ref().map(|c| c.content())),
            },
        ];
        let other = |kind: Kind| format!("joint.json is of another {} than the station's", kind.words());
        Some(stated.other(&now).map_or(Ok(stated), |kind| Err(other(kind))))
    }

    /// Remarks for reports that depend on these calibrations: what users have vouched for, and which records are
    /// badly determined.
    pub fn remarks(&self) -> Vec<String> {
        let of = |r: Record| {
            let mut said: Vec<String> = r.remarks.iter().map(|said| format!("{}: {said}", r.kind.words())).collect();
            if r.quality.verdict > Verdict::Usable {
                said.push(format!("{}: {}", r.kind.words(), r.quality.verdict.words()));
            }
            said
        };
        self.records().into_iter().flat_map(of).collect()
    }

    /// One hash over the values that turn pixels into points. A scan stores it, so that a later step can check
    /// whether the scan was taken with the station's present calibration.
    pub fn fingerprint(&self) -> String {
        let mut values = serde_json::json!({
            "camera": self.camera.as_ref().map(|c| c.value),
            "laser_plane": self.laser_plane.as_ref().map(|c| c.value),
            "hand_eye": self.hand_eye.as_ref().map(|c| c.value),
        });
        // Included only if present, so that scans of older versions keep their fingerprint.
        let others = [
            ("base_camera", self.base_camera.as_ref().map(|c| serde_json::json!(c.value))),
            ("linear_axis", self.linear_axis.as_ref().map(|c| serde_json::json!(c.value))),
            ("turntable", self.turntable.as_ref().map(|c| serde_json::json!(c.value))),
            ("profile_hand_eye", self.profile_hand_eye.as_ref().map(|c| serde_json::json!(c.value))),
        ];
        for (name, value) in others.into_iter().filter_map(|(n, v)| Some((n, v?))) {
            values[name] = value;
        }
        super::hash_text(values.to_string().as_bytes())
    }
}

/// Refuses values that look like another unit; for values that a user enters.
pub fn asked(value: &impl Measured) -> Result<()> {
    value.doubt().map_or(Ok(()), |doubt| {
        Err(Fault::refused(doubt)
            .cause("metres, or another unit than millimetres")
            .next("convert it to mm, or confirm it with --as-stated"))
    })
}

fn add<T: Serialize + Measured>(texts: &mut Vec<(Kind, String)>, part: &Option<Calibration<T>>) -> Result<()> {
    if let Some(c) = part {
        c.check(c.kind).map_err(|e| e.at(c.kind.words()))?;
        texts.push((c.kind, sealed(c)));
    }
    Ok(())
}

/// Stores calibrations together; the records that they replace are kept, the replaced pages are not.
fn together(folder: &Path) -> Together<'_> {
    fn keep_former(folder: &Path, new: &Path) -> std::io::Result<()> {
        for entry in std::fs::read_dir(new)? {
            let path = folder.join(entry?.file_name());
            crate::files::remove(&path.with_extension("html"))?;
            if path.exists() {
                crate::files::moment()?;
                std::fs::rename(&path, path.with_extension("previous.json"))?;
            }
        }
        Ok(())
    }
    Together::new(folder, "import", keep_former)
}

fn made_with_another(kind: Kind, what: String) -> Fault {
    let next = format!("run sheetlight calibrate {} again", kind.command());
    Fault::refused(what)
        .cause(OTHER_CAMERA)
        .next(format!("{next}; put camera.previous.json back only if the camera's new calibration was a mistake"))
}

const OTHER_CAMERA: &str = "the camera was calibrated or imported again, or files of two stations were mixed";

fn again(kind: Kind) -> String {
    format!(
        "run sheetlight calibrate {} again; if you know that its values are right, sheetlight station seal --kind {} \
         --because WHY accepts them on your word",
        kind.command(),
        kind.name().replace('_', "-")
    )
}

const NEVER_CALIBRATED: &str = "it was never calibrated, or another folder was given as --station";

fn missing(kind: Kind) -> Fault {
    // A profile sensor's pose is not among the values that are imported.
    let or = if kind == Kind::ProfileHandEye { "" } else { ", or import known values with sheetlight station import" };
    Fault::input(format!("the station has no {} calibration", kind.words()))
        .cause(NEVER_CALIBRATED)
        .next(format!("run sheetlight calibrate {}{or}", kind.command()))
}

fn file(station: &Path, kind: Kind) -> PathBuf {
    station.join("calibration").join(file_name(kind))
}

fn file_name(kind: Kind) -> String {
    format!("{}.json", kind.name())
}

fn load<T: DeserializeOwned + Measured>(station: &Path, kind: Kind) -> Result<Option<Calibration<T>>> {
    let folder = station.join("calibration");
    together(&folder).settle()?;
    read(&folder, kind)
}

fn read<T: DeserializeOwned + Measured>(folder: &Path, kind: Kind) -> Result<Option<Calibration<T>>> {
    let path = folder.join(file_name(kind));
    let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
    let found: Calibration<T> = unsealed(&text, &path.display().to_string()).map_err(|e| e.next(again(kind)))?;
    found.check(kind).map_err(|e| e.at(path.display()).next(again(kind)))?;
    Ok(Some(found))
}

#[cfg(test)]
mod tests {
    use super::super::Covariance;
    use super::*;
    use crate::geometry::Vec3;

    fn quality() -> Quality {
        let (reasons, advice) = (vec![], vec![]);
        Quality {
            verdict: Verdict::Good,
            reasons,
            advice,
            figures: [("rms_px".into(), f64::NAN)].into(),
            per_picture: vec![],
        }
    }

    fn camera(fx: f64) -> Calibration<Intrinsics> {
        let (cx, cy, skew, distortion) = (315.0, 232.0, 0.0, Default::default());
        let value = Intrinsics { fx, fy: 611.6, cx, cy, skew, distortion, width: 640, height: 480 };
        Calibration::new(Kind::Camera, value, None, Covariance::default(), quality())
    }

    fn plane(offset: f64, with: &Calibration<Intrinsics>) -> Calibration<Plane<Camera>> {
        let plane = Plane::new(Vec3::new(0.0, 0.9, 0.4), offset).unwrap();
        Calibration::new(Kind::LaserPlane, plane, Some(with), Covariance::default(), quality())
    }

    #[test]
    fn the_former_calibration_stays_beside_the_new_one() {
        let dir = tempfile::tempdir().unwrap();
        let camera = camera(611.6);
        Rig::store(dir.path(), &plane(70.0, &camera), None).unwrap();
        let first = Rig::load(dir.path()).unwrap();
        Rig::store(dir.path(), &plane(71.0, &camera), None).unwrap();
        let second = Rig::load(dir.path()).unwrap();
        assert_ne!(first.fingerprint(), second.fingerprint());
        let former = std::fs::read_to_string(dir.path().join("calibration/laser_plane.previous.json")).unwrap();
        let former: Calibration<Plane<Camera>> = unsealed(&former, "former").unwrap();
        assert_eq!(former.value, first.laser_plane.unwrap().value);
        assert!(second.camera.is_none() && second.need_camera().is_err());
        let lacks = second.unfinished().unwrap();
        assert!(lacks.ends_with("of: camera, hand-eye (or base camera, linear axis or turntable)"), "{lacks}");
        let said = second.need_all(&[Kind::Camera, Kind::LaserPlane, Kind::HandEye]).unwrap_err();
        assert!(said.what.ends_with(": camera, hand-eye") && said.next.contains("order: camera, hand-eye;"), "{said}");
        second.need_all(&[Kind::Camera, Kind::LaserPlane]).unwrap();
    }

    #[test]
    fn a_plane_is_used_with_its_own_camera_only() {
        let dir = tempfile::tempdir().unwrap();
        let (old, new) = (camera(611.6), camera(611.7));
        Rig::store(dir.path(), &old, None).unwrap();
        Rig::store(dir.path(), &plane(70.0, &old), None).unwrap();
        Rig::load(dir.path()).unwrap().need_laser_plane().unwrap();
        Rig::store(dir.path(), &new, None).unwrap();
        let rig = Rig::load(dir.path()).unwrap();
        let said = rig.need_laser_plane().unwrap_err();
        assert!(said.what.contains("measured with camera") && said.next.contains("calibrate laser-plane"), "{said}");
        assert!(rig.belong_together().is_err() && rig.remarks().is_empty());
        let beam = Ray::new(Vec3::new(30.0, 0.0, 0.0), Vec3::z()).unwrap();
        let pointer = Calibration::new(Kind::Pointer, beam, Some(&old), Covariance::default(), quality());
        let all = Rig { pointer: Some(pointer), ..rig };
        let said = all.belong_together().unwrap_err();
        assert!(said.what.ends_with("laser plane, pointer") && said.next.ends_with("laser-plane, pointer"), "{said}");
        Rig::vouch::<Plane<Camera>>(dir.path(), Kind::LaserPlane, "only the focus was touched", false).unwrap();
        let rig = Rig::load(dir.path()).unwrap();
        rig.need_laser_plane().unwrap();
        assert!(rig.remarks()[0].contains("only the focus was touched"), "{:?}", rig.remarks());
    }

    #[test]
    fn a_rig_with_two_axes_says_that_one_is_needed() {
        use crate::geometry::CountUnit;
        let camera = camera(611.6);
        let axis = |kind: Kind, of| {
            let value = Axis { kind: of, unit: CountUnit::Count, pitch: 0.01, camera_from_axis: Rigid::identity() };
            Some(Calibration::new(kind, value, Some(&camera), Covariance::default(), quality()))
        };
        let mut rig = Rig { linear_axis: axis(Kind::LinearAxis, AxisKind::Linear), ..Rig::default() };
        assert_eq!(rig.axis().unwrap().unwrap().kind, Kind::LinearAxis);
        rig.turntable = axis(Kind::Turntable, AxisKind::Turntable);
        assert!(rig.axis().unwrap_err().what.contains("a linear axis and a turntable"));
        rig.linear_axis = None;
        assert_eq!(rig.axis().unwrap().unwrap().kind, Kind::Turntable);
        assert!(Rig::default().axis().unwrap().is_none());
    }

    #[test]
    fn several_are_stored_together_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let camera = camera(611.6);
        let mut rig = Rig { laser_plane: Some(plane(70.0, &camera)), camera: Some(camera), ..Rig::default() };
        rig.store_all(dir.path()).unwrap();
        let before = Rig::load(dir.path()).unwrap().fingerprint();
        rig.camera.as_mut().unwrap().value.fx = 620.0;
        rig.laser_plane.as_mut().unwrap().value.normal *= 1.01;
        assert!(rig.store_all(dir.path()).is_err());
        assert_eq!(Rig::load(dir.path()).unwrap().fingerprint(), before);
    }
}
