//! Changes that would make pairs fit that do not: another notation of the poses, another order, another unit, a tool
//! in some of them.

mod explain;
mod explanation;
mod lengths;
mod order;
mod parts;
mod positions;
mod present;
mod reading;
mod readings;

pub use explain::{explain, find};
pub use explanation::Explanation;
pub use lengths::both_in_metres;
