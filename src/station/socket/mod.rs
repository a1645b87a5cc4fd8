//! In: requests of a robot's own program or of a PLC over TCP, as lines of text or as Modbus registers. Out: pictures
//! at the poses that it states, the requested part, poses in the robot's notation. In a session the controller moves,
//! and sheetlight only answers; behind the registers there may also be a station that runs jobs.
//! docs/robots/README.md has the lines, docs/connections.md the registers.
//! Frame and unit: base frame; each notation's own units.

mod executor;
mod frame;
mod modbus;
mod part;
mod peers;
mod registers;
mod serve;
mod session;
mod shown;
mod table;
pub mod words;

pub use executor::Executor;
pub use modbus::serve_modbus;
pub use part::Part;
pub use peers::Traffic;
pub use registers::has_registers;
pub use serve::{Patience, serve};
pub use session::{Session, SocketOptions};
pub use shown::{JobShown, Made, RobotShown, Shown, Stage};
pub use table::{GATES, request};
