//! In: the user's names for frames. Out: the names of frames in messages; the laser's frame.
//! Frame and unit: camera frame, mm, for the laser's frame.

use sheetlight::geometry::{Camera, Mat3, Plane, Rigid, Sensor, Vec3};
use sheetlight::scan::Along;
use std::collections::BTreeMap;

/// The frames that messages name; these names are used unless the user renames them.
pub const FRAMES: [&str; 7] = ["base", "flange", "axis", "map", "camera", "camera_reported", "laser"];

/// Names of frames.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    renamed: BTreeMap<&'static str, String>,
}

/// A frame and its new name: `base=base_link`.
#[derive(Clone, Debug)]
pub struct Renamed {
    frame: &'static str,
    name: String,
}

impl std::str::FromStr for Renamed {
    type Err = String;

    fn from_str(text: &str) -> Result<Renamed, String> {
        let (frame, name) = text.split_once('=').ok_or_else(|| format!("'{text}' is not like base=base_link"))?;
        let known = FRAMES.into_iter().find(|f| *f == frame);
        let frame = known.ok_or_else(|| format!("unknown frame '{frame}': {}", FRAMES.join(", ")))?;
        let good = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '/' | '.');
        if name.is_empty() || name.starts_with('/') || !name.chars().all(good) {
            return Err(format!("'{name}' is not a name of a frame: letters, digits, _ - . and / not at the begin"));
        }
        Ok(Renamed { frame, name: name.to_owned() })
    }
}

impl Frames {
    /// Frames with these names; all others keep theirs.
    ///
    /// # Errors
    /// In words: a frame renamed twice, or two frames of the same name.
    pub fn new(renamed: &[Renamed]) -> Result<Frames, String> {
        let mut frames = Frames::default();
        for Renamed { frame, name } in renamed {
            if frames.renamed.insert(frame, name.clone()).is_some() {
                return Err(format!("frame '{frame}' is renamed twice"));
            }
        }
        for (i, a) in FRAMES.iter().enumerate() {
            if let Some(b) = FRAMES[..i].iter().find(|b| frames.name(a) == frames.name(b)) {
                return Err(format!("frames '{b}' and '{a}' would both be named '{}'", frames.name(a)));
            }
        }
        Ok(frames)
    }

    /// The name of one of [`FRAMES`].
    pub fn name<'a>(&'a self, frame: &'a str) -> &'a str {
        self.renamed.get(frame).map_or(frame, String::as_str)
    }
}

/// The laser's frame in the camera frame: z along the sheet's normal, x along the stripe as projected into the
/// sheet, origin where the camera's axis meets the sheet.
pub fn camera_from_laser(sheet: &Plane<Camera>, along: Along) -> Rigid<Camera, Sensor> {
    let z = sheet.normal;
    let stripe = if along == Along::U { Vec3::x() } else { Vec3::y() };
    let x = stripe - z * z.dot(&stripe);
    // A stripe runs within its sheet. For a sheet across that direction, x is chosen arbitrarily.
    let x = x.try_normalize(1e-6).unwrap_or_else(|| z.cross(&Vec3::z()).normalize());
    // A sheet parallel to the axis never meets it: then the foot of the perpendicular from the camera's centre is
    // used.
    let origin = if z.z.abs() > 1e-3 { Vec3::z() * (sheet.offset / z.z) } else { z * sheet.offset };
    Rigid::new(Mat3::from_columns(&[x, z.cross(&x), z]), origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_renamed_once_and_stay_different() {
        let read = |words: &[&str]| {
            let renamed: Result<Vec<Renamed>, String> = words.iter().map(|w| w.parse()).collect();
            Frames::new(&renamed?)
        };
        let frames = read(&["base=base_link", "camera=cell3/camera_optical"]).unwrap();
        assert_eq!([frames.name("base"), frames.name("laser")], ["base_link", "laser"]);
        for (words, said) in [
            (&["base"][..], "not like"),
            (&["world=map"], "unknown frame 'world'"),
            (&["base="], "not a name"),
            (&["base=/base"], "not a name"),
            (&["base=a b"], "not a name"),
            (&["base=a", "base=b"], "renamed twice"),
            (&["base=laser"], "both be named 'laser'"),
        ] {
            assert!(read(words).unwrap_err().contains(said), "{words:?}");
        }
    }

    #[test]
    fn the_lasers_frame_lies_on_its_sheet() {
        let sheet = Plane::new(Vec3::new(0.1, 0.6, 0.8), 240.0).unwrap();
        for along in [Along::U, Along::V] {
            let laser = camera_from_laser(&sheet, along);
            assert!((laser.rotation.transpose() * laser.rotation - Mat3::identity()).norm() < 1e-12);
            assert!((laser.rotation.determinant() - 1.0).abs() < 1e-12);
            for p in [Vec3::zeros(), Vec3::new(50.0, 0.0, 0.0), Vec3::new(0.0, -7.0, 0.0)] {
                assert!(sheet.distance(&laser.point(&p)).abs() < 1e-9);
            }
            assert!(laser.translation.xy().norm() < 1e-12 && laser.translation.z > 0.0);
        }
        assert!(camera_from_laser(&sheet, Along::U).rotation[(0, 0)] > 0.99);
        assert!(camera_from_laser(&sheet, Along::V).rotation[(1, 0)] > 0.7);
    }
}
