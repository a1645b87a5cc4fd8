//! In: nothing. Out: the cases on which each stage is compared with its twin. Frame and unit: pixels, words.

mod hough;
mod peaks;
mod scenes;
mod walk;

pub use hough::cases as hough;
pub use peaks::{Space, peaks, ruled};
pub use scenes::{Scene, drawn, optics, pose, scenes, stripe};
pub use walk::{Walk, of};
