//! In: requests under /api/v1. Out: their answers in JSON, except for pictures, maps and points; faults with their
//! four sentences.
//! Frame and unit: as the messages.

mod answer;
mod camera;
mod jobs;
mod metrics;
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
#[cfg(test)]
mod tests;

pub use openapi::openapi;
pub use router::router;
