//! The C functions of GenTL 1.5, by the parts of the standard. A function checks its pointers, calls the module behind
//! the handle and turns the result into the standard's number.
//!
//! # Safety
//! All functions are called by other programs through C. Pointers are NULL, which is refused, or lead to as much
//! memory as the standard says; handles are numbers that are looked up and never followed.

mod device;
mod event;
mod port;
mod stream;
mod system;
mod value;

pub use device::*;
pub use event::*;
pub use port::*;
pub use stream::*;
pub use system::*;

use std::ffi::{c_char, c_void};

/// A handle: a number, whatever C calls it.
pub type Handle = usize;
/// The standard's `bool8_t`.
pub type Bool8 = u8;
/// A C text.
pub type Text = *mut c_char;
/// A place for a value of any type.
pub type Any = *mut c_void;
/// The value of a handle that stands for no module.
pub const NONE: Handle = 0;
