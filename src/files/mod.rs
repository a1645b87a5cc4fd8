//! In: bytes of results and the names they are to have, paths of files that others wrote. Out: files that are whole or not there, sets of files that take
//! their names together, folders that one process at a time writes into, names in the order people count in, bytes and text within limits.
//! Frame and unit: none; bytes and paths.

mod atomic;
mod inputs;
mod lock;
mod moment;
mod natural;
mod read;
mod together;

pub use atomic::{Aside, write, write_aside, write_unsynced};
pub use inputs::{not_over, not_over_any};
pub use lock::Lock;
pub use moment::moment;
pub use natural::natural;
pub use read::{length, read, read_text, read_text_if_there};
pub use together::{Together, remove};
