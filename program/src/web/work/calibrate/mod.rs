//! In: recordings of boards, or a board below an armed robot. Out: calibrations beside the station's present ones,
//! stored in the job's folder until they are accepted.
//! Frame and unit: px, mm, degrees.

mod auto;
mod one;
mod together;
mod views;

pub(super) use auto::auto;
pub use one::accept;
pub(super) use one::calibrate;
pub(super) use together::joint;
pub use views::Views;
