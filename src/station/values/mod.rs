//! Import and export of a rig's values, and the uncertainty that is assumed for them.

mod assumed;
mod exchange;
mod foreign;
mod sound;
mod stated;

pub use assumed::Sigmas;
pub use exchange::{PlaneValue, Values, remarks_of_import};
pub use foreign::{Format as ValuesFormat, written as written_camera};
