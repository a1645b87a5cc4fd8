//! In: lines of text from a robot's own program over TCP. Out: pictures at the poses that it states, the requested
//! part, poses in the robot's notation. Here the controller moves, and sheetlight only answers:
//! docs/robots/README.md has the protocol.
//! Frame and unit: base frame; each notation's own units.

mod serve;
mod session;
pub mod words;

pub use serve::{Patience, serve};
pub use session::{Session, SocketOptions};
