//! In: nothing. Out: the rig as one value, whose parts are listed once; what is asked of all parts or of one.
//! Frame and unit: as in the records.

use super::{Calibration, HandEye, Joint, JointCovariance, Kind, Measured, Quality, Verdict, sealed};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, Base, Camera, Flange, Plane, Ray, Rigid, Sensor};
use serde::Serialize;
use serde_json::{Map, Value};

/// Hands the parts of a rig to a macro: field, kind, value. What is done with each of them walks over this list, which
/// has the order of reports.
macro_rules! of_every_part {
    ($do:ident) => {
        $do! {
            /// Camera and lens.
            camera: Camera(Intrinsics),
            /// The sheet of light, camera frame.
            laser_plane: LaserPlane(Plane<Camera>),
            /// Pose of the camera on the flange.
            hand_eye: HandEye(HandEye),
            /// The pointer's beam, camera frame.
            pointer: Pointer(Ray<Camera>),
            /// Pose of a fixed camera, before a robot that carries the part.
            base_camera: BaseCamera(Rigid<Base, Camera>),
            /// Linear axis that moves the parts, or moves the camera along them.
            linear_axis: LinearAxis(Axis),
            /// Turntable that turns the parts before the camera.
            turntable: Turntable(Axis),
            /// Pose of a line-profile sensor on the flange.
            profile_hand_eye: ProfileHandEye(Rigid<Flange, Sensor>),
        }
    };
}
pub(super) use of_every_part;

macro_rules! rig {
    ($($(#[$doc:meta])* $field:ident: $kind:ident($value:ty),)*) => {
        /// The calibrations of a station; every part may be missing.
        #[derive(Clone, Debug, Default)]
        pub struct Rig {
            $($(#[$doc])* pub $field: Option<Calibration<$value>>,)*
            /// Joint covariance of the records, if they were calibrated together.
            pub joint: Joint,
        }

        impl Rig {
            /// Every existing record.
            pub fn records(&self) -> Vec<&dyn Record> {
                let all = [$(self.$field.as_ref().map(|c| c as &dyn Record)),*];
                all.into_iter().flatten().collect()
            }
        }

        impl Kind {
            /// The kinds that a station's scans and ranges use.
            pub const OF_A_RIG: &[Kind] = &[$(Kind::$kind),*];
        }
    };
}
of_every_part!(rig);

/// A record of whatever kind.
pub trait Record {
    /// Kind of the record.
    fn kind(&self) -> Kind;
    /// Time of the measurement, RFC 3339.
    fn created(&self) -> &str;
    /// Quality of the result.
    fn quality(&self) -> &Quality;
    /// What users have vouched for.
    fn remarks(&self) -> &[String];
    /// [`Calibration::content`] of the camera that it was measured with, if it names one.
    fn camera(&self) -> Option<&str>;
    /// The value as it stands in files.
    fn value(&self) -> Value;
    /// The record as JSON, without a seal.
    fn json(&self) -> Value;
    /// The text of its file.
    ///
    /// # Errors
    /// An invalid record.
    fn text(&self) -> Result<String>;
    /// Refuses a value that looks like another unit; for values that a user enters.
    ///
    /// # Errors
    /// What is unusual about it.
    fn likely(&self) -> Result<()>;
}

impl<T: Serialize + Measured> Record for Calibration<T> {
    fn kind(&self) -> Kind {
        self.kind
    }
    fn created(&self) -> &str {
        &self.created
    }
    fn quality(&self) -> &Quality {
        &self.quality
    }
    fn remarks(&self) -> &[String] {
        &self.remarks
    }
    fn camera(&self) -> Option<&str> {
        self.rests_on.get(&Kind::Camera).map(String::as_str)
    }
    fn value(&self) -> Value {
        serde_json::to_value(&self.value).expect("plain data")
    }
    fn json(&self) -> Value {
        serde_json::to_value(self).expect("plain data")
    }
    fn text(&self) -> Result<String> {
        self.check(self.kind).map_err(|e| e.at(self.kind.words()))?;
        Ok(sealed(self))
    }
    fn likely(&self) -> Result<()> {
        self.value.doubt().map_or(Ok(()), |doubt| {
            Err(Fault::refused(doubt)
                .cause("metres, or another unit than millimetres")
                .next("convert it to mm, or confirm it with --as-stated"))
        })
    }
}

impl Rig {
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

    /// Refuses a rig that lacks two or more of these kinds, and names all of them. One that lacks a single kind is left
    /// to that kind's own `need_`.
    pub fn need_all(&self, kinds: &[Kind]) -> Result<()> {
        let there: Vec<Kind> = self.kinds();
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
        let there: Vec<Kind> = self.kinds();
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

    /// The kinds of every existing record.
    fn kinds(&self) -> Vec<Kind> {
        self.records().iter().map(|r| r.kind()).collect()
    }

    /// The parts that were measured with another camera than the station's, and what is wrong with each.
    pub fn stale(&self) -> Vec<(Kind, String)> {
        self.records().into_iter().filter_map(|part| self.other_camera(part)).collect()
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

    fn belonging<'a, T: Serialize + Measured>(
        &self,
        part: &'a Option<Calibration<T>>,
    ) -> Result<Option<&'a Calibration<T>>> {
        let other = part.as_ref().and_then(|part| self.other_camera(part));
        other.map_or(Ok(part.as_ref()), |(kind, what)| Err(made_with_another(kind, what)))
    }

    /// Which part it is, and what is wrong, if it was measured with another camera than the station's.
    fn other_camera(&self, part: &dyn Record) -> Option<(Kind, String)> {
        let (kind, now) = (part.kind(), self.camera.as_ref()?.content());
        if !kind.rests_on_camera() || part.camera() == Some(&now) {
            return None;
        }
        let what = kind.words();
        let why = match part.camera() {
            Some(then) => format!("the {what} was measured with camera {then:.12}, the station now has {now:.12}"),
            None => format!("the {what} names no camera, the station has camera {now:.12}"),
        };
        Some((kind, why))
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
        let of = |r: &dyn Record| {
            let what = r.kind().words();
            let mut said: Vec<String> = r.remarks().iter().map(|said| format!("{what}: {said}")).collect();
            if r.quality().verdict > Verdict::Usable {
                said.push(format!("{what}: {}", r.quality().verdict.words()));
            }
            said
        };
        self.records().into_iter().flat_map(of).collect()
    }

    /// One hash over the values that turn pixels into points. A scan stores it, so that a later step can check
    /// whether the scan was taken with the station's present calibration.
    pub fn fingerprint(&self) -> String {
        // These three count even if they are missing, as in scans of older versions. A range's pointer makes no point.
        let always = [Kind::Camera, Kind::LaserPlane, Kind::HandEye].map(|k| (k.name().to_owned(), Value::Null));
        let mut values = Map::from_iter(always);
        let parts = self.records().into_iter().filter(|part| part.kind() != Kind::Pointer);
        values.extend(parts.map(|part| (part.kind().name().to_owned(), part.value())));
        super::hash_text(Value::from(values).to_string().as_bytes())
    }
}

fn made_with_another(kind: Kind, what: String) -> Fault {
    let next = format!("run sheetlight calibrate {} again", kind.command());
    Fault::refused(what)
        .cause(OTHER_CAMERA)
        .next(format!("{next}; put camera.previous.json back only if the camera's new calibration was a mistake"))
}

const OTHER_CAMERA: &str = "the camera was calibrated or imported again, or files of two stations were mixed";

const NEVER_CALIBRATED: &str = "it was never calibrated, or another folder was given as --station";

fn missing(kind: Kind) -> Fault {
    // A profile sensor's pose is not among the values that are imported.
    let or = if kind == Kind::ProfileHandEye { "" } else { ", or import known values with sheetlight station import" };
    Fault::input(format!("the station has no {} calibration", kind.words()))
        .cause(NEVER_CALIBRATED)
        .next(format!("run sheetlight calibrate {}{or}", kind.command()))
}
