//! In: nothing. Out: what every calibrated value must be able to say of itself.
//! Frame and unit: each value's own.

use crate::fault::Result;

/// A value that can be calibrated.
pub trait Measured {
    /// Refuses numbers that no such thing has.
    fn check(&self) -> Result<()>;
    /// What would be odd of right numbers: asked about where a person gives them.
    fn doubt(&self) -> Option<String> {
        None
    }
}
