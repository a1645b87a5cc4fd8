//! What a calibration that drives itself asks of the cell that it drives; poses are base_from_flange, mm.

use crate::camera::Readout;
use crate::fault::Result;
use crate::geometry::{Base, Flange, Rigid};
use crate::raster::Image;

/// What is on while a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The room's light alone.
    Room,
    /// The line laser.
    Line,
    /// The laser pointer.
    Pointer,
}

/// What came of a move.
#[derive(Clone, Debug)]
pub enum Went {
    /// It stands there; where it says that it stands.
    There(Rigid<Base, Flange>),
    /// It was refused before it began, in these words: the robot stands where it stood.
    NotBegun(String),
}

/// A robot with the sensor on its flange. Who implements it keeps the motion rules: a move that they do not allow is
/// not made.
pub trait Cell {
    /// Where the robot says that it stands.
    fn pose(&mut self) -> Result<Rigid<Base, Flange>>;
    /// Whether it may and can go there: reach, box, keep-outs. Nothing moves.
    fn may(&mut self, to: &Rigid<Base, Flange>) -> Result<bool>;
    /// Goes there, and waits until it stands still.
    fn go(&mut self, to: &Rigid<Base, Flange>) -> Result<Went>;
    /// How its pictures are read from the sensor; none where the camera does not say.
    fn readout(&self) -> Option<Readout>;
    /// Takes one picture where it stands.
    fn picture(&mut self, light: Light) -> Result<Image>;
}
