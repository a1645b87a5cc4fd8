//! In: what was calibrated. Out: its names in files and in messages, its frame, and the parameters of its
//! covariance.
//! Frame and unit: `A_T_b` maps coordinates in frame b to frame A; the unit is part of a parameter's name.

use crate::camera::{ALWAYS_NAMED, NAMES, PARAMETERS};

/// What a calibration describes.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize, strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Kind {
    /// A camera with its lens.
    Camera,
    /// A sheet of light.
    LaserPlane,
    /// A pointer's beam.
    Pointer,
    /// A camera on the flange.
    HandEye,
    /// A fixed camera.
    BaseCamera,
    /// A line-profile sensor on the flange.
    ProfileHandEye,
    /// A linear axis that moves parts before the camera, or the camera along parts.
    LinearAxis,
    /// A turntable that turns parts before the camera.
    Turntable,
}

/// The frame of a value, or the transform between two frames that it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Place {
    /// Camera frame.
    #[serde(rename = "camera")]
    Camera,
    /// Maps the camera frame to the flange frame.
    #[serde(rename = "flange_T_camera")]
    FlangeFromCamera,
    /// Maps the camera frame to the base frame.
    #[serde(rename = "base_T_camera")]
    BaseFromCamera,
    /// Maps the frame of a line-profile sensor to the flange frame.
    #[serde(rename = "flange_T_sensor")]
    FlangeFromSensor,
}

/// Units of every calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Units {
    /// The only supported units.
    #[serde(rename = "mm, rad, px")]
    MmRadPx,
}

const PLANE: [&str; 4] = ["nx", "ny", "nz", "offset_mm"];
/// The beam's own parameters, then the camera's: the beam was found with that camera, and a range needs both.
const POINTER: [&str; 6 + PARAMETERS] = {
    let mut all = ["ox_mm"; 6 + PARAMETERS];
    let beam = ["ox_mm", "oy_mm", "oz_mm", "dx", "dy", "dz"];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < 6 { beam[i] } else { NAMES[i - 6] };
        i += 1;
    }
    all
};
const LINEAR: [&str; 4] = ["dx", "dy", "dz", "pitch_mm"];
const TURNTABLE: [&str; 7] = ["dx", "dy", "dz", "pitch_rad", "px_mm", "py_mm", "pz_mm"];
const POSE: [&str; 6] = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];

impl Kind {
    /// Name in files and in file names.
    pub fn name(self) -> &'static str {
        self.into()
    }
    /// The `sheetlight calibrate` command that makes it.
    pub fn command(self) -> String {
        match self {
            Kind::BaseCamera => "hand-eye --mount eye-to-hand".into(),
            Kind::LinearAxis | Kind::Turntable => "axis".into(),
            _ => self.words().replace(' ', "-"),
        }
    }
    /// Name in messages.
    pub fn words(self) -> String {
        self.name().replace('_', " ").replace("hand eye", "hand-eye")
    }
    /// The frame of such a value, or the transform between two frames that it is.
    pub fn place(self) -> Place {
        match self {
            Kind::Camera | Kind::LaserPlane | Kind::Pointer | Kind::LinearAxis | Kind::Turntable => Place::Camera,
            Kind::HandEye => Place::FlangeFromCamera,
            Kind::BaseCamera => Place::BaseFromCamera,
            Kind::ProfileHandEye => Place::FlangeFromSensor,
        }
    }
    /// The covariance's parameters in their order, and how many of them, counted from the first, a file may have. An
    /// imported or simulated pointer may lack its camera's. After the longest of these, a camera's further terms may
    /// follow if they were estimated.
    pub fn parameters(self) -> (&'static [&'static str], &'static [usize]) {
        match self {
            Kind::Camera => (&NAMES, &[ALWAYS_NAMED]),
            Kind::LaserPlane => (&PLANE, &[4]),
            Kind::Pointer => (&POINTER, &[6, 6 + ALWAYS_NAMED]),
            Kind::HandEye | Kind::BaseCamera | Kind::ProfileHandEye => (&POSE, &[6]),
            Kind::LinearAxis => (&LINEAR, &[4]),
            Kind::Turntable => (&TURNTABLE, &[7]),
        }
    }
    /// Whether it was measured with the camera and is useless with another.
    pub fn rests_on_camera(self) -> bool {
        !matches!(self, Kind::Camera | Kind::ProfileHandEye)
    }
}

impl std::str::FromStr for Kind {
    type Err = String;
    /// Accepts the name in files or that of the command: `laser_plane`, `laser-plane`.
    fn from_str(s: &str) -> Result<Kind, String> {
        let name = s.replace('-', "_");
        Kind::OF_A_RIG.iter().find(|k| k.name() == name).copied().ok_or_else(|| {
            let names: Vec<String> = Kind::OF_A_RIG.iter().map(|k| k.name().replace('_', "-")).collect();
            format!("unknown calibration '{s}': {}", names.join(", "))
        })
    }
}
