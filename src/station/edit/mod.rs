//! Edits a TOML text that a person wrote: values change, comments stay.

mod document;
mod recipe;
mod settings;

pub use recipe::{point_added, point_chosen, point_taken_out};
pub use settings::{changed, edited};
