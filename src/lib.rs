//! Sheet-of-light scanning with a robot. The library calibrates the camera and the line laser on the robot's end
//! effector, and turns pictures of the stripe into point clouds in the robot's base frame. It finds parts in them by
//! shape, and says where the tool goes.
//!
//! Every pixel of every picture is examined, by WGSL stages on a GPU or by the same arithmetic on this machine's
//! processor. Each number comes with its standard deviation. What cannot be known is refused, not guessed.
//!
//! A recording becomes a cloud, a height map and a page to look at:
//!
//! ```no_run
//! use sheetlight::{Scan, recording::Recording};
//! # fn main() -> sheetlight::fault::Result<()> {
//! let recording = Recording::open("recordings/board7".as_ref())?;
//! let report = Scan::at("cell3")?.recording_into(&recording, "scans/board7")?;
//! println!("{} points, each good to {:?} mm", report.points, report.median_sigma_mm);
//! # Ok(()) }
//! ```
//!
//! `examples/` has four small programs: scan a recording, one picture to points, calibrate a camera, find a part.
//!
//! **Conventions.** Millimetres, radians and `f64` unless a name says otherwise (`angle_deg`, `peak_px`). An integer
//! pixel coordinate is a pixel's centre. A transform `a_from_b` takes points of frame b to frame a, and the frames are
//! types ([`geometry::Rigid`]). Bad input is a [`fault::Fault`]: what happened with its number and limit, the likely
//! cause, the next step.
//!
//! **Features.** `gige` has the cameras that speak GigE Vision, and `folder` makes a folder a camera. `pages` writes a
//! scan's `index.html` and the reports of calibrations, `tables` writes a batch's tables as Parquet files. All four are
//! on by default; a program that needs none of them sets `default-features = false`.
//!
//! The program `sheetlight` with its command line, screen and simulated cell is a package of its own, in `program/`.
//!
//! The modules are listed in the order of their floors; each imports only from floors above it in this list
//! (ARCHITECTURE.md, enforced by tests/floors.rs).

#![warn(missing_docs)]

pub mod fault;
pub mod files;

pub mod bcap;
pub mod geometry;
pub mod gpu;
pub mod raster;
pub mod solve;

pub mod arm;
pub mod camera;
pub mod recording;
pub mod rig;
pub mod robot;

pub mod calibrate;
pub mod capture;
pub mod simulate;

pub mod stages;

pub mod scan;

pub mod find;
pub mod station;

pub use station::Scan;
