//! In: requests of a PLC over Modbus TCP, the state of the screen. Out: jobs under the screen's own conditions, and
//! registers that show them. A PLC confirms and accepts nothing: each motion and each calibration waits for the person
//! at the screen.
//! Frame and unit: base frame, in the station's notation; docs/connections.md has the registers.

mod door;
mod executor;
mod job;
mod recording;

pub use door::Door;
pub use executor::MODBUS;
