//! In: nothing. Out: the checks that every calibrated value must provide.
//! Frame and unit: those of each value.

use crate::fault::Result;

/// A value that can be calibrated.
pub trait Measured {
    /// Refuses numbers that no such value can have.
    fn check(&self) -> Result<()>;
    /// What would be unusual about valid numbers. A user who enters such numbers is asked about it.
    fn doubt(&self) -> Option<String> {
        None
    }
}
