//! In: programs that read pictures of a laser stripe and write points. Out: their speed and accuracy on the same
//! pictures, in turns (docs/benchmark.md). Frame and unit: px, camera frame in mm, seconds.

mod child;
mod compare;
mod drawing;
mod drive;
mod entry;
mod page;
mod result;
mod scene;
mod score;
mod verify;
mod wire;

pub use compare::{Compared, compare};
pub use drive::{Entry, Plan, run};
pub use entry::serve;
pub use page::page;
pub use result::{Accuracy, Results, Round, RowOf};
pub use scene::{SceneKind, Task};
pub use verify::verify;
pub use wire::Scenario;
