//! In: the command line. Out: one library call a subcommand, its result on stdout, talk on stderr.
//! Frame and unit: as the subcommands say; every number is printed with its unit.

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
mod shift_scan;
mod simulate;
mod station;
mod terminal;
mod verify;

pub use commands::main;
