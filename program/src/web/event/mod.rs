//! In: what happens in jobs. Out: events for every viewer, and for an MQTT broker. Who is slow misses some and never
//! delays anything.
//! Frame and unit: bytes, rows of a growing height map (mm).

mod broker;
mod growing;
mod hub;
mod mqtt;
mod names;
mod rate;
mod socket;
mod sparkplug;

pub use broker::Broker;
pub use growing::Growing;
pub use hub::Hub;
pub use mqtt::{DOOR as MQTT, publish};
pub use names::Names;
pub use socket::stream;
pub use sparkplug::{Source, publish as publish_node};
