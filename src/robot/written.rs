//! A pose as a file has it: its numbers, and the convention that they were read by.

use super::Convention;
use crate::geometry::{Base, Flange, Rigid};

/// The numbers of one pose before they became a transform. Units are the convention's.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// What the numbers were read as.
    pub convention: Convention,
    /// As many as the convention has labels; Denso's figure is left out.
    pub numbers: Vec<f64>,
}

impl Written {
    /// A pose that was handed over as a matrix.
    pub fn matrix(pose: &Rigid<Base, Flange>) -> Written {
        Written { convention: Convention::Matrix, numbers: pose.to_rows().to_vec() }
    }
}
