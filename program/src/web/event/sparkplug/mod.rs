//! In: events of jobs and bar. Out: the same as metrics of a Sparkplug B node at an MQTT broker.
//! Frame and unit: as the table of metrics states for each.

mod link;
mod node;
mod payload;
mod seen;
mod table;

pub use link::{Source, publish};
