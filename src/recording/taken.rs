//! In: what is known of how a frame came: numbers, clocks, pairing. Out: the `taken` of a frame; where what moves
//! stood, and how far that may be off because the time is uncertain.
//! Frame and unit: times in ns, the device's by its own clock, the host's since the Unix epoch; base_from_flange, mm.

use super::stand::Stand;
use crate::geometry::{Base, Flange, Mat3, Rigid, Vec3};

/// How a picture and where what moves stood were brought together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, strum::Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Pairing {
    /// Everything stood still: before and after the picture the pose was the same.
    Step,
    /// By number: the picture's id or counter against encoder counts or trigger numbers.
    Count,
    /// By time: between the two poses around the middle of the exposure.
    Clock,
    /// The source itself says: a played recording, a simulated station.
    Given,
}

/// A small motion: how far a stand may be off because nobody knows the time of the picture better (one standard
/// deviation), or what moves does in a second.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slip {
    /// A motion of the flange seen from the base: shift of what is at the base's origin, mm, and turn, rad.
    Flange([f64; 6]),
    /// Of an axis, in its counts.
    Count(f64),
}

impl Slip {
    /// So many times as far.
    pub fn times(&self, k: f64) -> Slip {
        match self {
            Slip::Flange(motion) => Slip::Flange(motion.map(|m| m * k)),
            Slip::Count(counts) => Slip::Count(counts * k),
        }
    }

    /// Where a stand is after it.
    pub fn moves(&self, stand: &Stand) -> Stand {
        match (self, stand) {
            (Slip::Flange([x, y, z, a, b, c]), Stand::Robot(pose)) => {
                let w = Vec3::new(*a, *b, *c);
                let by: Rigid<Base, Base> = Rigid::from_vectors(&w, Vec3::new(*x, *y, *z));
                Stand::Robot(by * *pose)
            }
            (Slip::Count(by), Stand::Count(count)) => Stand::Count(count + by),
            _ => *stand,
        }
    }
}

/// How a frame came.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taken {
    /// The device's number of it.
    pub id: u64,
    /// When its exposure began, by the device's clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_ns: Option<u64>,
    /// When its last byte was here.
    pub host_ns: u64,
    /// How long it was exposed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_ns: Option<u64>,
    /// How it was paired; none where nothing moves, or nobody says what.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pairing: Option<Pairing>,
    /// How well the time between picture and pose is known, 1 sigma; of the pairing by clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_sigma_ns: Option<f64>,
    /// By how much the picture's time was taken to be late.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_ns: Option<f64>,
    /// What moves did in a second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Slip>,
    /// Where the robot's flange stood.
    #[serde(
        rename = "base_T_flange",
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "as_written"
    )]
    pub base_from_flange: Option<Rigid<Base, Flange>>,
}

/// Farther from orthonormal than rounding makes it: then the pose is not one that was written here, and is repaired.
const ROUNDING: f64 = 1e-12;

/// A pose bit for bit as it was recorded: a scan of the recording is the scan that was made while it ran.
fn as_written<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Option<Rigid<Base, Flange>>, D::Error> {
    let Some(rows) = <Option<[f64; 16]> as serde::Deserialize>::deserialize(d)? else { return Ok(None) };
    let (repaired, departure) = Rigid::from_rows(&rows).map_err(serde::de::Error::custom)?;
    let rotation = Mat3::from_fn(|i, k| rows[4 * i + k]);
    Ok(Some(if departure < ROUNDING { Rigid::new(rotation, repaired.translation) } else { repaired }))
}

impl Taken {
    /// Speed times what is not known of the time.
    pub fn slip(&self) -> Option<Slip> {
        Some(self.rate?.times(1e-9 * self.time_sigma_ns?))
    }

    /// Where what moves stood, and how far that may be off, if the picture's time was late by `delay_ns`, known to
    /// `sigma_ns`, whatever was thought of that when it was recorded; as it is for all but the pairing by clock.
    pub fn delayed(&self, stand: &Stand, delay_ns: f64, sigma_ns: f64) -> (Stand, Option<Slip>) {
        let (Some(rate), Some(time), Some(former)) = (self.rate, self.time_sigma_ns, self.delay_ns) else {
            return (*stand, self.slip());
        };
        let earlier = rate.times(1e-9 * (former - delay_ns));
        (earlier.moves(stand), Some(rate.times(1e-9 * time.hypot(sigma_ns))))
    }

    /// The same with where what moves stood; an axis' count is the frame's own.
    pub fn standing(mut self, stand: Option<&Stand>) -> Taken {
        if let Some(Stand::Robot(pose)) = stand {
            self.base_from_flange = Some(*pose);
        }
        self
    }
}
