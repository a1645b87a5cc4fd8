//! The program `sheetlight`: command line, operator's screen, simulated cell, benchmark and messages for ROS 2. What it
//! does is in the library [`sheetlight`]: a program of your own needs only that.
//!
//! The modules are listed in the order of their floors; each imports only from floors above it in this list, and from
//! the library (ARCHITECTURE.md, enforced by tests/floors.rs).

#![warn(missing_docs)]

pub mod bench;
pub mod cell;
pub mod ros;

pub mod procedure;

pub mod web;

pub mod cli;
