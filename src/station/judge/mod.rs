//! In: a finished scan, and the truth if the station was simulated. Out: its errors, and the page that shows them.
//! Frame and unit: base frame, mm.

#[cfg(feature = "pages")]
pub(super) mod embed;
pub(super) mod figures;
#[cfg(feature = "pages")]
pub(super) mod page;
pub(super) mod parts;
pub(super) mod points;
#[cfg(feature = "pages")]
mod view;
