//! In: a finished scan, the truth of the simulated station where there is one. Out: its errors, and the page that
//! shows it.
//! Frame and unit: base frame, mm.

pub(super) mod embed;
pub(super) mod figures;
pub(super) mod page;
pub(super) mod parts;
pub(super) mod points;
mod view;
