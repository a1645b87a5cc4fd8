//! In: nothing. Out: a stop of the calibration as the joint solve takes it: a board's features, where the robot said it
//! stood, the stripe and the spot on the board; what is left out of it and why.
//! Frame and unit: px in pictures; the robot's base and flange, mm.

use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::measured_pose::SeenBoard;
use crate::geometry::{Base, Flange, Rigid, Vec2};
use nalgebra::Matrix2;

/// Where the robot said that it stood, before a board that does not move against its carrier.
#[derive(Clone, Copy, Debug)]
pub struct Reported {
    /// base_from_flange, mm.
    pub pose: Rigid<Base, Flange>,
    /// Which of the boards' places: an index below [`super::unknowns::State::far_from_board`]'s length.
    pub place: usize,
}

/// The pointer's spot on the board.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Its centre, px.
    pub pixel: Vec2,
    /// px².
    pub covariance: Matrix2<f64>,
}

/// One stop: the board and the lasers did not move between its pictures.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The board's features in room light.
    pub seen: SeenBoard,
    /// `None` where no robot says where the board is: it tells of camera, sheet and beam alone.
    pub robot: Option<Reported>,
    /// The stripe's peaks on the board, those that are light of the sheet ([`thinned`]).
    pub stripe: Vec<StripePeak>,
    /// The pointer's spot on the board.
    pub spot: Option<Spot>,
}

/// Peaks of one stop that are handed to the solve at most: a straight line on a flat board has two numbers, and speckle
/// makes neighbours alike.
pub const PEAKS_A_STOP: usize = 48;

/// Neighbours along the stripe averaged until [`PEAKS_A_STOP`] are left; `peaks` in order along the stripe. Within a
/// group the stripe is straight: a lens bends it by less than 1e-3 px over ten.
pub fn thinned(peaks: &[StripePeak]) -> Vec<StripePeak> {
    let group = peaks.len().div_ceil(PEAKS_A_STOP).max(1);
    let mean = |g: &[StripePeak]| {
        let weight = |p: &StripePeak| p.sigma_px.powi(-2);
        let total: f64 = g.iter().map(weight).sum();
        StripePeak {
            pixel: g.iter().map(|p| p.pixel * weight(p)).sum::<Vec2>() / total,
            sigma_px: total.powf(-0.5),
            width_px: g.iter().map(|p| p.width_px).sum::<f64>() / g.len() as f64,
        }
    };
    peaks.chunks(group).filter(|g| g.len() * 2 > group).map(mean).collect()
}

/// A part of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The board's features.
    Features,
    /// The stripe on the board.
    Stripe,
    /// The pointer's spot.
    Spot,
    /// Where the robot says that the flange is.
    RobotPlace,
    /// How the robot says that the flange is turned.
    RobotTurn,
}

impl Part {
    /// All of them, in the order of [`super::options::Noise::factors`].
    pub const ALL: [Part; 5] = [Part::Features, Part::Stripe, Part::Spot, Part::RobotPlace, Part::RobotTurn];

    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Part::Features => "the board's corners",
            Part::Stripe => "the stripe",
            Part::Spot => "the pointer's spot",
            Part::RobotPlace => "the robot's position",
            Part::RobotTurn => "the robot's orientation",
        }
    }
}

/// A part of a stop that does not count.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Of the picture.
    pub name: String,
    /// What of it.
    pub part: Part,
    /// Why, in words.
    pub why: String,
}
