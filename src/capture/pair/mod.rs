//! In: pictures, and positions of what moves, related by rest, by number or by time. Out: pairs of the two, or
//! excluded pictures with the reason. Nothing is extrapolated.
//! Frame and unit: base_from_flange, mm; counts; times in ns.

mod count;
mod feed;
mod lines;
mod pairer;
mod step;
mod table;
mod track;
mod uri;

pub use count::Counting;
pub use feed::PoseFeed;
pub use lines::{Lines, Told};
pub use pairer::{LeftOut, Outcome, Paired, Pairer, Way};
pub use step::Still;
pub use table::Table;
pub use track::{Between, Sample, Track};
pub use uri::PoseUri;
