//! Recordings of a calibration board in; the camera with its standard deviations and the verdict out.
//!
//!   cargo run --example calibrate_camera -- RECORDING...

use sheetlight::calibrate::camera::procedure::{CameraOptions, calibrate};
use sheetlight::fault::Result;
use sheetlight::recording::Recording;
use std::path::Path;

fn main() -> Result<()> {
    let open = |folder: std::ffi::OsString| Recording::open(Path::new(&folder));
    let recordings = std::env::args_os().skip(1).map(open).collect::<Result<Vec<_>>>()?;
    let result = calibrate(&recordings, &CameraOptions::default(), &|done, all| eprint!("\r{done} of {all} pictures"))?;
    eprintln!();
    let (camera, known) = (&result.calibration.value, &result.calibration.covariance);
    for (name, value) in [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy)] {
        println!("{name} {value:.3} +- {:.3} px", known.sigma(&format!("{name}_px")).unwrap_or(f64::NAN));
    }
    println!("verdict: {}", result.calibration.quality.verdict.words());
    for advice in &result.calibration.quality.advice {
        println!("next: {advice}");
    }
    Ok(())
}
