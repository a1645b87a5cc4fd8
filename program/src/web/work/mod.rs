//! In: an operator's orders. Out: jobs that run one after the other on a separate thread, stored on disk with their
//! state.
//! Frame and unit: as the procedures; mm, degrees.

mod calibrate;
mod check;
mod find;
mod found;
mod insert;
mod jobs;
mod place;
mod procedures;
mod recipes;
mod resumes;
mod run;
mod scan;
mod store;
mod tune;
mod worker;

pub use calibrate::{Views, accept};
pub use found::{insertion_of, lies, report_of};
pub use jobs::Jobs;
pub use place::Place;
pub use recipes::{change_points, from_drawing, load as recipe_named, points, recipes, remove_recipe, save_recipe};
pub use store::scan_of;
pub use worker::Worker;
