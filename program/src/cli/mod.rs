//! In: the command line. Out: one library call per subcommand, its result on stdout, messages on stderr.
//! Frame and unit: stated by the subcommands; every number is printed with its unit.

mod bench;
mod board;
mod calibrate;
mod capture;
mod cell;
mod commands;
mod demo;
mod doctor;
mod find;
mod insert;
mod insertion;
mod live;
mod range;
mod rig;
mod ros;
mod scan;
mod scan_profiles;
mod shift_scan;
mod simulate;
mod station;
mod terminal;
mod verify;

pub use commands::main;
