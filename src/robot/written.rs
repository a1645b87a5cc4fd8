//! A pose as stored in a file: its numbers, and the convention by which they were read.

use super::Convention;
use crate::geometry::{Base, Flange, Rigid};

/// The numbers of one pose before the conversion to a transform. The convention gives the units.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The convention by which the numbers were read.
    pub convention: Convention,
    /// As many as the convention has labels; Denso's figure is excluded.
    pub numbers: Vec<f64>,
}

impl Written {
    /// A pose that was passed as a matrix.
    pub fn matrix(pose: &Rigid<Base, Flange>) -> Written {
        Written { convention: Convention::Matrix, numbers: pose.to_rows().to_vec() }
    }
}
