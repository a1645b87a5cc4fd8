//! In: a station folder. Out: the rig in its `calibration/` subfolder. Storing never leaves a file half replaced and
//! keeps the previous file beside it; records that do not belong together are not used together.
//! Frame and unit: as in the records.

use super::calibration::FORMAT;
use super::seal::{apart, shaped, unsealed};
use super::whole::of_every_part;
use super::{Calibration, HandEye, Joint, Kind, Measured, Record, Rig};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::files::Together;
use crate::geometry::{Axis, Base, Camera, Flange, Plane, Ray, Rigid, Sensor};
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

macro_rules! read_by_kind {
    ($($(#[$doc:meta])* $field:ident: $kind:ident($value:ty),)*) => {
        impl Rig {
            /// The records in a folder.
            fn read(folder: &Path) -> Result<Rig> {
                Ok(Rig { $($field: read(folder, Kind::$kind)?,)* joint: Joint::default() })
            }

            /// Seals a file again that has no seal, was edited, or depends on another camera; the user states the
            /// reason. The remark stays in the file. A file that is no calibration at all is still refused.
            pub fn vouch(station: &Path, kind: Kind, why: &str, as_stated: bool) -> Result<PathBuf> {
                let vouch = match kind {
                    $(Kind::$kind => vouch::<$value>,)*
                };
                vouch(station, kind, why, as_stated)
            }

            /// The record that a text of JSON holds, such as a result that waits to be stored. It is not checked.
            pub fn record(text: &str) -> serde_json::Result<Box<dyn Record>> {
                Ok(match serde_json::from_str::<Of>(text)?.kind {
                    $(Kind::$kind => Box::new(serde_json::from_str::<Calibration<$value>>(text)?),)*
                })
            }
        }
    };
}
of_every_part!(read_by_kind);

/// What tells the value of a record.
#[derive(serde::Deserialize)]
struct Of {
    kind: Kind,
}

impl Rig {
    /// Loads and checks the records that exist in `station/calibration`.
    pub fn load(station: &Path) -> Result<Rig> {
        let folder = station.join("calibration");
        together(&folder).settle()?;
        Ok(Rig { joint: Joint::load(station), ..Rig::read(&folder)? })
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
    pub fn store(station: &Path, record: &dyn Record, page: Option<&str>) -> Result<PathBuf> {
        let text = record.text()?;
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        let _lock = crate::files::Lock::wait(&folder, "import")?;
        together(&folder).settle_locked()?;
        let path = file(station, record.kind());
        if let Some(former) = crate::files::read_text_if_there(&path)? {
            crate::files::write(&path.with_extension("previous.json"), former.as_bytes())?;
        }
        let html = path.with_extension("html");
        let beside: Vec<(&Path, &[u8])> = page.iter().map(|p| (html.as_path(), p.as_bytes())).collect();
        crate::files::write_beside((&path, text.as_bytes()), &beside)?;
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
        let texts =
            self.records().into_iter().map(|part| Ok((part.kind(), part.text()?))).collect::<Result<Vec<_>>>()?;
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

    /// Whether a station has such a record, readable or not.
    pub fn stored(station: &Path, kind: Kind) -> bool {
        file(station, kind).is_file()
    }
}

fn vouch<T: Serialize + DeserializeOwned + Measured>(
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
        c.likely().map_err(|e| e.at(&what))?;
    }
    Rig::store(station, &c, None)
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

fn again(kind: Kind) -> String {
    format!(
        "run sheetlight calibrate {} again; if you know that its values are right, sheetlight station seal --kind {} \
         --because WHY accepts them on your word",
        kind.command(),
        kind.name().replace('_', "-")
    )
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
    use super::super::{Covariance, Quality, Verdict};
    use super::*;
    use crate::geometry::{AxisKind, Vec3};

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
    fn a_record_is_of_the_kind_that_its_text_names() {
        let dir = tempfile::tempdir().unwrap();
        let camera = camera(611.6);
        let text = serde_json::to_string(&plane(70.0, &camera)).unwrap();
        let record = Rig::record(&text).unwrap();
        assert_eq!((record.kind(), record.camera()), (Kind::LaserPlane, Some(&*camera.content())));
        Rig::store(dir.path(), &camera, None).unwrap();
        Rig::store(dir.path(), record.as_ref(), None).unwrap();
        let stored = Rig::load(dir.path()).unwrap().laser_plane.unwrap();
        assert_eq!(stored.value, plane(70.0, &camera).value);
        assert!(Rig::record(&text.replace("laser_plane", "turntable")).is_err());
        assert!(Rig::record("{}").is_err());
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
        Rig::vouch(dir.path(), Kind::LaserPlane, "only the focus was touched", false).unwrap();
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
