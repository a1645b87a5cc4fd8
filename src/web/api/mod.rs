//! In: requests under /api/v1. Out: their answers, JSON but for pictures, maps and points; faults with their four
//! sentences.
//! Frame and unit: as the messages.

mod answer;
mod camera;
#[cfg(test)]
mod documented;
mod jobs;
mod motion;
mod openapi;
mod place;
mod router;
mod routes;
mod session;
mod settings;
mod support;
mod surface;
mod sweep;

pub use openapi::openapi;
pub use router::router;

#[cfg(test)]
mod queue_test;
