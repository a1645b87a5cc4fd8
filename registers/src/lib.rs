//! The registers of a station as a client has them: what is asked, what is shown.
//!
//! Data flows one way: `station` (a thread that asks and looks) -> `table` (what registers say) over `modbus` (bytes).

mod modbus;
mod station;
mod table;

pub use station::{Station, Unanswered};
pub use table::{Answer, Ask, Job, Robot, Seen, Stage, Target, Verdict, is_address, is_name, is_recording};
