//! A recording and a calibrated station in, a scan folder out: cloud.ply, height map, page.
//!
//!   cargo run --example scan_recording -- RECORDING STATION OUT
//!
//! `sheetlight simulate --out sim` makes both: sim/scan and sim/station.

use sheetlight::Scan;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Recording;
use std::path::PathBuf;

fn main() -> Result<()> {
    let folders: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [recording, station, out] = folders.as_slice() else {
        return Err(Fault::usage("three folders are needed").next("give RECORDING STATION OUT"));
    };
    let scan = Scan::at(station)?.progress(|done, all| eprint!("\r{done} of {} shots", all.unwrap_or(done)));
    let report = scan.recording_into(&Recording::open(recording)?, out)?;
    eprintln!();
    println!("{} points from {} shots, {}", report.points, report.shots, report.ran_on);
    println!("each good to {:.3} mm", report.median_sigma_mm.unwrap_or(f64::NAN));
    Ok(())
}
