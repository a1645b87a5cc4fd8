//! In: a station folder. Out: the rig in its `calibration/` subfolder, loaded and stored so that no file is ever
//! half-replaced, the former one stays beside it, and what does not belong together is not used together.
//! Frame and unit: as in the records.

use super::calibration::FORMAT;
use super::seal::{apart, sealed, shaped, unsealed};
use super::{Calibration, HandEye, Joint, JointCovariance, Kind, Measured, Quality, Verdict};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::files::Together;
use crate::geometry::{Axis, AxisKind, Base, Camera, Plane, Ray, Rigid};
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// What has been measured of a station; every part may be missing.
#[derive(Clone, Debug, Default)]
pub struct Rig {
    /// Camera and lens.
    pub camera: Option<Calibration<Intrinsics>>,
    /// The sheet of light, camera frame.
    pub laser_plane: Option<Calibration<Plane<Camera>>>,
    /// The pointer's beam, camera frame.
    pub pointer: Option<Calibration<Ray<Camera>>>,
    /// The camera on the flange.
    pub hand_eye: Option<Calibration<HandEye>>,
    /// A camera that stands still before a robot that carries the part.
    pub base_camera: Option<Calibration<Rigid<Base, Camera>>>,
    /// What moves parts along, or the camera along parts.
    pub linear_axis: Option<Calibration<Axis>>,
    /// What turns parts before the camera.
    pub turntable: Option<Calibration<Axis>>,
    /// Covariance of the records together, where they were calibrated together.
    pub joint: Joint,
}

/// What a record says of itself, whatever its value is.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// Which one.
    pub kind: Kind,
    /// When it was measured, RFC 3339.
    pub created: &'a str,
    /// How well.
    pub quality: &'a Quality,
    /// What people have vouched for.
    pub remarks: &'a [String],
}

impl<'a> Record<'a> {
    fn of<T>(c: &'a Calibration<T>) -> Record<'a> {
        Record { kind: c.kind, created: &c.created, quality: &c.quality, remarks: &c.remarks }
    }
}

impl Rig {
    /// Loads and checks what there is in `station/calibration`.
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
            joint: Joint::default(),
        })
    }

    /// For a calibration made with the camera: a spoilt former result is not in its own way, nor in another's. The
    /// laser plane, where it can be read, says where the station works.
    pub fn load_to_calibrate(station: &Path) -> Result<Rig> {
        Ok(Rig { laser_plane: load(station, Kind::LaserPlane).unwrap_or(None), ..Rig::load_camera(station)? })
    }

    /// The camera alone.
    pub fn load_camera(station: &Path) -> Result<Rig> {
        Ok(Rig { camera: load(station, Kind::Camera)?, ..Rig::default() })
    }

    /// Stores one calibration under `station/calibration/<kind>.json` and, where there is one, its `page` beside it
    /// as `<kind>.html`; a former one is kept as `<kind>.previous.json`. Either the new file is complete or the old
    /// one is untouched.
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

    /// Stores every part that is there, all of them or none; former ones are kept as [`Rig::store`] keeps them.
    pub fn store_all(&self, station: &Path) -> Result<Vec<Kind>> {
        self.store_all_with(station, |_| Vec::new())
    }

    /// [`Rig::store_all`] together with files (name, text) that are of these records and of no others; they are made
    /// from the rig as a reader will find it: a rotation comes back from its file orthonormal to the last digit.
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

    /// Seals a file anew that has no seal, was edited, or rests on another camera, because a person says why. The
    /// remark stays with it. What is no calibration at all is refused even so.
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
        // Format 1 named frames as each writer liked, and had neither of the two lists.
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

    /// The camera, or what to do about its absence.
    pub fn need_camera(&self) -> Result<&Calibration<Intrinsics>> {
        self.camera.as_ref().ok_or_else(|| missing(Kind::Camera))
    }
    /// The sensor's hot pixels as its calibrations know them: the laser plane's, whose pictures are dark, else the
    /// camera's. In room light a speck of the background looks like a hot pixel to a camera that stands still.
    pub fn hot_pixels(&self) -> &[[u32; 2]] {
        let of = [self.laser_plane.as_ref().map(|c| &c.hot_pixels), self.camera.as_ref().map(|c| &c.hot_pixels)];
        of.into_iter().flatten().find(|hot| !hot.is_empty()).map_or(&[], |hot| hot)
    }

    /// The sheet of light; refused where it is missing or was measured with another camera.
    pub fn need_laser_plane(&self) -> Result<&Calibration<Plane<Camera>>> {
        self.belonging(&self.laser_plane)?.ok_or_else(|| missing(Kind::LaserPlane))
    }
    /// The pointer's beam; refused where it is missing or was measured with another camera.
    pub fn need_pointer(&self) -> Result<&Calibration<Ray<Camera>>> {
        self.belonging(&self.pointer)?.ok_or_else(|| missing(Kind::Pointer))
    }
    /// The camera on the flange; refused where it is missing or was measured with another camera.
    pub fn need_hand_eye(&self) -> Result<&Calibration<HandEye>> {
        self.belonging(&self.hand_eye)?.ok_or_else(|| missing(Kind::HandEye))
    }
    /// The camera that stands still; refused where it is missing or was measured with another camera.
    pub fn need_base_camera(&self) -> Result<&Calibration<Rigid<Base, Camera>>> {
        self.belonging(&self.base_camera)?.ok_or_else(|| missing(Kind::BaseCamera))
    }
    /// The axis of this kind; refused where it is missing or was measured with another camera.
    pub fn need_axis(&self, kind: AxisKind) -> Result<&Calibration<Axis>> {
        let (axis, kind) = match kind {
            AxisKind::Linear => (&self.linear_axis, Kind::LinearAxis),
            AxisKind::Turntable => (&self.turntable, Kind::Turntable),
        };
        self.belonging(axis)?.ok_or_else(|| missing(kind))
    }
    /// The axis of a rig that has one.
    ///
    /// # Errors
    /// It has a linear axis and a turntable. The motion of a recording says which of them moved:
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

    /// What every record that there is says of itself.
    pub fn records(&self) -> Vec<Record<'_>> {
        [
            self.camera.as_ref().map(Record::of),
            self.laser_plane.as_ref().map(Record::of),
            self.hand_eye.as_ref().map(Record::of),
            self.pointer.as_ref().map(Record::of),
            self.base_camera.as_ref().map(Record::of),
            self.linear_axis.as_ref().map(Record::of),
            self.turntable.as_ref().map(Record::of),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Whether a station has such a record, readable or not.
    pub fn stored(station: &Path, kind: Kind) -> bool {
        file(station, kind).is_file()
    }

    /// Refuses parts of which one was measured with another camera than the station's.
    pub fn belong_together(&self) -> Result<()> {
        self.belonging(&self.laser_plane)?;
        self.belonging(&self.pointer)?;
        self.belonging(&self.hand_eye)?;
        self.belonging(&self.base_camera)?;
        self.belonging(&self.linear_axis)?;
        self.belonging(&self.turntable).map(|_| ())
    }

    fn belonging<'a, T>(&self, part: &'a Option<Calibration<T>>) -> Result<Option<&'a Calibration<T>>> {
        let (Some(c), Some(camera)) = (part, &self.camera) else { return Ok(part.as_ref()) };
        let (now, then) = (camera.content(), c.rests_on.get(&Kind::Camera));
        if !c.kind.rests_on_camera() || then == Some(&now) {
            return Ok(part.as_ref());
        }
        let (what, kind) = (c.kind.words(), c.kind);
        Err(Fault::refused(match then {
            Some(then) => format!("the {what} was measured with camera {then:.12}, the station now has {now:.12}"),
            None => format!("the {what} names no camera, the station has camera {now:.12}"),
        })
        .cause("the camera was calibrated or imported again, or files of two stations were mixed")
        .next(again(kind)))
    }

    /// The covariance of camera, laser plane and the camera's place together. `None` where none was ever stated.
    ///
    /// # Errors
    /// Why what is stated is not of these records: one was exchanged since, or the file is spoilt. In words.
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

    /// What a report must say of the calibrations it rests on: what people have vouched for, and what is badly
    /// determined.
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

    /// One hash over the values that turn pixels into points; a scan keeps it, so that a later
    /// step can tell whether it was taken with the station's present calibration.
    pub fn fingerprint(&self) -> String {
        let mut values = serde_json::json!({
            "camera": self.camera.as_ref().map(|c| c.value),
            "laser_plane": self.laser_plane.as_ref().map(|c| c.value),
            "hand_eye": self.hand_eye.as_ref().map(|c| c.value),
        });
        // Only where they are there: scans of former versions keep their fingerprint.
        let others = [
            ("base_camera", self.base_camera.as_ref().map(|c| serde_json::json!(c.value))),
            ("linear_axis", self.linear_axis.as_ref().map(|c| serde_json::json!(c.value))),
            ("turntable", self.turntable.as_ref().map(|c| serde_json::json!(c.value))),
        ];
        for (name, value) in others.into_iter().filter_map(|(n, v)| Some((n, v?))) {
            values[name] = value;
        }
        super::hash_text(values.to_string().as_bytes())
    }
}

/// Refuses what looks like another unit; for values that a person gives.
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

/// Calibrations that are stored at once; those they replace are kept, their pages are not.
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

fn again(kind: Kind) -> String {
    format!(
        "run sheetlight calibrate {} again, put {}.previous.json back, or vouch for it with sheetlight station seal \
         --kind {} \
         --because WHY",
        kind.command(),
        kind.name(),
        kind.name().replace('_', "-")
    )
}

fn missing(kind: Kind) -> Fault {
    Fault::input(format!("the station has no {} calibration", kind.words()))
        .cause("it was never calibrated, or another folder was given as --station")
        .next(format!(
            "run sheetlight calibrate {}, or import known values with sheetlight station import",
            kind.command()
        ))
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
