//! In: nothing. Out: the input of the joint solve for one stop: a board's features, the robot's reported pose, the
//! stripe and the spot on the board; excluded parts with their reasons.
//! Frame and unit: px in pictures; the robot's base and flange, mm.

use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::measured_pose::SeenBoard;
use crate::geometry::{Base, Flange, Rigid, Vec2};
use nalgebra::Matrix2;

/// The robot's reported pose at a stop, and the board's fixed pose on its carrier.
#[derive(Clone, Copy, Debug)]
pub struct Reported {
    /// base_from_flange, mm.
    pub pose: Rigid<Base, Flange>,
    /// Which of the boards' poses: an index into [`super::unknowns::State::far_from_board`].
    pub place: usize,
}

/// The pointer's spot on the board.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Centre, px.
    pub pixel: Vec2,
    /// Covariance of the centre, px².
    pub covariance: Matrix2<f64>,
}

/// One stop: the board and the lasers did not move between its pictures.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The board's features in room light.
    pub seen: SeenBoard,
    /// `None` without a robot's pose: the stop then determines only camera, laser plane and beam.
    pub robot: Option<Reported>,
    /// The stripe's peaks on the board that belong to the laser plane ([`thinned`]).
    pub stripe: Vec<StripePeak>,
    /// The pointer's spot on the board.
    pub spot: Option<Spot>,
}

/// Largest number of peaks of one stop in the solve: a straight line on a flat board has two parameters, and
/// neighbours share speckle.
pub const PEAKS_A_STOP: usize = 48;

/// Averages neighbouring peaks until at most [`PEAKS_A_STOP`] remain; `peaks` in order along the stripe. Within a
/// group the stripe is straight: a lens bends it by less than 1e-3 px over ten peaks.
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
    /// The position of the flange that the robot reports.
    RobotPlace,
    /// The orientation of the flange that the robot reports.
    RobotTurn,
}

impl Part {
    /// All of them, in the order of [`super::options::Noise::factors`].
    pub const ALL: [Part; 5] = [Part::Features, Part::Stripe, Part::Spot, Part::RobotPlace, Part::RobotTurn];

    /// Name for messages.
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

/// A part of a stop that was excluded.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Name of the picture.
    pub name: String,
    /// The excluded part.
    pub part: Part,
    /// The reason, in words.
    pub why: String,
}
