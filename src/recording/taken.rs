//! In: acquisition data of a frame: numbers, clocks, pairing. Out: the `taken` of a frame; the position of what
//! moves, and how far that may be off because the time is uncertain.
//! Frame and unit: times in ns, the device's by its own clock, the host's since the Unix epoch; base_from_flange,
//! mm.

use super::stand::Stand;
use crate::geometry::{Base, Flange, Mat3, Rigid, Vec3};

/// How a picture and the position of what moves were paired.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize, strum::Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Pairing {
    /// At rest: the pose was the same before and after the picture.
    Step,
    /// By number: the picture's id or counter against encoder counts or trigger numbers.
    Count,
    /// By time: interpolated between the two poses around the middle of the exposure.
    Clock,
    /// Stated by the source: a played recording, a simulated station.
    Given,
}

/// A small motion. It states either how far a position may be off because the time of the picture is uncertain (one
/// standard deviation), or the motion in a second.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Slip {
    /// A motion of the flange seen from the base: shift of the point at the base's origin, mm, and rotation, rad.
    Flange([f64; 6]),
    /// A motion of an axis, in its counts.
    Count(f64),
}

impl Slip {
    /// The motion scaled by `k`.
    pub fn times(&self, k: f64) -> Slip {
        match self {
            Slip::Flange(motion) => Slip::Flange(motion.map(|m| m * k)),
            Slip::Count(counts) => Slip::Count(counts * k),
        }
    }

    /// The position that results from applying it to a position.
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

/// Acquisition data of a frame.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taken {
    /// The device's number of the frame.
    pub id: u64,
    /// Start of the exposure, by the device's clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device_ns: Option<u64>,
    /// Arrival of the last byte, by the host's clock.
    pub host_ns: u64,
    /// Exposure time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_ns: Option<u64>,
    /// How it was paired; none if nothing moves, or if it is not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pairing: Option<Pairing>,
    /// Uncertainty of the time between picture and pose, 1 sigma; for the pairing by clock.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_sigma_ns: Option<f64>,
    /// Delay of the picture's time that was assumed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_ns: Option<f64>,
    /// Motion in a second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Slip>,
    /// Pose of the robot's flange.
    #[serde(
        rename = "base_T_flange",
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "as_written"
    )]
    pub base_from_flange: Option<Rigid<Base, Flange>>,
}

/// Orthonormality error that rounding can cause. A pose with a larger one was not written here, and is repaired.
const ROUNDING: f64 = 1e-12;

/// A pose bit for bit as recorded: a scan of the recording then equals the scan that was made while it ran.
fn as_written<'de, D: serde::Deserializer<'de>>(d: D) -> Result<Option<Rigid<Base, Flange>>, D::Error> {
    let Some(rows) = <Option<[f64; 16]> as serde::Deserialize>::deserialize(d)? else { return Ok(None) };
    let (repaired, departure) = Rigid::from_rows(&rows).map_err(serde::de::Error::custom)?;
    let rotation = Mat3::from_fn(|i, k| rows[4 * i + k]);
    Ok(Some(if departure < ROUNDING { Rigid::new(rotation, repaired.translation) } else { repaired }))
}

impl Taken {
    /// Speed times the uncertainty of the time.
    pub fn slip(&self) -> Option<Slip> {
        Some(self.rate?.times(1e-9 * self.time_sigma_ns?))
    }

    /// The position of what moves, and its uncertainty, if the picture's time is late by `delay_ns`, known to
    /// `sigma_ns`. This replaces the delay assumed at recording. Without pairing by clock the position is unchanged.
    pub fn delayed(&self, stand: &Stand, delay_ns: f64, sigma_ns: f64) -> (Stand, Option<Slip>) {
        let (Some(rate), Some(time), Some(former)) = (self.rate, self.time_sigma_ns, self.delay_ns) else {
            return (*stand, self.slip());
        };
        let earlier = rate.times(1e-9 * (former - delay_ns));
        (earlier.moves(stand), Some(rate.times(1e-9 * time.hypot(sigma_ns))))
    }

    /// The same with the position of what moves; an axis' count is stored in the frame itself.
    pub fn standing(mut self, stand: Option<&Stand>) -> Taken {
        if let Some(Stand::Robot(pose)) = stand {
            self.base_from_flange = Some(*pose);
        }
        self
    }
}
