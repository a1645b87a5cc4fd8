//! Determines whether a station's camera is on the flange or stands still, and from which source that is known.

use crate::calibrate::hand_eye::options::Mount;
use crate::fault::{Fault, Result};
use crate::rig::{Kind, Rig};
use crate::station::settings::Settings;
use std::path::Path;

/// The mount of a station's camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mounted {
    /// The mount that calibrations use.
    pub mount: Mount,
    /// A remark if the mount was assumed; `None`: station.toml or the person stated it.
    pub assumed: Option<String>,
}

/// The mount of a station: first as station.toml states it, then that of the station's stored record, then the one
/// stated with the command. Without any of these the camera is assumed to be on the flange, with a remark.
///
/// # Errors
/// The command states another mount than the station has. The station has records of both mounts, and nothing
/// decides between them.
pub fn mount_of(station: &Path, settings: &Settings, stated: Option<Mount>) -> Result<Mounted> {
    let set = settings.mount;
    let stored = |kind| Rig::stored(station, kind);
    let (hand_eye, base_camera) = (stored(Kind::HandEye), stored(Kind::BaseCamera));
    let record = match (hand_eye, base_camera) {
        (true, false) => Some((Mount::EyeInHand, Kind::HandEye)),
        (false, true) => Some((Mount::EyeToHand, Kind::BaseCamera)),
        _ => None,
    };
    let known = set.or(record.map(|(mount, _)| mount));
    if let (Some(known), Some(stated)) = (known, stated)
        && known != stated
    {
        let whence = match (set, record) {
            (None, Some((_, kind))) => format!("the station's {}.json", kind.name()),
            _ => "station.toml".into(),
        };
        return Err(Fault::refused(format!("--mount says {}, {whence} says {}", stated.name(), known.name()))
            .cause("a wrong option, or the camera was mounted elsewhere since")
            .next(format!("omit the option, or set mount = \"{}\" in station.toml first", stated.name())));
    }
    let said = |mount: Mount, why: &str| Mounted { mount, assumed: Some(format!("mount {}: {why}", mount.name())) };
    Ok(match (set.or(stated), record) {
        (Some(mount), _) => Mounted { mount, assumed: None },
        (None, Some((mount, kind))) => {
            said(mount, &format!("station.toml states none, the station's {}.json is of it", kind.name()))
        }
        (None, None) if hand_eye && base_camera => {
            return Err(Fault::refused(
                "the station has hand_eye.json and base_camera.json, and station.toml states no mount",
            )
            .cause("the camera was mounted elsewhere since one of them was made")
            .next("set mount = \"eye-in-hand\" or \"eye-to-hand\" in station.toml"));
        }
        (None, None) => said(Mount::EyeInHand, "nothing states one, the camera is taken to be on the flange"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use Mount::{EyeInHand, EyeToHand};

    #[test]
    fn nothing_about_the_mount_is_guessed_without_a_word() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("calibration");
        std::fs::create_dir(&folder).unwrap();
        let is = |set: Option<Mount>, stated: Option<Mount>| {
            mount_of(dir.path(), &Settings { mount: set, ..Settings::default() }, stated)
        };
        let plain = |mount| Mounted { mount, assumed: None };
        assert!(is(None, None).unwrap().assumed.unwrap().contains("taken to be on the flange"));
        assert_eq!(is(None, Some(EyeToHand)).unwrap(), plain(EyeToHand));
        assert_eq!(is(Some(EyeToHand), None).unwrap(), plain(EyeToHand));
        assert_eq!(is(Some(EyeToHand), Some(EyeToHand)).unwrap(), plain(EyeToHand));
        let said = is(Some(EyeToHand), Some(EyeInHand)).unwrap_err();
        assert!(said.what.contains("--mount says eye-in-hand, station.toml says eye-to-hand"), "{said}");

        std::fs::write(folder.join("base_camera.json"), "spoilt").unwrap();
        let found = is(None, None).unwrap();
        assert!(found.mount == EyeToHand && found.assumed.unwrap().contains("base_camera.json"));
        assert!(is(None, Some(EyeInHand)).unwrap_err().what.contains("base_camera.json says eye-to-hand"));
        assert_eq!(is(Some(EyeInHand), None).unwrap(), plain(EyeInHand), "station.toml counts before a former record");

        std::fs::write(folder.join("hand_eye.json"), "spoilt").unwrap();
        assert!(is(None, None).unwrap_err().next.contains("station.toml"));
        assert_eq!(is(None, Some(EyeInHand)).unwrap(), plain(EyeInHand));
        assert_eq!(is(Some(EyeToHand), None).unwrap(), plain(EyeToHand));
    }
}
