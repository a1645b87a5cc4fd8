//! In: a finished scan, and if given its recording, its station and the parts found in it; or the profiles of a running
//! camera. Out: an MCAP file or stream with ROS 2 messages, made without ROS.
//! Frame and unit: frames of docs/connections.md; metres in the file.

mod bag;
mod cdr;
mod clock;
mod definitions;
mod export;
mod figures;
mod frames;
mod live;
mod messages;
mod part;
mod recorded;

pub use clock::Source;
pub use export::{Export, Exported, Written, export};
pub use frames::{FRAMES, Frames, Renamed};
pub use live::LiveBag;
pub use messages::MOST_POINTS;
