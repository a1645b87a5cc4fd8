//! In: a user's settings for the hand-eye solve. Out: the checked settings; the mount of the camera; the assumed
//! noise.
//! Frame and unit: mm; degrees where the name states them.

use super::closed::{Chain, Far, Near};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct HandEyeOptions {
    /// Sigma of the robot's position per axis, mm; `None`: estimated. 1e-6..=10.
    pub robot_sigma_mm: Option<f64>,
    /// Sigma of the robot's orientation per axis, degrees; `None`: estimated. 1e-7..=5.
    pub robot_sigma_deg: Option<f64>,
    /// A pair counts as wrong if its squared Mahalanobis distance (6 degrees of freedom) exceeds this; 26.1 excludes
    /// one good pair in 5,000. 12..=1000.
    pub gate: f64,
    /// Rotation about the second axis (rms over all motions) below which the result is refused, degrees; 0.1..=30.
    pub min_second_axis_deg: f64,
    /// Smallest number of agreeing pairs; 3..=1000.
    pub min_pairs: usize,
    /// Source of the board's lengths, as named in messages.
    pub board_length: String,
    /// Seed of the random triples for more than 25 pairs.
    pub seed: u64,
}

impl Default for HandEyeOptions {
    fn default() -> Self {
        HandEyeOptions {
            robot_sigma_mm: None,
            robot_sigma_deg: None,
            gate: 26.1,
            min_second_axis_deg: 3.0,
            min_pairs: 4,
            board_length: "the board's description".into(),
            seed: 1,
        }
    }
}

impl HandEyeOptions {
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        let bad = |name: &str, value: f64, range: &str| {
            Err(Fault::usage(format!("{name} is {value}, {range} is allowed")).next("choose a value in that range"))
        };
        if let Some(s) = self.robot_sigma_mm.filter(|s| !(1e-6..=10.0).contains(s)) {
            return bad("robot_sigma_mm", s, "1e-6 to 10");
        }
        if let Some(s) = self.robot_sigma_deg.filter(|s| !(1e-7..=5.0).contains(s)) {
            return bad("robot_sigma_deg", s, "1e-7 to 5");
        }
        if !(12.0..=1000.0).contains(&self.gate) {
            return bad("gate", self.gate, "12 to 1000");
        }
        if !(0.1..=30.0).contains(&self.min_second_axis_deg) {
            return bad("min_second_axis_deg", self.min_second_axis_deg, "0.1 to 30");
        }
        if !(3..=1000).contains(&self.min_pairs) {
            return bad("min_pairs", self.min_pairs as f64, "3 to 1000");
        }
        Ok(())
    }
}

/// Standard deviations of the robot's reported poses per axis, and the factor of the features' sigmas. For board
/// poses given without sigmas, the factor is the sigma of their rotation, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Position, per axis, mm.
    pub robot_mm: f64,
    /// Orientation, per axis, rad.
    pub robot_rad: f64,
    /// Factor from a feature's stated sigma to its true one; rad for board poses without sigmas.
    pub feature_factor: f64,
}

/// The side of the chain on which the flange moves.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Mount {
    /// The flange carries the camera, and the board stands still.
    EyeInHand,
    /// The flange carries the board, and the camera stands still.
    EyeToHand,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Mount>("mount", word)
}

impl Mount {
    /// Name in station.toml and on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }
    /// The robot's pose in the form that the chain uses.
    pub fn near_from_far(self, base_from_flange: &Rigid<Base, Flange>) -> Rigid<Near, Far> {
        let inverse = base_from_flange.inverse();
        match self {
            Mount::EyeInHand => Rigid::new(inverse.rotation, inverse.translation),
            Mount::EyeToHand => Rigid::new(base_from_flange.rotation, base_from_flange.translation),
        }
    }
    /// The inverse of [`Mount::near_from_far`]: the robot's pose of a pair.
    pub fn base_from_flange(self, near_from_far: &Rigid<Near, Far>) -> Rigid<Base, Flange> {
        let inverse = near_from_far.inverse();
        match self {
            Mount::EyeInHand => Rigid::new(inverse.rotation, inverse.translation),
            Mount::EyeToHand => Rigid::new(near_from_far.rotation, near_from_far.translation),
        }
    }
    /// The flange's origin in the camera frame.
    pub(in crate::calibrate) fn flange(self, chain: &Chain, near_from_far: &Rigid<Near, Far>) -> Vec3 {
        match self {
            Mount::EyeInHand => chain.near_from_camera.inverse().translation,
            Mount::EyeToHand => (chain.near_from_camera.inverse() * *near_from_far).translation,
        }
    }
}
