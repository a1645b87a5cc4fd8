//! In: requests of a robot's own program or of a PLC over TCP, as lines of text or as Modbus registers. Out: pictures
//! at the poses that it states, the requested part, poses in the robot's notation. Here the controller moves, and
//! sheetlight only answers: docs/robots/README.md has the lines, docs/connections.md the registers.
//! Frame and unit: base frame; each notation's own units.

mod frame;
mod modbus;
mod registers;
mod serve;
mod session;
pub mod words;

pub use modbus::serve_modbus;
pub use serve::{Patience, serve};
pub use session::{Session, SocketOptions};
