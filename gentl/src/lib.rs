//! A GenTL producer (EMVA GenTL 1.5): GenICam programs load this library and see finished scans, recordings, a
//! simulated station and folders of scans as 3-D cameras. docs/connections.md describes it.
//!
//! A call goes `abi` (the C functions) -> `library` (handles) -> `modules` (what each module says of itself) or
//! `camera` (the remote device's features) and `stream` (buffers and the thread that fills them). Frames come from
//! `source`, their bytes from `settings`. `features` makes descriptions and registers from one table.

mod abi;
mod buffer;
mod camera;
pub mod config;
mod event;
mod features;
mod library;
mod modules;
mod settings;
mod source;
mod standard;
mod status;
mod stream;

pub use abi::*;
