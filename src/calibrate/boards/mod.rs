//! In: pictures and descriptions of boards. Out: the boards' features, sub-pixel, with sigmas; printable boards.
//! Frame and unit: pixels (centres at integers); feature ids index `BoardSpec::features()`.

mod chess;
mod described;
mod dots;
pub mod extent;
mod marker_grid;
mod mask;
mod other_size;
pub mod print;
mod quads;
pub mod refine;
mod sandwich;
mod search;
pub mod shape;
mod view;

pub use chess::turns::{Turn, turns};
pub(crate) use other_size::WRONG_SIZE;
pub use other_size::look_at_all;
pub use search::find;
pub use view::{BoardPoint, BoardView, FindOptions};
