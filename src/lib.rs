//! Sheetlight: sheet-of-light scanning with a robot.
//!
//! The modules stand in floor order; each imports only from floors above it in this list
//! (ARCHITECTURE.md, enforced by tests/floors.rs).

pub mod fault;
pub mod files;

pub mod bcap;
pub mod geometry;
pub mod gpu;
pub mod raster;
pub mod solve;

pub mod camera;
pub mod recording;
pub mod rig;
pub mod robot;

pub mod calibrate;
pub mod simulate;

pub mod stages;

pub mod scan;

pub mod bench;

pub mod find;
pub mod station;

pub mod cli;
