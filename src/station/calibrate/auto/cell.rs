//! What an automatic calibration requires of its cell; poses are base_from_flange, mm.

use crate::camera::Readout;
use crate::fault::Result;
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::Image;

/// The light during a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The room's light alone.
    Room,
    /// The line laser.
    Line,
    /// The laser pointer.
    Pointer,
}

/// The outcome of a move.
#[derive(Clone, Debug)]
pub enum Went {
    /// The robot has arrived; its reported pose.
    There(Rigid<Base, Flange>),
    /// The move was refused before it began, with the reason: the robot has not moved.
    NotBegun(String),
}

/// A robot with the sensor on its flange. The implementation enforces the motion rules: moves that they do not
/// allow are not made.
pub trait Cell {
    /// The robot's reported pose.
    fn pose(&mut self) -> Result<Rigid<Base, Flange>>;
    /// Whether the robot may and can go there: reach, box, keep-outs. Nothing moves.
    fn may(&mut self, to: &Rigid<Base, Flange>) -> Result<bool>;
    /// Goes there, and waits until it stands still.
    fn go(&mut self, to: &Rigid<Base, Flange>) -> Result<Went>;
    /// The readout of its pictures from the sensor; `None` if the camera does not report it.
    fn readout(&self) -> Option<Readout>;
    /// Takes one picture at the present pose.
    fn picture(&mut self, light: Light) -> Result<Image>;
}
